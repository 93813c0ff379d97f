"""Tables as the numbers and pieces that `point` reads."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Final

import numpy as np
import numpy.typing as npt

from ringbalance.reduced_model.pieces import point
from ringbalance.reduced_model.pieces.table import Table
from ringbalance.scene.arrays import FloatArray

WIDTH_OF_ROW: Final = point.WIDTH_SLOPE + 1
_EDGE: Final = 1e-9


CELLS: Final = 1024
"""Of a law inside the program."""


@dataclass(frozen=True, kw_only=True)
class LawRows:
    """The law's numbers and rows of pieces, as far as they are."""

    ways: FloatArray
    """Rows that say where velocities are found, shape (ways, `WIDTH_OF_ROW`)."""
    edge: float = _EDGE
    """Of a cell, by which what lies next to the edge of a cell is taken to be in the next one."""
    numbers: list[FloatArray] = field(default_factory=lambda: [np.zeros(point.PLACES)])
    pieces: list[FloatArray] = field(default_factory=list)

    @classmethod
    def of(cls, ways: int, edge: float = _EDGE) -> LawRows:
        """With nothing but room for the whole tube and the ways to a crest."""
        return cls(ways=np.zeros((ways, WIDTH_OF_ROW)), edge=edge)

    def add(self, *columns: npt.ArrayLike) -> None:
        """Pieces as columns of what stands in a row, each of shape (pieces,) or (powers, pieces)."""
        whole = np.concatenate([np.atleast_2d(np.asarray(each, dtype=np.float64)) for each in columns])
        rows = np.zeros((whole.shape[1], WIDTH_OF_ROW))
        rows[:, : len(whole)] = whole.T
        self.pieces.append(rows)

    def add_cells(self, knots: FloatArray, *, cells: int) -> tuple[float, float]:
        """Cells for the pieces that are added next, equally long, that say at which piece to begin looking.

        Returns: Cells for one of x, and the place of x = 0, counted from the first of all cells.
        """
        start, place = float(knots[0]), sum(each.size for each in self.numbers[1:])
        first = sum(map(len, (self.ways, *self.pieces)))
        edges = np.linspace(start, float(knots[-1]), cells + 1)
        scale = cells / (float(knots[-1]) - start)
        # What is next to an edge counts as beyond it.
        beyond = edges + 2.0 * self.edge / scale
        self.numbers.append(first + np.searchsorted(knots[1:-1], beyond).astype(np.float64))
        return scale, place - start * scale + self.edge

    def add_ratios(
        self,
        way: int,
        knots: FloatArray,
        ratios: FloatArray,
        squares: FloatArray,
        more: Sequence[float],
        *,
        cells: int = CELLS,
    ) -> None:
        """Pieces of a way: velocity over the root of a pressure, along the eighth root of that.

        Args: `ratios`: shape (6, pieces). `squares`: of half-widths of the loss, shape (2, pieces). `more`:
            behind the cells in the way's own row.
        """
        first = float(knots[0])
        slowest = float(ratios[:, 0] @ (first - float(knots[1])) ** np.arange(6))
        row = [first**8, slowest / first**4, float(knots[-1]), *self.add_cells(knots, cells=cells), *more]
        self.ways[way, : len(row)] = row
        self.add(knots[1:], ratios, squares)

    def add_levels(self, levels: Table) -> None:
        """Hydrostatic pressure over the fill, with its half-width in column 3.

        The first that is added. Its knots are equally spaced, and cells end there.
        """
        self.numbers[0][point.LEVEL_SCALE] = self.add_cells(levels.knots, cells=levels.knots.size - 1)[0]
        self.add(levels.knots[1:], levels.quintics, levels.lines(levels.column(3)))

    def add_way(self, way: int, table: Table, density: float, *, error: float, more: Sequence[float]) -> None:
        """A table over the eighth root of a head, of a liquid's density, kg/m^3; its loss in column 3.

        Args: `error`: relative, of a velocity; part of the half-width.
        """
        root = density**0.125
        ratios = table.quintics / density**0.5 / root ** np.arange(6)[:, None]
        exponent = 0.5 + table.knots * table.column(1) / table.column(0) / 8
        squares = table.lines(table.column(3) ** 2 + (error / exponent) ** 2) / np.array([[1.0], [root]])
        self.add_ratios(way, root * table.knots, ratios, squares, more)

    def add_shares(self, table: Table, density: float) -> None:
        """Beside the pieces of the whole tube: from column 4 on, see `TubeHeads`."""
        powers, length = density ** (0.125 * np.arange(3))[:, None], np.diff(table.knots)
        shares = []
        for column in (5, min(7, table.count - 2)):
            # A parabola through the middle of a cubic piece and both its ends.
            value, slope, square, cube = table.cubics(column)
            shares.append(
                np.array([value, slope - cube * length**2 / 2, square - cube * length * 1.5]) / powers
            )
        self.add(*shares, table.lines(table.column(4)) / powers[:2])

    def arrays(self, scalars: Mapping[int, float]) -> tuple[FloatArray, FloatArray]:
        """Numbers, with those of the law at their places, and pieces, shape (rows, `WIDTH_OF_ROW`)."""
        numbers = np.concatenate(self.numbers)
        numbers[list(scalars)] = list(scalars.values())
        return numbers, np.concatenate([self.ways, *self.pieces])
