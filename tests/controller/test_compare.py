"""Two balancers on one rotor: what is carried over, what is refused, and what comes out."""

from __future__ import annotations

import cmath
import json
import math

import numpy as np
import pytest

from ringbalance.cli import main
from ringbalance.controller.balancer import Balancer, balancer_of, takes
from ringbalance.controller.compare import Comparison, compare
from ringbalance.controller.eccentric_mass.plant import PlantParameters
from ringbalance.controller.eccentric_mass.run import simulate_eccentric
from ringbalance.controller.eccentric_mass.scene_records import EccentricScene, SpeedPoint, eccentric_scene
from ringbalance.controller.judging.judge import judged_all
from ringbalance.controller.rotor import CommonRotor, joined_rotor, rotors_of
from ringbalance.results.requirements import Paired
from ringbalance.scene import Scene, SceneError, bundled_scene, liquid_ring_scene, load_scene
from ringbalance.scene.origins import SceneFile
from scenes import with_tables

RPM = math.pi / 30


def under_paper_law(scene: SceneFile) -> Balancer:
    return balancer_of(scene, flow_law="paper" if takes(scene, "flow_law") else None)


def rotor_of(scene: SceneFile) -> CommonRotor:
    return balancer_of(scene).rotor()


def moved(scene: SceneFile, to: SceneFile) -> SceneFile:
    placed: SceneFile = balancer_of(scene).on_rotor(rotor_of(to)).scene
    return placed


@pytest.fixture(scope="module")
def driven() -> EccentricScene:
    return eccentric_scene(load_scene(bundled_scene("eccentric_mass_paper")))


@pytest.fixture(scope="module")
def small() -> EccentricScene:
    return eccentric_scene(load_scene(bundled_scene("driven_masses_small")))


def test_eccentric_masses_on_the_liquid_rings_rotor(paper_scene: Scene, driven: EccentricScene) -> None:
    """Speed, influence coefficient and lag, first vibration, noise and limit are those of the other scene."""
    told = eccentric_scene(moved(driven, paper_scene))
    speed = told.rotor.speed_profile[0].speed
    assert speed == paper_scene.rotor.speed
    result = PlantParameters.of(told).influence(speed)
    assert abs(result) == pytest.approx(0.0108, rel=1e-12)
    assert math.degrees(-cmath.phase(result)) == pytest.approx(17.0, rel=1e-12)
    whirl = PlantParameters.of(told).steady_whirl(speed, told.masses.initial_angle)
    assert abs(whirl) == pytest.approx(10e-6, rel=1e-9)
    assert math.degrees(cmath.phase(whirl)) == pytest.approx(90.0, rel=1e-9)
    assert told.rotor.mass == pytest.approx(driven.rotor.mass)
    assert told.sensor.position_noise == paper_scene.sensor.amplitude_noise
    assert told.supervisor.limit == paper_scene.controller.limit
    assert told.masses.initial_angle[1] - told.masses.initial_angle[0] == pytest.approx(math.pi)
    believed = told.imbalance_filter
    assert (believed.assumed_stiffness, believed.assumed_damping) == pytest.approx(
        (told.rotor.stiffness, told.rotor.damping)
    )


def test_the_scene_made_for_that_rotor_has_it_already(paper_scene: Scene, small: EccentricScene) -> None:
    """What the comments of the small scene say its numbers come from."""
    told = eccentric_scene(moved(small, paper_scene))
    assert told.rotor.stiffness == pytest.approx(small.rotor.stiffness, rel=1e-5)
    assert told.rotor.damping == pytest.approx(small.rotor.damping, rel=1e-5)
    assert told.imbalance.mass == pytest.approx(small.imbalance.mass, rel=1e-4)
    assert told.imbalance.phase == pytest.approx(small.imbalance.phase, rel=1e-9)


def test_a_liquid_ring_on_the_eccentric_masses_rotor(paper_scene: Scene, small: EccentricScene) -> None:
    """There and back again; valve-open times per unbalance and wrong assumptions are kept."""
    wrong = with_tables(
        paper_scene,
        controller={
            "assumed_influence_coefficient": 1.1 * paper_scene.rotor.influence_coefficient,
            "assumed_lag_angle": paper_scene.rotor.lag_angle + 0.2,
        },
    )
    other = with_tables(small, rotor={"stiffness": 2 * small.rotor.stiffness})
    told = liquid_ring_scene(moved(wrong, other))
    parameters = PlantParameters.of(other)
    alpha = parameters.influence(small.rotor.speed_profile[0].speed)
    assert told.rotor.influence_coefficient == pytest.approx(abs(alpha))
    assert told.rotor.lag_angle == pytest.approx(-cmath.phase(alpha))
    assert told.rotor.initial_amplitude == pytest.approx(abs(alpha) * parameters.unbalance)
    assert told.rotor.initial_phase == pytest.approx(small.imbalance.phase + cmath.phase(alpha))
    control, before = told.controller, wrong.controller
    gas = control.proportional * told.rotor.influence_coefficient
    assert gas == pytest.approx(before.proportional * wrong.rotor.influence_coefficient)
    assert control.assumed_influence_coefficient == pytest.approx(1.1 * told.rotor.influence_coefficient)
    assert control.assumed_lag_angle - told.rotor.lag_angle == pytest.approx(0.2)
    assert control.limit == small.supervisor.limit


def test_eccentric_masses_start_in_steady_whirl_at_constant_speed(driven: EccentricScene) -> None:
    told = eccentric_scene(moved(driven, driven))
    assert [corner.speed for corner in told.rotor.speed_profile] == pytest.approx([100 * RPM])
    decay = told.rotor.damping / (2 * PlantParameters.of(told).mass)
    assert math.exp(-decay * told.supervisor.start) < 1e-5
    assert told.run.time_limit == pytest.approx(driven.run.time_limit + told.supervisor.start)


def test_no_ring_at_the_speed_of_the_eccentric_masses(driven: EccentricScene, paper_scene: Scene) -> None:
    pattern = "on the rotor of eccentric_mass_paper.toml: so slow that gravity"
    with pytest.raises(SceneError, match=pattern) as caught:
        compare(under_paper_law(driven), under_paper_law(paper_scene), rotor="first")
    assert caught.value.faults[0].file == str(bundled_scene("liquid_ring_paper"))
    with pytest.raises(SceneError, match="another speed than in"):
        compare(under_paper_law(driven), under_paper_law(paper_scene))


def _at(driven: EccentricScene, speed: float) -> EccentricScene:
    profile = (SpeedPoint(time=0.0, speed=speed),)
    return with_tables(driven, rotor={"speed_profile": profile})


def test_what_cannot_be_compared(driven: EccentricScene, paper_scene: Scene) -> None:
    with pytest.raises(SceneError, match="does not turn forwards"):
        rotor_of(_at(driven, 0.0))
    with pytest.raises(SceneError, match="does not turn forwards"):
        rotor_of(_at(driven, -10.0))
    with pytest.raises(SceneError, match="never becomes steady"):
        rotor_of(with_tables(driven, rotor={"damping": 0.0}))
    with pytest.raises(SceneError, match="does not vibrate"):
        compare(
            balancer_of(with_tables(driven, imbalance={"mass": 0.0})),
            balancer_of(paper_scene),
        )
    ahead = with_tables(paper_scene, rotor={"lag_angle": -0.3})
    with pytest.raises(SceneError, match=r"no bearing of this kind gives a lag of -17\.19 deg"):
        moved(driven, ahead)
    light = balancer_of(with_tables(driven, rotor={"mass": 0.2})).rotor()
    heavy = with_tables(driven, masses={"mass": 3.0})
    with pytest.raises(SceneError, match="heavier than the rotor itself"):
        balancer_of(heavy).on_rotor(light)


def test_two_liquid_rings(paper_scene: Scene) -> None:
    """The same disc twice comes to the same, whichever is first; so many devices settle as `judged` says."""
    brief = paper_scene.with_values({"run.time_limit": "20 s"})
    first, second = (brief.with_values({"requirement.fraction": fraction}) for fraction in (0.95, 0.8))
    compared = compare(under_paper_law(first), under_paper_law(second), most=16)
    # Of two fractions that are required, the larger one holds for both.
    assert compared.asked == 0.95
    result = compared.to_dict()
    assert json.loads(json.dumps(result, allow_nan=False)) == result
    for key in ("fraction", "time_s", "residual_ratio", "energy_J", "worst_amplitude_m", "settings"):
        one, other = result[key]
        assert one == other, key
    assert result["better"] is None
    assert 0 < result["residual_ratio"][0] < 0.05 / 10
    # The first injections, of a second, fill at least the 33.8 ml that a full chamber leaves, to 0.7 MPa.
    assert result["energy_J"][0] > 2 * 0.801325e6 * 33.8e-6 * math.log(0.801325 / 0.101325)
    alone = judged_all(under_paper_law(brief), [compared.sides[0].settings], most=16)[0]
    assert compared.sides[0].fraction.count == pytest.approx(alone.fraction.count, abs=1)


def test_both_are_run_on_the_same_drawn_rotor_whichever_is_first(
    paper_scene: Scene, small: EccentricScene
) -> None:
    """Speed, influence coefficient and unbalance of each device; what else is drawn is each one's own."""
    ring, masses = under_paper_law(paper_scene), balancer_of(small)
    both: dict[int, CommonRotor] = {}
    scenes: dict[str, SceneFile] = {}
    for first, second in ((ring, masses), (masses, ring)):
        common = joined_rotor(first.rotor(), second.rotor())
        rotors = rotors_of(common, first.rotor, second.rotor)
        placed = [each.on_rotor(common, rotors) for each in (first, second)]
        # To the last digit, so that searches and runs are the same too.
        assert all(each.scene == scenes.setdefault(each.scene.balancer, each.scene) for each in placed)
        for number in (3, 70):
            rotor = both.setdefault(number, rotors(number))
            assert rotors(number) == rotor
            for other in (rotors(number), *(each.rotor(number) for each in placed)):
                assert other.speed == pytest.approx(rotor.speed)
                assert other.influence == pytest.approx(rotor.influence, rel=1e-4)
                assert other.unbalance == pytest.approx(rotor.unbalance, rel=1e-4)
    assert both[3].unbalance != pytest.approx(both[70].unbalance, rel=0.01)


def test_the_rotor_is_as_uncertain_as_the_scene_that_states_more(paper_scene: Scene) -> None:
    vague = paper_scene.with_values({"uncertainty.influence_coefficient": "20 %"})
    one, other = (under_paper_law(each) for each in (paper_scene, vague))
    for scenes in ((one.rotor, other.rotor), (other.rotor, one.rotor)):
        rotors = rotors_of(one.rotor(), *scenes)
        for number in (3, 70):
            assert rotors(number).influence == pytest.approx(other.rotor(number).influence)


def _swapped(first: Balancer, second: Balancer) -> tuple[Comparison, Comparison]:
    one, other = compare(first, second, most=16), compare(second, first, most=16)
    assert other.better == (None if one.better is None else 1 - one.better)
    assert other.paired.p_value == pytest.approx(one.paired.p_value, abs=0.3)
    return one, other


def test_the_order_names_no_other_winner(paper_scene: Scene) -> None:
    """A disc beside itself with a narrower tube, with gas that moves nothing, and with a vague rotor."""
    brief = paper_scene.with_values({"run.time_limit": "12 s"})
    ring = under_paper_law(brief)
    result = [
        _swapped(ring, under_paper_law(brief.with_values({path: value})))[0].better
        for path, value in (
            ("tube.bore", "0.9 mm"),
            ("gas.pressure", "0.2 MPa"),
            ("uncertainty.influence_coefficient", "10 %"),
        )
    ]
    assert result == [None, 0, None]


def test_pairs_are_tested_exactly() -> None:
    """2 and 10 discordant pairs: (1 + 12 + 66)/2^11 by hand; none: no difference."""
    paired = Paired(both=50, first_alone=10, second_alone=2, neither=2)
    assert paired.p_value == pytest.approx(2 * (1 + 12 + 66) / 2**12)
    assert (paired.better(0.05), paired.better(0.05 / 3)) == (0, None)
    assert Paired(both=64, first_alone=0, second_alone=0, neither=0).p_value == 1.0
    settled = np.array([True, True, False, False])
    assert Paired.of(settled, settled[[0, 2, 1, 3]]) == Paired(
        both=1, first_alone=1, second_alone=1, neither=1
    )


def test_the_order_changes_neither_noise_nor_what_is_assumed_of_it(
    paper_scene: Scene, small: EccentricScene
) -> None:
    """The small masses' rotor is that of the ring to the digits of its file."""
    ring, masses = under_paper_law(paper_scene), balancer_of(small)
    for balancer in (ring, masses):
        one, other = (balancer.on_rotor(each.rotor()).scene for each in (ring, masses))
        tables = ("sensor",) if balancer is ring else ("sensor", "imbalance_filter", "supervisor")
        for table in tables:
            for name, value in vars(getattr(one, table)).items():
                if isinstance(value, float):
                    assert value == pytest.approx(getattr(getattr(other, table), name), rel=1e-4), name


def test_a_required_settling_time_holds_for_both(paper_scene: Scene, small: EccentricScene) -> None:
    """The shorter of both, whichever scene states it; devices that settle later are not counted."""
    soon, later = (paper_scene.with_values({"requirement.settling_time": time}) for time in (2.0, 3.0))
    for pair in ((soon, later), (later, soon), (soon, paper_scene)):
        rotor = joined_rotor(*map(rotor_of, pair))
        assert rotor.settling_time == 2.0
        for scene in (paper_scene, small):
            assert balancer_of(scene).on_rotor(rotor).demands()[0].required == 2.0
    brief = soon.with_values({"run.time_limit": "12 s"})
    compared = compare(under_paper_law(brief), under_paper_law(brief), most=16)
    side = compared.sides[0]
    in_time = int(np.count_nonzero(side.outcomes.settling_time <= 2.0))
    assert side.fraction.count == in_time < int(np.count_nonzero(side.outcomes.settled))
    said = compared.rows()
    assert "settle within 2 s" in said.findings[0].text
    (cells,) = (each for each in said.tables[0].rows if str(each[0]).startswith("time to the limit"))
    assert " to " in str(cells[1])
    assert all("gives no controller.proportional" not in each.text for each in said.findings)


def test_what_a_scene_requires_of_itself_is_not_asked_on_another_rotor(paper_scene: Scene) -> None:
    strict = paper_scene.with_values({"requirement.correction_moment": 1.0})
    assert len(balancer_of(strict).demands()) == 2
    assert len(balancer_of(strict).on_rotor(rotor_of(paper_scene)).demands()) == 1


def test_the_small_masses_balance_the_liquid_rings_rotor_with_every_seed(
    paper_scene: Scene, small: EccentricScene
) -> None:
    """With seed 3 a friction arm is estimated 1.3 % too small: 2.5 of its standard deviations."""
    told = eccentric_scene(moved(small, paper_scene))
    brief = with_tables(told, run={"time_limit": 12.0})
    for seed in range(5):
        run = simulate_eccentric(brief, seed=seed)
        assert run.settled
        assert run.settling_time is not None
        assert run.settling_time < 3.5


def test_the_masses_do_as_well_on_their_own_rotor_as_on_the_same_one_of_a_ring(
    paper_scene: Scene, small: EccentricScene
) -> None:
    """Both rotors are one to the digits of the scene file: the order of a comparison makes no difference."""
    scenes = moved(small, small), moved(small, paper_scene)
    one, other = (eccentric_scene(with_tables(scene, run={"time_limit": 10.0})) for scene in scenes)
    for seed in range(2):
        times = [simulate_eccentric(scene, seed=seed).settling_time for scene in (one, other)]
        assert times[0] == pytest.approx(times[1], rel=0.03)


@pytest.mark.heavy
def test_the_order_of_ring_and_masses_makes_no_difference(paper_scene: Scene, small: EccentricScene) -> None:
    ring, masses = under_paper_law(paper_scene), balancer_of(small)
    one, other = (compare(*both, most=8) for both in ((ring, masses), (masses, ring)))
    assert one.rotor == other.rotor
    assert [side.fraction for side in one.sides] == [side.fraction for side in reversed(other.sides)]
    times = [[side.middle("settling_time") for side in result.sides] for result in (one, other)]
    assert times[0] == times[1][::-1]


def test_two_pairs_of_eccentric_masses(driven: EccentricScene) -> None:
    """A second pair of half the mass cannot undo the imbalance of the first one's rotor."""
    strong = with_tables(driven, run={"time_limit": 40.0})
    weak = with_tables(strong, masses={"mass": 0.06}, source="weak.toml")
    result = compare(under_paper_law(strong), under_paper_law(weak), rotor="first", most=8)
    good, poor = result.sides
    assert (good.fraction.count, poor.fraction.count, result.better) == (8, 0, 0)
    middle = good.middle("settling_time")
    assert middle is not None
    assert 0 < middle < 40
    assert (good.middle("energy") or 0) > 0
    # From the steady vibration the worst amplitude is no less than that.
    assert good.worst_amplitude > 0.9 * result.rotor.amplitude
    assert poor.middle("settling_time") is None
    # What two masses of 0.06 kg leave of 0.18 kg at the same radius, their centres one length apart.
    pair = 2 * 0.06 * math.cos(0.05 / 0.23 / 2)
    assert float(np.median(poor.residual_ratio)) == pytest.approx((0.18 - pair) / 0.18, abs=0.03)


def test_the_command(capsys: pytest.CaptureFixture[str]) -> None:
    """One clean JSON document; a balancer that cannot work there is bad input, told in one line."""
    ring, masses = (str(bundled_scene(name)) for name in ("liquid_ring_paper", "eccentric_mass_paper"))
    words = ["compare", ring, str(bundled_scene("six_chamber")), "--law", "paper", "--json"]
    assert main(words) == 2
    assert "another speed" in capsys.readouterr().err
    code = main([*words, "--rotor", "first"])
    told = capsys.readouterr()
    # A run that SIGTERM interrupts prints no document: its exit code and its message say so.
    assert code in (0, 1), told.err
    result = json.loads(told.out)
    assert [scene["source"] for scene in result["scenes"]] == ["liquid_ring_paper.toml", "six_chamber.toml"]
    assert result["rotor"]["source"] == "liquid_ring_paper.toml"
    assert code == (0 if result["verdict"] == ["met", "met"] else 1)
    assert all(energy > 0 for energy in result["energy_J"])
    assert main(["compare", masses, ring, "--rotor", "first"]) == 2
    told = capsys.readouterr()
    assert told.out == ""
    assert "on the rotor of eccentric_mass_paper.toml" in told.err
    assert main(["compare", ring, ring, "--law", "paper"]) in (0, 1)
    assert "left over" in capsys.readouterr().out
