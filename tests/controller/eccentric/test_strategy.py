"""The whole strategy on the plant: it settles, repeats to the bit, and says how it fails."""

from __future__ import annotations

import cmath
import math
from typing import Any

import numpy as np
import pytest
from eccentric_runs import bundled, stage_names, stage_of

from ringbalance.controller.eccentric_mass.imbalance_filter import PLATEAU_FRACTION
from ringbalance.controller.eccentric_mass.memory import MEMORY, EccentricMeasurement
from ringbalance.controller.eccentric_mass.outcome import EccentricOutcome
from ringbalance.controller.eccentric_mass.plant import PlantParameters
from ringbalance.controller.eccentric_mass.run import simulate_eccentric
from ringbalance.controller.eccentric_mass.run_record import EccentricRun, StageSpan
from ringbalance.controller.eccentric_mass.run_rows import eccentric_history
from ringbalance.controller.eccentric_mass.scene_records import EccentricScene
from ringbalance.controller.eccentric_mass.settings import StrategySettings
from ringbalance.controller.eccentric_mass.step import begin_strategy, strategy_step
from ringbalance.verification.papers import RPM, at_constant_speed, changed


@pytest.fixture(scope="module")
def run(scene: EccentricScene) -> EccentricRun:
    return simulate_eccentric(scene)


def test_it_settles_through_all_stages(run: EccentricRun) -> None:
    assert run.settled
    assert run.outcome is EccentricOutcome.SETTLED
    assert stage_names(run) == ["imbalance estimation", "friction estimation", "positioning", "check", "rest"]
    assert run.settling_time is not None
    assert run.settling_time < 10
    assert run.residual_ratio is not None
    assert run.residual_ratio < 2e-3
    assert not run.warnings
    assert run.drive_off[-1]


def test_a_table_of_samples_divides_the_run_into_stages_once(
    run: EccentricRun, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Once a sample takes minutes over the 250,000 samples of the paper's run."""
    stages, calls = run.stages, []

    def counted(_: EccentricRun) -> tuple[StageSpan, ...]:
        calls.append(1)
        return stages

    monkeypatch.setattr(EccentricRun, "stages", property(counted))
    names = eccentric_history(run)["stage"]
    assert len(calls) == 1
    assert len(names) == run.time.size
    assert list(dict.fromkeys(names)) == [stage.name for stage in stages]


def unbalance_left(run: EccentricRun, plant: PlantParameters) -> float:
    """Unbalance of rotor and masses together at the end, kg m."""
    speed = float(run.speed[-1])
    return abs(plant.steady_whirl(speed, run.mass_angle[:, -1].tolist()) / plant.influence(speed))


def test_the_masses_undo_the_imbalance(run: EccentricRun, scene: EccentricScene) -> None:
    assert unbalance_left(run, PlantParameters.of(scene)) < 2e-3 * PlantParameters.of(scene).unbalance
    errors = run.history["friction_arm"][-1] - np.array(scene.masses.friction_arm)
    assert np.all(np.abs(errors) < 5 * np.sqrt(run.history["friction_variance"][-1]))


def test_a_seed_gives_the_same_bits(run: EccentricRun, scene: EccentricScene) -> None:
    again = simulate_eccentric(scene, seed=scene.run.seed)
    np.testing.assert_array_equal(again.whirl, run.whirl)
    np.testing.assert_array_equal(again.voltage, run.voltage)
    assert not np.array_equal(simulate_eccentric(scene, seed=1).whirl, run.whirl)


@pytest.mark.parametrize("factor", [0.97, 0.992, 1.008, 1.03])
def test_a_speed_near_a_plateau_takes_its_matrices(scene: EccentricScene, factor: float) -> None:
    """Within 1 % the estimate errs by d |d ln alpha/d ln W|, which is mended; beyond, none is made."""
    speed, plant = scene.rotor.speed_profile[0].speed, PlantParameters.of(scene)
    other = StrategySettings.of(at_constant_speed(scene, speed=factor * speed, time_limit=1.0))
    settings = StrategySettings.of(scene)._replace(filter=other.filter)
    run = simulate_eccentric(changed(scene, {"run.time_limit": 61.0}), settings=settings)
    if abs(factor - 1) < PLATEAU_FRACTION:
        assert run.outcome is EccentricOutcome.SETTLED
        expected = abs(plant.influence(speed) / plant.influence(factor * speed) - 1)
        true = plant.unbalance * cmath.exp(1j * plant.phase)
        assert abs(run.imbalance - true) / plant.unbalance == pytest.approx(expected, rel=0.3)
    else:
        assert run.outcome is EccentricOutcome.SPEED_NOT_CONSTANT
        assert "speed was not constant" in run.status


def test_progress_is_reported(scene: EccentricScene) -> None:
    reports: list[tuple[float, float]] = []
    simulate_eccentric(changed(scene, {"run.time_limit": 12.0}), progress=lambda *a: reports.append(a))
    times = [time for time, _ in reports]
    assert {limit for _, limit in reports} == {12.0}
    assert times == sorted(times)
    assert times[-1] == pytest.approx(12.0, abs=2e-3)


def test_a_step_is_repeatable_and_a_sample_that_is_not_a_number_is_passed_over(
    scene: EccentricScene,
) -> None:
    settings, memory = StrategySettings.of(scene), np.zeros(1, dtype=MEMORY)
    sample = EccentricMeasurement(0.0, 10.0, 0.0, 0.0, 1e-3 + 0j, 0j, (0.0, 3.0), (0.0, 0.0))
    begin_strategy(settings, memory[0], sample)
    again = memory.copy()
    strategy_step(settings, memory[0], sample)
    strategy_step(settings, again[0], sample)
    assert again.tobytes() == memory.tobytes()
    assert np.any(memory["voltage"] != 0.0)
    before = memory.copy()
    strategy_step(settings, memory[0], sample._replace(angle=(math.nan, 3.0)))
    assert memory["sample"] == before["sample"] + 1
    memory["sample"] = before["sample"]
    assert memory.tobytes() == before.tobytes()


@pytest.mark.parametrize("arms", [(0.0, 0.0), (0.004, 0.012), (0.0, 0.01)])
def test_any_friction_is_mastered(scene: EccentricScene, arms: tuple[float, float]) -> None:
    result = simulate_eccentric(changed(scene, {"masses.friction_arm": arms}))
    assert result.settled
    slippery = min(arms) == 0
    assert ("drives_stay_on" in {each.code for each in result.warned}) == slippery
    # The pair stays opposite although its frictions differ: the rotor does not feel them go round.
    friction = stage_of(result, "friction estimation")
    during = (result.time >= friction.start + 0.2) & (result.time <= friction.end)
    apart = result.mass_angle[1] - result.mass_angle[0] - math.pi
    assert np.max(np.abs(apart[during])) < math.radians(1.5)


def test_without_the_pair_loop_unequal_masses_part(scene: EccentricScene) -> None:
    slow = changed(scene, {"masses.friction_arm": (0.004, 0.012), "friction_filter.pair_gain": 0.0})
    result = simulate_eccentric(slow)
    friction = stage_of(result, "friction estimation")
    during = (result.time >= friction.start) & (result.time <= friction.end)
    apart = result.mass_angle[1] - result.mass_angle[0] - math.pi
    assert np.max(np.abs(apart[during])) > math.radians(2)


def test_a_saturated_rotor_keeps_what_two_masses_cannot_undo(scene: EccentricScene) -> None:
    result = simulate_eccentric(changed(scene, {"imbalance.mass": 0.5}))
    assert result.targets is not None
    assert result.targets.saturated
    parameters = PlantParameters.of(changed(scene, {"imbalance.mass": 0.5}))
    left = unbalance_left(result, parameters)
    assert left == pytest.approx(result.targets.residual, rel=0.01)


def test_a_drive_that_nearly_stalls_is_warned_of(scene: EccentricScene) -> None:
    weak = changed(
        scene, {"friction_filter.drive_speed": 0.02, "friction_filter.speed_gain": 2.0, "run.time_limit": 6.0}
    )
    paper_law = changed(weak, {"friction_filter.pair_gain": 0.0})
    assert "drive_nearly_stalled" in {each.code for each in simulate_eccentric(paper_law).warned}


def test_no_imbalance_is_no_trouble(scene: EccentricScene) -> None:
    result = simulate_eccentric(changed(scene, {"imbalance.mass": 0.0}))
    assert result.settled
    assert result.residual_ratio is None


@pytest.mark.parametrize(
    ("speed_rpm", "changes", "ratio"),
    [
        *((speed, {}, 5e-3) for speed in (-100.0, 60.0, 130.0, 300.0)),
        (100.0, {"sensor.frame": "laboratory"}, 2e-3),
        (100.0, {"masses.initial_angle": (0.4, 2.0)}, 2e-3),
    ],
)
def test_any_speed_sensor_and_start_will_do(
    scene: EccentricScene, speed_rpm: float, changes: dict[str, Any], ratio: float
) -> None:
    """At most this ratio of the vibration without balancing is left."""
    result = simulate_eccentric(
        changed(at_constant_speed(scene, time_limit=20.0, speed=speed_rpm * RPM), changes)
    )
    assert result.settled
    assert result.residual_ratio is not None
    assert result.residual_ratio < ratio


def test_the_washing_machine_settles() -> None:
    result = simulate_eccentric(bundled("washing_machine"))
    assert result.settled
    assert (result.residual_ratio or 1.0) < 5e-3
    np.testing.assert_allclose(result.history["friction_arm"][-1], [0.004, 0.006], rtol=0.05)


def test_a_run_that_ends_early_tells_why_it_would_have_failed(scene: EccentricScene) -> None:
    still = simulate_eccentric(at_constant_speed(scene, time_limit=2.0, speed=0.0))
    assert (still.outcome, still.residual_ratio) == ("too_slow", None)
    fast = simulate_eccentric(at_constant_speed(scene, time_limit=8.0, speed=1000 * RPM))
    assert fast.outcome == "stalled"


def test_the_document_is_thinned_and_keeps_the_largest_vibration(run: EccentricRun) -> None:
    document = run.to_dict()
    assert 2 < len(document["time_s"]) < 4000 < run.time.size
    assert max(document["amplitude_m"]) == run.worst_amplitude
    assert document["stages"][-1]["end_s"] == document["time_s"][-1]
