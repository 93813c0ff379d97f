"""A liquid-ring balancer in closed loop under the target-vector algorithm, written again for tests."""

from __future__ import annotations

import math
from typing import Any, Final, NamedTuple

import numpy as np
from own_draws import Drawn, Floats, drawn
from own_liquid import STATES, X, at, carry, compiled

from ringbalance.scene.models import Scene

FURTHER: Final = 60.0
"""s, after the hold time, of whose samples 99 % are within the limit."""
ALLOWED: Final = 0.01
_NEAR: Final = 1e-3
"""Of a fill."""
_INTEGRAL, _BEFORE, _TIME, _PHASE = 0, 1, 2, 3
_SINCE, _JUDGED, _ABOVE = 0, 1, 2


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


def settings_of(scene: Scene, *, offset: float = 0.0) -> Settings:
    """Of a scene; one offset for all chambers, s."""
    c = scene.controller
    return Settings(
        proportional=c.proportional,
        integral_time=c.integral_time or math.inf,
        derivative_time=c.derivative_time,
        limit=c.limit,
        hold_time=c.hold_time,
        period=c.period,
        shortest=c.minimum_gas_time,
        longest=c.maximum_gas_time,
        offset=offset,
        lag=scene.rotor.lag_angle,
        amplitude_noise=scene.sensor.amplitude_noise,
        phase_noise=scene.sensor.phase_noise,
        time_limit=scene.run.time_limit,
    )


@compiled
def _vibration(d: Any, pairs: Floats, moment: Floats) -> complex:
    total = 0j
    half = pairs.shape[0]
    for i in range(half):
        x = pairs[i, X] / d.total * (moment.size - 1)
        pair = at(moment, x) - at(moment, moment.size - 1 - x)
        angle = math.pi * i / half
        total += pair * complex(math.cos(angle), math.sin(angle))
    return complex(d.start_real, d.start_imaginary) + complex(d.gain_real, d.gain_imaginary) * total


@compiled
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


@compiled
def _wanted(c: Any, memory: Floats, time: float, seen: float, phase: float) -> float:
    """PID on the amplitude, T = Kc (e + 1/Ti int e dt + Td de/dt), s; a turned vector drops the integral."""
    wanted, dt = c.proportional * seen, time - memory[_TIME]
    if dt > 0.0:
        turned = math.cos(phase - memory[_PHASE]) < 0.0
        summed = 0.0 if turned else memory[_INTEGRAL] + (seen + memory[_BEFORE]) / 2 * dt
        slope = c.derivative_time * (seen - memory[_BEFORE]) / dt
        wanted = c.proportional * (seen + summed / c.integral_time + slope)
        if turned or wanted <= c.longest:
            memory[_INTEGRAL] = summed
    memory[_BEFORE], memory[_TIME], memory[_PHASE] = seen, time, phase
    return float(min(max(wanted, 0.0), c.longest))


@compiled
def _command(d: Any, c: Any, memory: Floats, time: float, z: complex, noise: Floats, empty: Any) -> Floats:
    """Valve-open time of every chamber."""
    asked = np.zeros(empty.size)
    seen = abs(abs(z) + c.amplitude_noise * noise[0])
    phase = math.atan2(z.imag, z.real) + c.phase_noise * noise[1]
    if seen <= c.limit:
        memory[_INTEGRAL], memory[_TIME] = 0.0, math.inf
        return asked
    _split(d, _wanted(c, memory, time, seen, phase), phase + c.lag, empty, asked)
    for i in range(asked.size):
        good = asked[i] >= c.shortest and asked[i] > 0.0
        asked[i] = min(asked[i] + c.offset, c.longest) if good else 0.0
    return asked


@compiled
def _settled(c: Any, held: Floats, time: float, amplitude: float) -> bool:
    """A hold, then a further stretch with few samples above the limit; a hold that is lost is forgotten."""
    if held[_JUDGED] < math.inf:
        held[_ABOVE] += amplitude > c.limit
        if held[_ABOVE] <= ALLOWED * FURTHER / c.period:
            return bool(time - held[_JUDGED] >= FURTHER - 1e-9)
        held[_SINCE], held[_JUDGED] = math.inf, math.inf
    held[_SINCE] = min(held[_SINCE], time) if amplitude <= c.limit else math.inf
    if time - held[_SINCE] >= c.hold_time - 1e-9:
        held[_JUDGED], held[_ABOVE] = time, 0.0
    return False


@compiled
def _loop(
    d: Any, tables: Any, moment: Floats, c: Any, noise: Floats, runout: complex, trace: Floats
) -> float:
    """The closed loop; time, reading and vibration of the rotor at every sample are left in `trace`.

    Returns: settling time of the reading.
    """
    n = int(d.chambers)
    half, time = n // 2, 0.0
    pairs, empty = np.zeros((half, STATES)), np.zeros(n, np.bool_)
    pairs[:, X] = d.total / 2
    memory, held = np.array([0.0, 0.0, math.inf, 0.0]), np.array([math.inf, math.inf, 0.0])
    for k in range(noise.shape[0]):
        of_rotor = _vibration(d, pairs, moment)
        z = of_rotor + runout
        trace[k, 0], trace[k, 1], trace[k, 2] = time, abs(z), abs(of_rotor)
        if _settled(c, held, time, abs(z)):
            return float(held[_SINCE])
        if time > c.time_limit and held[_SINCE] > c.time_limit:
            break
        asked = _command(d, c, memory, time, z, noise[k], empty)
        longest = np.max(asked)
        for i in range(half):
            side = 1 if asked[i + half] > 0 else 0
            carry(d, pairs[i], tables, side, asked[i] + asked[i + half], longest + c.period)
            empty[i] = pairs[i, X] <= d.residual * (1 + _NEAR)
            empty[i + half] = d.total - pairs[i, X] <= d.residual * (1 + _NEAR)
        time += longest + c.period
    return math.inf


class Run(NamedTuple):
    """What became of one drawn machine."""

    settling_time: float
    """s; infinite: not settled."""
    trace: Floats
    """Time, s, amplitude of the exact reading and of the rotor, m, at every sample; NaN beyond the end."""

    @property
    def residual(self) -> float:
        """Amplitude of the rotor at the last sample, m."""
        return float(self.trace[~np.isnan(self.trace[:, 2]), 2][-1])


def run(machine: Drawn, settings: Settings, *, noise_seed: int, runout: complex = 0j) -> Run:
    """One closed loop. Args: `runout`: vector that is added to the vibration in every reading, m."""
    tables = (machine.loss, machine.upstream, machine.downstream, machine.square)
    samples = 2 + int((settings.time_limit + settings.hold_time + FURTHER) / settings.period)
    noise = np.random.default_rng([noise_seed, 7]).standard_normal((samples, 2))
    trace = np.full((samples, 3), np.nan)
    settled = _loop(machine.device, tables, machine.moment, settings, noise, complex(runout), trace)
    return Run(float(settled), trace)


def settling_times(scene: Scene, settings: Settings, *, numbers: int, seed: int) -> Floats:
    """Of drawn machines, s, infinite where they do not settle."""
    machines = [drawn(scene, number=i, seed=seed) for i in range(numbers)]
    runs = [run(each, settings, noise_seed=seed + 1000 + i) for i, each in enumerate(machines)]
    return np.array([each.settling_time for each in runs])


class Share(NamedTuple):
    """Of drawn devices that settle, with its Wilson bounds (95 %)."""

    value: float
    low: float
    high: float

    @classmethod
    def of(cls, settled: Any) -> Share:
        n, p, z = len(settled), float(np.mean(settled)), 1.959964
        middle, half = p + z * z / (2 * n), z * math.sqrt(p * (1 - p) / n + z * z / (4 * n * n))
        return cls(p, (middle - half) / (1 + z * z / n), (middle + half) / (1 + z * z / n))

    def agrees(self, other: Share) -> bool:
        above, below = (self, other) if self.value >= other.value else (other, self)
        return above.value - below.value <= math.hypot(above.value - above.low, below.high - below.value)
