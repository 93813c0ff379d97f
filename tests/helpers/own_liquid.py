"""One pair of chambers of a liquid ring in time: gas line, front, siphon crest, column; for tests.

Implicit Euler steps of fixed length. The state of a pair is the fill of its first chamber, the gas pressures
of both, gauge, the velocity out of the first, the place of the front, and whether the tube is parted (0), is
being filled from a chamber or spills (1), or runs without gas over its crest (2).
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any, Final, TypeVar, cast

import numba
from own_draws import FILLS, SPEEDS, Floats

X, P, U, S, MODE, FROM, LIFTED, STATES = 0, 1, 3, 4, 5, 6, 7, 8
_FINE, _COARSE, _CALM = 20e-6, 400e-6, 20e-3
"""s; the coarse step is taken where velocities have been steady for the last of these."""
_SLOW, _FAST = 0.6, 1.1
"""Froude numbers between which a flow carries the gas over the crest away."""
_TOP: Final = math.sqrt(float(SPEEDS[-1]))
_GAS_OFF: Final = 100.0
"""Pa."""
_STRAIGHT: Final = 0.999
"""Ratio of pressures from which the flow of gas is laminar."""
Function = TypeVar("Function", bound=Callable[..., Any])


def compiled(function: Function) -> Function:
    """To machine code, kept beside this file."""
    return cast("Function", numba.njit(cache=True, error_model="numpy")(function))


@compiled
def at(table: Floats, place: float) -> float:
    i = min(max(int(place), 0), table.size - 2)
    return float(table[i] + (place - i) * (table[i + 1] - table[i]))


@compiled
def _rate(table: Floats, u: float) -> float:
    """Head over velocity, m/s."""
    return float(at(table, math.sqrt(abs(u)) / _TOP * (table.size - 1)))


@compiled
def _passes(d: Any, p: float, q: float) -> float:
    """Mass flow from absolute p to q by ISO 6358, kg/s, through a conductance of one."""
    if p < q:
        return float(-_passes(d, q, p))
    ratio, b = q / p, d.critical
    if ratio <= b:
        shape = 1.0
    elif ratio < _STRAIGHT:
        shape = math.sqrt(1 - ((ratio - b) / (1 - b)) ** 2)
    else:
        shape = math.sqrt(1 - ((_STRAIGHT - b) / (1 - b)) ** 2) * (1 - ratio) / (1 - _STRAIGHT)
    return float(1.185 * p * shape)


@compiled
def _gas(d: Any, y: Floats, opened: int, dt: float) -> None:
    """Pressures of both chambers; the opened one is fed, others are vented."""
    for c in range(2):
        supply = d.pressure if c == opened else 0.0
        if d.passing <= 0.0:
            y[P + c] = supply
            continue
        fill = y[X] if c == 0 else d.total - y[X]
        room = d.volume * (1 - fill) + d.dead_volume
        grows = y[U] * d.area if c == 0 else -y[U] * d.area
        now = y[P + c] + d.ambient
        fed = d.passing * _passes(d, supply + d.ambient, now) - d.leak * _passes(d, now, d.ambient)
        if c != opened:
            fed += d.leak_in * _passes(d, d.pressure + d.ambient, now)
        y[P + c] += dt * (d.gas * fed - now * grows) / room


@compiled
def _start(d: Any, y: Floats, squares: tuple[float, float]) -> None:
    """A parted tube is filled from the chamber that pushes harder."""
    near, far = squares
    push = y[P] - y[P + 1] + d.density * d.half_square * (far - near)
    giver = 0 if push > 0 else 1
    level = near if giver == 0 else far
    if abs(y[P] - y[P + 1]) < _GAS_OFF and level > d.crest**2:
        return
    inside = math.sqrt(max(level - d.crest**2, 0.0) / max(d.port**2 - d.crest**2, 1e-12))
    begin = d.crest_start if giver == 0 else 1 - d.crest_end
    y[S], y[U], y[MODE], y[FROM], y[LIFTED] = begin * (1 - min(inside, 1.0)), 0.0, 1, giver, 0.0


@compiled
def _spill(table: Floats, head: float) -> float:
    """Steady velocity over the crest under a head, m/s."""
    low, high = 0.0, 80.0
    for _ in range(24):
        u = (low + high) / 2
        low, high = (low, u) if _rate(table, u) * u > head else (u, high)
    return (low + high) / 2


@compiled
def _front(d: Any, y: Floats, squares: tuple[float, float], tables: Any, dt: float) -> float:
    """A front on its way to the crest, or liquid that spills over it. Returns: dx."""
    giver = int(y[FROM])
    sign = 1.0 if giver == 0 else -1.0
    begin = d.crest_start if giver == 0 else 1 - d.crest_end
    end = d.crest_end if giver == 0 else 1 - d.crest_start
    level, gas, other = squares[giver], y[P + giver], y[P + 1 - giver]
    s, u = y[S], sign * y[U]
    out = 1 - s / begin if s < begin else 0.0
    here = d.crest**2 + (d.port**2 - d.crest**2) * out * out
    clear = 0.0
    lifts = (gas - other) / d.density + d.half_square * (d.crest**2 - level)
    if lifts > 0.0:
        y[LIFTED] = 1.0
    if s >= end:
        part = min(max((_spill(tables[1 + giver], lifts) / d.froude - _SLOW) / (_FAST - _SLOW), 0.0), 1.0)
        clear = part * part * (3 - 2 * part)
    over = other + clear * (min(d.cavity + other, other) - other)
    force = (gas - over) / d.density + d.half_square * (here - level)
    column = max(min(s, end), 0.02) * d.length
    entered = d.entry * abs(u) / 2
    loss = entered + max(_rate(tables[1 + giver], u) - entered, 0.0) * min(s / end, 1.0)
    u = (u + dt * force / column) / (1 + dt * loss / column)
    if s >= end and clear > 0.5:
        head = (gas - other) / d.density + d.half_square * (squares[1 - giver] - level)
        full = (sign * y[U] + dt * head / d.length) / (1 + dt * _rate(tables[0], u) / d.length)
        if full < u or clear >= 1.0:
            u, y[MODE] = min(u, full), 2
    if s + u * dt / d.length > begin and y[LIFTED] == 0.0:
        # What the gas would not hold at the crest does not begin to pass it.
        u = min((begin - s) / dt * d.length, 0.0)
        y[S] = min(s, begin)
    if s < end:
        y[S] += u * dt / d.length
    middle = (begin + end) / 2
    if u < 0 and (s > middle or y[S] <= 0.0 or force > 0.0):
        # The column parts on the crest, or has fallen back to its level.
        u, y[MODE] = 0.0, 0
    y[U] = sign * u
    return -sign * max(u, 0.0) * dt * d.area / d.volume if s > middle else 0.0


@compiled
def _column(d: Any, y: Floats, squares: tuple[float, float], tables: Any, dt: float) -> float:
    """A tube without gas over its crest, full or separated there. Returns: dx."""
    u = y[U]
    head = (y[P] - y[P + 1]) / d.density + d.half_square * (squares[1] - squares[0])
    full = (u + dt * head / d.length) / (1 + dt * _rate(tables[0], u) / d.length)
    giver = 0 if (u > 0 or (u == 0 and head > 0)) else 1
    sign = 1.0 if giver == 0 else -1.0
    end = d.crest_end if giver == 0 else 1 - d.crest_start
    over = d.cavity
    force = (y[P + giver] - over) / d.density + d.half_square * (d.crest**2 - squares[giver])
    lost = _rate(tables[1 + giver], u) / (end * d.length)
    broken = (sign * u + dt * force / (end * d.length)) / (1 + dt * lost)
    after = min(sign * full, broken) if d.crest < d.port else sign * full
    if after <= 0.0:
        # It has come to rest: it turns round where the other chamber holds it over the crest, or parts.
        back = (y[P + 1 - giver] - over) / d.density + d.half_square * (d.crest**2 - squares[1 - giver])
        holds = d.crest >= d.port or (back > 0 and force > 0)
        y[U] = sign * after if holds and full * sign < 0 else 0.0
        y[MODE] = 2.0 if holds else 0.0
    else:
        y[U] = sign * after
    return float(-y[U] * dt * d.area / d.volume)


@compiled
def _step(d: Any, y: Floats, tables: Any, squares: tuple[float, float], dt: float) -> float:
    """Returns: dx."""
    if y[MODE] == 0:
        _start(d, y, squares)
    if y[MODE] == 1:
        return float(_front(d, y, squares, tables, dt))
    return float(_column(d, y, squares, tables, dt)) if y[MODE] == 2 else 0.0


@compiled
def _length(time: float, first: float, last: float, span: float, calm: bool) -> float:
    """Of the next step, s: fine after a valve has moved, and none beyond where one does."""
    moved = time < first + _CALM or last <= time < last + _CALM
    dt = _COARSE if calm and not (moved and last > first) else _FINE
    for event in (first, last, span):
        if time < event:
            dt = min(dt, event - time)
    return max(dt, 1e-9)


@compiled
def _quiet(d: Any, y: Floats, squares: tuple[float, float]) -> bool:
    """Whether nothing moves or will, with the valves closed."""
    vented = d.passing <= 0.0 or (abs(y[P]) < _GAS_OFF / 2 and abs(y[P + 1]) < _GAS_OFF / 2)
    return bool(y[MODE] == 0 and vented and min(squares[0], squares[1]) > d.crest**2)


@compiled
def _drawn_gas(d: Any, y: Floats, change: float, side: int) -> bool:
    """Whether gas enters the port of the chamber that gives liquid, which stops the flow."""
    kept = d.residual if (change < 0) == (side == 0) else 0.0
    if change == 0.0 or (y[X] if change < 0 else d.total - y[X]) > kept:
        return False
    y[X] = kept if change < 0 else d.total - kept
    y[U], y[MODE] = 0.0, 0
    return True


@compiled
def carry(d: Any, y: Floats, tables: Any, side: int, opens: float, span: float) -> None:
    """A pair from a command, gas into chamber `side` for a time (0: none), to the next sample after `span`.

    Args: `tables`: of `Drawn`: loss, upstream, downstream, square.
    """
    time, calm, spare = 0.0, 0.0, FILLS - 1
    first, last = (d.lag_of_valve, d.lag_of_valve + opens) if opens > 0 else (0.0, 0.0)
    while time < span - 1e-12:
        opened = first <= time < last
        dt = _length(time, first, last, span, calm > _CALM)
        _gas(d, y, side if opened else -1, dt)
        place = y[X] / d.total * spare
        squares = (at(tables[3], place), at(tables[3], spare - place))
        before = y[U]
        change = _step(d, y, tables, squares, dt)
        y[X] += change
        time += dt
        steady = abs(y[U] - before) <= 1e-3 * (abs(before) + 0.1) * dt / _FINE
        calm = calm + dt if steady else 0.0
        if _drawn_gas(d, y, change, side if opens > 0 else -1):
            last = min(last, max(time, first))
        if opened and d.passing <= 0.0 and y[U] == before == 0.0 and time > first + _CALM:
            # Gas that moves nothing: the rest of its time changes nothing.
            time = max(time, last)
        if time >= last and y[U] == 0.0 and _quiet(d, y, squares):
            break
