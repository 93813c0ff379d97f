"""Blocks of eccentric masses: every host runs the program's strategy and plant, over all stages."""

from __future__ import annotations

import re
import shutil
import subprocess
from functools import cache
from io import BytesIO
from pathlib import Path
from typing import Any, Final, NamedTuple, cast
from zipfile import ZipFile

import numpy as np
import pytest
from c_warnings import WARNINGS
from imported_unit import ImportedUnit
from scipy.linalg import expm, solve_continuous_are

import ringbalance as rb
from ringbalance.cli import main
from ringbalance.controller.eccentric_mass.memory import Cause, Stage
from ringbalance.controller.eccentric_mass.plant import PlantParameters
from ringbalance.controller.eccentric_mass.run import Machine, measure, sensor_noise
from ringbalance.controller.eccentric_mass.settings import StrategySettings
from ringbalance.export.blocks import Block
from ringbalance.export.flatten import Flattening, Layout
from ringbalance.export.fmu import fmu_bytes
from ringbalance.export.hosts import c_files, js_files, python_files, st_files
from ringbalance.export.libraries import Version
from ringbalance.export.masses import PLANT, plant_block, strategy_block
from ringbalance.export.translate import python_functions
from ringbalance.scene.arrays import FloatArray
from ringbalance.scene.changes import file_text

NAMES = ("driven_masses_small", "washing_machine", "eccentric_mass_paper")
SAMPLES: Final = 20_000
"""Of which the first of a scene hold all stages."""
HERE: Final = Path(__file__).parent
needs_compiler = pytest.mark.skipif(shutil.which("gcc") is None, reason="no C compiler")


@cache
def scene_of(name: str) -> rb.EccentricScene:
    return cast(rb.EccentricScene, rb.load_scene(rb.bundled_scene(name)))


@cache
def run_of(name: str) -> rb.EccentricRun:
    return rb.simulate(scene_of(name))


def inputs_of(block: Block) -> dict[str, int]:
    return {each.name: each.index for each in block.variables if each.input}


def outputs_of(block: Block) -> dict[str, int]:
    return {each.name: each.index for each in block.variables if not each.input}


def measured(name: str) -> FloatArray:
    """What the controller of a run measured, and the time between two samples before it."""
    scene, history = scene_of(name), run_of(name).history
    settings, machine, noise = (
        StrategySettings.of(scene),
        Machine.of(scene),
        sensor_noise(scene, scene.run.seed),
    )
    rows = np.zeros((min(len(history), SAMPLES), 12))
    for i, row in enumerate(rows):
        seen = measure(machine, settings.laboratory, history["state"][i], i * settings.step, noise[i])
        whirl = seen.position.real, seen.position.imag, seen.velocity.real, seen.velocity.imag
        row[:] = settings.step, seen.speed, seen.speed_rate, seen.rotor_angle, *whirl, *seen.angle, *seen.rate
    return rows


@needs_compiler
@pytest.mark.parametrize("name", NAMES)
def test_the_loop_in_c_is_the_programs_over_all_stages(tmp_path: Path, name: str) -> None:
    """To 1e-9 of the largest value, in what follows from sin, cos and the like of the host."""
    scene, history = scene_of(name), run_of(name).history
    ctrl, plant = strategy_block(scene), plant_block(scene)
    names = list(inputs_of(ctrl))
    assert names == [each for each in outputs_of(plant) if each != "energy"]
    places = {"measured": [outputs_of(plant)[each] for each in names], "told": list(inputs_of(ctrl).values())}
    row = Layout.of(np.zeros(1, dtype=PLANT)[0]).index("row.0")
    head = f"#define ROW {row}\n#define STEP {ctrl.period!r}\n" + "".join(
        f"static const int {key}[] = {{{', '.join(map(str, value))}}};\n" for key, value in places.items()
    )
    for file, text in {**c_files(ctrl, "ctrl"), **c_files(plant, "plant"), "places.h": head}.items():
        (tmp_path / file).write_text(text)
    sources = ["ctrl.c", "plant.c", str(HERE / "masses_loop.c")]
    subprocess.run(["gcc", *WARNINGS, "-O2", "-I.", *sources, "-lm", "-o", "loop"], cwd=tmp_path, check=True)

    count = len(history)
    noise = np.hstack([np.zeros((count, 3)), sensor_noise(scene, scene.run.seed)[:count]])
    ran = subprocess.run([tmp_path / "loop"], input=noise.tobytes(), capture_output=True, check=True)
    told = np.frombuffer(ran.stdout).reshape(-1, 13)
    assert {Stage.FRICTION_ESTIMATION, Stage.POSITIONING, Stage.REST} <= set(history["stage"].tolist())
    for column, key in ((10, "stage"), (11, "cause"), (12, "hold")):
        assert np.array_equal(told[:, column], history[key])
    for values, right in ((told[:, :8], history["state"]), (told[:, 8:10], history["voltage"])):
        assert np.all(np.abs(values - right) <= 1e-9 * np.max(np.abs(right), axis=0))


@pytest.mark.skipif(shutil.which("node") is None, reason="no Node")
@pytest.mark.parametrize("name", NAMES)
def test_what_a_run_measured_gives_its_voltages(tmp_path: Path, name: str) -> None:
    """In JavaScript over all stages, in Python over 5,000 samples: to 1e-12 of the largest voltage."""
    block, history = strategy_block(scene_of(name)), run_of(name).history
    assert np.any(history["stage"][:SAMPLES] == Stage.REST)
    rows, columns = measured(name), {key: at for at, key in enumerate(outputs_of(block))}
    (tmp_path / "ctrl.mjs").write_text(js_files(block, "ctrl")["ctrl.mjs"])
    command = ["node", str(HERE / "same_bits.mjs"), str(tmp_path / "ctrl.mjs"), str(len(rows))]
    ran = subprocess.run(command, input=rows.tobytes(), capture_output=True, check=True)
    module: dict[str, Any] = {}
    exec(python_files(block, "ctrl")["ctrl.py"], module)
    python, names = module["Block"](), list(inputs_of(block))
    in_python = [
        list(python.step(time, **dict(zip(names, values, strict=True))).values())
        for time, *values in rows[:5_000].tolist()
    ]
    voltages = [columns["voltage_1"], columns["voltage_2"]]
    for told in (np.frombuffer(ran.stdout).reshape(len(rows), -1), np.array(in_python)):
        right = history["voltage"][: len(told)]
        assert np.all(np.abs(told[:, voltages] - right) <= 1e-12 * np.max(np.abs(right)))
        for key, of in (("stage", "stage"), ("cause", "cause"), ("drives", "hold")):
            assert np.array_equal(told[:, columns[key]], history[of][: len(told)])
        arms = told[:, [columns["friction_arm_1"], columns["friction_arm_2"]]]
        assert np.allclose(arms, history["friction_arm"][: len(told)], rtol=1e-11, atol=0)
        assert np.ptp(told[:, voltages]) > 0


def test_the_text_for_controllers_says_what_stands_where() -> None:
    """Each index of the settings and of the memory once, with its meaning and unit."""
    block = strategy_block(scene_of("washing_machine"))
    text, c = st_files(block, "ctrl")["ctrl.st"], c_files(block, "ctrl")["ctrl.c"]
    for row in "cw":
        ranges = re.findall(rf"^ +{row}\[(\d+)(?:\.\.(\d+))?\] ", text, re.MULTILINE)
        ends = [(int(a), int(b or a)) for a, b in ranges]
        assert [a for a, _ in ends] == [0, *(b + 1 for _, b in ends[:-1])]
        assert ends[-1][1] <= (len(block.constants) if row == "c" else len(block.start)) - 1
    for line in (
        "sample: number of samples taken",
        "law.torque_per_volt: B_add, N m/V",
        "memory.friction.filter.1.arm: friction arm mu, m",
        "memory.voltage: for the motor of mass 1 and 2, held to the next sample, V",
    ):
        assert line in text
        assert line in c
    assert text.count("(*") == text.count("*)")
    assert "friction arm mu" not in js_files(block, "ctrl")["ctrl.mjs"]


_LEAF = np.dtype([("held", np.int64), ("vector", np.complex128)])
_NESTED = np.dtype([("first", np.float64), ("pair", np.dtype([("leaf", _LEAF)]), (2,)), ("leaf", _LEAF)])


def _set_leaf(leaf: Any, value: complex) -> None:
    leaf.vector = leaf.vector + value
    leaf.held = leaf.held + 1


def _set_all(settings: Any, host: Any, time: float) -> None:
    for i in range(2):
        _set_leaf(host.pair[i].leaf, settings[0] * time * (1 + i))
    _set_leaf(host.leaf, 1j)
    host.first = host.pair[1].leaf.vector.imag


class _Found(NamedTuple):
    number: float
    leaf: Any


def _found(host: Any, index: int) -> _Found:
    place = index + 1
    return _Found(host.first, host.pair[place - 1].leaf)


def _leaf(host: Any, index: int) -> Any:
    return host.pair[index].leaf


def _move_leaf(settings: Any, host: Any, time: float) -> None:
    for i in range(2):
        found = _found(host, 1 - i)
        host.first = found.number + found.leaf.vector.real
        host.leaf.vector = found.leaf.vector + settings[0] * time
        host.pair[i].leaf.held = _leaf(host, 1 - i).held + 1


def test_a_record_that_a_function_returns_keeps_its_numbers() -> None:
    flat, row = Flattening.of(_move_leaf, (2j,), np.zeros(1, dtype=_NESTED)[0]), [0.0] * 10
    names: dict[str, Any] = {"Law": list, "Query": list}
    exec(python_functions(flat.source), names)
    row[1:7] = [5.0, 3.0, 4.0, 7.0, 1.0, 2.0]
    row += [0.0] * (flat.row - len(row))
    names["do_move_leaf"]([0.0, 2.0], row, 1.0)
    assert row[:10] == [4.0, 8.0, 3.0, 4.0, 9.0, 1.0, 2.0, 0.0, 3.0, 6.0]


def test_records_within_records_are_places_of_any_depth() -> None:
    flat, row = Flattening.of(_set_all, (2j,), np.zeros(1, dtype=_NESTED)[0]), [0.0] * 10
    names: dict[str, Any] = {"Law": list, "Query": list}
    exec(python_functions(flat.source), names)
    for _ in range(2):
        names["do_set_all"]([0.0, 2.0], row, 0.5)
    assert row == [4.0, 2.0, 0.0, 2.0, 2.0, 0.0, 4.0, 2.0, 0.0, 2.0]


def test_a_controller_begins_with_the_masses_where_they_are() -> None:
    block = strategy_block(scene_of("washing_machine"))
    row, still = list(block.start), {"speed": 9.4, "angle_1": 2.0, "angle_2": 5.0}
    # A sample that is not a number at the start is passed over.
    assert block.run(row, 0.0, {**still, "rate_1": np.nan})["samples"] == 0
    told = block.run(row, block.period, {**still, "rate_1": 0.0})
    assert (told["goal_1"], told["goal_2"], told["samples"]) == (2.0, 5.0, 1)
    assert block.run(row, 0.5 * block.period, {})["samples"] == 1
    assert block.run(row, 0.5 * block.period, {})["samples"] == 2
    assert np.isfinite(list(block.run(row, block.period, {"position_x": np.nan}).values())).all()


def test_a_plant_turns_by_its_profile_and_shows_the_locked_whirl() -> None:
    """Steps of any length: alpha (U + p) at the end, and the angle is the integral of the speed."""
    scene = scene_of("eccentric_mass_paper").with_values({"supervisor.strategy": "locked"})
    block, row = plant_block(scene), []
    row = list(block.start)
    for time in (0.3, 0.001, 0.0, 0.05) * 60:
        told = block.run(row, time, {"voltage_1": 1.0})
    plant, speed = PlantParameters.of(scene), told["speed"]
    whirl = plant.steady_whirl(speed, scene.masses.initial_angle)
    assert abs(complex(told["position_x"], told["position_y"]) - whirl) < 1e-6 * abs(whirl)
    assert told["rotor_angle"] == pytest.approx(speed * 60 * 0.351, rel=1e-12)


@needs_compiler
@pytest.mark.parametrize("version", ["fmi2", "fmi3"])
def test_a_unit_has_the_outputs_of_the_block(tmp_path: Path, version: Version) -> None:
    block = plant_block(scene_of("driven_masses_small"))
    content, runs = fmu_bytes(block, "plant", version)
    assert runs
    ZipFile(BytesIO(content)).extractall(tmp_path)
    row = list(block.start)
    with ImportedUnit(tmp_path, version) as unit:
        for step in range(40):
            inputs = {"voltage_1": 2.0 - 0.1 * step, "voltage_2": 0.0}
            right, told = block.run(row, block.period, inputs), unit.step(inputs, block.period)
            assert all(abs(told[key] - value) <= 1e-12 * abs(value) + 1e-18 for key, value in right.items())


@pytest.mark.parametrize(
    ("changes", "words", "told"),
    [
        (
            {"supervisor.strategy": "locked"},
            ["--to", "c"],
            'strategy = "locked": locked masses have no contr',
        ),
        (
            {"supervisor.lowest_speed": "500 rpm"},
            ["--to", "c"],
            "keeps no speed at which the strategy estimat",
        ),
        ({}, ["--to", "c", "--block", "disc"], '--block = "disc": a scene of eccentric_mass has none'),
        ({}, ["--to", "csv", "--block", "plant"], "csv is a table of the controller"),
        ({}, ["--to", "csv", "--points", "5"], "--points = 5"),
        ({}, ["--to", "fmi2", "--all-systems"], "--all-systems = true"),
    ],
)
def test_what_cannot_be_exported_is_one_sentence(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], changes: dict[str, str], words: list[str], told: str
) -> None:
    file = tmp_path / "scene.toml"
    file.write_bytes(file_text(scene_of("eccentric_mass_paper").with_values(changes), to=tmp_path))
    assert main(["export", str(file), *words, "--out", str(tmp_path / "out")]) == 2
    assert told in capsys.readouterr().err
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize("name", NAMES)
def test_matrices_and_gains_are_those_of_the_equations(name: str) -> None:
    scene = scene_of(name)
    loop, plant = rb.eccentric_loop(scene), PlantParameters.of(scene)
    assumed = scene.imbalance_filter
    mass = assumed.assumed_mass + 2 * scene.masses.mass
    for w, transition in zip(loop.speed, loop.transition, strict=True):
        a = np.zeros((6, 6))
        a[0, 2] = a[1, 3] = 1.0
        a[2:4, :2] = np.eye(2) * (w * w - assumed.assumed_stiffness / mass)
        a[2, 1], a[3, 0] = w * assumed.assumed_damping / mass, -w * assumed.assumed_damping / mass
        a[2:4, 2:4] = [[-assumed.assumed_damping / mass, 2 * w], [-2 * w, -assumed.assumed_damping / mass]]
        a[2:4, 4:] = np.eye(2) * w * w / mass
        scale = np.outer(
            1 / np.maximum(1e-30, [1, 1, w, w, 1 / mass, 1 / mass]), [1, 1, w, w, 1 / mass, 1 / mass]
        )
        assert np.allclose(transition * scale.T, expm(a * loop.filter_step) * scale.T, rtol=1e-9, atol=1e-9)
    # The regulator's gains solve the Riccati equation of one mass.
    inertia = plant.inertia + plant.drive_inertia
    motion = np.array([[0.0, 1.0], [0.0, -plant.drive_damping / inertia]])
    push, q, r = np.array([[0.0], [1 / inertia]]), scene.lqr.state_weight, scene.lqr.input_weight
    cost = solve_continuous_are(motion, push, np.diag([0.1 * q, 0.01 * q]), np.array([[0.1 * r]]))
    gains = push.T @ cost / (0.1 * r)
    assert np.allclose(gains, [[loop.position_gain, loop.rate_gain]], rtol=1e-6)
    # Targets leave nothing of the imbalance.
    left = plant.unbalance * np.exp(1j * plant.phase) + plant.moment * np.exp(1j * loop.targets).sum()
    assert abs(left) < 1e-12 * plant.unbalance
    # Friction filter: w falls by friction over a step about the drive speed; F holds the slopes of that.
    for i, w in enumerate(loop.speed):
        for k, arm in enumerate(scene.masses.friction_arm):
            slope = plant.drive_damping + 2 * arm * plant.moment * (w + loop.drive_speed)
            yielding = inertia - plant.moment**2 / plant.mass
            assert loop.friction_transition[i, k, 0, 0] == pytest.approx(
                np.exp(-slope / yielding * loop.friction_step), rel=1e-2
            )
            assert np.all(np.linalg.eigvalsh(loop.friction_process[i, k]) >= 0)
    # The same numbers in the table and in the block.
    values = [
        float(line.split(",")[2]) for line in loop.csv.splitlines() if not line.startswith(("#", "name"))
    ]
    assert set(loop.transition.ravel()) <= set(values)
    assert set(loop.transition.ravel()) <= set(strategy_block(scene).constants)


@needs_compiler
def test_the_example_of_the_page_balances(tmp_path: Path) -> None:
    scene, page = scene_of("washing_machine"), HERE.parents[1] / "docs/export.md"
    (code,) = re.findall(r"```c\n(.*?)```", page.read_text(encoding="utf-8"), re.DOTALL)
    files = {**c_files(strategy_block(scene), "ctrl"), **c_files(plant_block(scene), "plant"), "main.c": code}
    for file, text in files.items():
        (tmp_path / file).write_text(text)
    command = ["gcc", *WARNINGS, "-O2", "main.c", "ctrl.c", "plant.c", "-lm", "-o", "main"]
    subprocess.run(command, cwd=tmp_path, check=True)
    ran = subprocess.run([tmp_path / "main"], capture_output=True, text=True, check=True)
    assert ran.stdout == f"stage {Stage.REST}, cause {Cause.BALANCED}\n"
