"""The target-vector algorithm on a member's record, by the law that `TargetVector` follows."""

from __future__ import annotations

import math
from typing import Final

from ringbalance.controller.compilation.compiled import compiled
from ringbalance.controller.ensemble.compiled_records import Record
from ringbalance.controller.formulas.control_law import valve_time, vector_gas_time, vector_shares

_vector_gas_time: Final = compiled(vector_gas_time)
_vector_shares: Final = compiled(vector_shares)
_valve_time: Final = compiled(valve_time)


@compiled
def forget(run: Record) -> None:
    """As before the first sample, and at or below the limit: no memory, no valve. Args: `run`: changed."""
    run.integral, run.before_time, run.pair, run.other_pair = 0.0, math.inf, -1, -1


@compiled
def decide(shared: Record, run: Record) -> None:
    """One step of the algorithm on what the sensor shows.

    Args: `shared`: of type `SHARED`. `run`: the member; its memory and its valves are changed.
    Source: as `TargetVector`.
    """
    if run.seen_amplitude <= shared.limit:
        forget(run)
        return
    wanted, run.integral = _vector_gas_time(
        run.seen_amplitude,
        run.seen_phase,
        run.time,
        run.integral,
        run.before_amplitude,
        run.before_phase,
        run.before_time,
        run.proportional,
        shared.integral_time,
        shared.derivative_time,
        shared.maximum_gas_time,
        True,
    )
    run.before_amplitude, run.before_phase, run.before_time = run.seen_amplitude, run.seen_phase, run.time
    length = min(max(wanted, 0.0), shared.maximum_gas_time)
    first, share, second, other = _vector_shares(shared.chambers, run.seen_phase + shared.assumed_lag, length)
    run.pair, run.other_pair = -1, -1
    _open(shared, run, first, share)
    _open(shared, run, second, other)


@compiled
def _open(shared: Record, run: Record, chamber: int, share: float) -> None:
    """Open the next valve, unless its share is below the minimum."""
    time = _valve_time(share, shared.minimum_gas_time, shared.maximum_gas_time)
    if time == 0.0:
        return
    half, duration = shared.chambers // 2, min(time, shared.time_limit - run.time)
    if run.pair < 0:
        run.pair, run.first, run.duration = chamber % half, int(chamber < half), duration
    else:
        run.other_pair, run.other_first, run.other_duration = chamber % half, int(chamber < half), duration
