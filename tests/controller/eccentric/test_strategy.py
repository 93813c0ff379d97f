"""The whole strategy on the plant: it settles, repeats to the bit, and says how it fails."""

from __future__ import annotations

import io
import json
import math
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from rich.console import Console

import ringbalance
from ringbalance.controller.eccentric_mass.advice import expected_deviation
from ringbalance.controller.eccentric_mass.plan import EccentricMeasurement
from ringbalance.controller.eccentric_mass.plant import PlantParameters
from ringbalance.controller.eccentric_mass.run import simulate_eccentric
from ringbalance.controller.eccentric_mass.run_record import (
    EccentricOutcome,
    EccentricRun,
    eccentric_document,
)
from ringbalance.controller.eccentric_mass.scene_records import EccentricScene, SpeedPoint, eccentric_scene
from ringbalance.controller.eccentric_mass.settings import StrategySettings
from ringbalance.controller.eccentric_mass.step import strategy_start, strategy_step
from ringbalance.reports.simulate_cli import simulate as command
from ringbalance.scene import bundled_scene, load_scene
from ringbalance.verification.eccentric_scenes import RPM, at_constant_speed, changed


@pytest.fixture(scope="module")
def paper() -> EccentricScene:
    return eccentric_scene(load_scene(bundled_scene("eccentric_mass_paper")))


@pytest.fixture(scope="module")
def scene(paper: EccentricScene) -> EccentricScene:
    """At 100 rpm for twenty seconds."""
    return at_constant_speed(paper, time_limit=20.0)


@pytest.fixture(scope="module")
def run(scene: EccentricScene) -> EccentricRun:
    return simulate_eccentric(scene)


def names(run: EccentricRun) -> list[str]:
    return [stage.name for stage in run.stages]


def test_it_settles_through_all_stages(run: EccentricRun) -> None:
    assert run.settled
    assert run.outcome is EccentricOutcome.SETTLED
    assert names(run) == ["imbalance estimation", "friction estimation", "positioning", "check", "rest"]
    assert run.settling_time is not None
    assert run.settling_time < 10
    assert run.residual_ratio is not None
    assert run.residual_ratio < 2e-3
    assert not run.warnings
    assert run.drive_off[-1]


def unbalance_left(run: EccentricRun, plant: PlantParameters) -> float:
    """That of rotor and masses together at the end, kg m."""
    speed = float(run.speed[-1])
    return abs(plant.steady_whirl(speed, run.mass_angle[:, -1].tolist()) / plant.influence(speed))


def test_the_masses_undo_the_imbalance(run: EccentricRun, scene: EccentricScene) -> None:
    assert unbalance_left(run, PlantParameters.of(scene)) < 2e-3 * PlantParameters.of(scene).unbalance


def test_estimates_are_as_good_as_they_claim(run: EccentricRun, scene: EccentricScene) -> None:
    told, plant = run.estimates, PlantParameters.of(scene)
    true = plant.unbalance * np.array([math.cos(plant.phase), math.sin(plant.phase)])
    error = told.imbalance[-1] - true
    assert error @ np.linalg.solve(told.imbalance_covariance[-1], error) < 20
    arms = np.array(scene.masses.friction_arm)
    assert np.all(np.abs(told.friction_arm[-1] - arms) < 5 * np.sqrt(told.friction_variance[-1]))


def test_a_seed_gives_the_same_bits(run: EccentricRun, scene: EccentricScene) -> None:
    again = simulate_eccentric(scene, seed=scene.run.seed)
    np.testing.assert_array_equal(again.whirl, run.whirl)
    np.testing.assert_array_equal(again.voltage, run.voltage)
    assert not np.array_equal(simulate_eccentric(scene, seed=1).whirl, run.whirl)


def test_progress_is_reported(scene: EccentricScene) -> None:
    told: list[tuple[float, float]] = []
    simulate_eccentric(changed(scene, "run", time_limit=12.0), progress=lambda *a: told.append(a))
    times = [time for time, _ in told]
    assert {limit for _, limit in told} == {12.0}
    assert times == sorted(times)
    assert times[-1] == pytest.approx(12.0, abs=2e-3)


def test_the_step_is_pure(scene: EccentricScene) -> None:
    settings = StrategySettings.of(scene)
    sample = EccentricMeasurement(0.0, 10.0, 0.0, 0.0, np.array([1e-3, 0, 0, 0]), (0.0, 3.0), (0.0, 0.0))
    state = strategy_start(settings, sample)
    first, voltage = strategy_step(settings, state, sample)
    again, same = strategy_step(settings, state, sample)
    assert voltage == same
    assert first.plan == again.plan
    np.testing.assert_array_equal(first.whirl.estimate.state, again.whirl.estimate.state)
    bad = sample._replace(angle=(math.nan, 3.0))
    skipped, kept = strategy_step(settings, first, bad)
    assert kept == voltage
    assert skipped.plan == first.plan


def test_plain_python_gives_the_compiled_steps_numbers(scene: EccentricScene) -> None:
    settings = StrategySettings.of(scene)
    sample = EccentricMeasurement(0.0, 10.0, 0.0, 0.0, np.array([1e-3, 0, 0, 0]), (0.0, 3.0), (0.01, 0.0))
    step: Any = strategy_step
    compiled, plain = strategy_start(settings, sample), strategy_start(settings, sample)
    for i in range(5):
        seen = sample._replace(time=1e-3 * i)
        compiled, one = strategy_step(settings, compiled, seen)
        plain, two = step.py_func(settings, plain, seen)
        assert one == pytest.approx(two, rel=1e-12)
    np.testing.assert_allclose(compiled.whirl.estimate.state, plain.whirl.estimate.state, rtol=1e-12)


def test_document_has_the_promised_keys(run: EccentricRun) -> None:
    found = json.loads(json.dumps(eccentric_document(run), allow_nan=False))
    promised = {"balancer", "settled", "settling_time_s", "status", "time_s", "amplitude_m", "phase_rad"}
    assert promised | {"mass_angle_rad", "estimates", "stages", "residual_ratio"} <= found.keys()
    assert found["balancer"] == "eccentric_mass"
    length = len(found["time_s"])
    assert 2 < length < 4000
    assert [len(found["amplitude_m"]), len(found["phase_rad"])] == [length, length]
    assert [len(angle) for angle in found["mass_angle_rad"]] == [length, length]
    assert len(found["estimates"]["imbalance_covariance"]) == length
    assert found["stages"][0].keys() == {"name", "start_s", "end_s"}
    assert found["stages"][-1]["end_s"] == found["time_s"][-1]
    assert max(found["amplitude_m"]) == run.worst_amplitude


def test_the_command_takes_either_balancer(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "short.toml"
    told = bundled_scene("eccentric_mass_paper").read_text()
    path.write_text(told.replace('time_limit = "250 s"', 'time_limit = "12 s"'))
    # Twelve seconds bring the masses home but not the check to its end.
    assert command(path, json=True) == 1
    found = json.loads(capsys.readouterr().out)
    assert found["outcome"] == "time_limit"
    path.write_text(told.replace('time_limit = "250 s"', 'time_limit = "20 s"'))
    assert command(path) == 0
    assert "friction estimation" in capsys.readouterr().out
    assert isinstance(ringbalance.simulate(load_scene(path)), EccentricRun)
    with pytest.raises(ValueError, match="has no flow_law"):
        ringbalance.simulate(load_scene(path), flow_law=object())  # type: ignore[call-overload]


def test_the_washing_machine_settles() -> None:
    found = simulate_eccentric(eccentric_scene(load_scene(bundled_scene("washing_machine"))))
    assert found.settled
    assert found.residual_ratio is not None
    assert found.residual_ratio < 5e-3
    np.testing.assert_allclose(found.estimates.friction_arm[-1], [0.004, 0.006], rtol=0.05)


@pytest.mark.parametrize("arms", [(0.0, 0.0), (0.004, 0.012), (0.0, 0.01)])
def test_any_friction_is_mastered(scene: EccentricScene, arms: tuple[float, float]) -> None:
    found = simulate_eccentric(changed(scene, "masses", friction_arm=arms))
    assert found.settled
    slippery = min(arms) == 0
    assert ("the drives must stay on" in " ".join(found.warnings)) == slippery
    # The pair stays opposite although its frictions differ: the rotor does not feel them go round.
    friction = next(stage for stage in found.stages if stage.name == "friction estimation")
    during = (found.time >= friction.start + 0.2) & (found.time <= friction.end)
    apart = found.mass_angle[1] - found.mass_angle[0] - math.pi
    assert np.max(np.abs(apart[during])) < math.radians(1.5)


def test_without_the_pair_loop_unequal_masses_part(scene: EccentricScene) -> None:
    slow = changed(changed(scene, "masses", friction_arm=(0.004, 0.012)), "friction_filter", pair_gain=0.0)
    found = simulate_eccentric(slow)
    friction = next(stage for stage in found.stages if stage.name == "friction estimation")
    during = (found.time >= friction.start) & (found.time <= friction.end)
    apart = found.mass_angle[1] - found.mass_angle[0] - math.pi
    assert np.max(np.abs(apart[during])) > math.radians(2)


def outcome(scene: EccentricScene) -> tuple[EccentricOutcome, str]:
    found = simulate_eccentric(scene)
    assert not found.settled
    return found.outcome, found.status


def test_each_way_to_fail_is_reported(scene: EccentricScene) -> None:
    short = changed(scene, "supervisor", imbalance_time=3.0, friction_time=3.0, positioning_time=5.0)
    slow = at_constant_speed(short, time_limit=5.0, speed=0.5 * RPM)
    assert outcome(slow) == (EccentricOutcome.TOO_SLOW, Having("lowest_speed"))
    ramp = (SpeedPoint(time=0.0, speed=10.0), SpeedPoint(time=5.0, speed=12.0))
    rising = changed(changed(short, "rotor", speed_profile=ramp), "run", time_limit=5.0)
    assert outcome(rising) == (EccentricOutcome.SPEED_NOT_CONSTANT, Having("speed_profile"))
    noisy = changed(short, "imbalance_filter", position_noise=5e-3, velocity_noise=0.05)
    assert outcome(noisy) == (EccentricOutcome.IMBALANCE_UNCERTAIN, Having("imbalance_filter.gate"))
    heavy = changed(short, "imbalance", mass=0.5)
    assert outcome(heavy) == (EccentricOutcome.SATURATED, Having("heavier masses"))
    weak = changed(short, "motor", maximum_voltage=0.05)
    assert outcome(weak) == (EccentricOutcome.STALLED, Having("maximum_voltage"))
    unsure = changed(short, "friction_filter", rate_noise=5.0)
    assert outcome(unsure) == (EccentricOutcome.FRICTION_UNCERTAIN, Having("friction_filter.gate"))
    sticky = changed(changed(scene, "run", time_limit=150.0), "masses", friction_arm=(0.04, 0.04))
    sticky = changed(sticky, "lqr", friction_compensation="none", state_weight=2e-3)
    assert outcome(sticky) == (EccentricOutcome.NOT_ARRIVED, Having("break_away"))
    assert outcome(changed(scene, "run", time_limit=3.0)) == (
        EccentricOutcome.TIME_LIMIT,
        Having("run.time_limit"),
    )
    locked = changed(scene, "supervisor", strategy="locked")
    assert outcome(locked) == (EccentricOutcome.LOCKED, Having("strategy"))


class Having:
    """Equal to any text that holds some words."""

    def __init__(self, words: str) -> None:
        self.words = words

    def __eq__(self, other: object) -> bool:
        return isinstance(other, str) and self.words in other

    __hash__ = None  # type: ignore[assignment]


def test_a_saturated_rotor_keeps_what_two_masses_cannot_undo(scene: EccentricScene) -> None:
    found = simulate_eccentric(changed(scene, "imbalance", mass=0.5))
    assert found.targets is not None
    assert found.targets.saturated
    parameters = PlantParameters.of(changed(scene, "imbalance", mass=0.5))
    left = unbalance_left(found, parameters)
    assert left == pytest.approx(found.targets.residual, rel=0.01)


def test_the_laboratory_sensor_does_as_well(scene: EccentricScene) -> None:
    found = simulate_eccentric(changed(scene, "sensor", frame="laboratory"))
    assert found.settled
    assert found.residual_ratio is not None
    assert found.residual_ratio < 2e-3


def test_masses_need_not_start_opposite(scene: EccentricScene) -> None:
    found = simulate_eccentric(changed(scene, "masses", initial_angle=(0.4, 2.0)))
    assert found.settled
    assert found.residual_ratio is not None
    assert found.residual_ratio < 2e-3


def test_a_run_that_ends_early_tells_why_it_would_have_failed(scene: EccentricScene) -> None:
    still = at_constant_speed(scene, time_limit=2.0, speed=0.0)
    assert outcome(still) == (EccentricOutcome.TOO_SLOW, Having("lowest_speed"))
    assert simulate_eccentric(still).residual_ratio is None
    fast = at_constant_speed(scene, time_limit=8.0, speed=1000 * RPM)
    assert outcome(fast) == (EccentricOutcome.STALLED, Having("drive_speed"))


def test_a_drive_that_nearly_stalls_is_warned_of(scene: EccentricScene) -> None:
    weak = changed(changed(scene, "friction_filter", drive_speed=0.02, speed_gain=2.0), "run", time_limit=6.0)
    paper_law = changed(weak, "friction_filter", pair_gain=0.0)
    assert any("nearly stalled" in warning for warning in simulate_eccentric(paper_law).warnings)


@pytest.mark.parametrize("speed", [-100.0, 60.0, 130.0, 300.0])
def test_any_speed_will_do(scene: EccentricScene, speed: float) -> None:
    found = simulate_eccentric(at_constant_speed(scene, time_limit=20.0, speed=speed * RPM))
    assert found.settled
    assert found.residual_ratio is not None
    assert found.residual_ratio < 5e-3


def test_no_imbalance_is_no_trouble(scene: EccentricScene) -> None:
    found = simulate_eccentric(changed(scene, "imbalance", mass=0.0))
    assert found.settled
    assert found.residual_ratio is None


def test_what_can_be_known_is_reported_beforehand(run: EccentricRun, scene: EccentricScene) -> None:
    end = run.stages[0].end
    expected = expected_deviation(scene, speed=100 * RPM, duration=end)
    found = math.sqrt(np.max(np.linalg.eigvalsh(run.estimates.imbalance_covariance[-1])))
    assert expected == pytest.approx(found, rel=0.1)
    slow = expected_deviation(scene, speed=2 * RPM)
    assert slow > 50 * expected_deviation(scene, speed=100 * RPM)
    assert expected_deviation(scene, speed=0.0) == scene.imbalance_filter.initial_unbalance


def test_the_documented_keys_are_there(run: EccentricRun) -> None:
    page = (Path(__file__).resolve().parents[3] / "docs" / "commands.md").read_text()
    section = page.split("## `simulate --json` of eccentric masses\n")[1].split("\n## ")[0]
    cells = [line.split("|")[1] for line in section.splitlines() if line.startswith("|")]
    told = {word for cell in cells for word in re.findall(r"`([a-zA-Z_]+)`", cell)}
    assert told == eccentric_document(run).keys()


def test_the_table_for_people_reads_well(run: EccentricRun) -> None:
    told = io.StringIO()
    Console(file=told, width=120).print(run.rows().view())
    text = told.getvalue()
    assert "settled: within the limit of 0.3 mm" in text
    assert f"{1e3 * run.final_amplitude:.4g} mm" in text or f"{1e6 * run.final_amplitude:.4g} um" in text
    assert "fine tuning" not in text
