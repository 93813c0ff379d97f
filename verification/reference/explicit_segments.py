"""Eq. 20's explicit segments: the paper's own way through an operation, kept for comparison."""

from __future__ import annotations

import numpy as np

from ringbalance.controller.liquid_ring.transfer import Drive, Event, Integrator, Transfer, checked_instants
from ringbalance.reduced_model.law.flow_law import Regime
from ringbalance.reduced_model.law.paper_law import PaperLaw
from ringbalance.scene.arrays import FloatArray


def paper_drive(law: PaperLaw, *, gas_pressure: float, fill: float, total: float) -> Drive:
    """One chamber that gives liquid away from a fill ratio, by the paper's law, its tube empty."""
    return Drive(
        law=law,
        fill=fill,
        total=total,
        exchange_rate=law.tube_area / law.chamber_volume,
        gas_pressure=gas_pressure,
        primed=False,
    )


def explicit_segments(segments: int) -> Integrator:
    """An integrator with n equal explicit segments, x_i = x_(i-1) - u_(i-1) S dt/V; first order in dt.

    Near a stall, where u goes like the square root of the distance, a segment may step over it; the law then
    answers with zero and the fill stays where it landed. Between segments fills lie on the straight line.
    Raises: ValueError: fewer than one segment.
    Source: Eq. 20 of the liquid-ring paper.
    """
    if segments < 1:
        raise ValueError(f"segments must be at least 1, not {segments}")

    def integrate(drive: Drive, instants: FloatArray) -> Transfer:
        return _march(drive, checked_instants(instants), segments)

    return integrate


def _march(drive: Drive, t: FloatArray, segments: int) -> Transfer:
    before = drive.flow(drive.fill, primed=drive.primed)
    velocity, regime = float(before.velocity), Regime(int(before.regime))
    if velocity == 0:
        return drive.still(t, flow=before)
    edges = np.linspace(0.0, t[-1], segments + 1)
    x = np.full(segments + 1, drive.fill)
    event, event_time = Event.NONE, None
    for i, step in enumerate(np.diff(edges)):
        x[i + 1 :] = min(max(x[i] - velocity * drive.exchange_rate * step, drive.lowest), drive.highest)
        event = _event(drive, float(x[i + 1]), velocity)
        velocity = float(drive.flow(x[i + 1]).velocity) if event is Event.NONE else velocity
        event = Event.STALLED if velocity == 0 else event
        if event is not Event.NONE:
            event_time = float(edges[i + 1])
            break
    return drive.finished(t, np.interp(t, edges, x), regime_start=regime, event=event, event_time=event_time)


def _event(drive: Drive, fill: float, velocity: float) -> Event:
    end = drive.lowest if velocity > 0 else drive.highest
    return drive.boundary_event(end) if fill == end else Event.NONE
