"""The loop under the calibrated law: MARCH against an adaptive integrator, through every regime."""

from __future__ import annotations

import numpy as np
import pytest
from transfers import Drive, adaptive_ode, marched

from ringbalance import bundled_scene, load_scene
from ringbalance.controller.liquid_ring.devices import Spread, devices
from ringbalance.controller.loop import simulate
from ringbalance.controller.simulation import Outcome
from ringbalance.reduced_model.calibration import calibrate
from ringbalance.reduced_model.injection.dynamics import Event
from ringbalance.reduced_model.law.flow_law import BalancerModel, Regime
from ringbalance.scene.models import Scene
from ringbalance.scene.narrowing import liquid_ring_scene
from ringbalance.scene.origins import InputUncertainty
from scenes import with_tables

MARCH = marched(liquid_ring_scene(load_scene(bundled_scene("liquid_ring_paper"))).tube)


@pytest.fixture(scope="module")
def calibrated(paper_scene: Scene) -> BalancerModel:
    return calibrate(paper_scene).model


def drive_of(model: BalancerModel, *, fill: float, pressure: float, primed: bool = False) -> Drive:
    return Drive(
        law=model.flow,
        fill=fill,
        total=0.5,
        exchange_rate=model.tube_area / model.chamber_volume,
        gas_pressure=pressure,
        primed=primed,
    )


@pytest.mark.parametrize(
    ("fill", "pressure", "start", "event"),
    [
        (0.45, 0.7e6, Regime.SEPARATED, Event.NONE),
        (0.25, 0.7e6, Regime.SEPARATED, Event.EMPTY),
        (0.15, 1.5e6, Regime.SIPHON, Event.EMPTY),
        (0.15, 2.5e6, Regime.SIPHON, Event.EMPTY),
    ],
)
def test_quadrature_against_the_adaptive_integrator(
    calibrated: BalancerModel, fill: float, pressure: float, start: Regime, event: Event
) -> None:
    drive = drive_of(calibrated, fill=fill, pressure=pressure)
    t = np.array([0.05, 0.3, 0.6]) if event is Event.NONE else np.array([0.05, 0.3, 2.0])
    result, reference = MARCH(drive, t), adaptive_ode()(drive, t)
    assert result.fill == pytest.approx(reference.fill, abs=1e-8)
    assert (result.regime_start, result.event) == (start, event)
    if event is Event.EMPTY:
        assert result.event_time == pytest.approx(reference.event_time, rel=1e-7)


def test_an_empty_tube_below_its_priming_pressure_stays_blocked(calibrated: BalancerModel) -> None:
    # 0.33 MPa start it; a full tube holds together from 0.05 MPa less: half of what lies between vapour
    # pressure and the vented chamber's.
    for primed, event in ((False, Event.BLOCKED), (True, Event.NONE)):
        drive = drive_of(calibrated, fill=0.25, pressure=0.3e6, primed=primed)
        assert MARCH(drive, np.array([0.05])).event is event


def test_the_papers_gain_overshoots_on_the_calibrated_tube(
    paper_scene: Scene, calibrated: BalancerModel
) -> None:
    run = simulate(paper_scene, calibrated)
    assert run.overshoots > 2
    gentle = with_tables(paper_scene, controller={"proportional": 0.02e6})
    calm = simulate(gentle, calibrated)
    assert calm.overshoots == 0


def test_too_little_pressure_names_the_priming_threshold(
    paper_scene: Scene, calibrated: BalancerModel
) -> None:
    low = with_tables(paper_scene, gas={"pressure": 0.3e6})
    run = simulate(low, calibrated)
    assert run.outcome is Outcome.STALLED
    # Column from the crest to the free surface at a quarter's fill, rho omega^2 (a^2 - r_m^2)/2, in MPa.
    assert "to start there: 0.33" in run.status


def test_a_slow_rotor_siphons_its_correction_away(paper_scene: Scene) -> None:
    slow = with_tables(paper_scene, rotor={"speed": 314.0}, gas={"pressure": 0.1e6}, run={"time_limit": 6.0})
    run = simulate(slow, calibrate(slow).model)
    assert run.outcome is Outcome.DRIFTING
    assert "run back" in run.status


def test_devices_differ_in_the_measured_factor_of_the_moment(
    paper_scene: Scene, calibrated: BalancerModel
) -> None:
    measured = with_tables(
        paper_scene,
        disc={"lambda_factor": 0.8},
        uncertainty=(InputUncertainty(quantity="lambda_factor", half_width=0.04, relative=False),),
    )
    made = devices(measured, calibrated, Spread.of(measured, calibrated), range(64), seed=0)
    factors = [each.scene.disc.lambda_factor or 0.0 for each in made]
    assert np.std(factors) == pytest.approx(0.04 / 1.96, rel=0.1)
