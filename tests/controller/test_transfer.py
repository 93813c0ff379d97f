"""One operation on one pair: every integrator against closed forms and against each other."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from transfers import (
    Drive,
    Integrator,
    adaptive_ode,
    closed_form,
    marched,
)

from ringbalance import bundled_scene, load_scene
from ringbalance.reduced_model.injection.dynamics import Event
from ringbalance.reduced_model.law.flow_law import Regime
from ringbalance.scene.narrowing import liquid_ring_scene

MARCH = marched(liquid_ring_scene(load_scene(bundled_scene("liquid_ring_paper"))).tube)

DriveBy = Callable[..., Drive]

PIECE = 0.5 / 4096
TIMES = np.array([0.0, 0.1, 0.35, 0.8, 2.0])
# du/dt = -2 omega^2 S/((k+1) B theta) and u0^2 = 2 p0/(rho (k+1)) at equal fills: Eqs. 19 and 20 by hand.
OMEGA = 10000 * 2 * math.pi / 60
AREA = math.pi / 4 * 1.5e-3**2
DECELERATION = 2 * OMEGA**2 * AREA / (51 * 62e-3 * math.pi / 2)
VOLUME = (math.pi / 4 * (44.5e-3**2 - 20.5e-3**2) - 2 * 2.777e-3 * 24e-3) * 62e-3


def by_hand(t: np.ndarray, *, pressure: float) -> np.ndarray:
    u0 = math.sqrt(2 * pressure / (1000 * 51))
    return np.asarray(0.25 - AREA / VOLUME * (u0 * t - DECELERATION * t**2 / 2))


@pytest.mark.parametrize(
    ("integrator", "tolerance"),
    [(closed_form, 1e-14), (MARCH, 1e-10), (adaptive_ode(), 1e-8)],
)
def test_the_papers_operation_by_hand(drive: Drive, integrator: Integrator, tolerance: float) -> None:
    transfer = integrator(drive, TIMES)
    assert transfer.fill == pytest.approx(by_hand(TIMES, pressure=0.7e6), abs=tolerance)
    assert transfer.event is Event.NONE
    assert transfer.event_time is None
    assert (transfer.regime_start, transfer.regime_end) == (Regime.SIPHON, Regime.SIPHON)
    assert transfer.primed


@pytest.mark.parametrize("integrator", [closed_form, MARCH, adaptive_ode()])
def test_the_paper_stalls_where_the_head_is_used_up(drive: Drive, integrator: Integrator) -> None:
    low = replace(drive, gas_pressure=0.2e6)
    u0 = math.sqrt(2 * 0.2e6 / (1000 * 51))
    stall = u0 / DECELERATION
    x_stall = by_hand(np.array([stall]), pressure=0.2e6)[0]
    transfer = integrator(low, np.array([stall / 2, stall * 2]))
    assert transfer.event is Event.STALLED
    assert transfer.fill == pytest.approx(
        [by_hand(np.array([stall / 2]), pressure=0.2e6)[0], x_stall], abs=1e-9
    )
    assert transfer.event_time == pytest.approx(stall, rel=1e-4)
    assert transfer.regime_end is Regime.BLOCKED or integrator not in {closed_form}


@pytest.mark.parametrize("integrator", [closed_form, MARCH, adaptive_ode()])
def test_a_chamber_runs_empty_in_mid_operation(drive: Drive, integrator: Integrator) -> None:
    u0 = math.sqrt(2 * 0.7e6 / (1000 * 51))
    b, c = u0 / DECELERATION, 2 * 0.25 * VOLUME / AREA / DECELERATION
    empty = b - math.sqrt(b**2 - c)
    transfer = integrator(drive, np.array([empty * 0.5, empty * 1.5]))
    assert transfer.event is Event.EMPTY
    assert transfer.fill[-1] == 0.0
    assert transfer.event_time == pytest.approx(empty, rel=1e-3)
    assert not transfer.primed


def test_exact_and_adaptive_integrators_agree_on_the_time_of_emptying(drive: Drive) -> None:
    times = [i(drive, np.array([20.0])).event_time for i in (closed_form, MARCH, adaptive_ode())]
    assert times[0] is not None
    assert times[1] == pytest.approx(times[0], rel=1e-9)
    assert times[2] == pytest.approx(times[0], rel=1e-8)


@pytest.mark.parametrize("integrator", [MARCH, adaptive_ode()])
def test_a_constant_velocity(drive_by: DriveBy, integrator: Integrator) -> None:
    transfer = integrator(drive_by("constant"), np.array([0.5, 1.0, 4.0]))
    assert transfer.fill == pytest.approx([0.2, 0.15, 0.0], abs=1e-12)
    assert transfer.event is Event.EMPTY
    assert transfer.event_time == pytest.approx(2.5, abs=0.08)


@pytest.mark.parametrize("integrator", [MARCH, adaptive_ode()])
def test_velocity_like_the_root_of_the_distance_stalls_in_finite_time(
    drive_by: DriveBy, integrator: Integrator
) -> None:
    # d = x - 0.1: sqrt(d) falls linearly at 20 * 0.02 / 2 per second.
    t = np.array([0.3, 1.0, 1.9, 5.0])
    exact = 0.1 + np.maximum(math.sqrt(0.15) - 0.2 * t, 0.0) ** 2
    transfer = integrator(drive_by("square_root"), t)
    # The march takes such a law from a table, whose pieces are as long as the tolerance of its stall.
    near, late = (PIECE, 0.03) if integrator is MARCH else (1e-9, 2e-4)
    assert transfer.fill == pytest.approx(exact, abs=near)
    assert transfer.event is Event.STALLED
    assert transfer.event_time == pytest.approx(math.sqrt(0.15) / 0.2, rel=late)


@pytest.mark.parametrize("start", [0.25, 0.02])
def test_velocity_like_the_distance_approaches_from_either_side(drive_by: DriveBy, start: float) -> None:
    t = np.array([0.5, 3.0, 12.0])
    exact = 0.1 + (start - 0.1) * np.exp(-0.8 * t)
    transfer = MARCH(drive_by("proportional", fill=start), t)
    assert transfer.fill == pytest.approx(exact, abs=PIECE)
    assert transfer.fill[0] == pytest.approx(exact[0], abs=1e-9)


def test_an_endless_approach_is_called_a_stall_once_nothing_is_left(drive_by: DriveBy) -> None:
    transfer = MARCH(drive_by("proportional"), np.array([1e6]))
    assert transfer.event is Event.STALLED
    assert transfer.fill[-1] == pytest.approx(0.1, abs=PIECE)


def test_a_change_of_regime_is_met(drive_by: DriveBy) -> None:
    # 5 m/s to x = 0.2 at t = 0.5, then x = 0.2 exp(-0.5 (t - 0.5)).
    t = np.array([0.25, 0.5, 1.5, 6.0])
    exact = np.where(t <= 0.5, 0.25 - 0.1 * t, 0.2 * np.exp(-0.5 * (t - 0.5)))
    transfer = MARCH(drive_by("two_regimes"), t)
    assert transfer.fill == pytest.approx(exact, abs=1e-8)
    assert (transfer.regime_start, transfer.regime_end) == (Regime.SEPARATED, Regime.SIPHON)


def test_the_receiving_chamber_runs_full_before_the_driven_one_is_empty(drive_by: DriveBy) -> None:
    transfer = MARCH(drive_by("constant", fill=0.3, total=0.6), np.array([1.0, 9.0]))
    assert transfer.event is Event.FULL
    assert transfer.event_time == pytest.approx(2.0, rel=1e-8)
    assert transfer.fill == pytest.approx([0.2, 0.1], abs=1e-12)


def test_a_full_tube_levels_its_pair_with_the_gas_off(drive_by: DriveBy) -> None:
    t = np.array([0.5, 2.0])
    for start in (0.1, 0.4):
        transfer = MARCH(drive_by("levelling", fill=start, gas_pressure=0.0, primed=True), t)
        assert transfer.fill == pytest.approx(0.25 + (start - 0.25) * np.exp(-0.8 * t), abs=1e-9)
        assert transfer.primed


@pytest.mark.parametrize("integrator", [closed_form, MARCH, adaptive_ode()])
def test_nothing_moves_without_gas_or_liquid(drive: Drive, integrator: Integrator) -> None:
    for fill, pressure, event in ((0.4, 0.0, Event.BLOCKED), (0.0, drive.gas_pressure, Event.EMPTY)):
        transfer = integrator(replace(drive, fill=fill, gas_pressure=pressure), TIMES)
        assert transfer.event is event
        assert np.all(transfer.fill == fill)
        assert not transfer.primed
