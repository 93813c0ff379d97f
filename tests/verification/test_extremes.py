"""The extremes: the designed set, the scene files of its points, and a judgement that can fail."""

from __future__ import annotations

import json
import tomllib
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from ringbalance.reduced_model.calibration import calibrate
from ringbalance.reduced_model.calibration_record import Calibration
from ringbalance.scene import bundled_scene
from ringbalance.scene.loader import scene_from
from ringbalance.scene.models import Scene
from ringbalance.scene.toml import toml_bytes
from ringbalance.verification.extremes import design as extremes_design
from ringbalance.verification.extremes import point as extremes_point
from ringbalance.verification.extremes.design import AXES, CHUNK, Base, Point, design, fitted, varied
from ringbalance.verification.extremes.point import Defect, Ending, Judgement, judge_point
from ringbalance.verification.extremes.study import Size, Sweep, find_extremes
from ringbalance.verification.reference.chambers import exact_moment


@pytest.fixture(scope="module")
def document() -> dict[str, Any]:
    text = bundled_scene("liquid_ring_paper").read_text(encoding="utf-8")
    found = tomllib.loads(text)
    found["run"]["time_limit"] = "3 s"
    return found


@pytest.fixture(scope="module")
def base(document: dict[str, Any]) -> Base:
    return Base(document=document, file="disc.toml")


def made(document: dict[str, Any], scene: Scene, **values: float) -> Scene:
    found = scene_from(content=toml_bytes(varied(document, scene=scene, values=values)), file="disc.toml")
    assert isinstance(found, Scene)
    return found


def test_the_designed_set_is_reproducible_and_grows_at_its_end() -> None:
    assert design(count=30, seed=1) == design(count=100, seed=1)[:30]
    assert design(count=30, seed=1) != design(count=30, seed=2)


def test_the_designed_set_reaches_both_ends_of_every_axis() -> None:
    points = design(count=2000, seed=1)
    for axis in AXES:
        shares = np.array(
            [axis.share(p[axis.name]) if axis.low or axis.spacing == "linear" else 0 for p in points]
        )
        assert shares.min() >= -1e-12
        assert shares.max() <= 1 + 1e-12
        assert shares.min() < 0.05
        assert shares.max() > 0.95


def test_each_axis_sets_what_it_says(document: dict[str, Any], paper_scene: Scene) -> None:
    scene = made(
        document,
        paper_scene,
        speed=3000.0,
        fill=0.4,
        angle=80.0,
        plate=0.25,
        viscosity=2e-5,
        bore=2.0,
        roughness=0.01,
        pressure=1.5,
        period=0.7,
        tolerance=1e-3,
        gravity=0.5,
    )
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


def fitted_scene(document: dict[str, Any], scene: Scene, **values: float) -> Scene:
    changed = varied(document, scene=scene, values=values)
    disc = made(document, scene, **values)
    found = scene_from(
        content=toml_bytes(fitted(changed, scene=scene, made=disc, values=values)), file="disc.toml"
    )
    assert isinstance(found, Scene)
    return found


def full_vibration(scene: Scene) -> float:
    moment = exact_moment(disc=scene.disc, density=scene.liquid.density, fill_ratio=scene.disc.max_fill_ratio)
    return float(scene.rotor.influence_coefficient * moment)


def test_the_loop_has_as_much_to_do_on_any_disc(document: dict[str, Any], paper_scene: Scene) -> None:
    """The rotor is as light as the disc's liquid, so that limit, gain and noise mean what they meant."""
    found = fitted_scene(document, paper_scene, fill=1e-6, unbalance=0.5, gain=2.0, noise=0.1)
    assert full_vibration(found) == pytest.approx(full_vibration(paper_scene))
    assert found.controller.assumed_influence_coefficient == found.rotor.influence_coefficient
    assert found.rotor.initial_amplitude == pytest.approx(0.5 * full_vibration(paper_scene))
    assert found.controller.limit == pytest.approx(paper_scene.controller.limit)
    assert found.controller.proportional == pytest.approx(2 * paper_scene.controller.proportional)
    assert found.sensor.amplitude_noise == pytest.approx(0.1 * found.controller.limit)


def test_the_papers_scene_is_solved(document: dict[str, Any]) -> None:
    found = judge_point(document)
    assert found.ending is Ending.SOLVED
    assert found.violations == ()
    assert 0 < found.worst_ratio <= 1
    assert 0 < found.residual < 1e-10


@pytest.mark.parametrize("name", [axis.name for axis in AXES])
def test_a_scene_of_little_more_than_a_disc_can_be_varied_along_every_axis(
    document: dict[str, Any], name: str
) -> None:
    """Tables that a file leaves out, no hump, no bends, units close to their numbers."""
    tube = {"bore": "1.5mm", "length": "120 mm"}
    kept = {table: document[table] for table in ("disc", "liquid")}
    short = Base(
        document={**kept, "tube": tube, "gas": {"pressure": "0.7 MPa"}, "rotor": {"speed": "10000 rpm"}},
        file="short.toml",
    )
    (axis,) = (axis for axis in AXES if axis.name == name)
    found = short.judge({name: float(axis.at(0.5))})
    assert found.violations == ()
    assert found.loop


def test_a_rotor_without_a_ring_is_refused_by_name(document: dict[str, Any], paper_scene: Scene) -> None:
    found = judge_point(varied(document, scene=paper_scene, values={"speed": 10.0}))
    assert found.ending is Ending.REFUSED
    assert "[rotor] speed" in found.text
    assert found.violations == ()


def test_half_widths_too_small_and_lost_liquid_are_noticed(document: dict[str, Any]) -> None:
    narrow = judge_point(document, defect=Defect(width_factor=0.01))
    leaking = judge_point(document, defect=Defect(leak=1e-6))
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


@pytest.mark.parametrize(("name", "told"), [("wall_pressure", "wall pressure"), ("moment", "moment")])
def test_a_chamber_quantity_that_does_not_grow_is_noticed(
    calibration: Calibration, name: str, told: str
) -> None:
    curve = getattr(calibration.chamber, name)
    spoiled = replace(calibration.chamber, **{name: replace(curve, value=-curve.value)})
    assert f"the {told} does not grow" in faults(calibration, chamber=spoiled)


def test_a_velocity_that_falls_with_the_pressure_is_noticed(
    calibration: Calibration, monkeypatch: pytest.MonkeyPatch
) -> None:
    sound = type(calibration.flow_law).evaluate

    def backwards(law: Any, **state: Any) -> Any:
        flow = sound(law, **state)
        return replace(flow, velocity=-flow.velocity)

    monkeypatch.setattr(type(calibration.flow_law), "evaluate", backwards)
    assert "the velocity falls" in " ".join(extremes_point._law_faults(calibration))


def test_an_exception_is_a_finding(document: dict[str, Any], monkeypatch: pytest.MonkeyPatch) -> None:
    def fails(*_: object) -> None:
        raise ZeroDivisionError("by accident")

    monkeypatch.setattr(extremes_point, "calibrate", fails)
    found = judge_point(document)
    assert found.ending is Ending.BROKEN
    assert found.violations == ("exception ZeroDivisionError: by accident",)


@pytest.fixture
def counting(monkeypatch: pytest.MonkeyPatch) -> list[Point]:
    """Replaces the judgement by one that takes no time and remembers its points."""
    seen: list[Point] = []

    def quick(_: Base, point: Point) -> Judgement:
        seen.append(point)
        good = 300 < point.get("speed", 1000.0) < 2e4
        return Judgement(ending=Ending.SOLVED if good else Ending.REFUSED, text="" if good else "too fast")

    monkeypatch.setattr(Base, "judge", quick)
    return seen


def test_an_interrupted_set_goes_on_where_it_stopped(
    base: Base, tmp_path: Path, counting: list[Point]
) -> None:
    points, kept = design(count=3 * CHUNK, seed=1), tmp_path / "kept.json"
    first = base.judged(points[: 2 * CHUNK], kept=kept)
    whole = base.judged(points, kept=kept)
    assert len(counting) == 3 * CHUNK
    assert whole[: 2 * CHUNK] == first
    assert base.judged(points) == whole


@pytest.mark.parametrize("content", ["", "[" * 100_000, '{"key": 1, "judgements": [], "digest": 1}'])
def test_a_damaged_file_of_points_is_made_again(
    content: str, base: Base, tmp_path: Path, counting: list[Point], caplog: pytest.LogCaptureFixture
) -> None:
    points, kept = design(count=CHUNK, seed=1), tmp_path / "kept.json"
    kept.write_text(content)
    whole = base.judged(points, kept=kept)
    assert len(counting) == CHUNK
    (told,) = caplog.messages
    assert f"{kept} is damaged" in told
    assert base.judged(points, kept=kept) == whole
    assert len(counting) == CHUNK


def test_only_judgements_of_the_same_points_scene_and_version_are_taken(
    base: Base, tmp_path: Path, counting: list[Point], monkeypatch: pytest.MonkeyPatch
) -> None:
    points, kept = design(count=CHUNK, seed=1), tmp_path / "kept.json"
    base.judged(points, kept=kept)
    kept.write_text(kept.read_text().replace('"residual": 0.0', '"residual": "x"', 1))
    base.judged(points, kept=kept)
    assert len(counting) == 2 * CHUNK
    monkeypatch.setattr(extremes_design, "_sources", lambda: "another version")
    base.judged(points, kept=kept)
    assert len(counting) == 3 * CHUNK
    replace(base, document={**base.document, "name": "another"}).judged(points, kept=kept)
    assert len(counting) == 4 * CHUNK


def test_a_belief_about_the_rotor_follows_the_rotor(document: dict[str, Any], paper_scene: Scene) -> None:
    control = {**document["controller"], "assumed_influence_coefficient": "0.02 um/(g*mm)"}
    found = fitted_scene({**document, "controller": control}, paper_scene, fill=0.05)
    wrong = replace(
        paper_scene, controller=replace(paper_scene.controller, assumed_influence_coefficient=0.02)
    )
    believed = fitted_scene({**document, "controller": control}, wrong, fill=0.05)
    assert full_vibration(found) == pytest.approx(full_vibration(paper_scene))
    share = believed.controller.assumed_influence_coefficient / believed.rotor.influence_coefficient
    assert share == pytest.approx(0.02 / paper_scene.rotor.influence_coefficient)


def test_everything_is_reported(base: Base, counting: list[Point]) -> None:
    size = Size(points=10, sweep=5, fineness=1.0)
    found = find_extremes(base, size=size)
    told = found.to_dict()
    assert len(counting) == told["judged"] == 10 + 5 * len(AXES)
    assert found.broken() == 0
    assert sum(told["endings"].values()) == told["judged"]
    json.dumps(told, allow_nan=False)


@pytest.mark.usefixtures("counting")
def test_a_sweep_finds_where_answers_end(base: Base) -> None:
    found = find_extremes(base, size=Size(points=1, sweep=11, fineness=1e-3)).sweeps[0]
    assert isinstance(found, Sweep)
    assert np.all(np.diff(found.values) > 0)
    assert found.solved() == (pytest.approx(300, rel=0.02), pytest.approx(2e4, rel=0.02))
    assert found.beyond() == ("too fast",)
    below, between, above = found.spans()
    assert (below.low, above.high) == (pytest.approx(1), pytest.approx(3e5))
    assert below.high < 300 < between.low
    assert between.high < 2e4 < above.low
    assert [span.ending for span in (below, between, above)] == [
        Ending.REFUSED,
        Ending.SOLVED,
        Ending.REFUSED,
    ]


def sweep_of(*texts: str) -> Sweep:
    ends = [Ending.REFUSED if text else Ending.SOLVED for text in texts]
    found = tuple(Judgement(ending=end, text=text) for end, text in zip(ends, texts, strict=True))
    return Sweep(axis=AXES[0], values=np.arange(1.0, len(texts) + 1), judgements=found)


def test_a_stretch_tells_what_is_said_next_to_the_answers() -> None:
    spans = sweep_of("far", "near", "", "", "beyond", "further").spans()
    assert [(span.low, span.high, span.text) for span in spans] == [
        (1, 2, "near"),
        (3, 4, ""),
        (5, 6, "beyond"),
    ]


@pytest.mark.heavy
def test_two_workers_find_what_one_finds(base: Base) -> None:
    points = design(count=2 * CHUNK, seed=3)
    assert base.judged(points, workers=2) == base.judged(points)


def test_a_few_designed_points_hold(base: Base) -> None:
    for point in design(count=4, seed=1):
        found = base.judge(point)
        assert found.violations == (), (found.text, dict(point))
