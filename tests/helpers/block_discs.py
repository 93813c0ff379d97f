"""Chambers of block meshes for tests: a plain sector, and a disc whose own chamber is imported."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ringbalance.scene.arrays import FloatArray, IntArray
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

    chamber = block_chamber(cells, place, kind=kind)
    return welded(chamber, chamber.points, chamber.cells) if angle > 2 * np.pi - 1e-9 else chamber


def ribbed_chamber(angle: float) -> ChamberGeometry:
    """A sector from 0.5 to 1 whose outer wall has a rib of a tenth in its middle."""

    def place(cube: FloatArray) -> FloatArray:
        bulge = 0.1 * np.exp(-(((cube[..., 1] - 0.5) / 0.1) ** 2))
        radius = 0.5 + (0.5 - bulge) * cube[..., 0]
        turn = angle * (cube[..., 1] - 0.5)
        return np.stack([radius * np.cos(turn), radius * np.sin(turn), cube[..., 2]], axis=-1)

    return block_chamber((4, 16, 3), place)


def welded(like: ChamberGeometry, points: FloatArray, cells: IntArray) -> ChamberGeometry:
    """A chamber in which points at one place are one, without plates."""
    _, first, number = np.unique(points.round(9), axis=0, return_index=True, return_inverse=True)
    number = number.reshape(-1)
    boundaries = {name: number[at] for name, at in like.boundaries.items() if not name.startswith("plate")}
    return replace(like, points=points[first], cells=number[cells], boundaries=boundaries)


def imported(disc: Disc, *, cells: tuple[int, int, int] = (4, 16, 2)) -> Disc:
    """The disc with its own chamber imported, and no other dimensions."""
    return replace(disc, geometry=disc_chamber(disc, cells))


def turned(disc: Disc, *, angle: float) -> Disc:
    """The disc with its own chamber imported, the mesh turned with the rotation and not its middle."""
    geometry = disc.geometry or disc_chamber(disc, (4, 16, 2))
    c, s = np.cos(angle), np.sin(angle)
    points = geometry.points @ np.array([[c, s, 0], [-s, c, 0], [0, 0, 1]])
    return replace(disc, geometry=replace(geometry, points=points, digest=f"{geometry.digest} at {angle}"))
