"""The rotor that balancers are put on, as far as they have it in common."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

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
