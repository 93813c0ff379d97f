"""Claims of a run's filters, and remedies that mend a failed run."""

from __future__ import annotations

import json
import math

import numpy as np
import pytest
from eccentric_runs import bundled, normalised
from scipy.stats import chi2

from ringbalance.controller.balancer import AS_GIVEN, balancer_of
from ringbalance.controller.eccentric_mass.remedies import remedies_of
from ringbalance.controller.eccentric_mass.run import simulate_eccentric
from ringbalance.controller.eccentric_mass.sampled_loops import RecommendedGains, advised
from ringbalance.controller.eccentric_mass.scene_records import EccentricScene, SpeedPoint
from ringbalance.controller.eccentric_mass.targets import reach_of
from ringbalance.scene import SceneError
from ringbalance.scene.origins import with_values_at
from ringbalance.verification.papers import RPM, at_constant_speed, changed

SEEDS = range(3)


def creeping() -> list[EccentricScene]:
    """Ten scenes whose masses are moved by the start or whose encoders are noisy, ended after stage A."""
    paper, washing = bundled("eccentric_mass_paper"), bundled("washing_machine")
    base, wash = at_constant_speed(paper, time_limit=3.3), at_constant_speed(washing, time_limit=1.0)

    def arms(scene: EccentricScene, first: float, second: float) -> EccentricScene:
        return changed(scene, {"masses.friction_arm": (first, second)})

    def noisy(scene: EccentricScene, degrees: float) -> EccentricScene:
        return changed(scene, {"sensor.encoder_noise": math.radians(degrees)})

    return [
        arms(base, 0.0, 0.0),
        arms(base, 1e-3, 1e-3),
        arms(changed(base, {"masses.mass": 1.5}), 2e-3, 1e-3),
        arms(base, 0.0, 5e-3),
        noisy(arms(base, 2e-3, 2e-3), 0.04),
        noisy(base, 0.14),
        arms(at_constant_speed(base, time_limit=3.3, speed=300 * RPM), 1e-3, 2e-3),
        noisy(arms(at_constant_speed(base, time_limit=3.3, speed=60 * RPM), 1e-3, 0.0), 0.04),
        arms(wash, 0.0, 0.0),
        arms(changed(base, {"sensor.frame": "laboratory"}), 1e-3, 0.0),
    ]


@pytest.mark.parametrize("number", range(10))
def test_errors_of_the_imbalance_are_those_claimed_while_masses_creep(number: int) -> None:
    """The sum of the squares over the seeds is chi-square; its limits let one run in a million pass."""
    scene = creeping()[number]
    total = sum(normalised(scene, seed) for seed in SEEDS)
    low, high = chi2.ppf([1e-6, 1 - 1e-6], 2 * len(SEEDS))
    assert low < total < high


def test_innovations_show_a_wrong_stiffness(scene: EccentricScene) -> None:
    short = changed(scene, {"run.time_limit": 3.0})
    right = simulate_eccentric(short)
    assert right.innovation == pytest.approx(1.0, abs=0.1)
    stiff = changed(short, {"imbalance_filter.assumed_stiffness": 1.05 * scene.rotor.stiffness})
    wrong = simulate_eccentric(stiff)
    assert wrong.innovation is not None
    assert wrong.innovation > 2
    assert "innovations_unlike_model" in {each.code for each in wrong.warned}
    assert right.warned == ()


@pytest.mark.parametrize("seed", range(3))
def test_masses_that_rest_teach_nothing(seed: int) -> None:
    """A friction far beyond the drives: three standard deviations of encoder noise are no motion."""
    small = changed(bundled("driven_masses_small"), {"masses.friction_arm": (0.01, 0.01)})
    stuck = changed(small, {"lqr.friction_compensation": "none", "run.time_limit": 8.0})
    run = simulate_eccentric(stuck, seed=seed)
    assert np.ptp(run.mass_angle, axis=1).max() == 0.0
    np.testing.assert_array_equal(run.history["friction_arm"], 0.0)
    start = stuck.friction_filter.initial_friction**2
    np.testing.assert_allclose(run.history["friction_variance"], start)
    assert run.outcome == "stalled"


def test_drives_that_do_their_work_are_not_warned_of(scene: EccentricScene) -> None:
    """Speed control alone is just strong enough to break friction, and compensation does the rest."""
    weak = changed(scene, {"friction_filter.speed_gain": 0.3})
    run = simulate_eccentric(weak)
    assert run.settled
    assert run.warnings == ()


def test_a_resting_mass_does_not_bias_the_other_ones_friction(scene: EccentricScene) -> None:
    """Its acceleration is wanted but never happens; a light rotor makes that count."""
    uneven = changed(scene, {"masses.friction_arm": (0.2, 0.005)})
    weak = changed(uneven, {"friction_filter.pair_gain": 0.0, "run.time_limit": 8.0})
    run = simulate_eccentric(weak)
    moved = np.ptp(run.mass_angle, axis=1)
    assert moved[0] < 1e-2 < moved[1]
    error = run.history["friction_arm"][-1, 1] - 0.005
    assert abs(error) < 5 * math.sqrt(run.history["friction_variance"][-1, 1])


def test_a_balanced_rotor_that_leaves_its_limit_is_not_settled() -> None:
    paper = bundled("eccentric_mass_paper")
    wrong = changed(paper, {"imbalance_filter.assumed_stiffness": 1.02 * paper.rotor.stiffness})
    loose = changed(wrong, {"supervisor.limit": 1e-3, "supervisor.correction": "trials"})
    run = simulate_eccentric(loose)
    assert run.outcome == "rises_again"
    assert not run.settled
    assert run.amplitude[-1] < 1e-3


def failing(scene: EccentricScene) -> dict[str, EccentricScene]:
    """One scene for each outcome with remedies."""
    short = changed(
        scene,
        {
            "supervisor.imbalance_time": 3.0,
            "supervisor.friction_time": 3.0,
            "supervisor.positioning_time": 5.0,
        },
    )
    noise = {"position_noise": 5e-3, "velocity_noise": 0.05}
    both = {f"{table}.{key}": size for table in ("imbalance_filter", "sensor") for key, size in noise.items()}
    loud = changed(short, both)
    slow = changed(short, {"friction_filter.rate_walk": 5.0, "friction_filter.friction_walk": 1e-3})
    wrong = changed(short, {"imbalance_filter.assumed_stiffness": 1.1 * scene.rotor.stiffness})
    wrong = changed(wrong, {"supervisor.correction": "trials"})
    sticky = changed(scene, {"run.time_limit": 150.0, "masses.friction_arm": (0.04, 0.04)})
    return {
        "imbalance_uncertain": loud,
        "saturated": changed(short, {"imbalance.mass": 0.5}),
        "stalled": changed(short, {"motor.maximum_voltage": 0.05}),
        "friction_uncertain": slow,
        "not_arrived": changed(sticky, {"lqr.friction_compensation": "none", "lqr.state_weight": 2e-3}),
        "time_limit": changed(scene, {"run.time_limit": 3.0}),
        "residual": changed(
            wrong, {"fine_tuning.step": 2e-4, "fine_tuning.stop": 1.5e-4, "run.time_limit": 200.0}
        ),
        "tuning_time": changed(wrong, {"supervisor.fine_tuning_time": 1.0, "run.time_limit": 60.0}),
    }


@pytest.mark.parametrize(
    "outcome",
    ["imbalance_uncertain", "saturated", "stalled", "friction_uncertain", "not_arrived", "tuning_time"],
)
def test_a_remedy_by_how_a_run_ends_mends_it(scene: EccentricScene, outcome: str) -> None:
    broken = failing(scene)[outcome]
    outcomes = balancer_of(broken).run({}, AS_GIVEN)
    assert outcomes.ended == (outcome,)
    imbalance = broken.imbalance.mass * broken.imbalance.radius / reach_of(broken)
    remedies = remedies_of(broken, outcomes, outcomes, [imbalance])
    ends = {simulate_eccentric(with_values_at(broken, each.changes)).outcome for each in remedies}
    assert ends - {outcome}


def test_what_has_no_single_value_is_mended_by_the_speed_profile(scene: EccentricScene) -> None:
    level = scene.rotor.speed_profile
    ramp = (SpeedPoint(time=0.0, speed=10.0), SpeedPoint(time=20.0, speed=12.0))
    early = (*level, SpeedPoint(time=6.0, speed=level[0].speed), SpeedPoint(time=9.0, speed=15.0))
    off = changed(scene, {"imbalance_filter.assumed_stiffness": 1.02 * scene.rotor.stiffness})
    long = changed(off, {"run.time_limit": 250.0})
    for start, profile, expected in ((scene, ramp, "speed_not_constant"), (long, early, "speed_changed")):
        broken = changed(start, {"rotor.speed_profile": profile})
        run = simulate_eccentric(broken)
        assert run.outcome == expected
        assert "rotor.speed_profile" in run.status
        assert simulate_eccentric(changed(broken, {"rotor.speed_profile": level})).settled
    slow = at_constant_speed(scene, time_limit=20.0, speed=0.5 * RPM)
    assert simulate_eccentric(slow).outcome == "too_slow"


@pytest.fixture(scope="module")
def unlimited() -> EccentricScene:
    """The small scene with the weight and gain of a larger machine, and without its voltage limit."""
    strong = changed(bundled("driven_masses_small"), {"lqr.state_weight": 3.5})
    fast = changed(strong, {"friction_filter.speed_gain": 2.0})
    return changed(fast, {"motor.maximum_voltage": None, "run.time_limit": 4.0})


def test_a_diverging_run_has_finite_numbers_and_a_remedy(unlimited: EccentricScene) -> None:
    run = simulate_eccentric(unlimited)
    assert run.outcome == "diverged"
    assert not run.settled
    assert run.time[-1] < 4.0
    json.dumps(run.to_dict(), allow_nan=False)
    assert np.all(np.isfinite(run.amplitude))
    mended = changed(with_values_at(unlimited, advised(unlimited)), {"run.time_limit": 8.0})
    assert all(loop.stable for loop in RecommendedGains.of(mended).loops)
    assert simulate_eccentric(mended).settled


def test_sampled_poles_of_the_small_scene(unlimited: EccentricScene) -> None:
    speed = RecommendedGains.of(unlimited).speed
    assert speed.radius == pytest.approx(1.34, abs=0.01)
    half = changed(unlimited, {"friction_filter.speed_gain": 2 * speed.recommended})
    assert RecommendedGains.of(half).speed.radius == pytest.approx(1.0)


def test_a_run_of_too_many_steps_or_samples_is_refused_with_key_and_limit(unlimited: EccentricScene) -> None:
    stiff = changed(unlimited, {"rotor.stiffness": 1.26e12, "run.time_limit": 30.0})
    with pytest.raises(SceneError, match=r"\[rotor\] stiffness = .* allowed: at most .* N/m"):
        simulate_eccentric(stiff)
    with pytest.raises(SceneError, match="time_limit"):
        simulate_eccentric(changed(unlimited, {"run.time_limit": 1e6}))
