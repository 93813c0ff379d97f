"""The calibrated law as at most 4 kB of numbers, from which every host answers with the same bits.

Velocity over the square root of its pressure is tabulated as polynomials of degree five in the pressure's
eighth root, a chamber's hydrostatic pressure (its level) likewise in the fill ratio, each piece as long as
the tolerance allows; further numbers decide on regime and status.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Final, NamedTuple

import numpy as np
from numpy.polynomial.polynomial import polyval

from ringbalance.mesh.geometry import surface_radius
from ringbalance.reduced_model.law.calibrated_law import CalibratedLaw
from ringbalance.reduced_model.pieces import point
from ringbalance.reduced_model.pieces.query import answer
from ringbalance.reduced_model.pieces.rows import WIDTH_OF_ROW, LawRows
from ringbalance.reduced_model.pieces.table import Table
from ringbalance.reduced_model.tube.heads import BACK_SHARE, SHARE, roots_of
from ringbalance.scene.arrays import FloatArray, IntArray
from ringbalance.scene.faults import SceneError
from ringbalance.scene.models import Scene

VELOCITIES: Final = (1e-3, 100.0)
"""Range of velocities that heads are tabulated for, m/s."""
TOLERANCE: Final = 1e-4
"""Largest relative error of a velocity against the calibrated law."""
_HEAD_ERROR: Final = 0.25 * TOLERANCE
"""Relative error of a head, a part of the tolerance."""
_LEVEL_ERROR: Final = 0.2 * TOLERANCE
"""Error of a level over the pressure of the slowest velocity."""
_MAX_LEVEL_PIECES: Final = 16
"""Largest number of pieces of a level; one that needs more is less exact; the export reports its error."""
_SHARE_ERROR: Final = 5e-4
"""Relative error of the fraction of the pressure that is lost up to the crest; where it decides if a column
separates, `point` allows for more."""
_CHAMBER_ERROR: Final = 2e-6
"""Error relative to the largest squared radius and moment."""
_EASES: Final = (1.0, 1.6, 2.5, 4.0)
"""Factors on the error of heads, cubed on that of a chamber, tried in turn until there is room for enough
pieces of levels: `_MAX_LEVEL_PIECES` over the square of the factor."""
_DRAWN_EASE: Final = 8.0
"""Factor for drawn devices, of which a page holds many."""
_ROUNDING: Final = 0.2
"""Fraction of a piece's error to which coefficients are rounded: numbers of few bits make small libraries."""
_END_BITS: Final = 18
"""Number of bits to which the ends of pieces are rounded, for small libraries."""
_CELL_COUNTS: Final = (64, 128, 256)
"""Numbers of cells of equal length, tried in turn until the tolerance is met; a cell holds the piece at which
a search begins, and pieces end where cells do."""
_LEVEL_CELLS: Final = 160
MAX_BYTES: Final = 4096
"""Largest size of all numbers, bytes; levels get what the rest leaves."""
_SAMPLES_PER_CELL: Final = 10
_EDGE: Final = 1e-3
"""Margin at the edge of a cell, as a fraction of its length: more than rounding moves a value."""
_COMPARED_CONDITIONS: Final = 4000
"""Drawn conditions in which the finished law is compared with the calibrated one."""


@dataclass(frozen=True, kw_only=True)
class Answer:
    """Answer of the law to one query."""

    velocity: float
    """m/s, positive out of the driven chamber."""
    regime: int
    """Value of `Regime`."""
    status: int
    """0 ok, 1 extrapolated, 2 blocked, 4 invalid: not a number, or no possible pressure."""
    primed: bool
    """True if the tube holds a continuous column afterwards."""


class Tables(NamedTuple):
    """Tables of a law's polynomials, as `point` reads them."""

    cells: tuple[int, ...]
    """Rows at which a search begins, one byte each."""
    pieces: tuple[tuple[float, ...], ...]
    """Rows of eight numbers of single precision."""
    levels: tuple[tuple[float, ...], ...]
    """Rows of eight numbers of double precision: near a stall two levels nearly cancel."""

    @property
    def size(self) -> int:
        """Size of all numbers, bytes."""
        return len(self.cells) + 4 * sum(map(len, self.pieces)) + 8 * sum(map(len, self.levels))


@dataclass(frozen=True, kw_only=True)
class CompactLaw:
    """Law of one scene in numbers that `point` reads."""

    scene: str
    """File of the scene that the law was calibrated from."""
    constants: tuple[float, ...]
    """Constants at the indices that `point` names."""
    tables: Tables
    level_error: float
    """Largest error of a level's pressure, Pa."""
    calibrated: CalibratedLaw
    """The tabulated law, which has half-widths."""
    departure: float = 0.0
    """Largest relative difference of a velocity from the calibrated law's, in drawn conditions."""

    @property
    def size(self) -> int:
        """Size of all numbers, bytes."""
        return 8 * len(self.constants) + self.tables.size

    @property
    def max_fill_ratio(self) -> float:
        """Liquid of the pair as a fraction of one chamber's volume."""
        return self.constants[point.LARGEST_FILL]

    def answer(
        self,
        *,
        fill_ratio: float,
        opposite_fill_ratio: float | None = None,
        gas_pressure: float,
        primed: bool = False,
    ) -> Answer:
        """Answer one query; nothing is refused, the status gives the validity of the answer.

        Args: as `FlowLaw.evaluate`.
        """
        opposite = self.max_fill_ratio - fill_ratio if opposite_fill_ratio is None else opposite_fill_ratio
        query = [0.0] * point.PLACES_OF_QUERY
        query[:4] = fill_ratio, opposite, gas_pressure, float(primed)
        answer(self.constants, *self.tables, query)
        velocity, regime, status, after = query[point.VELOCITY : point.PRIMED_AFTER + 1]
        return Answer(velocity=velocity, regime=int(regime), status=int(status), primed=after != 0.0)


def compact_law(*, scene: Scene, law: CalibratedLaw, of_many: bool = False) -> CompactLaw:
    """Tabulate a calibrated law again, on as few knots as `TOLERANCE` allows.

    Args: `scene`: scene of the law; its chamber gives the free surface. `of_many`: true for one of many drawn
        devices, whose errors may be `_DRAWN_EASE` times as large and are not measured.
    Raises: SceneError: a law that does not fit into `MAX_BYTES`.
    """
    tables = law.heads.tables
    for ease in (_DRAWN_EASE,) if of_many else _EASES:
        rows, level_rows = LawRows.of(len(tables), edge=_EDGE), LawRows.of(0)
        for way, table in enumerate(tables):
            _add_way(rows, law, way, table, ease)
        _add_chamber(rows, scene, law, ease)
        before, count = map(len, rows.arrays({}))
        left = MAX_BYTES - 7 * point.PLACES - before - _LEVEL_CELLS - 1 - 4 * WIDTH_OF_ROW * count
        most = left // (8 * WIDTH_OF_ROW)
        if most * ease**2 >= _MAX_LEVEL_PIECES:
            break
    else:
        problem = f"its law does not fit into the {MAX_BYTES} bytes of its compact form"
        raise SceneError.of_file(scene.file, problem, "a tube whose loss changes less abruptly")
    level_error = _add_levels(level_rows, law, most=min(_MAX_LEVEL_PIECES, most))
    level_numbers, levels = level_rows.arrays({})
    numbers, pieces = rows.arrays(
        law.scalars()
        | {
            point.LOWEST: VELOCITIES[0],
            point.HIGHEST: VELOCITIES[1],
            point.LEVEL_SCALE: level_numbers[point.LEVEL_SCALE],
        }
    )
    constants, cells = np.split(numbers, [point.PLACES])
    # Cells of the levels come first.
    constants[point.CHAMBER_CELLS] += _LEVEL_CELLS + 1
    pieces[: len(tables), point.CELLS] += _LEVEL_CELLS + 1
    compact = CompactLaw(
        scene=scene.file,
        constants=tuple(constants.tolist()),
        tables=Tables(
            cells=tuple(map(int, (*level_numbers[point.PLACES :], *cells))),
            pieces=tuple(map(tuple, pieces.astype(np.float32).tolist())),
            levels=tuple(map(tuple, levels.tolist())),
        ),
        level_error=level_error,
        calibrated=law,
    )

    if of_many:
        return compact
    # Compared over fills of both chambers, pressures of six decades and both states of the tube.
    random, departure, size = np.random.default_rng(0), 0.0, _COMPARED_CONDITIONS
    fills, pressures = random.uniform(0.0, law.max_fill_ratio, (size, 2)), 10 ** random.uniform(2, 8, size)
    for at, ((fill, opposite), pressure) in enumerate(zip(fills.tolist(), pressures.tolist(), strict=True)):
        query = {"fill_ratio": fill, "opposite_fill_ratio": opposite, "gas_pressure": pressure}
        exact = float(law.evaluate(**query, primed=at % 2 > 0).velocity)
        if VELOCITIES[0] < abs(exact) < VELOCITIES[1]:
            velocity = compact.answer(**query, primed=at % 2 > 0).velocity
            departure = max(departure, abs(velocity / exact - 1.0))
    return replace(compact, departure=departure)


@dataclass(frozen=True, kw_only=True)
class _Piecewise:
    """Quantity at samples, approximated by piecewise polynomials."""

    value: FloatArray
    """Shape (samples,)."""
    allowed: FloatArray
    """Largest error, shape (samples,)."""
    degree: int = point.C5 - point.C0

    def polynomial(self, x: FloatArray, first: int, last: int) -> FloatArray:
        """Coefficients in powers of x - x[last] from the samples `first` to `last`, both of which are met.

        The samples are those next to the extrema of a Chebyshev polynomial.  Coefficients are rounded to
        `_ROUNDING` of the piece's error.
        """
        extrema = (1 - np.cos(np.pi * np.arange(self.degree + 1) / self.degree)) / 2
        at = np.unique(np.rint(first + (last - first) * extrema).astype(int))
        powers = (x[last] - x[first]) ** np.arange(at.size)
        t = (x[at] - x[last]) / (x[last] - x[first])
        exact = np.linalg.solve(np.vander(t, increasing=True), self.value[at]) / powers
        step = 2.0 ** np.floor(np.log2(_ROUNDING * self.allowed[first : last + 1].min() / powers))
        return np.pad(np.rint(exact / step) * step + 0.0, (0, self.degree + 1 - at.size))

    def errors(self, x: FloatArray, first: int, last: int) -> FloatArray:
        """Errors of one piece, at the samples that it spans."""
        inside = slice(first, last + 1)
        polynomial = self.polynomial(x, first, last)
        return np.asarray(polyval(x[inside] - x[last], polynomial) - self.value[inside])

    def largest(self, x: FloatArray, ends: IntArray, of: FloatArray | float = 1.0) -> float:
        """Largest error of all pieces. Args: `of`: values at the samples to which it is relative."""
        scale, pairs = np.broadcast_to(of, x.shape), pairwise(ends.tolist())
        return max(float(np.max(np.abs(self.errors(x, a, b) / scale[a : b + 1]))) for a, b in pairs)

    def pieces(self, x: FloatArray, ends: IntArray) -> FloatArray:
        """Coefficients of all pieces, shape (degree + 1, pieces)."""
        return np.transpose([self.polynomial(x, a, b) for a, b in pairwise(ends.tolist())])


def _add_levels(rows: LawRows, law: CalibratedLaw, *, most: int) -> float:
    """Add the hydrostatic pressure over the fill ratio in at most `most` pieces. Returns: error, Pa."""
    x = np.linspace(0.0, law.max_fill_ratio, _LEVEL_CELLS * _SAMPLES_PER_CELL + 1)
    slowest = float(roots_of(law.heads.siphon, VELOCITIES[0])) ** 8 * law.density
    level = _Piecewise(value=law.hydrostatic_pressure(x), allowed=np.full_like(x, _LEVEL_ERROR * slowest))
    while (ends := _ends(x, [level])).size > most + 1:
        level = replace(level, allowed=1.5 * level.allowed)
    rows.numbers[0][point.LEVEL_SCALE] = rows.add_cells(x[ends], cells=_LEVEL_CELLS)[0]
    rows.add(x[None, ends[1:]], level.pieces(x, ends))
    return level.largest(x, ends)


def _add_chamber(rows: LawRows, scene: Scene, law: CalibratedLaw, ease: float) -> None:
    """Add the squared radius of the free surface, and the moment with its half-width, by the fill."""
    cells = _CELL_COUNTS[0]
    x = _rounded(np.linspace(0.0, law.max_fill_ratio, cells * _SAMPLES_PER_CELL + 1))
    # The last piece holds the largest fill, whichever way that is rounded.
    x[-1] = np.nextafter(np.float32(law.max_fill_ratio), np.float32(1.0))
    columns = []
    for value in (surface_radius(disc=scene.disc, fill_ratio=x) ** 2, law.moment.chamber_moment(x)):
        allowed = np.full_like(x, ease**3 * _CHAMBER_ERROR * float(np.max(np.abs(value))))
        columns.append(_Piecewise(value=value, allowed=allowed, degree=2))
    ends = _ends(x, columns)
    width = np.maximum(law.moment.half_width(x), 0.0)
    widest = [np.max(width[first : last + 1]) for first, last in pairwise(ends.tolist())]
    rows.numbers[0][[point.CHAMBER_SCALE, point.CHAMBER_CELLS]] = rows.add_cells(x[ends], cells=cells)
    rows.add(x[None, ends[1:]], *(each.pieces(x, ends) for each in columns), np.array([widest]))


def _add_way(rows: LawRows, law: CalibratedLaw, way: int, table: Table, ease: float) -> None:
    """Add velocities over the eighth root of a pressure, for a siphon also fractions lost to the crest."""
    root = law.density**0.125
    slowest, fastest = roots_of(table, VELOCITIES)
    for cells in _CELL_COUNTS:
        x = _rounded(np.linspace(root * slowest, root * fastest, cells * _SAMPLES_PER_CELL + 1))
        s = np.clip(x / root, slowest, fastest)
        value = table.quintic(s) / law.density**0.5
        ratio = _Piecewise(value=value, allowed=ease * _HEAD_ERROR * value)
        shares = []
        if way == point.SIPHON and table.count > SHARE:
            # Fraction of the pressure that is lost up to the crest, forwards and backwards.
            for at in (SHARE, min(BACK_SHARE, table.count - 2)):
                share = table.cubic(s, at)
                shares.append(_Piecewise(value=share, allowed=_SHARE_ERROR * share, degree=2))
        ends = _ends(x, [ratio, *shares])
        if ratio.largest(x, ends, of=value) <= ease * _HEAD_ERROR:
            break
    rows.add_ratios(way, x[ends], ratio.pieces(x, ends), law.carrying_pressures(table), cells=cells)
    if shares:
        rows.add(*(each.pieces(x, ends) for each in shares))


def _rounded(x: FloatArray) -> FloatArray:
    """Round samples to `_END_BITS` binary digits of the largest."""
    step = 2.0 ** (np.ceil(np.log2(x[-1])) - _END_BITS)
    return np.asarray(np.rint(x / step) * step)


def _ends(x: FloatArray, columns: Sequence[_Piecewise]) -> IntArray:
    """Samples at which pieces meet, each piece as many cells long as its errors allow, and both ends."""

    def fits(first: int, last: int) -> bool:
        inside = slice(first * _SAMPLES_PER_CELL, last * _SAMPLES_PER_CELL + 1)
        return all(
            bool(np.all(np.abs(column.errors(x, inside.start, inside.stop - 1)) <= column.allowed[inside]))
            for column in columns
        )

    cells, last = [0], (x.size - 1) // _SAMPLES_PER_CELL
    while cells[-1] < last:
        # The furthest end, by bisection; one cell is taken to fit.
        low, high = cells[-1] + 1, last
        while low < high:
            middle = (low + high + 1) // 2
            low, high = (middle, high) if fits(cells[-1], middle) else (low, middle - 1)
        cells.append(low)
    return np.array(cells) * _SAMPLES_PER_CELL
