"""Rules of defaults that follow from other values of the scene; the declarations of keys name them."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Protocol, TypeVar

from ringbalance.scene.keys.fields import LETTERS

Value = TypeVar("Value")

_NEARLY_WHOLE = 1e-3
_FINEST_POSITION = 1e-6
_FINEST_VELOCITY = 1e-5
_FINEST_RATE = 1e-3
_LONGEST_WAIT = 30.0


class Corner(Protocol):
    """One corner of a speed profile."""

    @property
    def speed(self) -> float:
        """Speed of the rotor, rad/s."""


def same(value: Value) -> Value:
    """The value of another key."""
    return value


def half(value: float) -> float:
    """Half the value of another key."""
    return value / 2


def a_tenth(value: float) -> float:
    """A tenth of the value of another key."""
    return value / 10


def ten_times(value: float) -> float:
    """Ten times the value of another key.

    Of samples that lie within a limit by chance half of the time, ten in a row do so once in a thousand.
    """
    return 10 * value


def even_number_of_chambers(central_angle: float) -> int | None:
    """Number of chambers that fill the circle.

    n = 2 pi / theta, when that is an even whole number to within 0.001, as drawings round angles.
    Args: `central_angle`: theta, rad.
    Returns: The number; None when it would not be even.
    """
    exact = 2 * math.pi / central_angle
    nearest = round(exact) if exact <= len(LETTERS) else 0
    close = abs(exact - nearest) <= _NEARLY_WHOLE
    return nearest if close and nearest >= 2 and nearest % 2 == 0 else None


def trial_sequence(chambers: int) -> tuple[str, ...]:
    """Order in which chambers are tried: each followed by its opposite.

    Returns: Letters; A, C, B, D for four, as in the liquid-ring paper's section 6.
    """
    half_of_them = chambers // 2
    return tuple(
        LETTERS[chamber] for first in range(half_of_them) for chamber in (first, first + half_of_them)
    )


def radius_of_edge(entrance: str) -> float | None:
    """Radius of an entrance's edge, m; None for a rounded one, whose radius must be given."""
    return None if entrance == "rounded" else 0.0


def assumed_position_noise(noise: float) -> float:
    """Standard deviation of a coordinate that a filter can assume, m."""
    return max(noise, _FINEST_POSITION)


def assumed_velocity_noise(noise: float) -> float:
    """Standard deviation of a velocity that a filter can assume, m/s."""
    return max(noise, _FINEST_VELOCITY)


def assumed_rate_noise(noise: float) -> float:
    """Standard deviation of an angular velocity that a filter can assume, rad/s."""
    return max(noise, _FINEST_RATE)


def capacity(mass: float, radius: float) -> float:
    """Greatest static moment of the eccentric masses, kg m."""
    return 2 * mass * radius


def capacity_travel(mass: float, radius: float, rotor: float) -> float:
    """Greatest static moment of the eccentric masses over the whole mass, m."""
    return 2 * mass * radius / (rotor + 2 * mass)


def critical_velocity(travel: float, stiffness: float, rotor: float, mass: float) -> float:
    """Velocity amplitude of a displacement at the critical speed, m/s."""
    return travel * math.sqrt(stiffness / (rotor + 2 * mass))


def settling(damping: float, rotor: float, mass: float) -> float:
    """Eight time constants of the free whirl, at most half a minute, s."""
    whole = 2 * (rotor + 2 * mass)
    return _LONGEST_WAIT if damping * _LONGEST_WAIT <= 8 * whole else 8 * whole / damping


def two_turns(profile: Sequence[Corner]) -> float:
    """Time of two turns of the rotor at the start, s."""
    speeds = [abs(corner.speed) for corner in profile]
    fastest = speeds[0] or max(speeds) if speeds else 0.0
    return 4 * math.pi / fastest if fastest else 1.0


def amplitude_limit(mass: float, radius: float, rotor: float, noise: float) -> float:
    """Amplitude below which no fine tuning is needed, m."""
    return max(0.02 * capacity_travel(mass, radius, rotor), 3 * noise)
