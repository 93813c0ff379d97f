"""The page of eccentric masses: its runs are the program's, its controls are the scene's keys."""

from __future__ import annotations

import json
import re
from functools import cache
from pathlib import Path
from typing import Any, Final, cast

import numpy as np
import pytest
from page_modules import in_node, needs_node

import ringbalance as rb
from ringbalance.cli import main
from ringbalance.controller.eccentric_mass.memory import STAGE_NAMES, Stage
from ringbalance.controller.eccentric_mass.plant import PlantParameters
from ringbalance.controller.eccentric_mass.run import SENSOR_NOISES
from ringbalance.controller.eccentric_mass.scene_records import EccentricScene
from ringbalance.export.hosts import python_files
from ringbalance.export.masses import plant_block, strategy_block
from ringbalance.panels.document import MASS_MODULES, module_text
from ringbalance.panels.masses import DEVICES, mass_blocks, masses_content
from ringbalance.scene.changes import file_text

MOST_BYTES: Final = 300_000
"""As of every panel: it is sent by mail."""
NAMES: Final = ("driven_masses_small", "washing_machine", "eccentric_mass_paper")
TIME: Final = {"driven_masses_small": "5 s", "washing_machine": "10 s", "eccentric_mass_paper": "18 s"}
"""In which all stages pass."""
SAMPLES: Final = 900
RUN: Final = """
const run = new MassRun(content, { ...massSettings(content), ...changes }, { noise: (k) => noise[k] ?? 0 });
const rows = [];
while (!run.over && run.samples < samples) {
  run.advance();
  const { w } = run.plant, { row } = content.places;
  rows.push([...w.slice(row, row + 8), w[voltages[0]], w[voltages[1]]]);
}
answer = { rows: rows.filter((_, i) => i % stride === 0), stages: run.stages, settled: run.settled };
"""


@cache
def scene_of(name: str) -> EccentricScene:
    scene = rb.load_scene(rb.bundled_scene(name))
    return cast(EccentricScene, scene.with_values({"run.time_limit": TIME[name]}))


@cache
def blocks_of(name: str) -> str:
    return mass_blocks(scene_of(name))


@cache
def content_of(name: str) -> dict[str, Any]:
    return masses_content(scene_of(name), devices=2)


def inputs_of(name: str) -> list[int]:
    return [each.index for each in plant_block(scene_of(name)).variables if each.input]


@needs_node
@pytest.mark.parametrize("name", NAMES)
def test_a_run_with_the_programs_noise_is_the_programs(name: str) -> None:
    """Over all stages to 1e-9 of the largest value, as in C: sin, cos and the like are the host's."""
    scene = scene_of(name)
    run = rb.simulate(scene)
    noise = np.random.default_rng(scene.run.seed).standard_normal((scene.samples, SENSOR_NOISES))
    answer = in_node(
        RUN,
        blocks=blocks_of(name),
        content=content_of(name),
        noise=noise.ravel().tolist(),
        changes={},
        samples=scene.samples,
        stride=7,
        voltages=inputs_of(name),
    )
    assert STAGE_NAMES[Stage.REST] in [each["name"] for each in answer["stages"]]
    assert [(each["name"], pytest.approx(each["time"])) for each in answer["stages"]] == [
        (each.name, each.start) for each in run.stages
    ]
    right = np.hstack([run.history["state"], run.history["voltage"]])[::7]
    assert np.all(np.abs(np.array(answer["rows"]) - right) <= 1e-9 * np.max(np.abs(right), axis=0))
    assert answer["settled"] == pytest.approx(run.settling_time)
    assert content_of(name)["devices"][0]["settled"] == pytest.approx(run.settling_time)


@needs_node
def test_a_run_without_noise_is_the_exported_python_in_a_loop() -> None:
    """To 1e-12 of the largest value, in the stages of estimating and driving."""
    name = "washing_machine"
    scene, modules = scene_of(name), list[dict[str, Any]]([{}, {}])
    blocks = strategy_block(scene), plant_block(scene)
    for block, names in zip(blocks, modules, strict=True):
        exec(python_files(block, "m")["m.py"], names)
    control, plant = (names["Block"]() for names in modules)
    inputs, row = modules[0]["INPUTS"], content_of(name)["places"]["row"]
    told, rows = plant.step(0.0), []
    for sample in range(SAMPLES):
        state = list(plant.w[row : row + 8])
        seen = {key: told[key] for key in inputs}
        drives = control.step(scene.sensor.step if sample else 0.0, **seen)
        voltages = {key: drives[key] for key in ("voltage_1", "voltage_2")}
        rows.append([*state, *voltages.values()])
        told = plant.step(scene.sensor.step, **voltages)
    answer = in_node(
        RUN,
        blocks=blocks_of(name),
        content=content_of(name),
        noise=[],
        changes={"noise": 0},
        samples=SAMPLES,
        stride=1,
        voltages=inputs_of(name),
    )
    right = np.array(rows)
    assert np.ptp(right[:, 8]) > 0
    assert len(answer["stages"]) > 1
    assert np.all(np.abs(np.array(answer["rows"]) - right) <= 1e-12 * np.max(np.abs(right), axis=0))


@needs_node
@pytest.mark.parametrize("name", NAMES)
@pytest.mark.parametrize("factor", [0.5, 1.5, 0.0])
def test_a_control_sets_the_constants_of_the_changed_scene(name: str, factor: float) -> None:
    scene, controls = scene_of(name), content_of(name)["controls"]
    changes = {control: factor * each["range"][2] for control, each in controls.items() if control != "noise"}
    if factor == 0.0:
        changes = dict.fromkeys(("imbalance", "wait", "arm_1", "arm_2"), 0.0)
    keys = {
        "imbalance": ("imbalance.radius", scene.imbalance.radius),
        "phase": ("imbalance.phase", scene.imbalance.phase),
        "limit": ("supervisor.limit", scene.supervisor.limit),
        "wait": ("fine_tuning.wait", scene.fine_tuning.wait),
        "drive_speed": ("friction_filter.drive_speed", scene.friction_filter.drive_speed),
    }
    values: dict[str, Any] = {keys[each][0]: factor * keys[each][1] for each in changes if each in keys}
    # A page keeps the averaging time, which the program derives from the limit.
    values["fine_tuning.average"] = scene.fine_tuning.average
    values["masses.friction_arm"] = [factor * arm for arm in scene.masses.friction_arm]
    if factor == 0.0:
        del values["imbalance.radius"]
    changed = scene.with_values(values)
    answer = in_node(
        """
        const settings = { ...massSettings(content), ...changes };
        answer = ["strategy", "plant"].map((kind) => [...constantsOf(kind, content, settings, 0)]);
        """,
        blocks=blocks_of(name),
        content=content_of(name),
        changes=changes,
    )
    right = [list(strategy_block(changed).constants), list(plant_block(changed).constants)]
    if factor == 0.0:
        right[1][content_of(name)["controls"]["imbalance"]["places"][0]] = 0.0
    for told, wanted in zip(answer, right, strict=True):
        assert told == pytest.approx(wanted, rel=1e-12, abs=0)
    assert right != [list(strategy_block(scene).constants), list(plant_block(scene).constants)]


@needs_node
def test_a_drawn_device_has_its_own_plant_and_is_changed_in_proportion() -> None:
    name = "washing_machine"
    answer = in_node(
        """
        const scene = massSettings(content), { places } = content.controls.imbalance;
        const half = { ...scene, imbalance: 0.5 * scene.imbalance, limit: 2 * scene.limit };
        const one = (settings) => [...constantsOf("plant", content, settings, 2)];
        const [own, less] = [one(scene), one(half)];
        const changed = less.filter((each, i) => each !== own[i]).length;
        answer = { own, ratio: less[places[0]] / own[places[0]], changed };
        """,
        blocks=blocks_of(name),
        content=content_of(name),
    )
    own = content_of(name)["devices"][2]["constants"]
    assert answer["own"][: len(own)] == own
    assert own != content_of(name)["devices"][0]["constants"]
    assert (answer["ratio"], answer["changed"]) == (0.5, 1)


@needs_node
def test_moments_of_balanced_masses_oppose_the_imbalance() -> None:
    name = "driven_masses_small"
    answer = in_node(
        """
        const run = new MassRun(content, massSettings(content), { seed: 3 });
        while (!run.over) run.advance();
        const angles = run.trace.angles.map((each) => each.at(-1)), c = run.plant.numbers.constants;
        const { imbalance, phase } = content.controls;
        const [size, angle] = [imbalance, phase].map(({ places }) => c[places[0]]);
        const unbalance = [size * Math.cos(angle), size * Math.sin(angle)];
        const torque = Math.max(...run.trace.torques[0].map(Math.abs));
        answer = [moments({ angles, moment: run.own.moment, unbalance }), run.settled, torque];
        """,
        blocks=blocks_of(name),
        content=content_of(name),
    )
    plant, (drawn, settled, torque) = PlantParameters.of(scene_of(name)), answer
    unbalance, masses = np.array(drawn["unbalance"]), np.array(drawn["masses"])
    assert np.hypot(*unbalance) == pytest.approx(plant.unbalance)
    speed = scene_of(name).rotor.profile[1][0]
    assert np.hypot(*(unbalance + masses)) <= scene_of(name).supervisor.limit / abs(plant.influence(speed))
    assert 0 < settled < 5
    assert 0 < torque <= 2 * plant.drive_gain * plant.maximum_voltage


@needs_node
def test_the_state_is_in_the_address_and_nothing_else_is() -> None:
    texts = ["", "limit=0.1&device=2&seed=7&speed=60", "arm_1=0.03", "wait=0.004"]
    wrong = ["device=3", "device=-1", "device=1.5", "speed=3", "seed=1e3", "limit=<b>", "limit=9999"]
    wrong += ["x=1", "device", "=" * 999, "__proto__=1", "constructor=1"]
    answer = in_node(
        """
        const again = (text) => massAddress(massState("#" + text, content), content);
        answer = [texts.map(again), wrong.map(again)];
        """,
        blocks=blocks_of("driven_masses_small"),
        content=content_of("driven_masses_small"),
        texts=texts,
        wrong=wrong,
    )
    assert answer == [texts, [""] * len(wrong)]


def test_modules_import_from_those_before_them() -> None:
    for at, name in enumerate(MASS_MODULES):
        if name != "mass_blocks":
            imported = set(re.findall(r'from "\./(\w+)\.js"', module_text(name)))
            assert imported <= set(MASS_MODULES[:at]), name


def test_a_scene_with_eccentric_masses_has_a_panel(tmp_path: Path) -> None:
    page = rb.panel(scene_of("driven_masses_small").with_values({"run.time_limit": "0.2 s"}))
    written = page.save(tmp_path / "panel.html").read_text(encoding="utf-8")
    packed = json.loads(written.split('id="content">')[1].split("</script>")[0])
    assert len(packed["devices"]) == DEVICES + 1
    assert "connect-src" not in written
    assert len(written) <= MOST_BYTES


def test_locked_masses_have_no_panel(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    file = tmp_path / "scene.toml"
    file.write_bytes(
        file_text(scene_of("washing_machine").with_values({"supervisor.strategy": "locked"}), to=tmp_path)
    )
    assert main(["panel", str(file), "--out", str(tmp_path / "panel.html")]) == 2
    assert "locked masses have no controller" in capsys.readouterr().err
    assert not (tmp_path / "panel.html").exists()
