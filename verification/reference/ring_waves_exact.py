"""Waves on a full ring of liquid between flat ends, in closed form, with the Coriolis force.

With all of the flow turning as F(r) cos(k z) exp(i (m angle + s t)), lengths in outer radii and times in
1/omega, the pressure obeys F'' + F'/r - (m^2/r^2 + q) F = 0, q = k^2 (1 - 4/s^2): Bessel functions I and K
where s > 2, J and Y below.  The radial velocity is i (s F' + 2 m F/r)/(s^2 - 4); it vanishes on the wall, and
at the free surface, where centrifugal gravity is a, F s (s^2 - 4) = - a (s F' + 2 m F/r).
"""

from __future__ import annotations

import numpy as np
from scipy.optimize import brentq
from scipy.special import iv, ivp, jv, jvp, kv, kvp, yv, yvp

from ringbalance.scene.arrays import FloatArray

_SEARCH = np.linspace(3.9, 0.05, 1200)
_TRIVIAL = 0.01
"""Distance from |s| = 2 within which the condition is met by no flow at all."""


def _pair(m: int, q: FloatArray, r: float) -> FloatArray:
    """Two solutions, and their slopes, shape (2, 2, q's)."""
    root = np.sqrt(np.abs(q))
    found = np.empty((2, 2, q.size))
    for chosen, values, slopes in ((q > 0, (iv, kv), (ivp, kvp)), (q < 0, (jv, yv), (jvp, yvp))):
        k = root[chosen]
        found[0][:, chosen] = [f(m, k * r) for f in values]
        found[1][:, chosen] = [k * f(m, k * r) for f in slopes]
    if np.any(q == 0):
        powers = [[r**m, r**-m], [m * r ** (m - 1), -m * r ** (-m - 1)]]
        found[:, :, q == 0] = np.array(powers)[:, :, None]
    return found


def _conditions(s: FloatArray, m: int, k: float, a: float) -> FloatArray:
    """Zero at the frequencies of the ring's waves."""
    q = k**2 * (1 - 4 / s**2)
    wall, surface = _pair(m, q, 1.0), _pair(m, q, a)
    rows = np.array(
        [
            s * wall[1] + 2 * m * wall[0],
            surface[0] * s * (s**2 - 4) + a * (s * surface[1] + 2 * m * surface[0] / a),
        ]
    )
    rows /= np.abs(rows).max(axis=1, keepdims=True)
    return np.asarray(rows[0, 0] * rows[1, 1] - rows[0, 1] * rows[1, 0])


def _condition(s: float, m: int, k: float, a: float) -> float:
    return float(_conditions(np.array([s]), m, k, a)[0])


def ring_frequencies(*, surface_radius: float, width: float, around: int, along: int) -> tuple[float, ...]:
    """The surface's two waves, s in both directions round the ring; lengths in outer radii.

    Below them lie the inertial waves of the same m and k, of which none is meant here.
    Args: `around`: m, 1 or more where `along` is 0. `along`: half waves from end to end.
    """
    arguments = (around, along * np.pi / width, surface_radius)
    found = []
    for sign in (1.0, -1.0):
        values = _conditions(sign * _SEARCH, *arguments)
        # From the fastest on, and no further than the first change of sign.
        for place in np.flatnonzero(values[:-1] * values[1:] < 0):
            high, low = _SEARCH[place], _SEARCH[place + 1]
            if not low - _TRIVIAL < 2 < high + _TRIVIAL:
                found.append(abs(float(brentq(_condition, sign * high, sign * low, args=arguments))))
                break
    return tuple(found)


def still_frequency(*, surface_radius: float, width: float, angle: float, around: int, along: int) -> float:
    """s of a sector without Coriolis force, s^2 = - a F'(a)/F(a), from I and K; lengths in outer radii.

    Args: `around`, `along`: half waves from plate to plate and from end to end, not both 0.
    """
    m, k = around * np.pi / angle, along * np.pi / width
    if along == 0:
        return float(np.sqrt(m * np.tanh(m * np.log(1 / surface_radius))))
    at, wall = k * surface_radius, k
    value = iv(m, at) * kvp(m, wall) - kv(m, at) * ivp(m, wall)
    slope = k * (ivp(m, at) * kvp(m, wall) - kvp(m, at) * ivp(m, wall))
    return float(np.sqrt(-surface_radius * slope / value))
