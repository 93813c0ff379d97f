"""Tables as the numbers and pieces that `point` reads."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Final

import numpy as np
import numpy.typing as npt

from ringbalance.reduced_model.pieces import point
from ringbalance.reduced_model.pieces.table import Table, pieces_of
from ringbalance.scene.arrays import FloatArray

WIDTH_OF_ROW: Final = point.ALL + 1
_EDGE: Final = 1e-9


CELLS: Final = 1024
"""Number of cells of a way in a law that the program itself evaluates."""


@dataclass(frozen=True, kw_only=True)
class LawRows:
    """Numbers and rows of pieces of a law under construction; a stack of laws has a first axis."""

    ways: FloatArray
    """Rows that locate the pieces of each way's velocities, shape (..., ways, `WIDTH_OF_ROW`)."""
    edge: float = _EDGE
    """Distance from the edge of a cell, over its length, below which the next cell counts."""
    numbers: list[FloatArray]
    """Shape (..., n) each."""
    pieces: list[FloatArray] = field(default_factory=list)
    """Shape (..., pieces, `WIDTH_OF_ROW`) each."""

    @classmethod
    def of(cls, ways: int, edge: float = _EDGE, *, stack: tuple[int, ...] = ()) -> LawRows:
        """Make rows for the whole tube and the ways to a crest, without pieces; `stack`: (laws,) of many."""
        return cls(
            ways=np.zeros((*stack, ways, WIDTH_OF_ROW)), edge=edge, numbers=[np.zeros((*stack, point.PLACES))]
        )

    def add(self, *columns: FloatArray) -> None:
        """Append pieces by the columns of their rows, each of shape (..., powers, pieces)."""
        table = np.swapaxes(np.concatenate(columns, axis=-2), -1, -2)
        rows = np.zeros((*table.shape[:-1], WIDTH_OF_ROW))
        rows[..., : table.shape[-1]] = table
        self.pieces.append(rows)

    def add_cells(self, knots: FloatArray, *, cells: int) -> tuple[FloatArray, FloatArray]:
        """Append cells of equal length for the pieces added next; each holds the piece where a search begins.

        Returns: Cells per unit of x, and the position of x = 0, counted from the first of all cells.
        """
        start, end = knots[..., 0], knots[..., -1]
        offset = sum(each.shape[-1] for each in self.numbers[1:])
        first = sum(each.shape[-2] for each in (self.ways, *self.pieces))
        scale = np.asarray(cells / (end - start))
        # An x next to an edge counts as beyond it.
        beyond = np.linspace(start, end, cells + 1, axis=-1) + (2.0 * self.edge / scale)[..., None]
        self.numbers.append(first + pieces_of(knots, beyond).astype(np.float64))
        return scale, offset - start * scale + self.edge

    def add_ratios(
        self,
        way: int,
        knots: FloatArray,
        ratios: FloatArray,
        more: Sequence[npt.ArrayLike] | FloatArray,
        *,
        cells: int = CELLS,
    ) -> None:
        """Append the pieces of a way, u/sqrt(p) over the eighth root of the pressure p.

        Args: `ratios`: shape (..., 6, pieces). `more`: numbers that follow the cells in the way's row, of the
            law or of the laws.
        """
        ends = []
        for (first, second), ratio in zip(
            knots[..., :2].reshape(-1, 2).tolist(), ratios[..., 0].reshape(-1, 6), strict=True
        ):
            slowest = float(ratio @ (first - second) ** np.arange(6))
            ends.append((first**8, slowest / first**4))
        row = [*np.reshape(ends, (*knots.shape[:-1], 2)).T, knots[..., -1]]
        for column, value in enumerate([*row, *self.add_cells(knots, cells=cells), *more]):
            self.ways[..., way, column] = value
        if way == point.SIPHON:
            self.numbers[0][..., point.SHARES] = knots.shape[-1] - 1
        self.add(knots[..., None, 1:], ratios)

    def add_levels(self, levels: Table) -> None:
        """Append the hydrostatic pressure over the fill, as first table; cells end at its even knots."""
        cells = levels.knots.shape[-1] - 1
        self.numbers[0][..., point.LEVEL_SCALE] = self.add_cells(levels.knots, cells=cells)[0]
        self.add(levels.knots[..., None, 1:], levels.quintics)

    def add_way(
        self, way: int, table: Table, density: npt.ArrayLike, *, more: Sequence[npt.ArrayLike] | FloatArray
    ) -> None:
        """Append a table over the eighth root of a head, for a liquid's density, kg/m^3."""
        root, half = _powers_of(density, 0.125), _powers_of(density, 0.5)
        ratios = table.quintics / half[..., None, None] / _powers_of(root, np.arange(6))[..., None]
        self.add_ratios(way, root[..., None] * table.knots, ratios, more)

    def add_shares(self, table: Table, density: npt.ArrayLike) -> None:
        """Append the shares of the whole tube's pieces, from column 3 on of its table; see `TubeHeads`."""
        powers = _powers_of(density, 0.125 * np.arange(3))[..., None]
        length = np.diff(table.knots)
        shares = []
        for column in (3, min(5, table.count - 2)):
            # A parabola through the middle of a cubic piece and both its ends.
            value, slope, square, cube = np.moveaxis(table.cubics(column), -2, 0)
            parabola = [value, slope - cube * length**2 / 2, square - cube * length * 1.5]
            shares.append(np.stack(parabola, axis=-2) / powers)
        self.add(*shares)

    def arrays(self, scalars: Mapping[int, npt.ArrayLike]) -> tuple[FloatArray, FloatArray]:
        """Numbers, with `scalars` at their indices, and pieces of shape (..., rows, `WIDTH_OF_ROW`)."""
        numbers = np.concatenate(self.numbers, axis=-1)
        for index, value in scalars.items():
            numbers[..., index] = value
        return numbers, np.concatenate([self.ways, *self.pieces], axis=-2)


def _powers_of(bases: npt.ArrayLike, exponents: npt.ArrayLike) -> FloatArray:
    """Powers of each base, shape of bases and exponents, bit for bit as of each base alone."""
    bases = np.asarray(bases, dtype=np.float64)
    powers = [each**exponents for each in bases.ravel().tolist()]
    return np.reshape(powers, (*bases.shape, *np.shape(exponents)))
