"""Geometry and balance grades, for defaults and for rules."""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt

from ringbalance.scene.arrays import FloatArray, plain
from ringbalance.scene.keys.fields import LEAST_CHAMBERS, LETTERS

_NEARLY_WHOLE = 1e-3


def swept_area(*, radius: npt.ArrayLike, central_angle: float, plate_thickness: float) -> FloatArray:
    """Cross-section of a chamber within a radius, m^2, up to a constant.

    theta r^2/2 - r^2 asin(t/r) - t sqrt(r^2 - t^2).
    Args: `radius`: r, m, any shape, at least the plate thickness t.
    Source: integral of 2 r (theta/2 - asin(t/r)); Fig. 2(b) of the liquid-ring paper, exact.
    """
    r, t = np.asarray(radius, dtype=np.float64), plate_thickness
    swept = central_angle / 2 * r**2
    return np.asarray(swept - r**2 * np.arcsin(t / r) - t * np.sqrt(r**2 - t**2), dtype=np.float64)


def even_number_of_chambers(central_angle: float) -> int | None:
    """Number of chambers of an angle theta (rad) that fill the circle; None when it would not be even.

    n = 2 pi / theta if within 0.001 of an even integer of 4 or more, because drawings round angles.
    """
    exact = 2 * math.pi / central_angle
    nearest = round(exact) if exact <= len(LETTERS) else 0
    close = abs(exact - nearest) <= _NEARLY_WHOLE
    return nearest if close and nearest >= LEAST_CHAMBERS and nearest % 2 == 0 else None


def permissible_unbalance(*, grade: float, mass: float, speed: float) -> float:
    """U_per = G M / W of a whole rigid rotor, kg m, with G in m/s; 9549 G M / n in g mm, mm/s and rpm.

    Source: ISO 21940-11:2016.
    """
    return grade * mass / speed


def trial_sequence(chambers: int) -> tuple[str, ...]:
    """Order in which chambers are tried, each followed by its opposite: A, C, B, D for four, as printed."""
    half = chambers // 2
    return tuple(LETTERS[chamber] for first in range(half) for chamber in (first, first + half))


def shortest_path(*, port_radius: float, hump_radius: float | None, separation: float) -> float:
    """Lower bound of the length of a path between two ports, m.

    Both ports lie at r_p, an angle psi apart; the path keeps to r >= r_m and touches r_m somewhere.  Its
    projection along the shaft is not longer than the path, so that the plane case suffices.

    - no hump: the chord, 2 r_p sin(psi/2);
    - the chord passes inside the crest's circle, r_p cos(psi/2) < r_m: the taut string around that circle,
      2 sqrt(r_p^2 - r_m^2) + r_m (psi - 2 acos(r_m/r_p));
    - else the longer of the chord and of the way in and out, 2 (r_p - r_m).
    Args: `port_radius`: r_p, m. `hump_radius`: r_m, m, at most r_p; None without a siphon crest.
        `separation`: psi, rad, within [0, pi].
    Range: the last case is a bound below every path; the others are lengths of actual paths.
    Source: elementary geometry (shortest path around a circle).
    """
    chord = 2 * port_radius * np.sin(separation / 2)
    if hump_radius is None:
        straight_line: float = plain(chord)
        return straight_line
    wrapped = separation - 2 * np.arccos(np.minimum(hump_radius / port_radius, 1.0))
    straight = np.sqrt(np.maximum((port_radius - hump_radius) * (port_radius + hump_radius), 0.0))
    around = 2 * straight + hump_radius * wrapped
    past = np.maximum(chord, 2 * (port_radius - hump_radius))
    length: float = plain(np.where(port_radius * np.cos(separation / 2) < hump_radius, around, past))
    return length
