"""Disc and controller in other languages: the program's own closed loop, and the same bits in each host."""

from __future__ import annotations

import csv
import shutil
import subprocess
from collections.abc import Mapping
from functools import cache
from pathlib import Path
from typing import cast

import numpy as np
import pytest
from c_warnings import WARNINGS

import ringbalance as rb
from ringbalance.controller.simulation import Simulation
from ringbalance.export import disc, law_based
from ringbalance.export.blocks import Block, controller_block, disc_block
from ringbalance.export.fmu import reference_files
from ringbalance.export.hosts import c_files, python_files, st_files
from ringbalance.reduced_model.law.calibrated_law import CalibratedLaw
from ringbalance.reduced_model.pieces.point import BLOCK
from ringbalance.scene.arrays import FloatArray
from ringbalance.scene.faults import SceneError
from ringbalance.scene.models import Scene

SANITIZERS = ["-O1", "-fsanitize=address,undefined,float-cast-overflow", "-fno-sanitize-recover=all"]
IN_A_STEP = 10.0
"""s, longer than any wait for a sample: the disc goes from sample to sample."""


LAW_BASED, TRIAL = {"controller.kind": "law_based"}, {"controller.kind": "trial"}


def exact_scene(name: str, values: Mapping[str, str]) -> Scene:
    """A bundled scene whose sensor is exact, with other values."""
    quiet = {"sensor.amplitude_noise": "0 m", "sensor.phase_noise": "0 deg"}
    return cast(Scene, rb.load_scene(rb.bundled_scene(name)).with_values({**quiet, **values}))


@cache
def law_of(name: str) -> CalibratedLaw:
    """The law of a bundled scene, which no setting of its controller changes."""
    return rb.calibrate(exact_scene(name, {})).flow_law


def loop_in_c(folder: Path, disc: Block, controller: Block, *, samples: int, longest: float) -> FloatArray:
    """Time, vibration x and y, then open time and fill of each chamber, a row for each sample."""

    def places(block: Block, begins: str) -> str:
        return ", ".join(str(each.index) for each in block.variables if each.name.startswith(begins))

    of_chambers = {
        "asked": places(disc, "open_time"),
        "told": places(controller, "open_time"),
        "fills": places(disc, "fill_ratio"),
    }
    header = f"enum {{ SAMPLES = {samples} }};\nstatic const double LONGEST = {longest!r};\n"
    header += "".join(f"static const int {key}[] = {{{text}}};\n" for key, text in of_chambers.items())
    texts = c_files(disc, "plant") | c_files(controller, "ctrl") | {"places.h": header}
    for file, text in texts.items():
        (folder / file).write_text(text)
    main = str(Path(__file__).parent / "closed_loop.c")
    command = ["gcc", *WARNINGS, *SANITIZERS, "-I.", "plant.c", "ctrl.c", main, "-lm", "-o", "loop"]
    subprocess.run(command, cwd=folder, check=True)
    ran = subprocess.run([folder / "loop"], capture_output=True, text=True, check=True)
    return np.array([[float(cell) for cell in line.split()] for line in ran.stdout.splitlines()])


@pytest.mark.skipif(shutil.which("gcc") is None, reason="no C compiler")
@pytest.mark.parametrize(
    ("name", "values", "longest", "late"),
    [
        ("six_chamber", {}, IN_A_STEP, 1e-4),
        ("grinding_spindle", {}, IN_A_STEP, 1e-4),
        ("grinding_spindle", {"gas.leak_to_ambient": "0.15 l/(s*bar)"}, IN_A_STEP, 1e-4),
        ("liquid_ring_paper", {}, 2e-4, 1e-3),
        ("six_chamber", TRIAL, IN_A_STEP, 1e-4),
        ("six_chamber", {**LAW_BASED, "controller.assumed_lag_angle": "60 deg"}, IN_A_STEP, 1e-4),
        ("six_chamber", {**LAW_BASED, "rotor.initial_vibration.amplitude": "18.5 um"}, 2e-4, 1e-4),
        (
            "six_chamber",
            {
                **LAW_BASED,
                "rotor.initial_vibration.amplitude": "18.5 um",
                "rotor.initial_vibration.phase": "270 deg",
            },
            2e-4,
            1e-4,
        ),
        ("grinding_spindle", {**LAW_BASED, "controller.assumed_lag_angle": "50 deg"}, IN_A_STEP, 5e-4),
    ],
)
def test_in_c_they_run_as_the_programs_own_loop(
    tmp_path: Path, name: str, values: dict[str, str], longest: float, late: float
) -> None:
    """The spindle has valves and a gas line; on the paper's disc a chamber comes to its residual fill.

    Nobody tells the controller of that: it sees what the vibration does.  The law-based one has to learn
    another influence coefficient, or to bring a pair to its end.
    """
    scene, law = exact_scene(name, values), law_of(name)
    gas = scene.gas
    line = {"gas filling": gas.conductance, "valve lag": gas.valve_lag}
    own = rb.simulate(
        scene, flow_law=law, modelled=[term for term, given in line.items() if given is not None]
    )
    assert isinstance(own, Simulation)
    assert own.settled
    controller, disc = controller_block(scene, law), disc_block(scene, law)
    rows = loop_in_c(tmp_path, disc, controller, samples=len(own.samples), longest=longest)
    right = np.array([vibration_of(each.measurement) for each in own.samples])
    assert rows[:, 0] == pytest.approx([each.time for each in own.samples], abs=late)
    assert np.abs(rows[:, 1] + 1j * rows[:, 2] - right) == pytest.approx(0.0, abs=3e-4 * abs(right[0]))
    fills = np.array(list(own.fill_ratio.values()))[
        :, np.searchsorted(own.time, [e.time for e in own.samples])
    ]
    assert pytest.approx(fills, abs=3e-4) == rows[:, 4::2].T
    for row, sample in zip(rows, own.samples, strict=True):
        asked = np.zeros(scene.disc.chambers)
        asked[[each.chamber for each in sample.command.valves]] = [e.duration for e in sample.command.valves]
        assert row[3::2] == pytest.approx(asked, abs=late)


def vibration_of(seen: object) -> complex:
    assert isinstance(seen, rb.Measurement)
    return complex(seen.amplitude * np.exp(1j * seen.phase))


def test_a_module_of_its_own_has_the_same_bits(blocks: dict[str, Block]) -> None:
    for kind, inputs in (
        ("disc", {"open_time_a": 0.03, "open_time_e": 0.02}),
        ("controller", {"vibration_x": 3e-6, "vibration_y": -2e-6}),
        ("trial", {"vibration_x": 3e-6, "vibration_y": -2e-6}),
        ("law_based", {"vibration_x": 3e-6, "vibration_y": -2e-6}),
    ):
        block, names = blocks[kind], dict[str, object]()
        exec(python_files(block, "m")["m.py"], names)
        made = names["Block"]
        assert callable(made)
        mine, row = made(), list(block.start)
        for step in range(8):
            given = inputs if step % 3 == 0 else dict.fromkeys(inputs, 0.0)
            assert mine.step(0.03, **given) == block.run(row, 0.03, given)
        assert mine.w == row


def test_the_controller_passes_over_what_is_no_number_and_forgets_nothing(blocks: dict[str, Block]) -> None:
    block = blocks["controller"]
    row = list(block.start)
    wait = block.run(row, 0.0, {"vibration_x": 3e-6, "vibration_y": 0.0})["wait"]
    before = list(row)
    told = block.run(row, wait, {"vibration_x": np.nan})
    assert told["samples"] == 2
    assert not any(told[f"open_time_{letter}"] for letter in "abcdef")
    changed = {place for place, (a, b) in enumerate(zip(before, row, strict=True)) if a != b and b == b}
    module = block.modules[-1]
    openings = {each.index for each in block.variables if each.name.startswith("open_time")}
    assert changed <= {module.SAMPLES, module.WAIT, module.SINCE, *openings}


@pytest.mark.parametrize("fall", [9e-16, 1e-7])
def test_a_fall_that_a_fill_hardly_resolves_has_an_end(blocks: dict[str, Block], fall: float) -> None:
    """Parts of the first are below the last bit of the fill; those of the second at a stall."""
    block, fill = blocks["law_based"], 0.4662590784001067
    row = list(block.start)
    assert block.tables is not None
    row[law_based.host_row(block.constants) + law_based.FLOW_PRIMED] = 1.0
    numbers = (block.constants, *block.tables, row)
    assert 0.0 <= law_based.flow_time(*numbers, fill, fill - fall, 5.0) < 1e-4


def test_a_gas_line_too_fast_for_a_hosts_steps_is_refused() -> None:
    """A step of 10 ms takes at most 10,000 parts."""
    law = law_of("grinding_spindle")
    with pytest.raises(SceneError, match=r"time constant of .* too short for a host's steps"):
        disc_block(exact_scene("grinding_spindle", {"gas.conductance": "1e5 l/(s*bar)"}), law)
    for conductance in ("1 l/(s*bar)", "30 l/(s*bar)"):
        block = disc_block(exact_scene("grinding_spindle", {"gas.conductance": conductance}), law)
        assert block.constants[int(block.constants[BLOCK]) + disc.LONGEST] >= 1e-2 / 10_000


def test_headers_and_declarations_say_unit_range_and_meaning(blocks: dict[str, Block]) -> None:
    header = c_files(blocks["disc"], "m")["m.h"]
    assert "/* out, Pa, 0 to 1e+08: absolute pressure of the gas in chamber F */" in header
    assert header.count("/* in, ") + header.count("/* out, ") == len(blocks["disc"].variables)
    assert "(* in, s, 0 to 1e+06: how long" in st_files(blocks["disc"], "m")["m.st"]
    assert "# out, m, -1 to 1: zero-to-peak vibration" in python_files(blocks["disc"], "m")["m.py"]


@pytest.mark.parametrize("kind", ["law", "disc"])
def test_reference_results_are_those_of_the_step_that_they_stand_at(
    blocks: dict[str, Block], kind: str
) -> None:
    """Inputs hold from their row's time on; outputs are read after that step, one step later."""
    block = blocks[kind]
    files = {name.rsplit("/", 1)[-1]: text.decode() for name, text in reference_files(block, "unit").items()}
    stimuli, results = (
        list(csv.DictReader(files[f"unit_{name}.csv"].splitlines())) for name in ("in", "out")
    )
    row = list(block.start)
    for place, (stimulus, result) in enumerate(zip(stimuli, results, strict=True)):
        inputs = {name: float(value) for name, value in stimulus.items() if name != "time"}
        outputs = block.run(row, 0.01, inputs)
        assert float(stimulus["time"]) == pytest.approx(0.01 * place)
        assert float(result["time"]) == pytest.approx(0.01 * (place + 1))
        assert {name: float(result[name]) for name in outputs} == outputs
