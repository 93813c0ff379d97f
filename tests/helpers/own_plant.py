"""A liquid-ring balancer in closed loop, written again: liquid with mass, gas line, siphon crest, target vector.

Columns of liquid and gas are stepped through time by one implicit Euler scheme of fixed steps. Of each
pair the state is: fill of its first chamber, gas pressures of both, velocity out of the first, place of the
front, and whether the tube is parted (0), is being filled from a chamber or spills (1), or runs without gas
over its crest (2).
"""

from __future__ import annotations

import math
from typing import Any, Final, NamedTuple, cast

import numba
import numpy as np
import numpy.typing as npt

from ringbalance.scene.models import Scene
from tests.helpers.own_draws import FILLS, SPEEDS, Drawn, Floats, drawn

FURTHER: Final = 60.0
"""s, after the hold time, of whose samples 99 % are within the limit."""
ALLOWED: Final = 0.01
_FINE, _COARSE = 20e-6, 400e-6
"""s; the coarse step is taken where nothing has been moving fast for `_CALM`."""
_CALM: Final = 0.02
_NEAR: Final = 1e-3
_SLOW, _FAST = 0.6, 1.1
"""Froude numbers between which a flow carries the gas over the crest away."""
_TOP: Final = math.sqrt(float(SPEEDS[-1]))
_X, _P, _U, _S, _MODE, _FROM, _LIFTED = 0, 1, 3, 4, 5, 6, 7


class Settings(NamedTuple):
    """A target-vector controller; SI."""

    proportional: float
    integral_time: float
    derivative_time: float
    limit: float
    hold_time: float
    period: float
    shortest: float
    longest: float
    offset: float
    lag: float
    amplitude_noise: float
    phase_noise: float
    time_limit: float


def settings_of(scene: Scene, *, offset: float = 0.0, proportional: float | None = None) -> Settings:
    """Of a scene; one offset for all chambers, s."""
    c = scene.controller
    return Settings(
        proportional=proportional or c.proportional,
        integral_time=c.integral_time or math.inf,
        derivative_time=c.derivative_time,
        limit=c.limit,
        hold_time=c.hold_time or 10 * c.period,
        period=c.period,
        shortest=c.minimum_gas_time,
        longest=c.maximum_gas_time,
        offset=offset,
        lag=scene.rotor.lag_angle,
        amplitude_noise=scene.sensor.amplitude_noise,
        phase_noise=scene.sensor.phase_noise,
        time_limit=scene.run.time_limit,
    )


_compiled: Any = numba.njit(cache=True, error_model="numpy")


@_compiled
def _at(table: Floats, place: float) -> float:
    i = min(max(int(place), 0), table.size - 2)
    return float(table[i] + (place - i) * (table[i + 1] - table[i]))


@_compiled
def _rate(table: Floats, u: float) -> float:
    """Head over velocity, m/s."""
    return float(_at(table, math.sqrt(abs(u)) / _TOP * (table.size - 1)))


@_compiled
def _radius_square(d: Any, s: float) -> float:
    """Of the path at a share of it, from the giving chamber."""
    out = 0.0
    if s < d.crest_start:
        out = 1 - s / d.crest_start
    elif s > d.crest_end:
        out = (s - d.crest_end) / (1 - d.crest_end)
    return float(d.crest**2 + (d.port**2 - d.crest**2) * out * out)


@_compiled
def _passes(d: Any, p: float, q: float) -> float:
    """Mass flow from absolute p to q by ISO 6358, kg/s."""
    if p < q:
        return float(-_passes(d, q, p))
    ratio, b = q / p, d.critical
    if ratio <= b:
        shape = 1.0
    elif ratio < _STRAIGHT:
        shape = math.sqrt(1 - ((ratio - b) / (1 - b)) ** 2)
    else:
        shape = math.sqrt(1 - ((_STRAIGHT - b) / (1 - b)) ** 2) * (1 - ratio) / (1 - _STRAIGHT)
    return float(d.passing * 1.185 * p * shape)


_STRAIGHT: Final = 0.999


@_compiled
def _gas(d: Any, y: Floats, opened: int, dt: float) -> None:
    """Pressures of both chambers; the opened one is fed, others are vented."""
    for c in range(2):
        supply = d.pressure if c == opened else 0.0
        if d.passing <= 0.0:
            y[_P + c] = supply
            continue
        fill = y[_X] if c == 0 else d.total - y[_X]
        room = d.volume * (1 - fill) + d.dead_volume
        grows = y[_U] * d.area if c == 0 else -y[_U] * d.area
        now = y[_P + c] + d.ambient
        fed = d.gas * _passes(d, supply + d.ambient, now)
        y[_P + c] += dt * (fed - now * grows) / room


@_compiled
def _start(d: Any, y: Floats, squares: Floats) -> None:
    """A parted tube is filled from the chamber that pushes harder."""
    near, far = squares
    push = y[_P] - y[_P + 1] + d.density * d.half_square * (far - near)
    giver = 0 if push > 0 else 1
    level = near if giver == 0 else far
    if abs(y[_P] - y[_P + 1]) < _GAS_OFF and level > d.crest**2:
        return
    inside = math.sqrt(max(level - d.crest**2, 0.0) / max(d.port**2 - d.crest**2, 1e-12))
    begin = d.crest_start if giver == 0 else 1 - d.crest_end
    y[_S], y[_U], y[_MODE], y[_FROM], y[_LIFTED] = begin * (1 - min(inside, 1.0)), 0.0, 1, giver, 0.0


_GAS_OFF: Final = 100.0
"""Pa."""


@_compiled
def _spill(table: Floats, head: float) -> float:
    """Steady velocity over the crest under a head, m/s."""
    low, high = 0.0, 80.0
    for _ in range(24):
        u = (low + high) / 2
        low, high = (low, u) if _rate(table, u) * u > head else (u, high)
    return (low + high) / 2


@_compiled
def _front(d: Any, y: Floats, squares: Floats, tables: Any, dt: float) -> float:
    """A front on its way to the crest, or liquid that spills over it. Returns: dx."""
    giver = int(y[_FROM])
    sign = 1.0 if giver == 0 else -1.0
    begin = d.crest_start if giver == 0 else 1 - d.crest_end
    end = d.crest_end if giver == 0 else 1 - d.crest_start
    level, gas, other = squares[giver], y[_P + giver], y[_P + 1 - giver]
    s, u = y[_S], sign * y[_U]
    out = 1 - s / begin if s < begin else 0.0
    here = d.crest**2 + (d.port**2 - d.crest**2) * out * out
    clear = 0.0
    lifts = (gas - other) / d.density + d.half_square * (d.crest**2 - level)
    if lifts > 0.0 or d.surges > 0.0:
        y[_LIFTED] = 1.0
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
        full = (sign * y[_U] + dt * head / d.length) / (1 + dt * _rate(tables[0], u) / d.length)
        if full < u or clear >= 1.0:
            u, y[_MODE] = min(u, full), 2
    if s + u * dt / d.length > begin and y[_LIFTED] == 0.0:
        # What the gas would not hold at the crest does not begin to pass it.
        u = min((begin - s) / dt * d.length, 0.0)
        y[_S] = min(s, begin)
    if s < end:
        y[_S] += u * dt / d.length
    middle = (begin + end) / 2
    if u < 0 and (s > middle or y[_S] <= 0.0 or y[_S] < s and s < _GONE):
        # The column parts on the crest, or has fallen back.
        u, y[_MODE] = 0.0, 0
    y[_U] = sign * u
    return -sign * max(u, 0.0) * dt * d.area / d.volume if s > middle else 0.0


_GONE: Final = 1e-9


@_compiled
def _column(d: Any, y: Floats, squares: Floats, tables: Any, dt: float) -> float:
    """A tube without gas over its crest, full or separated there. Returns: dx."""
    u = y[_U]
    head = (y[_P] - y[_P + 1]) / d.density + d.half_square * (squares[1] - squares[0])
    full = (u + dt * head / d.length) / (1 + dt * _rate(tables[0], u) / d.length)
    giver = 0 if (u > 0 or (u == 0 and head > 0)) else 1
    sign = 1.0 if giver == 0 else -1.0
    end = d.crest_end if giver == 0 else 1 - d.crest_start
    over = d.cavity
    force = (y[_P + giver] - over) / d.density + d.half_square * (d.crest**2 - squares[giver])
    lost = _rate(tables[1 + giver], u) / (end * d.length)
    broken = (sign * u + dt * force / (end * d.length)) / (1 + dt * lost)
    after = min(sign * full, broken) if d.crest < d.port else sign * full
    if after <= 0.0:
        # It has come to rest: it turns round where the other chamber holds it over the crest, or parts.
        back = (y[_P + 1 - giver] - over) / d.density + d.half_square * (d.crest**2 - squares[1 - giver])
        holds = d.crest >= d.port or (back > 0 and force > 0)
        y[_U] = sign * after if holds and full * sign < 0 else 0.0
        y[_MODE] = 2.0 if holds else 0.0
    else:
        y[_U] = sign * after
    return -y[_U] * dt * d.area / d.volume


@_compiled
def _pass(d: Any, y: Floats, tables: Any, side: int, opens: float, span: float) -> None:
    """One pair from a command, gas into chamber `side` for a time, to the next sample after `span`."""
    time, calm = 0.0, 0.0
    first, last = d.lag_of_valve, d.lag_of_valve + opens
    line = d.passing > 0.0
    while time < span - 1e-12:
        opened = side if opens > 0 and first <= time < last else -1
        rests = y[_MODE] == 0 and abs(y[_U]) == 0.0
        dt = _COARSE if calm > _CALM else _FINE
        if time < first:
            dt = min(dt, first - time)
        elif time < last:
            dt = min(dt, last - time)
        if (time < first + _CALM or last <= time < last + _CALM) and opens > 0:
            dt = min(dt, _FINE)
        dt = max(min(dt, span - time), 1e-9)
        _gas(d, y, opened, dt)
        spare = FILLS - 1
        squares = (_at(tables[3], y[_X] / d.total * spare), _at(tables[3], (1 - y[_X] / d.total) * spare))
        if rests:
            _start(d, y, squares)
        before, change = y[_U], 0.0
        if y[_MODE] == 1:
            change = _front(d, y, squares, tables, dt)
        elif y[_MODE] == 2:
            change = _column(d, y, squares, tables, dt)
        y[_X] += change
        time += dt
        calm = calm + dt if abs(y[_U] - before) <= 1e-3 * (abs(before) + 0.1) * dt / _FINE else 0.0
        if change != 0.0:
            kept = d.residual if opens > 0 and (change < 0) == (side == 0) else 0.0
            driven = y[_X] if change < 0 else d.total - y[_X]
            if driven <= kept:
                # Gas enters the port, and the injection is over.
                y[_X] = kept if change < 0 else d.total - kept
                y[_U], y[_MODE] = 0.0, 0
                if not line:
                    last = min(last, time)
                else:
                    last = min(last, max(time, first))
                if time < last + 1e-12 and not line:
                    opened = -1
        quiet = y[_MODE] == 0 and y[_U] == 0.0 and (time >= last or not opens > 0)
        if quiet and (not line or (abs(y[_P]) < 50.0 and abs(y[_P + 1]) < 50.0)):
            if squares[0] > d.crest**2 and squares[1] > d.crest**2:
                break


@_compiled
def _vibration(d: Any, pairs: Floats, moment: Floats) -> complex:
    total = 0j
    half = pairs.shape[0]
    for i in range(half):
        x = pairs[i, _X] / d.total * (moment.size - 1)
        pair = _at(moment, x) - _at(moment, moment.size - 1 - x)
        angle = math.pi * i / half
        total += pair * complex(math.cos(angle), math.sin(angle))
    return complex(d.start_real, d.start_imaginary) + complex(d.gain_real, d.gain_imaginary) * total


@_compiled
def _split(d: Any, length: float, angle: float, empty: Any, asked: Floats) -> None:
    """A vector of valve-open time by the two chambers on either side, passing over those that are empty."""
    n = int(d.chambers)
    step = 2 * math.pi / n
    turn = angle % (2 * math.pi)
    low = min(int(turn / step), n - 1)
    a, b = low, low + 1
    while empty[a % n] and b - a < n:
        a -= 1
    while empty[b % n] and b - a < n:
        b += 1
    if 2 * (b - a) >= n:
        a, b = low, low + 1
    asked[:] = 0.0
    asked[a % n] = max(length * math.sin(b * step - turn) / math.sin((b - a) * step), 0.0)
    asked[b % n] = max(length * math.sin(turn - a * step) / math.sin((b - a) * step), 0.0)


@_compiled
def _loop(d: Any, tables: Any, moment: Floats, c: Any, noise: Floats, trace: Floats) -> tuple[float, float]:
    """The closed loop, with the amplitude of every sample. Returns: settling time (inf: none), end."""
    n = int(d.chambers)
    half = n // 2
    pairs = np.zeros((half, 8))
    pairs[:, _X] = d.total / 2
    asked, empty = np.zeros(n), np.zeros(n, np.bool_)
    time, integral, before, earlier, phase = 0.0, 0.0, 0.0, math.inf, 0.0
    since, judged, above = math.inf, math.inf, 0
    ends = c.time_limit + c.hold_time + FURTHER
    amplitude = 0.0
    for k in range(noise.shape[0]):
        z = _vibration(d, pairs, moment)
        amplitude = abs(z)
        trace[k, 0], trace[k, 1] = time, amplitude
        # Settled: a hold, then a further stretch with few samples above the limit.
        if judged < math.inf:
            above += amplitude > c.limit
            if above > ALLOWED * FURTHER / c.period:
                since, judged = math.inf, math.inf
            elif time - judged >= FURTHER - 1e-9:
                return since, amplitude
        if judged == math.inf:
            since = min(since, time) if amplitude <= c.limit else math.inf
            if time - since >= c.hold_time - 1e-9:
                judged, above = time, 0
            if since == math.inf and time > c.time_limit:
                break
        if time > ends:
            break
        seen = abs(amplitude + c.amplitude_noise * noise[k, 0])
        angle = math.atan2(z.imag, z.real) + c.phase_noise * noise[k, 1]
        asked[:] = 0.0
        if seen <= c.limit:
            integral, earlier = 0.0, math.inf
        else:
            wanted = c.proportional * seen
            if earlier < math.inf:
                dt = time - earlier
                turned = math.cos(angle - phase) < 0.0
                summed = 0.0 if turned else integral + (seen + before) / 2 * dt
                slope = c.derivative_time * (seen - before) / dt
                wanted = c.proportional * (seen + summed / c.integral_time + slope)
                integral = summed if turned or wanted <= c.longest else integral
            before, earlier, phase = seen, time, angle
            _split(d, min(max(wanted, 0.0), c.longest), angle + c.lag, empty, asked)
        longest = 0.0
        for i in range(n):
            good = asked[i] >= c.shortest and asked[i] > 0.0
            asked[i] = min(asked[i] + c.offset, c.longest) if good else 0.0
            longest = max(longest, asked[i])
        for i in range(half):
            side = 1 if asked[i + half] > 0 else 0
            _pass(d, pairs[i], tables, side, asked[i] + asked[i + half], longest + c.period)
            for far in range(2):
                fill = d.total - pairs[i, _X] if far else pairs[i, _X]
                empty[i + far * half] = fill <= d.residual * (1 + _NEAR)
        time += longest + c.period
    return math.inf, amplitude


class Run(NamedTuple):
    """What became of one drawn machine."""

    settling_time: float
    amplitude: float
    trace: Floats

    @property
    def settled(self) -> bool:
        return self.settling_time < math.inf


def run(machine: Drawn, settings: Settings, *, noise_seed: int) -> Run:
    """One closed loop."""
    tables = (machine.loss, machine.upstream, machine.downstream, machine.square)
    samples = 2 + int((settings.time_limit + settings.hold_time + FURTHER) / settings.period)
    noise = np.random.default_rng([noise_seed, 7]).standard_normal((samples, 2))
    trace = np.full((samples, 2), np.nan)
    time, end = cast(
        tuple[float, float], _loop(machine.device, tables, machine.moment, settings, noise, trace)
    )
    return Run(time, end, trace)


def settled(scene: Scene, settings: Settings, *, numbers: int, seed: int) -> npt.NDArray[np.float64]:
    """Settling times of drawn machines, s, infinite where they do not settle."""
    machines = (drawn(scene, number=i, seed=seed) for i in range(numbers))
    return np.array([run(m, settings, noise_seed=seed + 1000 + i).settling_time for i, m in enumerate(machines)])
