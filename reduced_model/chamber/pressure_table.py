"""What a chamber's liquid presses with at the outer radius R2, as a table over the fill.

Where liquid begins to cover a wall, R2^2 - a^2 goes with a root of the fill: in an edge, with x^(1/2).  Then
the nodes of a calibration are too few, and errors between more of them count where they are.
"""

from __future__ import annotations

from functools import lru_cache
from typing import Final

import numpy as np

from ringbalance.mesh.geometry import head_square, surface_radius
from ringbalance.reduced_model.tables import HermiteTable, table_from_samples
from ringbalance.scene.arrays import FloatArray
from ringbalance.scene.models import Disc, Scene

_PIECES: Final = 1000
"""Of the table of an imported chamber, at least."""
_PLACES: Final = np.arange(1, 8) / 8
"""Within a piece, at which the table is compared."""


def even_table(nodes: FloatArray, value: FloatArray) -> tuple[HermiteTable, FloatArray]:
    """A table through equally spaced fills, and its expanded uncertainty (95 %) between them, at each."""
    start, stop = float(nodes[0]), float(nodes[-1])
    table = table_from_samples(start=start, stop=stop, value=value)
    coarse = table_from_samples(start=start, stop=stop, value=value[::2])
    # Twice the step at worst triples the error; half of what the coarse table misses is on the safe side.
    missed = float(np.max(np.abs(coarse(nodes) - value)))
    return table, np.full(nodes.shape, missed / 2)


def pressure_table(scene: Scene, nodes: FloatArray, value: FloatArray) -> tuple[HermiteTable, FloatArray]:
    """The same for the pressure at R2, Pa; of an imported chamber with the closed form at more fills.

    Args: `nodes`: equally spaced from zero. `value`: with gravity, where that is modelled.
    """
    disc = scene.disc
    if disc.geometry is None:
        return even_table(nodes, value)
    scale = scene.liquid.density * scene.rotor.speed**2 / 2
    squares, error = _samples(disc, nodes.size, float(nodes[-1]))
    every = (squares.size - 1) // (nodes.size - 1)
    change, missed = even_table(nodes, value - scale * squares[::every])
    fine = np.linspace(0.0, float(nodes[-1]), squares.size)
    table = table_from_samples(start=0.0, stop=float(nodes[-1]), value=scale * squares + change(fine))
    return table, scale * error + missed


@lru_cache(maxsize=16)
def _samples(disc: Disc, count: int, largest: float) -> tuple[FloatArray, FloatArray]:
    """R2^2 - a^2, m^2, at equally spaced fills, and what a table of it misses about every one of `count`."""
    every = -(-_PIECES // (count - 1))
    fills = np.linspace(0.0, largest, every * (count - 1) + 1)
    squares = _square(disc, fills)
    table = table_from_samples(start=0.0, stop=largest, value=squares)
    between = fills[:-1, None] + np.diff(fills)[:, None] * _PLACES
    missed = np.abs(table(between) - _square(disc, between)).reshape(count - 1, -1).max(axis=1)
    return squares, np.maximum(np.append(missed[:1], missed), np.append(missed, missed[-1:]))


def _square(disc: Disc, fills: FloatArray) -> FloatArray:
    return head_square(disc=disc, surface_radius=surface_radius(disc=disc, fill_ratio=fills))
