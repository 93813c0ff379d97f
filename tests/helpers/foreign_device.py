"""An injection of gas and flow through a tube, by a simulator that shares no code with the program.

It uses numpy and scipy alone.  k(u) is by other sources than the program's: Haaland's friction factor, Ito
and Nanbu's factors of rotation, K of entrance and bends as in handbooks, each with an error of its own.

An injection is the one-dimensional momentum of liquid in the tube, in three parts:
1. the front rises from the level of the chamber over the crest and down to the level of the other one,
2. a full column is driven by gas and levels (its pressure over the crest is checked: it does not separate),
3. gas off, it parts over the crest; what is upstream coasts to rest.  What has passed the crest's middle has
   been moved, the rest falls back.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Final

import numpy as np
import numpy.typing as npt
from scipy.integrate import solve_ivp

FloatArray = npt.NDArray[np.float64]
AMBIENT: Final = 101325.0
_LAMINAR_ENDS: Final = 1.83
"""Of 2.33 in all, for an entrance loss of 0.50."""


@dataclass(frozen=True, kw_only=True)
class Device:
    """Everything that the simulator needs, SI."""

    outer_radius: float
    inner_radius: float
    axial_width: float
    central_angle: float
    chambers: int
    fill: float
    density: float
    kinematic_viscosity: float
    bore: float
    length: float
    roughness: float
    extra_loss: float
    crest_radius: float
    bends: int
    pressure: float
    speed: float
    influence_coefficient: float
    lag_angle: float
    lambda_factor: float = 1.0
    pressure_offset: float = 0.0
    """Of the liquid's gas over what the gauge shows, Pa."""
    friction_factor: float = 1.0
    """On f, an error of the foreign law like the next three."""
    rotation_factor: float = 1.0
    """On what rotation adds to f."""
    coasts: bool = True
    """Whether liquid goes on over the crest once the gas is shut."""
    entrance_loss: float = 0.50
    bend_loss: float = 0.28

    @property
    def area(self) -> float:
        """Of the bore."""
        return math.pi * self.bore**2 / 4

    @property
    def volume(self) -> float:
        """Of one chamber, a sector."""
        ring = self.outer_radius**2 - self.inner_radius**2
        return self.central_angle / 2 * ring * self.axial_width

    def level(self, fill: float) -> float:
        """Radius of the free surface."""
        ring = self.outer_radius**2 - self.inner_radius**2
        return math.sqrt(self.outer_radius**2 - fill * ring)

    def head(self, radius: float) -> float:
        """Pressure of a column from a radius to the outer wall, Pa."""
        return self.density * self.speed**2 * (self.outer_radius**2 - radius**2) / 2

    def moment(self, fill: float) -> float:
        """Of one chamber's liquid, kg m."""
        cubes = self.outer_radius**3 - self.level(fill) ** 3
        arm = math.sin(self.central_angle / 2) * 2 / 3 * cubes
        return self.lambda_factor * self.density * self.axial_width * arm

    @property
    def arc(self) -> float:
        """Share of the path on the circle of the crest, between two straight legs that touch it."""
        turn = 2 * math.acos(self.crest_radius / self.outer_radius)
        arc = self.crest_radius * (math.pi - turn)
        return arc / (arc + 2 * math.sqrt(self.outer_radius**2 - self.crest_radius**2))

    def path_radius(self, share: float) -> float:
        """At a share of the path, the crest in its middle."""
        out = max(abs(share - 0.5) - self.arc / 2, 0.0) / ((1 - self.arc) / 2)
        return math.sqrt(self.crest_radius**2 + (self.outer_radius**2 - self.crest_radius**2) * out**2)

    def share_at(self, radius: float) -> float:
        """Share of the near leg at which it passes a radius."""
        squares = (radius**2 - self.crest_radius**2) / (self.outer_radius**2 - self.crest_radius**2)
        return (1 - self.arc) / 2 * (1 - math.sqrt(max(squares, 0.0)))

    def friction(self, velocity: float) -> float:
        """f of the tube where it turns; straight at rest."""
        reynolds = max(abs(velocity), 1e-3) * self.bore / self.kinematic_viscosity
        rotation = self.speed * self.bore**2 / self.kinematic_viscosity
        rough = (self.roughness / self.bore / 3.7) ** 1.11
        laminar = 64 / reynolds
        turbulent = (-1.8 * math.log10(rough + 6.9 / max(reynolds, 1000.0))) ** -2
        if rotation > 0:
            laminar *= 1 + self.rotation_factor * (laminar_factor(rotation * reynolds) - 1)
            turbulent *= 1 + self.rotation_factor * (turbulent_factor(rotation**2 / reynolds) - 1)
        part = min(max((reynolds - 2300) / 1700, 0.0), 1.0)
        return self.friction_factor * ((1 - part) * laminar + part * turbulent)

    def losses(self, velocity: float) -> tuple[float, float]:
        """What is lost at the near port with the stream's own kinetic energy, and spread along the path,
        over u^2/2; that at the far port is 1, and more in laminar flow."""
        reynolds = max(abs(velocity), 1e-3) * self.bore / self.kinematic_viscosity
        near = self.entrance_loss + (1.05 if reynolds > 2300 else _LAMINAR_ENDS)
        along = self.friction(velocity) * self.length / self.bore + self.extra_loss
        return near + self.bend_loss * self.bends / 2, along

    def loss(self, velocity: float) -> float:
        """k + 1 of the whole tube; both ends of laminar flow together take 2.33 (Hagenbach)."""
        reynolds = max(abs(velocity), 1e-3) * self.bore / self.kinematic_viscosity
        ends = self.entrance_loss + (1.0 if reynolds > 2300 else _LAMINAR_ENDS)
        return ends + self.bend_loss * self.bends + self.losses(velocity)[1]


def laminar_factor(kl: float) -> float:
    """On f of laminar flow. Source: Ito and Nanbu, J. Basic Eng. 93 (1971) 383."""
    return max(float(0.0883 * kl**0.25 * (1 + 11.2 * kl**-0.325)), 1.0) if kl > 220 else 1.0


def turbulent_factor(kt: float) -> float:
    """The same of turbulent flow."""
    if kt < 1:
        return 1.0
    return float(0.942 + 0.058 * kt**0.282 if kt < 500 else 0.942 * kt**0.05)


def injected(device: Device, fill: float, gauge: float, gas_time: float) -> float:
    """Fill that leaves a chamber by one injection, of a pair that is at rest before and after."""
    gas = gauge + device.pressure_offset
    start = device.share_at(device.level(fill))
    far = 1 - device.share_at(device.level(2 * device.fill - fill))
    rate = device.area / device.volume
    rising = _run(_rising(device, fill, gas, start), [start, 0.0], gas_time, until=lambda y: y[0] - far)
    if rising.t[-1] >= gas_time or not rising.t_events[0].size:
        raise ValueError("the valve closes before the tube is full: no injection of these rigs is so short")
    moved = (far - start) * device.length * rate
    full = _run(_full(device, fill, gas), [moved, float(rising.y[1, -1])], gas_time - float(rising.t[-1]))
    _check_column(device, fill, gas, full.y)
    left = (0.5 - start) * device.length * rate
    if not device.coasts:
        return float(full.y[0, -1]) - left
    parted = _run(_parted(device, fill), [float(v) for v in full.y[:, -1]], 1.0, until=lambda y: y[1] - 1e-3)
    return float(parted.y[0, -1]) - left


def _run(
    rates: Callable[[float, FloatArray], list[float]],
    state: list[float],
    time: float,
    until: Callable[[FloatArray], float] | None = None,
) -> Any:
    def event(_: float, y: FloatArray) -> float:
        return -1.0 if until is None else float(until(y))

    event.terminal = True  # type: ignore[attr-defined]
    return solve_ivp(rates, (0.0, time), state, events=event, rtol=1e-7, atol=1e-9)


def _rising(
    device: Device, fill: float, gas: float, start: float
) -> Callable[[float, FloatArray], list[float]]:
    """Of the share of the path that is full, and the velocity."""

    def rates(_: float, y: FloatArray) -> list[float]:
        share, u = float(y[0]), float(y[1])
        now = fill - (share - start) * device.length * device.area / device.volume
        near, along = device.losses(u)
        push = gas + device.head(device.level(now)) - device.head(device.path_radius(share))
        mass = device.density * (share * device.length + device.bore)
        return [u / device.length, (push - device.density * (near + along * share) * u * abs(u) / 2) / mass]

    return rates


def _full(device: Device, fill: float, gas: float) -> Callable[[float, FloatArray], list[float]]:
    """Of the fill moved, and the velocity."""
    total, mass = 2 * device.fill, device.density * device.length

    def rates(_: float, y: FloatArray) -> list[float]:
        moved, u = float(y[0]), float(y[1])
        near, far = device.level(fill - moved), device.level(total - fill + moved)
        push = gas + device.head(near) - device.head(far)
        return [
            u * device.area / device.volume,
            (push - device.density * device.loss(u) * u * abs(u) / 2) / mass,
        ]

    return rates


def _parted(device: Device, fill: float) -> Callable[[float, FloatArray], list[float]]:
    """The same without gas, a cavity over the crest at half of ambient pressure."""

    def rates(_: float, y: FloatArray) -> list[float]:
        moved, u = float(y[0]), float(y[1])
        near, along = device.losses(u)
        push = device.head(device.level(fill - moved)) - device.head(device.crest_radius) + AMBIENT / 2
        lost = device.density * (near + along / 2) * u * abs(u) / 2
        return [u * device.area / device.volume, (push - lost) / (device.density * device.length / 2)]

    return rates


def _check_column(device: Device, fill: float, gas: float, path: FloatArray) -> None:
    """A full column whose pressure behind the crest's arc fell below that around it might separate there,
    and one that is as high without gas would not part: neither is what this simulator describes."""
    moved, u = path
    end = 0.5 + device.arc / 2
    level = np.array([device.head(device.level(fill - m)) for m in moved])
    lost = np.array([sum(device.losses(v)[i] * (1, end)[i] for i in (0, 1)) for v in u])
    over = gas + level - device.head(device.crest_radius) - device.density * lost * u**2 / 2
    if over[-1] < 0 or level[-1] - device.head(device.crest_radius) > -AMBIENT:
        raise ValueError(f"no full column: {over[-1]:.3g} Pa over the crest, {level[-1]:.3g} Pa of level")
