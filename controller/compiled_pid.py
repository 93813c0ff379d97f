"""The target-vector algorithm in plain numbers, step for step the one of `TargetVector`."""

from __future__ import annotations

import math

from ringbalance.controller.compiled import compiled
from ringbalance.controller.compiled_records import Record


@compiled
def forget(run: Record) -> None:
    """As before the first sample, and at or below the limit: no memory, no valve.

    Args:
        run: changed.
    """
    run.integral, run.before_time, run.pair, run.other_pair = 0.0, math.inf, -1, -1


@compiled
def decide(shared: Record, run: Record) -> None:
    """One step of the algorithm on what the sensor shows.

    Args:
        shared: of type `SHARED`.
        run: the member; its memory and its valves are changed.

    Source: as `TargetVector`.
    """
    if run.seen_amplitude <= shared.limit:
        forget(run)
        return
    wanted = _gas_time(shared, run)
    run.before_amplitude, run.before_phase, run.before_time = run.seen_amplitude, run.seen_phase, run.time
    _split(shared, run, min(max(wanted, 0.0), shared.maximum_gas_time))


@compiled
def _gas_time(shared: Record, run: Record) -> float:
    """Unlimited, of the correction vector, s; the integral is changed."""
    amplitude, dt = run.seen_amplitude, run.time - run.before_time
    if not dt > 0.0:
        return float(run.proportional * amplitude)
    turned = math.cos(run.seen_phase - run.before_phase) < 0.0
    integral = 0.0 if turned else run.integral + (amplitude + run.before_amplitude) / 2.0 * dt
    slope = shared.derivative_time * (amplitude - run.before_amplitude) / dt
    wanted = run.proportional * (amplitude + integral / shared.integral_time + slope)
    if turned or wanted <= shared.maximum_gas_time:
        run.integral = integral
    return float(wanted)


@compiled
def _split(shared: Record, run: Record, length: float) -> None:
    """Over the chambers on either side of the unbalance, as `target_vector.components`."""
    angle, n = run.seen_phase + shared.assumed_lag, shared.chambers
    run.pair, run.other_pair = -1, -1
    if n == 2:
        along = length * math.cos(angle)
        _open(shared, run, 0 if along >= 0.0 else 1, abs(along))
        return
    spacing = 2.0 * math.pi / n
    turn = angle % (2.0 * math.pi)
    before = min(int(turn / spacing), n - 1)
    past, scale = turn - before * spacing, length / math.sin(spacing)
    _open(shared, run, before, scale * max(math.sin(spacing - past), 0.0))
    _open(shared, run, (before + 1) % n, scale * max(math.sin(past), 0.0))


@compiled
def _open(shared: Record, run: Record, chamber: int, share: float) -> None:
    """Open the next valve, unless its share is below the minimum."""
    if not (share > 0.0 and share >= shared.minimum_gas_time):
        return
    half = shared.chambers // 2
    duration = min(share, shared.maximum_gas_time, shared.time_limit - run.time)
    if run.pair < 0:
        run.pair, run.first, run.duration = chamber % half, int(chamber < half), duration
    else:
        run.other_pair, run.other_first, run.other_duration = chamber % half, int(chamber < half), duration
