"""The calibrated law as some four hundred numbers, from which every host answers with the same bits.

Velocity over the square root of its pressure stands as polynomials of degree five along the pressure's eighth
root, levels alike along the fill ratio, each piece as long as the tolerance allows; beside them is what
decides on regime, status and uncertainty.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Final

import numpy as np
from numpy.polynomial.polynomial import polyval

from ringbalance.export import point
from ringbalance.mesh.geometry import surface_radius
from ringbalance.reduced_model.law.calibrated_law import CalibratedLaw
from ringbalance.reduced_model.tables import HermiteTable
from ringbalance.reduced_model.tube.regime import CLEARING, TubePath
from ringbalance.scene.arrays import FloatArray
from ringbalance.scene.faults import SceneError
from ringbalance.scene.models import Scene

VELOCITIES: Final = (1e-3, 100.0)
"""m/s, that heads are tabulated for."""
TOLERANCE: Final = 1e-4
"""Of a velocity against the calibrated law."""
_OF_HEADS: Final = 0.35 * TOLERANCE
"""What of it a head takes."""
_AT_CREST: Final = 2.0
"""Gas that the flow carries out from over the crest makes up to the double of it."""
_OF_LEVELS: Final = 0.1 * TOLERANCE
"""Of the head of the slowest velocity."""
_MOST_LEVELS: Final = 16
"""Pieces; a level from a mesh that asks for more is less exact, and says so in its half-width."""
_OF_SHARE: Final = 1e-3
_OF_CHAMBER: Final = 2e-6
"""Of the largest squared radius and moment."""
_OF_WIDTHS: Final = 0.08
"""Of a half-width, and a tenth of that of the largest one."""
_OF_MOMENT_WIDTH: Final = 0.1
_SAMPLES: Final = 2001
_CELLS: Final = 8
"""Of equal length, each of which knows at which piece to begin looking."""
_EDGE: Final = 1e-9
"""Of a cell, by which rounding may not lead before the first."""
_DRAWN: Final = 4000
"""Conditions in which the finished law is compared with the calibrated one."""


@dataclass(frozen=True, kw_only=True)
class Answer:
    """What the law says of one query."""

    velocity: float
    """m/s, positive out of the driven chamber."""
    uncertainty: float
    """Expanded (95 %), m/s; the error of tabulation is part of it."""
    regime: int
    """Value of `Regime`."""
    status: int
    """0 ok, 1 extrapolated, 2 blocked, 3 undecided, 4 invalid: not a number, or no possible pressure."""
    primed: bool
    """Whether the tube holds a continuous column afterwards."""


@dataclass(frozen=True, kw_only=True)
class CompactLaw:
    """The law of one scene in numbers that `point` reads."""

    scene: str
    """File that it was calibrated from."""
    constants: tuple[float, ...]
    """At the places that `point` names."""
    pieces: tuple[tuple[float, ...], ...]
    """Rows of nine numbers, likewise."""
    head_error: float
    """Largest relative error of a velocity for a given head against the calibrated law."""
    level_error: float
    """Largest error of a level's pressure, Pa; part of its half-width."""
    departure: float = 0.0
    """Largest relative difference of a velocity from the calibrated law's, in drawn conditions."""

    @property
    def size(self) -> int:
        """Of all numbers, bytes."""
        return 8 * (len(self.constants) + sum(map(len, self.pieces)))

    @property
    def max_fill_ratio(self) -> float:
        """Liquid of the pair as a share of one chamber's volume."""
        return self.constants[point.LARGEST_FILL]

    def answer(
        self,
        *,
        fill_ratio: float,
        opposite_fill_ratio: float | None = None,
        gas_pressure: float,
        primed: bool = False,
    ) -> Answer:
        """Answer one query; nothing is refused, the status says what the answer is worth.

        Args: as `FlowLaw.evaluate`.
        """
        opposite = self.max_fill_ratio - fill_ratio if opposite_fill_ratio is None else opposite_fill_ratio
        query = [0.0] * point.PLACES_OF_QUERY
        query[:4] = fill_ratio, opposite, gas_pressure, float(primed)
        point.answer(self.constants, self.pieces, query, True)
        velocity, width, regime, status, after = query[point.VELOCITY : point.PRIMED_AFTER + 1]
        return Answer(
            velocity=velocity,
            uncertainty=width,
            regime=int(regime),
            status=int(status),
            primed=after != 0.0,
        )


def compact_law(*, scene: Scene, law: CalibratedLaw) -> CompactLaw:
    """Tabulate a calibrated law again, on as few knots as `TOLERANCE` allows.

    Args: `scene`: whose law it is; its chamber gives the free surface.
    Raises: SceneError: a scene with inputs that were fitted together, whose effect such a law does not hold.
    """
    if law.variants:
        raise SceneError.of_file(
            scene.file,
            "inputs were fitted together: the compact form of its law would miss their uncertainty",
            "a scene without [fitted]",
        )
    builder = _Builder(numbers=[0.0] * point.PLACES, rows=[])
    missed = _add_tube(builder, law)
    level_error = _add_levels(builder, law)
    _add_chamber(builder, scene, law)
    for at, value in _scalars(law, missed).items():
        builder.numbers[at] = float(value)
    made = CompactLaw(
        scene=scene.file,
        constants=tuple(builder.numbers),
        pieces=tuple(map(tuple, builder.rows)),
        head_error=missed,
        level_error=level_error,
    )
    return replace(made, departure=_departure(made, law))


def _departure(made: CompactLaw, law: CalibratedLaw) -> float:
    """Over fills of both chambers, pressures of six decades and both states of the tube."""
    drawn, top = np.random.default_rng(0), law.max_fill_ratio
    fill, opposite = drawn.uniform(0.0, top, (2, _DRAWN))
    pressure, worst = 10 ** drawn.uniform(2, 8, _DRAWN), 0.0
    for primed in (False, True):
        right = law.evaluate(
            fill_ratio=fill, opposite_fill_ratio=opposite, gas_pressure=pressure, primed=primed
        ).velocity
        for at in np.flatnonzero((np.abs(right) > VELOCITIES[0]) & (np.abs(right) < VELOCITIES[1])):
            answer = made.answer(
                fill_ratio=float(fill[at]),
                opposite_fill_ratio=float(opposite[at]),
                gas_pressure=float(pressure[at]),
                primed=primed,
            )
            worst = max(worst, abs(answer.velocity / float(right[at]) - 1.0))
    return worst


def _scalars(law: CalibratedLaw, missed: float) -> dict[int, float]:
    path, inputs = law.path, law.inputs
    by_density, by_speed = inputs.relative_density**2, (2 * inputs.relative_speed) ** 2
    return {
        point.LARGEST_FILL: law.max_fill_ratio,
        point.AMBIENT: law.ambient_pressure,
        point.GAS_FACTOR: law.gas_factor,
        point.PORT: path.port_pressure,
        point.CREST: path.crest,
        point.COLUMN: path.column_pressure,
        point.TRAPPED: path.trapped,
        point.VAPOUR: path.vapour_pressure,
        point.RELEASED: path.released,
        point.CAVITY_KNOWN: path.cavity_fitted,
        point.OF_DENSITY: by_density,
        point.OF_BLOWN: by_density + inputs.relative_gas_pressure**2,
        point.OF_SPEED: by_speed,
        point.OF_GAS: inputs.relative_gas_pressure**2,
        point.OF_CREST: inputs.hump_pressure**2 + inputs.vapour_pressure**2,
        point.OF_LIQUID: by_density + by_speed,
        point.TABULATION: (_AT_CREST * missed) ** 2,
        point.LOWEST: VELOCITIES[0],
        point.HIGHEST: VELOCITIES[1],
    }


@dataclass(frozen=True, kw_only=True)
class _Column:
    """A quantity over samples, as polynomials."""

    value: FloatArray
    """Shape (samples,)."""
    allowed: FloatArray
    """Largest error, shape (samples,)."""
    degree: int = point.C5 - point.C0

    def polynomial(self, x: FloatArray, first: int, last: int) -> FloatArray:
        """Coefficients in (x - end)/length from the samples between two, both of which are met.

        The samples are those next to the extrema of a Chebyshev polynomial.
        """
        extrema = (1 - np.cos(np.pi * np.arange(self.degree + 1) / self.degree)) / 2
        at = np.unique(np.rint(first + (last - first) * extrema).astype(int))
        t = (x[at] - x[last]) / (x[last] - x[first])
        found = np.linalg.solve(np.vander(t, increasing=True), self.value[at])
        return np.pad(found, (0, self.degree + 1 - at.size))

    def errors(self, x: FloatArray, first: int, last: int) -> FloatArray:
        """Of one piece, at the samples that it spans."""
        inside = slice(first, last + 1)
        t = (x[inside] - x[last]) / (x[last] - x[first])
        return np.asarray(polyval(t, self.polynomial(x, first, last)) - self.value[inside])

    def largest(self, x: FloatArray, ends: list[int], of: FloatArray | float = 1.0) -> float:
        """Error of all pieces. Args: `of`: what it is relative to, at the samples."""
        scale = np.broadcast_to(of, x.shape)
        return max(float(np.max(np.abs(self.errors(x, a, b) / scale[a : b + 1]))) for a, b in pairwise(ends))


@dataclass(frozen=True, kw_only=True)
class _Builder:
    """The law's numbers and pieces, as far as they are."""

    numbers: list[float]
    rows: list[list[float]]

    def add(self, x: FloatArray, ends: list[int], columns: Sequence[_Column], *, ended: bool = True) -> None:
        """Pieces in powers of the distance from their ends, and these before them if they are asked for."""
        for first, last in pairwise(ends if columns else ()):
            row = [float(x[last])] if ended else []
            for column in columns:
                powers = (x[last] - x[first]) ** np.arange(column.degree + 1)
                row += (column.polynomial(x, first, last) / powers).tolist()
            self.rows.append([*row, *[0.0] * (point.WIDTH_SLOPE + 1 - len(row))])

    def add_cells(self, x: FloatArray, ends: list[int]) -> tuple[float, float]:
        """Cells for the pieces that are added next. Returns: cells for one of x, and the place of x = 0."""
        scale = _CELLS / (x[-1] - x[0])
        place = len(self.numbers)
        for edge in np.linspace(x[0], x[-1], _CELLS + 1)[:-1]:
            self.numbers.append(float(len(self.rows) + np.searchsorted(x[ends[1:]], edge, side="right")))
        self.numbers.append(float(len(self.rows) + len(ends) - 2))
        return float(scale), float(place - x[0] * scale + _EDGE)


def _add_levels(builder: _Builder, law: CalibratedLaw) -> float:
    """The hydrostatic pressure over the fill ratio. Returns: its largest error, Pa."""
    table = law.hydrostatic_pressure
    # Every node of the law's table is a sample, so that a table with few nodes is met exactly.
    parts = max(1, round(_SAMPLES / (table.value.size - 1)))
    x = np.linspace(0.0, law.max_fill_ratio, parts * (table.value.size - 1) + 1)
    slowest = float(np.exp(law.heads.head(np.log(VELOCITIES[0])))) * law.density
    level = _Column(value=table(x), allowed=np.full_like(x, _OF_LEVELS * slowest))
    width = _half_width(np.maximum(law.hydrostatic_pressure_uncertainty(x), 0.0))
    while len(ends := _ends(x, [level, width])) > _MOST_LEVELS + 1:
        level = replace(level, allowed=2 * level.allowed)
    error = level.largest(x, ends)
    cells = builder.add_cells(x, ends)
    builder.numbers[point.LEVEL_SCALE], builder.numbers[point.LEVEL_CELLS] = cells
    builder.add(x, ends, [level, replace(width, value=np.hypot(width.value, error))])
    return error


def _add_chamber(builder: _Builder, scene: Scene, law: CalibratedLaw) -> None:
    """Squared radius of the free surface, moment and its half-width over the fill ratio."""
    x = np.linspace(0.0, law.max_fill_ratio, _SAMPLES)
    columns = []
    for value in (surface_radius(disc=scene.disc, fill_ratio=x) ** 2, law.moment.chamber_moment(x)):
        allowed = np.full_like(x, _OF_CHAMBER * float(np.max(np.abs(value))))
        columns.append(_Column(value=value, allowed=allowed, degree=2))
    columns.append(_half_width(np.maximum(law.moment.half_width(x), 0.0), _OF_MOMENT_WIDTH))
    ends = _ends(x, columns)
    cells = builder.add_cells(x, ends)
    builder.numbers[point.CHAMBER_SCALE], builder.numbers[point.CHAMBER_CELLS] = cells
    builder.add(x, ends, columns)


def _add_tube(builder: _Builder, law: CalibratedLaw) -> float:
    """Velocities over pressures. Returns: their largest relative error."""
    heads, log_u = law.heads, np.log(np.geomspace(*VELOCITIES, _SAMPLES))
    ways = [way for way in (heads.hump_head, heads.return_hump_head) if way is not None]
    if len(ways) == 2 and np.array_equal(ways[0].value, ways[1].value):
        del ways[1]
    builder.numbers[point.WAY_BACK] = float(len(ways))
    builder.rows.extend([] for _ in range(1 + len(ways)))
    beside = [_share(heads.head, way, log_u, degree=3 - at) for at, way in enumerate(ways)]
    if ways:
        beside.insert(1, _half_width(np.hypot(heads.fraction_uncertainty(log_u), _OF_SHARE)))
    columns = _velocities(law, heads.head, heads.uncertainty(log_u), log_u)
    missed = [_add_velocities(builder, point.SIPHON, *columns, beside)]
    for at, way in enumerate(ways, start=point.THERE):
        columns = _velocities(law, way, heads.hump_uncertainty(log_u), log_u)
        missed.append(_add_velocities(builder, at, *columns))
        builder.rows[at] += [*law.path.clearing_velocities, *_carried(law.path)]
    return max(missed)


def _carried(path: TubePath) -> tuple[float, float]:
    """Factor of the velocity, and what is taken from it, for how far it carries gas out."""
    low, high = CLEARING
    froude = path.froude_velocity * (high - low)
    return (1.0 / froude, low / (high - low)) if froude else (0.0, -1.0)


def _velocities(
    law: CalibratedLaw, head: HermiteTable, loss: FloatArray, log_u: FloatArray
) -> tuple[FloatArray, list[_Column]]:
    """Eighth root of the pressure; velocity over its square root, and squared half-width of the loss."""
    log_pressure = head(log_u) + np.log(law.density)
    ratio = np.exp(log_u - log_pressure / 2)
    return np.exp(log_pressure / 8), [_Column(value=ratio, allowed=_OF_HEADS * ratio), _half_width(loss**2)]


def _add_velocities(
    builder: _Builder, way: int, x: FloatArray, columns: list[_Column], beside: Sequence[_Column] = ()
) -> float:
    """Pieces of one way with those beside them, and its own row. Returns: their largest relative error."""
    ends = _ends(x, [*columns, *beside])
    scale, cells = builder.add_cells(x, ends)
    builder.add(x, ends, columns)
    builder.add(x, ends, beside, ended=False)
    lowest, ratio = float(x[0]), columns[0]
    builder.rows[way] = [lowest**8, float(ratio.value[0]) / lowest**4, float(x[-1]), scale, cells]
    if way == point.SIPHON:
        builder.rows[way] += [float(len(ends) - 1), 0.0, 0.0, 0.0]
    return ratio.largest(x, ends, of=ratio.value)


def _share(head: HermiteTable, way: HermiteTable, log_u: FloatArray, *, degree: int) -> _Column:
    """Part of the pressure that is lost up to the crest."""
    share = np.exp(way(log_u) - head(log_u))
    return _Column(value=share, allowed=_OF_SHARE * share, degree=degree)


def _half_width(value: FloatArray, of: float = _OF_WIDTHS) -> _Column:
    allowed = of * (value + 0.1 * float(np.max(value))) + 1e-300
    return _Column(value=value, allowed=allowed, degree=1)


def _ends(x: FloatArray, columns: Sequence[_Column]) -> list[int]:
    """Samples at which pieces meet, each piece as long as its errors allow, and those at both ends."""

    def fits(first: int, last: int) -> bool:
        inside = slice(first, last + 1)
        return all(
            bool(np.all(np.abs(column.errors(x, first, last)) <= column.allowed[inside]))
            for column in columns
        )

    ends = [0]
    while ends[-1] < x.size - 1:
        ends.append(_furthest(lambda last: fits(ends[-1], last), ends[-1] + 1, x.size - 1))
    return ends


def _furthest(fits: Callable[[int], bool], low: int, high: int) -> int:
    """By halving; the lowest is taken to fit."""
    while low < high:
        middle = (low + high + 1) // 2
        low, high = (middle, high) if fits(middle) else (low, middle - 1)
    return low
