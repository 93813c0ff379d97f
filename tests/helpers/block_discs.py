"""Chambers of block meshes for tests: a plain sector, and a disc whose own chamber is imported."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ringbalance.scene.arrays import FloatArray
from ringbalance.scene.chamber_file.record import CellKind, ChamberGeometry
from ringbalance.scene.models import Disc
from ringbalance.verification.reference.chambers import block_chamber, disc_chamber


def sector_chamber(
    cells: tuple[int, int, int],
    *,
    radii: tuple[float, float],
    angle: float,
    width: float,
    kind: CellKind = "hexahedron27",
) -> ChamberGeometry:
    """The space between two radii, m, within an angle, rad (2 pi: a full ring), and along a width, m."""

    def place(cube: FloatArray) -> FloatArray:
        radius = radii[0] + (radii[1] - radii[0]) * cube[..., 0]
        turned = angle * (cube[..., 1] - 0.5)
        across = [radius * np.cos(turned), radius * np.sin(turned), width * (cube[..., 2] - 0.5)]
        return np.stack(across, axis=-1)

    return block_chamber(cells, place, kind=kind, closed=angle > 2 * np.pi - 1e-9)


def imported(disc: Disc, *, cells: tuple[int, int, int] = (4, 16, 2)) -> Disc:
    """The disc with its own chamber imported, and no other dimensions."""
    return replace(disc, geometry=disc_chamber(disc, cells))


def turned(disc: Disc, *, angle: float) -> Disc:
    """The disc with its own chamber imported, the mesh turned with the rotation and not its middle."""
    geometry = disc.geometry or disc_chamber(disc, (4, 16, 2))
    c, s = np.cos(angle), np.sin(angle)
    points = geometry.points @ np.array([[c, s, 0], [-s, c, 0], [0, 0, 1]])
    return replace(disc, geometry=replace(geometry, points=points, digest=f"{geometry.digest} at {angle}"))
