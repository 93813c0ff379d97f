"""What a rule finds, and how its numbers are written for people."""

from __future__ import annotations

from dataclasses import dataclass

from ringbalance.scene.units import format_quantity


@dataclass(frozen=True, kw_only=True)
class Finding:
    """What is wrong with a combination of values."""

    problem: str
    allowed: str


def mm(length: float) -> str:
    """Write a length.

    Args: `length`: m.
    Returns: Such as "44.5 mm".
    """
    return format_quantity(length, "length", "mm")


def um(length: float) -> str:
    """Write a vibration amplitude.

    Args: `length`: m.
    Returns: Such as "0.05 um".
    """
    return format_quantity(length, "length", "um")


def deg(angle: float) -> str:
    """Write an angle.

    Args: `angle`: rad.
    Returns: Such as "90 deg".
    """
    return format_quantity(angle, "angle", "deg")


def kilopascal(pressure: float) -> str:
    """Write a pressure.

    Args: `pressure`: Pa.
    Returns: Such as "101.325 kPa".
    """
    return format_quantity(pressure, "pressure", "kPa")


def seconds(time: float) -> str:
    """Write a time.

    Args: `time`: s.
    Returns: Such as "0.5 s".
    """
    return format_quantity(time, "time", "s")
