"""Masses, guide radius, gear and motor for an imbalance and a requirement."""

from __future__ import annotations

import json
import math
from pathlib import Path

import numpy as np
import pytest

from ringbalance import SceneError, bundled_scene, find_design, load_scene
from ringbalance.controller.balancer import Draws, balancer_of
from ringbalance.controller.eccentric_mass.devices import imbalance_ratios
from ringbalance.controller.eccentric_mass.scene_records import EccentricScene, eccentric_scene
from ringbalance.controller.eccentric_mass.static_answers import required_residual, stall_ratio
from ringbalance.controller.eccentric_mass.targets import reach_of
from ringbalance.design.mass_design import MassDesign

# Made up: no maker's data.
_MOTORS = """\
# made-up motors
name,torque_constant,resistance,inertia,mass,maximum_voltage
strong,20 mN*m/A,1 ohm,20 g*cm^2,120 g,24 V
heavy,20 mN*m/A,1 ohm,20 g*cm^2,1.5 kg,24 V
weak,0.1 mN*m/A,60 ohm,1 g*cm^2,20 g,1.5 V
"""


def washing(folder: Path, motors: str = _MOTORS, **tables: str) -> EccentricScene:
    """The washing machine with motors at hand and further tables; in its short runs nothing settles."""
    text = Path(bundled_scene("washing_machine")).read_text("utf-8").replace('"160 s"', '"0.5 s"')
    (folder / "motors.csv").write_text(motors, encoding="utf-8")
    tables = {"design": 'motor_file = "motors.csv"', **tables}
    parts = [text, *(f"[{name}]\n{content}" for name, content in tables.items())]
    file = folder / "machine.toml"
    file.write_text("\n".join(parts), encoding="utf-8")
    return eccentric_scene(load_scene(file))


def designed(scene: EccentricScene) -> MassDesign:
    design = find_design(scene)
    assert isinstance(design, MassDesign)
    return design


@pytest.fixture(scope="module")
def design(tmp_path_factory: pytest.TempPathFactory) -> MassDesign:
    content = 'motor_file = "motors.csv"\nguide_radius = "0.24 m"'
    return designed(washing(tmp_path_factory.mktemp("machine"), design=content))


def test_masses_cancel_the_imbalance_of_nearly_all_devices_and_no_more(design: MassDesign) -> None:
    scene = design.recommended_scene
    assert design.best is not None
    assert design.best.motor == "strong"
    assert scene.masses.guide_radius == pytest.approx(0.24)
    covered = np.mean(np.array(imbalance_ratios(scene)) < 1)
    assert covered >= 0.99
    assert design.needed < reach_of(scene) < 1.02 * design.needed
    length = 0.08 * (scene.masses.mass / 0.6) ** (1 / 3)
    assert scene.masses.arc_length == pytest.approx(length, rel=5e-3)


def test_a_mass_is_no_lighter_than_the_motor_that_travels_with_it(design: MassDesign) -> None:
    heavy = [each for each in design.candidates if each.motor == "heavy"]
    assert all(each.point["masses.mass"] >= 1.5 for each in heavy)
    moving = [each.moving for each in design.candidates if each.against is None]
    assert moving == sorted(moving)
    # The same moment at a smaller radius needs a heavier mass.
    strong = sorted(
        (e.point["masses.guide_radius"], e.moving) for e in design.candidates if e.motor == "strong"
    )
    assert [mass for _, mass in strong] == sorted((mass for _, mass in strong), reverse=True)


def test_gears_give_torque_and_speed_with_a_margin(design: MassDesign) -> None:
    scene = design.recommended_scene
    assert (stall_ratio(scene) or math.inf) >= 2
    ratio = scene.motor.teeth[2] / scene.motor.teeth[0]
    assert 24 / (0.02 * ratio) >= 2 * 0.6
    weak = [each for each in design.candidates if each.motor == "weak"]
    assert {each.against.code for each in weak if each.against} == {"motor_too_weak"}
    assert all(each.judgement is None for each in weak)


def test_the_answer_is_one_json_document_and_says_why_others_were_not_run(design: MassDesign) -> None:
    document = design.to_dict()
    assert json.loads(json.dumps(document, allow_nan=False)) == document
    assert document["verdict"] == "not met"
    assert not design.succeeded
    texts = [finding.text for finding in design.rows().findings]
    assert any("motor weak is too weak" in text for text in texts)
    assert [row[-1] for row in design.rows().tables[-1].rows].count("motor too weak") == 3


@pytest.mark.parametrize(
    ("tables", "code", "words"),
    [
        ({"design": 'motor_file = "motors.csv"\nmass = "50 g"'}, "mass_too_heavy", "leaves 50 g"),
        ({"requirement": 'residual = "0.05 mm"'}, "mass_design_refused", "below the sensor noise"),
    ],
)
def test_what_stands_against_it_is_said(
    tmp_path: Path, tables: dict[str, str], code: str, words: str
) -> None:
    design = designed(washing(tmp_path, **tables))
    assert design.judgement is None
    assert code in {each.against.code for each in design.candidates if each.against}
    texts = [finding.text for finding in design.rows().findings]
    assert texts[0].startswith("not met")
    assert any(words in text for text in texts)
    with pytest.raises(SceneError, match="no design can work"):
        _ = design.recommended_scene


def test_a_grade_is_the_vibration_of_its_unbalance_at_the_last_speed(tmp_path: Path) -> None:
    """G 6.3 of 25 kg at 90 rpm: 6.3e-3 * 25/9.42 kg m, and the smaller of grade and residual holds."""
    scene = washing(tmp_path, requirement='grade = "G 6.3"')
    speed = 90 * math.pi / 30
    mass, moment = 25 + 2 * 0.6, 6.3e-3 * 25 / speed
    whirl = moment * speed**2 / abs(complex(12e3 - mass * speed**2, 180 * speed))
    assert required_residual(scene) == pytest.approx(whirl)
    (_, residual) = balancer_of(scene).demands()
    assert residual.required == pytest.approx(whirl)
    assert required_residual(scene.with_values({"requirement.residual": "0.1 mm"})) == pytest.approx(1e-4)


@pytest.mark.parametrize(
    ("motors", "words"),
    [
        ("name,torque\nM,1 mN*m/A\n", "torque"),
        ("name,torque_constant,resistance,inertia,mass\nM,1 mN*m/A,1 ohm,1 g*cm^2,1 g\n", "maximum_voltage"),
        (_MOTORS.replace("1 ohm,20 g*cm^2,120 g", "1 mm,20 g*cm^2,120 g"), "resistance"),
    ],
)
def test_errors_of_the_motors_name_their_place(tmp_path: Path, motors: str, words: str) -> None:
    with pytest.raises(SceneError, match=words):
        find_design(washing(tmp_path, motors))


@pytest.mark.heavy
def test_a_design_settles_on_devices_that_took_no_part(tmp_path: Path) -> None:
    scene = washing(tmp_path).with_values({"run.time_limit": "60 s", "requirement.residual": "1 mm"})
    design = designed(eccentric_scene(scene))
    assert design.succeeded
    fresh = balancer_of(design.recommended_scene)
    outcomes = fresh.run({}, Draws.block(1 << 22, 20))
    assert np.sum(np.all([each.met(outcomes) for each in fresh.demands()], axis=0)) >= 18
