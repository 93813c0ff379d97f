"""The rotor that balancers are put on, as far as they have it in common."""

from __future__ import annotations

import cmath
import math
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import cache
from typing import Final, Protocol

import numpy as np

from ringbalance.scene.faults import Fault, SceneError
from ringbalance.scene.origins import SceneFile


@dataclass(frozen=True, kw_only=True)
class CommonRotor:
    """What balancers on one rotor have in common.

    What a balancer knows of a rotor at constant speed is its vibration before balancing and its vibration per
    unbalance, V = alpha (U_0 + U_balancer).  One rotor therefore means: the same speed, the same complex
    alpha, the same U_0, the same sensor and the same amplitude to come below.
    """

    source: str
    """File of the scene that it is taken from."""
    speed: float
    """W, rad/s, above zero."""
    influence: complex
    """alpha, m/(kg m)."""
    unbalance: complex
    """U_0, kg m."""
    mass: float | None
    """M with the balancer, kg; None when the scene does not give it."""
    noise: float
    """Standard deviation of the measured vibration, m."""
    limit: float
    """Amplitude to come below, m."""

    @property
    def amplitude(self) -> float:
        """Vibration before balancing, m zero-to-peak."""
        return abs(self.influence * self.unbalance)


Rotors = Callable[[int], CommonRotor]
"""The rotor by number of the drawn device that it belongs to."""


_COUNT: Final = 16
"""Devices by which it is told which of two scenes draws a quantity more widely."""


class _Drawn(Protocol):
    """`Balancer.rotor`."""

    def __call__(self, number: int | None = None) -> CommonRotor: ...


def rotors_of(first: _Drawn, second: _Drawn) -> Rotors:
    """The rotor that the first scene says, drawn as widely as either scene draws its own.

    Each of speed, magnitude and angle of alpha, and size and direction of the unbalance deviates by what that
    scene draws of which it is more uncertain: the order of the scenes does not matter to the deviations.
    """
    nominal = first()
    scenes = [_deviations(nominal, first)]
    with suppress(SceneError):
        # A rotor that stands still or does not vibrate says nothing of this one.
        if (own := second()).amplitude > 0.0:
            scenes.append(_deviations(own, second))
    spread = np.array([np.std([of(number) for number in range(_COUNT)], axis=0) for of in scenes])
    wider = np.argmax(spread, axis=0)

    def rotor(number: int) -> CommonRotor:
        drawn = np.choose(wider, [of(number) for of in scenes])
        speed, size, angle, unbalance, direction = drawn.tolist()
        return replace(
            nominal,
            speed=nominal.speed * math.exp(speed),
            influence=nominal.influence * cmath.rect(math.exp(size), angle),
            unbalance=nominal.unbalance * cmath.rect(math.exp(unbalance), direction),
        )

    return cache(rotor)


def _deviations(nominal: CommonRotor, drawn: _Drawn) -> Callable[[int], list[float]]:
    """By number: logarithms of ratios to what the scene says, and angles."""

    def of(number: int) -> list[float]:
        rotor = drawn(number)
        influence, unbalance = rotor.influence / nominal.influence, rotor.unbalance / nominal.unbalance
        return [
            math.log(rotor.speed / nominal.speed),
            *(math.log(abs(influence)), cmath.phase(influence)),
            *(math.log(abs(unbalance)), cmath.phase(unbalance)),
        ]

    return of


def rotor_fault(scene: SceneFile, path: str, problem: str, allowed: str) -> SceneError:
    """The error about a rotor, or about a balancer that cannot work on it; `path`: of the value to change."""
    table, _, key = path.partition(".")
    return SceneError([Fault(file=scene.file, table=table, key=key, problem=problem, allowed=allowed)])


def vibrating(scene: SceneFile, rotor: CommonRotor) -> CommonRotor:
    """The same rotor. Raises: SceneError: it does not vibrate."""
    if rotor.amplitude == 0:
        problem = "it does not vibrate: there is nothing to compare"
        raise rotor_fault(scene, "rotor", problem, "an unbalance")
    return rotor
