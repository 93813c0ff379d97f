"""Fits of a scene with eccentric masses: run-ups and positioning, against the plant and its asymptotes."""

from __future__ import annotations

import json
import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from synthetic_rigs import observations

from ringbalance.cli import main
from ringbalance.controller.balancer import balancer_of
from ringbalance.controller.eccentric_mass.plant import PlantParameters
from ringbalance.controller.eccentric_mass.scene_records import (
    EccentricScene,
    eccentric_scene,
)
from ringbalance.identification.criticism import Review
from ringbalance.identification.fitting import fit
from ringbalance.identification.identifiability import Identified
from ringbalance.identification.kinds.kind import Observations
from ringbalance.identification.next_measurement import _offered_rows, _words_of, next_measurement
from ringbalance.identification.parameters import FitError
from ringbalance.identification.reading import KINDS
from ringbalance.scene import bundled_scene, load_scene
from ringbalance.scene.arrays import FloatArray
from ringbalance.scene.origins import value_at, with_values_at

NOISE = 20e-6
SPEEDS = np.linspace(8.0, 24.0, 24)


@pytest.fixture(scope="module")
def scene() -> EccentricScene:
    """Without uncertainties: nothing is known beforehand."""
    loaded = eccentric_scene(load_scene(bundled_scene("eccentric_mass_paper")))
    return replace(loaded, uncertainty=())


def run_up(true: EccentricScene, seed: int) -> Observations:
    plain = observations("run_up", {"speed": SPEEDS, "amplitude": np.ones(24), "phase": np.zeros(24)})
    found = KINDS["run_up"].predict(true, plain, None)
    draw = np.random.default_rng(seed).standard_normal(48)
    vector = (found + NOISE * draw).reshape(2, -1)
    amplitude, phase = np.hypot(*vector), np.arctan2(vector[1], vector[0])
    return replace(plain, columns={"speed": SPEEDS, "amplitude": amplitude, "phase": phase})


def positioning(true: EccentricScene, seed: int, noise: float = 0.002) -> Observations:
    times, volts = np.tile(np.linspace(0.05, 1.0, 10), 3), np.repeat([6.0, 9.0, 12.0], 10)
    columns = {"time": times, "voltage": volts, "speed": np.full(30, 10.5), "angle": np.zeros(30)}
    found = KINDS["positioning"].predict(true, observations("positioning", columns), None)
    return observations(
        "positioning", columns | {"angle": found + noise * np.random.default_rng(seed).standard_normal(30)}
    )


def test_a_run_up_gives_back_bearing_and_imbalance(scene: EccentricScene) -> None:
    truth = {"rotor.stiffness": 1080.0, "rotor.damping": 11.5, "imbalance.mass": 0.17, "imbalance.phase": 0.7}
    true = with_values_at(scene, truth)
    result = fit(scene, data=[run_up(true, 1)])
    assert [each.name for each in result.parameters] == list(truth)
    for each in result.parameters:
        low, high = each.interval
        assert low < truth[each.name] < high
        assert each.verdict is Identified.IDENTIFIED
        assert each.path == each.name
    assert Review.of(result).criticism.describes


def test_only_the_product_of_mass_and_radius_is_identified(scene: EccentricScene) -> None:
    """U = m_im r_im is all that the rotor feels of its imbalance."""
    result = fit(scene, data=[run_up(scene, 2)], parameters=["imbalance.mass", "imbalance.radius"])
    assert {each.verdict for each in result.parameters} == {Identified.STRUCTURALLY}
    (found,) = result.combinations
    assert found.exponents == (1.0, 1.0)
    moment = scene.imbalance.mass * scene.imbalance.radius
    assert found.value == pytest.approx(moment, rel=max(2 * found.relative_uncertainty, 1e-3))


def test_positioning_gives_back_friction_and_motor(scene: EccentricScene) -> None:
    truth = {"masses.friction_arm[0]": 0.012, "motor.torque_constant": 0.0093}
    true = with_values_at(scene, truth)
    result = fit(scene, data=[positioning(true, 3)], parameters=list(truth))
    for each in result.parameters:
        low, high = each.interval
        assert low < truth[each.name] < high, each.name
        assert (high - low) / truth[each.name] < 0.2
    assert eccentric_scene(result.scene).masses.friction_arm[1] == scene.masses.friction_arm[1]


def test_the_second_mass_moves_as_the_first_one_would_in_its_place(scene: EccentricScene) -> None:
    """Places and friction exchanged give the same motion, and the friction that is fitted is its own."""
    masses = replace(scene.masses, friction_arm=(0.014, 0.009))
    one = replace(scene, masses=masses)
    other = replace(
        scene,
        masses=replace(
            masses, friction_arm=masses.friction_arm[::-1], initial_angle=masses.initial_angle[::-1]
        ),
    )
    data = positioning(one, 4)
    second = data.with_columns(moved_mass=np.full(30, 2.0))
    predict = KINDS["positioning"].predict
    assert predict(other, second, None) == pytest.approx(predict(one, data, None), rel=1e-12)
    arms = {"masses.friction_arm[0]", "masses.friction_arm[1]"}
    for each, name in ((data, "masses.friction_arm[0]"), (second, "masses.friction_arm[1]")):
        assert arms & set(KINDS["positioning"].informs(each)) == {name}
    found = fit(scene, data=[second], parameters=["masses.friction_arm[1]", "masses.friction_arm[0]"])
    assert found.parameters[0].verdict is Identified.IDENTIFIED
    assert found.parameters[1].verdict is Identified.STRUCTURALLY


def test_the_next_speed_narrows_as_expected(scene: EccentricScene) -> None:
    """A run-up with the offered speed as one more row of known noise, against the gain expected of it."""
    width = {"amplitude": np.full(24, 1.96 * NOISE)}
    few = replace(run_up(scene, 6), uncertainty=width).where(np.arange(4))
    first = fit(scene, data=[few], parameters=["rotor.damping"])
    told = next_measurement(first, "rotor.damping")
    offered = _offered_rows(first.scene, "run_up", few)
    chosen = next(i for i in range(len(offered)) if _words_of(offered, i) == told.gains[0].candidate)
    speed = offered.columns["speed"][[chosen]]
    plain = observations("run_up", {"speed": speed, "amplitude": np.ones(1), "phase": np.zeros(1)})
    real, imaginary = KINDS["run_up"].predict(first.scene, plain, None)
    row = {
        "speed": speed,
        "amplitude": np.hypot([real], [imaginary]),
        "phase": np.arctan2([imaginary], [real]),
    }
    more = observations("run_up", row, widths={"amplitude": np.array([1.96 * NOISE])})
    again = fit(scene, data=[few, replace(more, file="more.csv")], parameters=["rotor.damping"])
    widths = [r.parameters[0].profile.high - r.parameters[0].profile.low for r in (first, again)]
    assert widths[1] / widths[0] == pytest.approx(told.gains[0].ratio, rel=0.05)
    assert told.gains[0].ratio < 0.5


def test_data_of_a_rotor_without_damping(scene: EccentricScene) -> None:
    """Off the critical speed, noise stated: the damping of the scene, held, describes its own alone."""
    none = with_values_at(scene, {"rotor.damping": 1e-9})
    for true, describes in ((scene, True), (none, False)):
        data = replace(run_up(true, 7), uncertainty={"amplitude": np.full(24, 1.96 * NOISE)})
        assert Review.of(fit(scene, data=[data], parameters=["imbalance.mass"])).describes == describes


def test_a_mass_reaches_the_speed_at_which_motor_and_friction_balance(scene: EccentricScene) -> None:
    """B V = C phi' + mu_f b (W + phi')^2, solved by hand; whirl moves it by less than two per cent."""
    stiff = with_values_at(scene, {"rotor.stiffness": 1e6})
    plant, volts, speed = PlantParameters.of(stiff), 9.0, 10.5
    times = np.array([4.0, 4.0 + 2 * math.pi / 5])
    columns = {
        "time": times,
        "voltage": np.full(2, volts),
        "speed": np.full(2, speed),
        "angle": np.zeros(2),
    }
    start, end = KINDS["positioning"].predict(stiff, observations("positioning", columns), None)
    arm = plant.friction_arm[0] * plant.moment
    a, b, c = arm, plant.drive_damping + 2 * arm * speed, arm * speed**2 - plant.drive_gain * volts
    steady = (-b + math.sqrt(b * b - 4 * a * c)) / (2 * a)
    assert (end - start) / (times[1] - times[0]) == pytest.approx(steady, rel=0.02)


def test_a_long_motion_is_that_of_its_parts(scene: EccentricScene) -> None:
    """A motion that the plant is given in parts, so that signals can act, has the angle of its rows."""

    def columns(times: list[float]) -> dict[str, FloatArray]:
        many = np.ones(len(times))
        return {"time": np.array(times), "voltage": 9 * many, "speed": 10.5 * many, "angle": 0 * many}

    predict = KINDS["positioning"].predict
    whole = predict(scene, observations("positioning", columns([60.0])), None)
    parts = predict(scene, observations("positioning", columns([20.0, 40.0, 60.0])), None)
    assert whole[0] == pytest.approx(parts[-1], rel=1e-4)


def test_friction_holds_a_small_voltage(scene: EccentricScene) -> None:
    columns = {
        "time": np.array([1.0]),
        "voltage": np.array([1e-3]),
        "speed": np.array([10.5]),
        "angle": np.zeros(1),
    }
    stiff = with_values_at(scene, {"rotor.stiffness": 1e7})
    assert KINDS["positioning"].predict(stiff, observations("positioning", columns), None)[0] == 0.0


def test_every_uncertain_quantity_can_be_changed(scene: EccentricScene) -> None:
    for name in (each.path for each in balancer_of(scene).inputs()):
        changed = with_values_at(scene, {name: 0.125})
        assert value_at(changed, name) == 0.125
        assert with_values_at(changed, {name: value_at(scene, name)}) == scene


def test_what_cannot_be_fitted_is_said(scene: EccentricScene) -> None:
    data = [run_up(scene, 1)]
    with pytest.raises(FitError, match=r"allowed: rotor\.mass"):
        fit(scene, data=data, parameters=["bore"])
    still = with_values_at(scene, {"masses.friction_arm[1]": 0.0})
    with pytest.raises(FitError, match="is zero"):
        fit(still, data=data, parameters=["masses.friction_arm[1]"])
    with pytest.raises(FitError, match="each once"):
        fit(scene, data=data, parameters=["rotor.mass", "rotor.mass"])


def test_the_command_takes_and_saves_such_a_scene(
    scene: EccentricScene, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    data = run_up(scene, 5).columns
    rows = [
        f"{s},{a * 1e3},{math.degrees(p)}"
        for s, a, p in zip(data["speed"], data["amplitude"], data["phase"], strict=True)
    ]
    path, target = tmp_path / "run.csv", tmp_path / "fitted.toml"
    head = '# kind = "run_up"\n# source = "rig"\n# amplitude = "zero_to_peak"\n'
    path.write_text(
        head + "speed [rad/s],amplitude [mm],phase [deg]\n" + "\n".join(rows) + "\n", encoding="utf-8"
    )
    words = [str(bundled_scene("eccentric_mass_paper")), str(path), "--save", str(target)]
    assert main(["fit", *words, "--json"]) == 0
    document = json.loads(capsys.readouterr().out)
    assert document["next_measurement"]["candidates"][0]["measurement"].startswith("run up with speed")
    saved = eccentric_scene(load_scene(target))
    by_name = {each["name"]: each["value"] for each in document["parameters"]}
    assert saved.rotor.damping == pytest.approx(by_name["rotor.damping"], rel=1e-7)
    assert main(["fit", *words[:2]]) == 0
    assert "rotor.stiffness" in capsys.readouterr().out
