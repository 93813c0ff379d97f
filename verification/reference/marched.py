"""The program's own march on one operation under a flow law alone, as an integrator beside the references."""

from __future__ import annotations

from ringbalance.reduced_model.injection.dynamics import Column, Dynamics, Event
from ringbalance.reduced_model.injection.pair import Motion, PairState, opened, pass_time
from ringbalance.scene.arrays import FloatArray
from ringbalance.scene.models import Tube
from ringbalance.verification.reference.transfers import Drive, Integrator, Transfer, checked_instants


def marched(tube: Tube) -> Integrator:
    """The march that every run takes, without a term beyond the flow law; its error is that of one run."""

    def integrate(drive: Drive, instants: FloatArray) -> Transfer:
        t = checked_instants(instants)
        dynamics = Dynamics(
            column=Column.of(law=drive.law, tube=tube),
            inertia=False,
            line=None,
            valve_lag=0.0,
            gas_pressure=drive.gas_pressure,
            ambient_pressure=1e5,
            dead_volume=0.0,
            tube_area=drive.exchange_rate,
            chamber_volume=1.0,
            max_fill_ratio=drive.law.max_fill_ratio,
        )
        valve = opened(dynamics, chamber=0, duration=2 * float(t[-1]) + 1)
        pair = PairState(
            fill=drive.fill,
            total=drive.total,
            primed=drive.primed,
            motion=Motion(pending=valve if drive.gas_pressure > 0 else ()),
        )
        path = pass_time(dynamics, pair, instants=t)
        record = path.motion.record
        return Transfer(
            instants=t,
            fill=path.fills,
            regime_start=record.regime_start,
            regime_end=record.regime_end,
            event=record.event,
            event_time=path.ended if record.event is not Event.NONE else None,
            primed=path.primed,
        )

    return integrate
