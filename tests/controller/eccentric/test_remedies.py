"""What is told before a run, what its filters claim, and whether the remedies of a failed run mend it."""

from __future__ import annotations

import json
import math
import random
from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from eccentric_runs import bundled, stage_of, true_imbalance
from scipy.stats import chi2

from ringbalance.controller.eccentric_mass.advice import _of_time, _slower_walks, found_beforehand
from ringbalance.controller.eccentric_mass.integration import check_substeps, longest_run
from ringbalance.controller.eccentric_mass.plan import Stage
from ringbalance.controller.eccentric_mass.resolution import friction_floor
from ringbalance.controller.eccentric_mass.run import simulate_eccentric
from ringbalance.controller.eccentric_mass.run_record import EccentricRun
from ringbalance.controller.eccentric_mass.sampled_loops import RecommendedGains
from ringbalance.controller.eccentric_mass.scene_records import EccentricScene, SpeedPoint
from ringbalance.results.rows import Finding
from ringbalance.scene import SceneError
from ringbalance.verification.papers import RPM, at_constant_speed, changed

SEEDS = range(3)


def cured(scene: EccentricScene, remedy: Finding) -> EccentricScene:
    """The scene with the changes of a remedy."""
    for key, value in remedy.change.items():
        table, name = key.split(".")
        scene = changed(scene, table, **{name: value})
    return scene


def creeping() -> list[EccentricScene]:
    """Ten scenes whose masses are moved by the start or whose encoders are noisy, ended after stage A."""
    paper, washing = bundled("eccentric_mass_paper"), bundled("washing_machine")
    base, wash = at_constant_speed(paper, time_limit=3.3), at_constant_speed(washing, time_limit=1.0)

    def arms(scene: EccentricScene, first: float, second: float) -> EccentricScene:
        return changed(scene, "masses", friction_arm=(first, second))

    def noisy(scene: EccentricScene, degrees: float) -> EccentricScene:
        return changed(scene, "sensor", encoder_noise=math.radians(degrees))

    return [
        arms(base, 0.0, 0.0),
        arms(base, 1e-3, 1e-3),
        arms(changed(base, "masses", mass=1.5), 2e-3, 1e-3),
        arms(base, 0.0, 5e-3),
        noisy(arms(base, 2e-3, 2e-3), 0.04),
        noisy(base, 0.14),
        arms(at_constant_speed(base, time_limit=3.3, speed=300 * RPM), 1e-3, 2e-3),
        noisy(arms(at_constant_speed(base, time_limit=3.3, speed=60 * RPM), 1e-3, 0.0), 0.04),
        arms(wash, 0.0, 0.0),
        arms(changed(base, "sensor", frame="laboratory"), 1e-3, 0.0),
    ]


@pytest.mark.parametrize("number", range(10))
def test_errors_of_the_imbalance_are_those_claimed_while_masses_creep(number: int) -> None:
    """The sum of the squares over the seeds is chi-square; its limits let one run in a million pass."""
    scene = creeping()[number]
    true = true_imbalance(scene)
    total = 0.0
    for seed in SEEDS:
        run = simulate_eccentric(scene, seed=seed)
        error = run.estimates.imbalance[-1] - true
        total += float(error @ np.linalg.solve(run.estimates.imbalance_covariance[-1], error))
    low, high = chi2.ppf([1e-6, 1 - 1e-6], 2 * len(SEEDS))
    assert low < total < high


def test_innovations_show_a_wrong_stiffness(scene: EccentricScene) -> None:
    short = changed(scene, "run", time_limit=3.0)
    right = simulate_eccentric(short)
    assert right.innovation == pytest.approx(1.0, abs=0.1)
    stiff = changed(short, "imbalance_filter", assumed_stiffness=1.05 * scene.rotor.stiffness)
    wrong = simulate_eccentric(stiff)
    assert wrong.innovation is not None
    assert wrong.innovation > 2
    assert "innovations_unlike_model" in {each.code for each in wrong.warned}
    assert right.warned == ()


@pytest.mark.parametrize("seed", range(3))
def test_masses_that_rest_teach_nothing(seed: int) -> None:
    """A friction far beyond the drives: three standard deviations of encoder noise are no motion."""
    small = changed(bundled("driven_masses_small"), "masses", friction_arm=(0.01, 0.01))
    stuck = changed(changed(small, "lqr", friction_compensation="none"), "run", time_limit=8.0)
    run = simulate_eccentric(stuck, seed=seed)
    assert np.ptp(run.mass_angle, axis=1).max() == 0.0
    np.testing.assert_array_equal(run.estimates.friction_arm, 0.0)
    start = stuck.friction_filter.initial_friction**2
    np.testing.assert_allclose(run.estimates.friction_variance, start)
    assert run.outcome == "stalled"
    assert "drives_too_weak" in {each.code for each in run.warned}


def test_drives_that_do_their_work_are_not_warned_of(scene: EccentricScene) -> None:
    """Speed control alone is just strong enough to break friction, and compensation does the rest."""
    weak = changed(scene, "friction_filter", speed_gain=0.3)
    run = simulate_eccentric(weak)
    assert run.settled
    assert run.warnings == ()


def test_a_resting_mass_does_not_bias_the_other_ones_friction(scene: EccentricScene) -> None:
    """Its acceleration is wanted but never happens; a light rotor makes that count."""
    uneven = changed(scene, "masses", friction_arm=(0.2, 0.005))
    weak = changed(changed(uneven, "friction_filter", pair_gain=0.0), "run", time_limit=8.0)
    run = simulate_eccentric(weak)
    moved = np.ptp(run.mass_angle, axis=1)
    assert moved[0] < 1e-2 < moved[1]
    error = run.estimates.friction_arm[-1, 1] - 0.005
    assert abs(error) < 5 * math.sqrt(run.estimates.friction_variance[-1, 1])


def test_a_balanced_rotor_that_leaves_its_limit_is_not_settled() -> None:
    paper = bundled("eccentric_mass_paper")
    wrong = changed(paper, "imbalance_filter", assumed_stiffness=1.02 * paper.rotor.stiffness)
    loose = changed(wrong, "supervisor", limit=1e-3, correction="trials")
    run = simulate_eccentric(loose)
    assert run.outcome == "rises_again"
    assert not run.settled
    assert run.amplitude[-1] < 1e-3
    again = simulate_eccentric(cured(loose, run.remedies[0]))
    assert again.settled


def failing(scene: EccentricScene) -> dict[str, EccentricScene]:
    """One scene for each outcome with remedies."""
    short = changed(scene, "supervisor", imbalance_time=3.0, friction_time=3.0, positioning_time=5.0)
    noise = {"position_noise": 5e-3, "velocity_noise": 0.05}
    loud = changed(changed(short, "imbalance_filter", **noise), "sensor", **noise)
    slow = changed(short, "friction_filter", rate_walk=5.0, friction_walk=1e-3)
    wrong = changed(short, "imbalance_filter", assumed_stiffness=1.1 * scene.rotor.stiffness)
    wrong = changed(wrong, "supervisor", correction="trials")
    sticky = changed(changed(scene, "run", time_limit=150.0), "masses", friction_arm=(0.04, 0.04))
    return {
        "imbalance_uncertain": loud,
        "saturated": changed(short, "imbalance", mass=0.5),
        "stalled": changed(short, "motor", maximum_voltage=0.05),
        "friction_uncertain": slow,
        "not_arrived": changed(sticky, "lqr", friction_compensation="none", state_weight=2e-3),
        "time_limit": changed(scene, "run", time_limit=3.0),
        "residual": changed(changed(wrong, "fine_tuning", step=2e-4, stop=1.5e-4), "run", time_limit=200.0),
        "tuning_time": changed(changed(wrong, "supervisor", fine_tuning_time=1.0), "run", time_limit=60.0),
    }


@pytest.mark.parametrize(
    "outcome",
    [
        *("imbalance_uncertain", "saturated", "stalled", "friction_uncertain"),
        *("not_arrived", "time_limit", "residual", "tuning_time"),
    ],
)
def test_each_remedy_of_a_status_works(scene: EccentricScene, outcome: str) -> None:
    """It ends that outcome; what then still stands in the way may have another remedy, which settles it."""
    broken = failing(scene)[outcome]
    run = simulate_eccentric(broken)
    assert run.outcome == outcome
    assert run.remedies
    for remedy in run.remedies:
        assert remedy.text in run.status
        mended = cured(broken, remedy)
        again = simulate_eccentric(mended)
        assert again.outcome != outcome
        assert followed(mended, again, most=3).settled


def followed(scene: EccentricScene, run: EccentricRun, *, most: int) -> EccentricRun:
    """Apply the first remedy that each status names, up to a number of times."""
    for _ in range(most):
        if run.settled or not run.remedies:
            break
        scene = cured(scene, run.remedies[0])
        run = simulate_eccentric(scene)
    return run


def test_what_has_no_single_value_is_mended_by_the_speed_profile(scene: EccentricScene) -> None:
    level = scene.rotor.speed_profile
    ramp = (SpeedPoint(time=0.0, speed=10.0), SpeedPoint(time=20.0, speed=12.0))
    early = (*level, SpeedPoint(time=6.0, speed=level[0].speed), SpeedPoint(time=9.0, speed=15.0))
    off = changed(scene, "imbalance_filter", assumed_stiffness=1.02 * scene.rotor.stiffness)
    long = changed(off, "run", time_limit=250.0)
    for start, profile, expected in ((scene, ramp, "speed_not_constant"), (long, early, "speed_changed")):
        broken = changed(start, "rotor", speed_profile=profile)
        run = simulate_eccentric(broken)
        assert run.outcome == expected
        assert "rotor.speed_profile" in run.status
        assert simulate_eccentric(changed(broken, "rotor", speed_profile=level)).settled
    slow = at_constant_speed(scene, time_limit=20.0, speed=0.5 * RPM)
    assert simulate_eccentric(slow).outcome == "too_slow"


def test_gates_out_of_reach_are_told_beforehand(scene: EccentricScene) -> None:
    assert found_beforehand(scene) == ()
    noisy = changed(scene, "imbalance_filter", position_noise=0.05, velocity_noise=0.5)
    assert "imbalance_gate_out_of_reach" in codes(noisy)
    rough = changed(scene, "friction_filter", rate_walk=5.0, friction_walk=1e-3)
    assert "friction_gate_out_of_reach" in codes(rough)
    light = changed(scene, "friction_filter", speed_gain=200.0)
    (found,) = found_beforehand(light)
    assert (found.code, found.values["loop"]) == ("loop_unstable", "speed control")


def codes(scene: EccentricScene) -> set[str]:
    return {each.code for each in found_beforehand(scene)}


def test_the_friction_filters_floor_is_where_its_variance_stays(scene: EccentricScene) -> None:
    """As the filter's own Riccati equation has it with a perfect encoder, d = 1, small rates."""
    rough = changed(scene, "friction_filter", rate_walk=0.5, friction_walk=1e-3, rate_noise=1e-3)
    long = changed(changed(rough, "supervisor", friction_time=6.0), "run", time_limit=8.0)
    run = simulate_eccentric(long)
    during = stage_of(run, "friction estimation")
    last = int(np.searchsorted(run.time, during.end)) - 1
    found = math.sqrt(float(run.estimates.friction_variance[last, 0]))
    # The masses turn as well: b (W + w)^2 in place of b W^2.
    speed = scene.rotor.speed_profile[0].speed + scene.friction_filter.drive_speed
    assert found == pytest.approx(friction_floor(rough, speed=speed), rel=0.1)


def test_an_encoders_noise_keeps_up_a_floor_that_the_arms_walk_lowers(scene: EccentricScene) -> None:
    """With next to no walk of the rate the floor goes with the arm's walk to the power 3/4."""
    speed = scene.rotor.speed_profile[0].speed
    noisy = changed(scene, "friction_filter", rate_walk=1e-9, friction_walk=1e-4, rate_noise=0.1)
    calmer = changed(noisy, "friction_filter", friction_walk=1e-4 / 16)
    assert friction_floor(noisy, speed=speed) == pytest.approx(8 * friction_floor(calmer, speed=speed), 1e-4)
    target = friction_floor(noisy, speed=speed) / 2
    walks = {key.split(".")[1]: value for key, value in _slower_walks(noisy, target, speed=speed).items()}
    told = changed(noisy, "friction_filter", **walks)
    assert told.friction_filter.friction_walk < noisy.friction_filter.friction_walk
    assert 0.5 * target < friction_floor(told, speed=speed) <= 1.001 * target


def random_scene(number: int) -> EccentricScene:
    """A machine of any size: masses by the rotor, bearing by the speed, motor by chance."""
    chance = random.Random(number)

    def between(low: float, high: float) -> float:
        return math.exp(chance.uniform(math.log(low), math.log(high)))

    base = bundled("washing_machine" if number % 2 else "eccentric_mass_paper")
    speed = base.rotor.speed_profile[0].speed * between(0.5, 3)
    scene = at_constant_speed(base, time_limit=30.0, speed=speed)
    size = between(0.05, 2)
    damping = scene.rotor.damping * size * between(0.5, 3)
    rotor = {"mass": scene.rotor.mass * size, "stiffness": scene.rotor.stiffness * size, "damping": damping}
    scene = changed(scene, "rotor", **rotor)
    scene = changed(scene, "imbalance_filter", **{f"assumed_{key}": value for key, value in rotor.items()})
    radius = scene.masses.guide_radius
    arms = (between(1e-3, 0.1) * radius, between(1e-3, 0.1) * radius)
    heavy = scene.masses.mass * size * between(0.3, 3)
    scene = changed(scene, "masses", mass=heavy, friction_arm=arms if number % 5 else (0.0, arms[1]))
    scene = changed(scene, "imbalance", mass=scene.imbalance.mass * size * between(0.2, 2))
    scene = changed(scene, "imbalance", phase=chance.uniform(0, 2 * math.pi))
    volts = None if number % 3 else between(0.5, 50)
    scene = changed(scene, "motor", maximum_voltage=volts)
    scene = changed(scene, "sensor", encoder_noise=math.radians(between(1e-3, 0.1)))
    return replace(scene, lqr=replace(scene.lqr, state_weight=between(0.01, 50)))


@pytest.mark.heavy
@pytest.mark.parametrize("number", range(60))
def test_random_scenes_end_with_a_status_and_a_remedy_that_works(number: int) -> None:
    scene = random_scene(number)
    run = simulate_eccentric(scene)
    for _ in range(6):
        document = run.to_dict()
        assert np.all(np.isfinite(document["amplitude_m"]))
        if run.settled or not run.remedies:
            break
        scene = cured(scene, run.remedies[0])
        try:
            run = simulate_eccentric(scene)
        except SceneError:
            pytest.skip("the remedy's run would take too long")
    assert run.settled


def test_no_remedy_asks_for_a_run_that_would_be_refused() -> None:
    """Drives of a time constant far below the sample: the stages' times would need too many steps."""
    fast = changed(bundled("driven_masses_small"), "motor", resistance=0.02, maximum_voltage=None)
    short = changed(changed(fast, "run", time_limit=0.5), "supervisor", start=0.5)
    longest = longest_run(short)
    with pytest.raises(SceneError):
        check_substeps(changed(short, "run", time_limit=1.01 * longest))
    run = simulate_eccentric(short)
    assert run.outcome == "time_limit"
    (remedy,) = run.remedies
    check_substeps(cured(short, remedy))
    assert cured(short, remedy).run.time_limit == pytest.approx(longest, rel=0.02)
    # No longer run is allowed: then none is advised.
    least = changed(short, "run", time_limit=0.99 * longest)
    facts: Any = SimpleNamespace(scene=least, stage=Stage.IMBALANCE, end=least.run.time_limit)
    assert _of_time(facts) == []


def test_a_stalled_drive_with_too_low_a_gain_is_not_advised_more_volts_alone(scene: EccentricScene) -> None:
    weak = changed(scene, "friction_filter", speed_gain=0.5)
    limited = changed(changed(weak, "masses", friction_arm=(0.03, 0.03)), "motor", maximum_voltage=0.5)
    run = simulate_eccentric(limited)
    assert run.outcome == "stalled"
    for remedy in run.remedies:
        assert simulate_eccentric(cured(limited, remedy)).outcome != "stalled"


@pytest.fixture(scope="module")
def unlimited() -> EccentricScene:
    """The small scene with the weight and gain of a larger machine, and without its voltage limit."""
    strong = changed(bundled("driven_masses_small"), "lqr", state_weight=3.5)
    fast = changed(strong, "friction_filter", speed_gain=2.0)
    return changed(changed(fast, "motor", maximum_voltage=None), "run", time_limit=4.0)


def test_a_diverging_run_has_finite_numbers_and_a_remedy(unlimited: EccentricScene) -> None:
    run = simulate_eccentric(unlimited)
    assert run.outcome == "diverged"
    assert not run.settled
    assert run.time[-1] < 4.0
    json.dumps(run.to_dict(), allow_nan=False)
    assert np.all(np.isfinite(run.amplitude))
    mended = changed(cured(unlimited, run.remedies[0]), "run", time_limit=8.0)
    assert all(loop.stable for loop in RecommendedGains.of(mended).loops)
    assert simulate_eccentric(mended).settled


def test_sampled_poles_of_the_small_scene(unlimited: EccentricScene) -> None:
    speed = RecommendedGains.of(unlimited).speed
    assert speed.radius == pytest.approx(1.34, abs=0.01)
    half = changed(unlimited, "friction_filter", speed_gain=2 * speed.recommended)
    assert RecommendedGains.of(half).speed.radius == pytest.approx(1.0)


def test_a_run_of_too_many_steps_or_samples_is_refused_with_key_and_limit(unlimited: EccentricScene) -> None:
    stiff = changed(changed(unlimited, "rotor", stiffness=1.26e12), "run", time_limit=30.0)
    with pytest.raises(SceneError, match=r"\[rotor\] stiffness = .* allowed: at most .* N/m"):
        simulate_eccentric(stiff)
    with pytest.raises(SceneError, match="time_limit"):
        simulate_eccentric(changed(unlimited, "run", time_limit=1e6))
