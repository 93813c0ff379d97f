"""How short a tube from port to port can be: a bound that holds wherever the ports lie in their chambers."""

from __future__ import annotations

import math


def shortest_path(*, port_radius: float, hump_radius: float | None, separation: float) -> float:
    """Length that no path between two ports can fall below.

    Both ports lie at r_p, an angle psi apart; the path keeps to r >= r_m and touches r_m somewhere.  Its
    projection along the shaft is no longer than itself, so the plane is enough.

    - no hump: the chord, 2 r_p sin(psi/2);
    - the chord passes inside the crest's circle, r_p cos(psi/2) < r_m: the taut string around that circle,
      2 sqrt(r_p^2 - r_m^2) + r_m (psi - 2 acos(r_m/r_p));
    - else the longer of the chord and of the way in and out, 2 (r_p - r_m).
    Args: `port_radius`: r_p, m. `hump_radius`: r_m, m, at most r_p; None for a path that may go anywhere.
        `separation`: psi, rad, within [0, pi].
    Returns: Length, m.
    Range: the last case is a bound that is not reached; the others are lengths of actual paths.
    Source: elementary geometry (shortest path around a circle).
    """
    chord = 2 * port_radius * math.sin(separation / 2)
    if hump_radius is None:
        return chord
    if port_radius * math.cos(separation / 2) < hump_radius:
        wrapped = separation - 2 * math.acos(hump_radius / port_radius)
        straight = math.sqrt((port_radius - hump_radius) * (port_radius + hump_radius))
        return 2 * straight + hump_radius * wrapped
    return max(chord, 2 * (port_radius - hump_radius))
