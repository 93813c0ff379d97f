"""The calibrated law as some four hundred numbers, from which every host answers with the same bits.

Velocity over the square root of the head stands as cubic Hermite pieces along the head's eighth root, levels
as quintic ones along the fill ratio, with knots where the tolerance asks for them; beside them is what
decides on regime, status and uncertainty.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Final

import numpy as np

from ringbalance.export import point
from ringbalance.mesh.geometry import surface_radius
from ringbalance.reduced_model.law.calibrated_law import CalibratedLaw
from ringbalance.reduced_model.tables import HermiteTable
from ringbalance.scene.arrays import FloatArray, IntArray
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
_MOST_LEVELS: Final = 26
"""Knots; a level from a mesh that asks for more is less exact, and says so in its half-width."""
_OF_SHARE: Final = 5e-4
_OF_CHAMBER: Final = 1e-5
"""Of the largest squared radius and moment."""
_OF_WIDTHS: Final = 0.05
"""Of a half-width, and a tenth of that of the largest one."""
_SAMPLES: Final = 2001
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
    head_error: float
    """Largest relative error of a velocity for a given head against the calibrated law."""
    level_error: float
    """Largest error of a level's pressure, Pa; part of its half-width."""
    departure: float = 0.0
    """Largest relative difference of a velocity from the calibrated law's, in drawn conditions."""

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
        point.answer(self.constants, query)
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
    row = [0.0] * point.PLACES
    level_error = _append_levels(row, law)
    _append_chamber(row, scene, law)
    missed = _append_tube(row, law)
    for at, value in _scalars(law, missed).items():
        row[at] = float(value)
    made = CompactLaw(scene=scene.file, constants=tuple(row), head_error=missed, level_error=level_error)
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
    return {
        point.LARGEST_FILL: law.max_fill_ratio,
        point.AMBIENT: law.ambient_pressure,
        point.GAS_FACTOR: law.gas_factor,
        point.DENSITY: law.density,
        point.PORT: path.port_pressure,
        point.CREST: path.crest,
        point.COLUMN: path.column_pressure,
        point.TRAPPED: path.trapped,
        point.VAPOUR: path.vapour_pressure,
        point.RELEASED: path.released,
        point.CAVITY_KNOWN: path.cavity_fitted,
        point.FROUDE: path.froude_velocity,
        point.STAYS: path.clearing_velocities[0],
        point.CLEARS: path.clearing_velocities[1],
        point.OF_DENSITY: inputs.relative_density,
        point.OF_SPEED: inputs.relative_speed,
        point.OF_GAS: inputs.relative_gas_pressure,
        point.OF_CREST: float(np.hypot(inputs.hump_pressure, inputs.vapour_pressure)),
        point.TABULATION: _AT_CREST * missed,
        point.LOWEST: VELOCITIES[0],
        point.HIGHEST: VELOCITIES[1],
    }


@dataclass(frozen=True, kw_only=True)
class _Column:
    """A quantity over samples, with derivatives by the table's x as far as its pieces need them."""

    value: FloatArray
    """Shape (samples,)."""
    allowed: FloatArray | float
    """Largest error."""
    slope: FloatArray | None = None
    """None: straight between the knots."""
    curvature: FloatArray | None = None

    @property
    def stored(self) -> tuple[FloatArray, ...]:
        return tuple(each for each in (self.value, self.slope, self.curvature) if each is not None)

    def errors(self, x: FloatArray, first: int, last: int) -> FloatArray:
        """Of one piece between two samples, at the samples that it spans."""
        ends, inside = [first, last], slice(first, last + 1)
        width = float(x[last] - x[first])
        t, y = (x[inside] - x[first]) / width, self.value[ends]
        if self.slope is None:
            return np.asarray(y[0] + t * (y[1] - y[0]) - self.value[inside])
        slope = width * self.slope[ends]
        if self.curvature is None:
            bend = 3 * (y[1] - y[0]) - 2 * slope[0] - slope[1]
            piece = slope[0] + t * (bend + t * (y[1] - y[0] - slope[0] - bend))
        else:
            half = width * width * self.curvature[ends] / 2
            rise = y[1] - y[0] - slope[0] - half[0]
            turn, bend = slope[1] - slope[0] - 2 * half[0], half[1] - half[0]
            third, fourth = 10 * rise - 4 * turn + bend, 7 * turn - 15 * rise - 2 * bend
            piece = slope[0] + t * (half[0] + t * (third + t * (fourth + t * (6 * rise - 3 * turn + bend))))
        return np.asarray(y[0] + t * piece - self.value[inside])


def _append_levels(row: list[float], law: CalibratedLaw) -> float:
    """The hydrostatic pressure over the fill ratio. Returns: its largest error, Pa."""
    table = law.hydrostatic_pressure
    # Every node of the law's table is a sample, so that a table with few nodes is met exactly.
    parts = max(1, round(_SAMPLES / (table.value.size - 1)))
    x = np.linspace(0.0, law.max_fill_ratio, parts * (table.value.size - 1) + 1)
    slowest = float(np.exp(law.heads.head(np.log(VELOCITIES[0])))) * law.density
    value, slope = table.with_slope(x)
    level = _Column(
        value=value,
        allowed=_OF_LEVELS * slowest,
        slope=slope,
        curvature=_curvature(table, x),
    )
    width = np.maximum(law.hydrostatic_pressure_uncertainty(x), 0.0)
    while (knots := _knots(x, [level, _half_width(width)])).size > _MOST_LEVELS:
        level = replace(level, allowed=2 * np.asarray(level.allowed))
    error = _largest(x, level, knots)
    _append(row, point.FILLS, x, knots, [level, replace(_half_width(width), value=np.hypot(width, error))])
    return error


def _curvature(table: HermiteTable, x: FloatArray) -> FloatArray:
    cell = np.clip(np.floor((x - table.start) / table.step), 0, table.value.size - 2).astype(int)
    t = (x - table.start) / table.step - cell
    c = table.coefficients[:, cell]
    return np.asarray((2 * c[2] + t * (6 * c[3] + t * (12 * c[4] + t * 20 * c[5]))) / table.step**2)


def _append_chamber(row: list[float], scene: Scene, law: CalibratedLaw) -> None:
    """Squared radius of the free surface, moment and its half-width over the fill ratio."""
    x = np.linspace(0.0, law.max_fill_ratio, _SAMPLES)
    square = surface_radius(disc=scene.disc, fill_ratio=x) ** 2
    moment, slope = law.moment.chamber_moment.with_slope(x)
    columns = [
        _Column(
            value=square,
            allowed=_OF_CHAMBER * float(np.max(square)),
            slope=np.gradient(square, x, edge_order=2),
        ),
        _Column(value=moment, allowed=_OF_CHAMBER * float(np.max(np.abs(moment))), slope=slope),
        _half_width(np.maximum(law.moment.half_width(x), 0.0)),
    ]
    _append(row, point.CHAMBER, x, _knots(x, columns), columns)


def _append_tube(row: list[float], law: CalibratedLaw) -> float:
    """Velocities over heads. Returns: their largest relative error."""
    heads, log_u = law.heads, np.log(np.geomspace(*VELOCITIES, _SAMPLES))
    ways = [way for way in (heads.hump_head, heads.return_hump_head) if way is not None]
    alike = len(ways) == 2 and np.array_equal(ways[0].value, ways[1].value)
    ways = ways[:1] if alike else ways
    s, ratio, by_s = _velocities(heads.head, log_u)
    columns = [ratio, _half_width(heads.uncertainty(log_u))]
    if ways:
        columns.append(_half_width(heads.fraction_uncertainty(log_u) + _OF_SHARE))
        columns += [_share(heads.head, way, log_u, by_s) for way in ways]
    tables = [(point.SIPHON, s, columns)]
    for at, way in zip((point.THERE, point.BACK), ways, strict=False):
        s, ratio, _ = _velocities(way, log_u)
        tables.append((at, s, [ratio, _half_width(heads.hump_uncertainty(log_u))]))
    missed = []
    for at, x, each in tables:
        knots = _knots(x, each)
        _append(row, at, x, knots, each)
        missed.append(_largest(x, each[0], knots, relative=True))
    row[point.BACK_SHARE] = point.SHARE_COLUMN + (0 if alike else 2)
    if alike:
        row[point.BACK : point.BACK + 2] = row[point.THERE : point.THERE + 2]
    return max(missed)


def _velocities(head: HermiteTable, log_u: FloatArray) -> tuple[FloatArray, _Column, FloatArray]:
    """Eighth root of the head, u/sqrt(head) over it, and d(ln u)/d(eighth root)."""
    value, slope = head.with_slope(log_u)
    s, ratio = np.exp(value / 8), np.exp(log_u - value / 2)
    by_s = 8 / (s * slope)
    column = _Column(value=ratio, allowed=_OF_HEADS * ratio, slope=ratio * (1 - slope / 2) * by_s)
    return s, column, by_s


def _share(head: HermiteTable, way: HermiteTable, log_u: FloatArray, by_s: FloatArray) -> _Column:
    """Part of the head that is lost up to the crest, over the eighth root of the head."""
    (whole, slope), (part, part_slope) = head.with_slope(log_u), way.with_slope(log_u)
    share = np.exp(part - whole)
    return _Column(value=share, allowed=_OF_SHARE * share, slope=share * (part_slope - slope) * by_s)


def _half_width(value: FloatArray) -> _Column:
    return _Column(value=value, allowed=_OF_WIDTHS * (value + 0.1 * float(np.max(value))) + 1e-300)


def _knots(x: FloatArray, columns: list[_Column]) -> IntArray:
    """Samples at which pieces meet, each piece as long as its errors allow."""

    def fits(first: int, last: int) -> bool:
        return all(
            bool(np.all(np.abs(column.errors(x, first, last)) <= _inside(column.allowed, first, last)))
            for column in columns
        )

    knots = [0]
    while knots[-1] < x.size - 1:
        knots.append(_furthest(lambda last: fits(knots[-1], last), knots[-1] + 1, x.size - 1))
    return np.array(knots)


def _inside(allowed: FloatArray | float, first: int, last: int) -> FloatArray | float:
    return allowed[first : last + 1] if isinstance(allowed, np.ndarray) and allowed.ndim else allowed


def _furthest(fits: Callable[[int], bool], low: int, high: int) -> int:
    """By halving; the lowest is taken to fit."""
    while low < high:
        middle = (low + high + 1) // 2
        low, high = (middle, high) if fits(middle) else (low, middle - 1)
    return low


def _largest(x: FloatArray, column: _Column, knots: IntArray, *, relative: bool = False) -> float:
    """Error of a column between its knots."""
    return max(
        float(np.max(np.abs(column.errors(x, a, b) / (column.value[a : b + 1] if relative else 1.0))))
        for a, b in pairwise(knots.tolist())
    )


def _append(row: list[float], at: int, x: FloatArray, knots: IntArray, columns: list[_Column]) -> None:
    """Put a table behind a row, and where it begins, with its number of knots, into its places."""
    row[at], row[at + 1] = float(len(row)), float(knots.size)
    row += x[knots].tolist()
    for column in columns:
        for values in column.stored:
            row += values[knots].tolist()
