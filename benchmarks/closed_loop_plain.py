"""The rival of the closed-loop benchmark: the target-vector loop in plain Python, with solve_ivp."""

from __future__ import annotations

import cmath
import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from scipy.integrate import solve_ivp

from ringbalance.controller.algorithms.built_in import vector_shares
from ringbalance.reduced_model.law.flow_law import BalancerModel
from ringbalance.reduced_model.law.paper_law import PaperLaw
from ringbalance.scene.models import Scene


class Carrier(Protocol):
    """What carries one operation through."""

    @property
    def total(self) -> float:
        """x_A + x_C."""

    def operate(self, fill: float, duration: float) -> float:
        """Fill of the driven chamber after a valve-open time, s."""


@dataclass(frozen=True, kw_only=True)
class Plain:
    """How the rival carries one operation through."""

    velocity: Callable[[float], float]
    """m/s at a fill ratio of the driven chamber with the gas on."""
    rate: float
    """S/V, 1/m."""
    total: float
    """x_A + x_C."""
    tolerance: float
    """rtol of solve_ivp."""

    def operate(self, fill: float, duration: float) -> float:
        """Fill of the driven chamber after a valve-open time, by solve_ivp with events for empty and stall.

        Args: `fill`: x at the start. `duration`: s.
        Returns: x at the end.
        """

        def rhs(_: float, x: Sequence[float]) -> list[float]:
            return [-self.rate * self.velocity(x[0])]

        def empty(_: float, x: Sequence[float]) -> float:
            return x[0]

        def stall(_: float, x: Sequence[float]) -> float:
            return self.velocity(x[0])

        for event in (empty, stall):
            event.terminal = True  # type: ignore[attr-defined]
        found = solve_ivp(
            rhs,
            (0.0, duration),
            [fill],
            rtol=self.tolerance,
            atol=self.tolerance * 1e-2,
            events=(empty, stall),
        )
        return float(found.y[0, -1])


def in_numbers(scene: Scene, model: BalancerModel) -> Callable[[float], float]:
    """Eq. 19 in plain numbers, the cheapest right-hand side that Python has.

    Args: `model`: the balancer by the paper's law.
    Returns: Velocity from the fill ratio.
    Raises: ValueError: another law.
    """
    law, pressure, total = model.flow, scene.gas.pressure, 2 * scene.disc.initial_fill
    if not isinstance(law, PaperLaw):
        raise ValueError("only the paper's law comes in plain numbers")
    a, b = law.velocity_squared_per_pressure, law.pressure_per_fill_difference
    return lambda x: math.sqrt(max(a * (pressure + b * (2 * x - total)), 0.0))


def by_the_law(scene: Scene, model: BalancerModel) -> Callable[[float], float]:
    """The flow law through its interface, as for a law of which nothing else is known.

    Returns: Velocity from the fill ratio.
    """
    total, largest = 2 * scene.disc.initial_fill, model.flow.max_fill_ratio

    def velocity(x: float) -> float:
        held = min(max(x, 0.0), largest)
        flow = model.flow.evaluate(
            fill_ratio=held,
            opposite_fill_ratio=min(max(total - held, 0.0), largest),
            gas_pressure=scene.gas.pressure,
            primed=True,
        )
        return float(flow.velocity)

    return velocity


def plain_run(scene: Scene, model: BalancerModel, plain: Carrier, seed: int) -> tuple[complex, int]:
    """One target-vector run as one would write it oneself.

    Args: `plain`: how an operation is carried through. `seed`: of the noise.
    Returns: Vibration at the end, m, and the number of samples.
    """
    settings, sensor, random = scene.controller, scene.sensor, np.random.default_rng(seed)
    exact = sensor.amplitude_noise == sensor.phase_noise == 0
    fills = [scene.disc.initial_fill] * (scene.disc.chambers // 2)
    now, samples, integral = 0.0, 0, 0.0
    before: tuple[float, float, float] | None = None
    while True:
        v, z = _vibration(scene, model, fills, plain.total), random.standard_normal(2)
        amplitude = abs(abs(v) + sensor.amplitude_noise * z[0])
        phase = cmath.phase(v) + sensor.phase_noise * z[1]
        samples += 1
        if now >= scene.run.time_limit or (exact and amplitude <= settings.limit):
            return v, samples
        if amplitude <= settings.limit:
            integral, before = 0.0, None
        else:
            wanted, integral = _pid(scene, (now, amplitude, phase), before, integral)
            before = (now, amplitude, phase)
            now += _gas(scene, plain, fills, wanted, phase, scene.run.time_limit - now)
        now += min(settings.period, max(scene.run.time_limit - now, 0.0))


def _vibration(scene: Scene, model: BalancerModel, fills: Sequence[float], total: float) -> complex:
    rotor = scene.rotor
    k = cmath.rect(rotor.influence_coefficient, -rotor.lag_angle)
    moment = sum(
        float(model.moment.pair_moment(fill_ratio=x, opposite_fill_ratio=total - x))
        * cmath.rect(1.0, math.pi * i / len(fills))
        for i, x in enumerate(fills)
    )
    return cmath.rect(rotor.initial_amplitude, rotor.initial_phase) + k * moment


def _pid(
    scene: Scene,
    sample: tuple[float, float, float],
    before: tuple[float, float, float] | None,
    integral: float,
) -> tuple[float, float]:
    now, amplitude, phase = sample
    if before is None:
        return scene.controller.proportional * amplitude, integral
    dt, settings = now - before[0], scene.controller
    turned = math.cos(phase - before[2]) < 0
    area = 0.0 if turned else integral + (amplitude + before[1]) / 2 * dt
    slope = settings.derivative_time * (amplitude - before[1]) / dt
    wanted = settings.proportional * (amplitude + area / (settings.integral_time or math.inf) + slope)
    return wanted, integral if wanted > settings.maximum_gas_time and not turned else area


def _gas(
    scene: Scene, plain: Carrier, fills: list[float], wanted: float, phase: float, remaining: float
) -> float:
    """Drive the two chambers and return how long the gas was on."""
    settings, half, longest = scene.controller, len(fills), 0.0
    length = min(max(wanted, 0.0), settings.maximum_gas_time)
    angle = phase + settings.assumed_lag_angle
    first, near, second, far = vector_shares(2 * half, angle, length, (False,) * 2 * half)
    for chamber, share in ((first, near), (second, far)):
        duration = min(share, remaining)
        if share < settings.minimum_gas_time or duration <= 0:
            continue
        pair, positive = chamber % half, chamber < half
        driven = plain.operate(fills[pair] if positive else plain.total - fills[pair], duration)
        fills[pair] = driven if positive else plain.total - driven
        longest = max(longest, duration)
    return longest
