"""The extremes: the designed set, the scenes at its points, and a judgement that can fail."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from ringbalance.reduced_model.calibration import calibrate
from ringbalance.reduced_model.calibration_record import Calibration
from ringbalance.scene import Scene
from ringbalance.scene.loader import scene_from
from ringbalance.verification.extremes import point as extremes_point
from ringbalance.verification.extremes import study
from ringbalance.verification.extremes.axes import AXES, InputAxis, Point, designed_set, scene_at
from ringbalance.verification.extremes.point import Ending, PointJudgement, judged
from ringbalance.verification.extremes.study import AxisSweep, Size, find_extremes
from ringbalance.verification.reference.chambers import exact_moment

SHORT = b"""
[disc]
outer_radius = "44.5 mm"
inner_radius = "20.5 mm"
axial_width = "62 mm"
central_angle = "90 deg"
[liquid]
name = "water"
temperature = "20 degC"
[tube]
bore = "1.5mm"
length = "120 mm"
[gas]
pressure = "0.7 MPa"
[rotor]
speed = "10000 rpm"
"""
"""Little more than a disc: tables that a file leaves out, no crest, no bends, a unit close to its number."""


def at(scene: Scene, point: Point, **mutation: float) -> PointJudgement:
    return PointJudgement.of_record(judged(scene, point, **mutation))


def test_the_designed_set_is_reproducible_and_grows_at_its_end() -> None:
    assert designed_set(count=30, seed=1) == designed_set(count=100, seed=1)[:30]
    assert designed_set(count=30, seed=1) != designed_set(count=30, seed=2)


def test_the_designed_set_reaches_both_ends_of_every_axis() -> None:
    points = designed_set(count=2000, seed=1)
    for axis in AXES:
        shares = np.array([axis.share(point[axis.name]) for point in points])
        assert -1e-12 <= shares.min() < 0.05
        assert 0.95 < shares.max() <= 1 + 1e-12


def test_each_axis_sets_what_it_says(paper_scene: Scene) -> None:
    point = {"speed": 3000.0, "fill": 0.4, "angle": 80.0, "plate": 0.25, "viscosity": 2e-5, "bore": 2.0}
    point |= {"roughness": 0.01, "pressure": 1.5, "period": 0.7, "tolerance": 1e-3, "gravity": 0.5}
    scene = scene_at(paper_scene, point)
    closing = paper_scene.disc.inner_radius * np.sin(np.radians(40))
    column = 1000 * scene.rotor.speed**2 * (44.5e-3**2 - 31.5e-3**2) / 2
    assert scene.rotor.speed == pytest.approx(100 * np.pi)
    assert (scene.disc.max_fill_ratio, scene.disc.initial_fill, scene.disc.chambers) == (0.4, 0.2, 4)
    assert scene.disc.central_angle == pytest.approx(np.radians(80))
    assert scene.disc.plate_thickness == pytest.approx(0.25 * closing)
    assert scene.liquid.kinematic_viscosity == pytest.approx(2e-5)
    assert scene.liquid.density == pytest.approx(paper_scene.liquid.density)
    assert (scene.tube.bore, scene.tube.roughness) == (pytest.approx(2e-3), pytest.approx(2e-5))
    assert scene.gas.pressure == pytest.approx(1.5 * column)
    assert scene.environment.gravity == pytest.approx(0.5 * 9.80665)
    assert (scene.controller.period, scene.tolerance) == (pytest.approx(0.7), pytest.approx(1e-3))
    assert scene.run.time_limit == pytest.approx(20 * 0.7 + 0.2)


def full_vibration(scene: Scene) -> float:
    moment = exact_moment(disc=scene.disc, density=scene.liquid.density, fill_ratio=scene.disc.max_fill_ratio)
    return float(scene.rotor.influence_coefficient * moment)


def test_the_loop_has_as_much_to_do_on_any_disc(paper_scene: Scene) -> None:
    """The rotor is as light as the disc's liquid, so that limit, gain and noise mean what they meant."""
    scene = scene_at(paper_scene, {"fill": 1e-6, "unbalance": 0.5, "gain": 2.0, "noise": 0.1})
    assert full_vibration(scene) == pytest.approx(full_vibration(paper_scene))
    assert scene.controller.assumed_influence_coefficient == scene.rotor.influence_coefficient
    assert scene.rotor.initial_amplitude == pytest.approx(0.5 * full_vibration(paper_scene))
    assert scene.controller.limit == pytest.approx(paper_scene.controller.limit)
    assert scene.controller.proportional == pytest.approx(2 * paper_scene.controller.proportional)
    assert scene.sensor.amplitude_noise == pytest.approx(0.1 * scene.controller.limit)


def test_a_belief_about_the_rotor_follows_the_rotor(paper_scene: Scene) -> None:
    wrong = paper_scene.with_values({"controller.assumed_influence_coefficient": 0.02})
    scene = scene_at(wrong, {"fill": 0.05})
    share = scene.controller.assumed_influence_coefficient / scene.rotor.influence_coefficient
    assert full_vibration(scene) == pytest.approx(full_vibration(paper_scene))
    assert share == pytest.approx(0.02 / paper_scene.rotor.influence_coefficient)


def test_the_papers_scene_is_solved(paper_scene: Scene) -> None:
    result = at(paper_scene, {})
    assert result.ending is Ending.SOLVED
    assert result.violations == ()
    assert 0 < result.worst_ratio <= 1
    assert 0 < result.residual < 1e-10


@pytest.fixture(scope="module")
def short() -> Scene:
    scene = scene_from(content=SHORT, file="short.toml")
    assert isinstance(scene, Scene)
    return scene


@pytest.mark.parametrize("axis", AXES, ids=lambda axis: axis.name)
def test_a_scene_of_little_more_than_a_disc_can_be_varied_along_every_axis(
    short: Scene, axis: InputAxis
) -> None:
    assert scene_at(short, {axis.name: float(axis.at(0.5))}) != short


@pytest.mark.parametrize(
    "axis",
    [
        axis if axis.name in ("angle", "pressure") else pytest.param(axis, marks=pytest.mark.heavy)
        for axis in AXES
    ],
    ids=lambda axis: axis.name,
)
def test_such_a_scene_holds_along_every_axis(short: Scene, axis: InputAxis) -> None:
    result = at(short, {axis.name: float(axis.at(0.5))})
    assert result.violations == ()
    assert result.loop


def test_a_rotor_without_a_ring_is_refused_by_name(paper_scene: Scene) -> None:
    result = at(paper_scene, {"speed": 10.0})
    assert result.ending is Ending.REFUSED
    assert "[rotor] speed" in result.text
    assert "/" not in result.text.split(": ")[0]
    assert result.violations == ()


def test_half_widths_too_small_and_lost_liquid_are_noticed(paper_scene: Scene) -> None:
    narrow = at(paper_scene, {}, width_factor=0.01)
    leaking = at(paper_scene, {}, leak=1e-6)
    assert narrow.ending is leaking.ending is Ending.BROKEN
    assert "half-width" in narrow.violations[0]
    assert "not conserved" in leaking.violations[0]


@pytest.fixture(scope="module")
def calibration(paper_scene: Scene) -> Calibration:
    return calibrate(paper_scene)


def faults(calibration: Calibration, **changes: Any) -> str:
    return " ".join(extremes_point._calibration_faults(replace(calibration, **changes), 0.5))


def test_a_head_that_falls_with_the_velocity_is_noticed(calibration: Calibration) -> None:
    tube = calibration.tube
    falling = replace(tube.k, value=tube.k.value / tube.reynolds**3 - 1)
    assert "head" in faults(calibration, tube=replace(tube, k=falling))


@pytest.mark.parametrize(("name", "title"), [("wall_pressure", "wall pressure"), ("moment", "moment")])
def test_a_chamber_quantity_that_does_not_grow_is_noticed(
    calibration: Calibration, name: str, title: str
) -> None:
    curve = getattr(calibration.chamber, name)
    spoiled = replace(calibration.chamber, **{name: replace(curve, value=-curve.value)})
    assert f"the {title} does not grow" in faults(calibration, chamber=spoiled)


def test_a_velocity_that_falls_with_the_pressure_is_noticed(
    calibration: Calibration, monkeypatch: pytest.MonkeyPatch
) -> None:
    sound = type(calibration.flow_law).evaluate

    def backwards(law: Any, **state: Any) -> Any:
        flow = sound(law, **state)
        return replace(flow, velocity=-flow.velocity)

    monkeypatch.setattr(type(calibration.flow_law), "evaluate", backwards)
    assert "the velocity falls" in " ".join(extremes_point._law_faults(calibration))


def test_an_exception_is_a_finding(paper_scene: Scene, monkeypatch: pytest.MonkeyPatch) -> None:
    def fails(*_: object) -> None:
        raise ZeroDivisionError("by accident")

    monkeypatch.setattr(extremes_point, "calibrate", fails)
    result = at(paper_scene, {})
    assert result.ending is Ending.BROKEN
    assert result.violations == ("exception ZeroDivisionError: by accident",)


@pytest.fixture
def counting(monkeypatch: pytest.MonkeyPatch) -> list[Point]:
    """Replaces the judgement by one that takes no time and remembers its points."""
    seen: list[Point] = []

    def judged(_: Scene, point: Point) -> dict[str, Any]:
        seen.append(point)
        good = 300 < point.get("speed", 1000.0) < 2e4
        ending, text = (Ending.SOLVED, "") if good else (Ending.REFUSED, "too fast")
        return {"ending": str(ending), "text": text, "violations": []}

    monkeypatch.setattr(study, "judged", judged)
    return seen


SMALL = Size(points=10, sweep=5, fineness=1.0)


def test_an_interrupted_study_resumes_where_it_stopped(
    paper_scene: Scene, tmp_path: Path, counting: list[Point]
) -> None:
    complete = find_extremes(paper_scene, size=SMALL).to_dict()
    counting.clear()

    def stop(what: str, done: int, _: int) -> None:
        if what == "axes" and done == 7:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        find_extremes(paper_scene, size=SMALL, folder=tmp_path, progress=stop)
    assert len(counting) == 17
    assert find_extremes(paper_scene, size=SMALL, folder=tmp_path).to_dict() == complete
    assert len(counting) == complete["judged"]
    find_extremes(paper_scene.with_values({"tube.bore": "1.6 mm"}), size=SMALL, folder=tmp_path)
    assert len(counting) == 2 * complete["judged"]


def test_everything_is_reported(paper_scene: Scene, counting: list[Point]) -> None:
    result = find_extremes(paper_scene, size=SMALL)
    document = result.to_dict()
    assert len(counting) == document["judged"] == 10 + 5 * len(AXES)
    assert result.broken() == 0
    assert sum(document["endings"].values()) == document["judged"]
    json.dumps(document, allow_nan=False)


@pytest.mark.usefixtures("counting")
def test_a_sweep_finds_where_answers_end(paper_scene: Scene) -> None:
    result = find_extremes(paper_scene, size=Size(points=1, sweep=11, fineness=1e-3)).sweeps[0].to_dict()
    assert np.all(np.diff(result["values"]) > 0)
    assert result["answered"] == [pytest.approx(300, rel=0.02), pytest.approx(2e4, rel=0.02)]
    assert result["beyond"] == ["too fast"]
    below, between, above = result["spans"]
    assert (below["low"], above["high"]) == (pytest.approx(1), pytest.approx(3e5))
    assert below["high"] < 300 < between["low"]
    assert between["high"] < 2e4 < above["low"]
    endings = [span["ending"] for span in (below, between, above)]
    assert endings == [Ending.REFUSED, Ending.SOLVED, Ending.REFUSED]


def test_a_stretch_has_the_message_next_to_the_answers() -> None:
    texts = ("far", "near", "", "", "beyond", "further")
    ends = tuple(
        PointJudgement(ending=Ending.REFUSED if text else Ending.SOLVED, text=text) for text in texts
    )
    sweep = AxisSweep(axis=AXES[-1], shares=np.arange(1.0, 7.0) / 2, judgements=ends)
    spans = [(span["low"], span["high"], span["text"]) for span in sweep.spans()]
    assert spans == [(1, 2, "near"), (3, 4, ""), (5, 6, "beyond")]


@pytest.mark.heavy
def test_two_workers_find_what_one_finds(paper_scene: Scene) -> None:
    few = Size(points=10, sweep=2, fineness=1.0)
    single, two = (find_extremes(paper_scene, size=few, workers=n).to_dict() for n in (1, 2))
    assert single == two


def test_a_few_designed_points_hold(paper_scene: Scene) -> None:
    for point in designed_set(count=4, seed=1):
        result = at(paper_scene, point)
        assert result.violations == (), (result.text, dict(point))
