"""The connecting tube's schematic centre line, without the packages that draw it."""

from __future__ import annotations

import numpy as np

from ringbalance.scene.arrays import FloatArray


def tube_path(*, port: float, hump: float | None, height: float, bend: float) -> FloatArray:
    """Schematic centre line from the first chamber's port over the crest to the opposite one's.

    Out of the chamber, inward to the crest's radius, along that radius half-way round, outward and in again;
    without a crest straight across.
    Args: `port`: radius of both ports, mm. `hump`: smallest radius on the path, mm; None: a straight tube.
    `bend`: radius of its corners, mm.
    Returns: Points, mm, shape (n, 3).
    """
    low = -height
    if hump is None:
        return np.array(
            [[port, 0, low], [port, 0, height], [-port, 0, height], [-port, 0, low]], dtype=np.float64
        )
    angle = np.linspace(0, np.pi, 121)
    arc = np.c_[hump * np.cos(angle), hump * np.sin(angle), np.full(angle.size, height)]
    return np.vstack(
        [
            [[port, 0, low]],
            _corner(np.array([port, 0, low]), np.array([port, 0, height]), arc[0], bend),
            _corner(np.array([port, 0, height]), arc[0], arc[5], bend),
            arc[6:-6],
            _corner(arc[-6], arc[-1], np.array([-port, 0, height]), bend),
            _corner(arc[-1], np.array([-port, 0, height]), np.array([-port, 0, low]), bend),
            [[-port, 0, low]],
        ]
    )


def _corner(before: FloatArray, corner: FloatArray, after: FloatArray, bend: float) -> FloatArray:
    """A corner rounded by a parabola, at most half-way into its legs."""
    legs = [point - corner for point in (before, after)]
    start, end = (corner + leg * min(bend / float(np.linalg.norm(leg)), 0.5) for leg in legs)
    share = np.linspace(0, 1, 13)[:, None]
    return np.asarray((1 - share) ** 2 * start + 2 * share * (1 - share) * corner + share**2 * end)
