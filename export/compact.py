"""The calibrated law as some four hundred numbers, from which every host answers with the same bits.

Velocity over the square root of the head stands as cubic Hermite pieces along the head's eighth root, levels
as quintic ones along the fill ratio, with knots where the tolerance asks for them; beside them is what
decides on regime, status and uncertainty.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Final

import numpy as np
from scipy.interpolate import BPoly, CubicHermiteSpline

from ringbalance.mesh.geometry import surface_radius
from ringbalance.reduced_model.law import point
from ringbalance.reduced_model.law.calibrated_law import CalibratedLaw
from ringbalance.reduced_model.law.table import Column, Table, knots_of, largest_error, table_at
from ringbalance.reduced_model.tube.heads import TubeHeads, roots_of
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
    heads, missed = _heads(law.heads)
    levels, level_error = _levels(law)
    compact = replace(law, heads=heads, levels=levels)
    row = compact.constants_with({point.CHAMBER: _chamber(scene, law)})
    return CompactLaw(
        scene=scene.file,
        constants=tuple(row.tolist()),
        head_error=missed,
        level_error=level_error,
        departure=_departure(compact, law),
    )


def _departure(compact: CalibratedLaw, law: CalibratedLaw) -> float:
    """Over fills of both chambers, pressures of six decades and both states of the tube."""
    drawn, top = np.random.default_rng(0), law.max_fill_ratio
    fill, opposite = drawn.uniform(0.0, top, (2, _DRAWN))
    pressure, primed = 10 ** drawn.uniform(2, 8, _DRAWN), drawn.integers(0, 2, _DRAWN) > 0
    right, found = (
        each.evaluate(
            fill_ratio=fill, opposite_fill_ratio=opposite, gas_pressure=pressure, primed=primed
        ).velocity
        for each in (law, compact)
    )
    inside = (np.abs(right) > VELOCITIES[0]) & (np.abs(right) < VELOCITIES[1])
    return float(np.max(np.abs(found[inside] / right[inside] - 1.0), initial=0.0))


def _heads(heads: TubeHeads) -> tuple[TubeHeads, float]:
    """On fewer knots. Returns: also the largest relative error of a velocity for a given head."""
    ways = [table for table in (heads.siphon, heads.hump, heads.return_hump) if table is not None]
    made = [_coarser(table) for table in ways]
    missed = max(error for _, error in made) + heads.interpolation_error / 2
    return TubeHeads.with_ways(*(table for table, _ in made), error=_AT_CREST * missed), missed


def _coarser(table: Table) -> tuple[Table, float]:
    """A table over the eighth root of a head, and its largest error of a velocity."""
    slowest, fastest = roots_of(table, VELOCITIES)
    s = np.geomspace(slowest, fastest, _SAMPLES)
    columns = [_smooth(table, 1, s, _OF_HEADS), _half_width(table.straight(s, point.LOSS_COLUMN))]
    shares = range(point.SHARE_COLUMN, table.columns.size // table.knots.size, 2)
    if shares:
        columns.append(_half_width(table.straight(s, point.SHARE_WIDTH_COLUMN) + _OF_SHARE))
        columns += [_smooth(table, number, s, _OF_SHARE) for number in shares]
    knots = knots_of(s, columns)
    return table_at(s, knots, columns), largest_error(s, columns[0], knots, relative=True)


def _smooth(table: Table, number: int, s: FloatArray, allowed: float) -> Column:
    """Args: `allowed`: relative error."""
    curve = CubicHermiteSpline(table.knots, table.column(number), table.column(number + 1))
    return Column(value=curve(s), allowed=allowed * curve(s), slope=curve(s, nu=1))


def _levels(law: CalibratedLaw) -> tuple[Table, float]:
    """The hydrostatic pressure over the fill ratio, and its largest error, Pa."""
    table, curve = law.levels, _quintic(law.levels)
    # Every knot of the law's table is a sample, so that a table with few knots is met exactly.
    parts = max(1, round(_SAMPLES / (table.knots.size - 1)))
    x = np.linspace(0.0, law.max_fill_ratio, parts * (table.knots.size - 1) + 1)
    slowest = float(roots_of(law.heads.siphon, VELOCITIES[0])) ** 8 * law.density
    level = Column(
        value=curve(x), allowed=_OF_LEVELS * slowest, slope=curve(x, nu=1), curvature=curve(x, nu=2)
    )
    width = np.maximum(law.hydrostatic_pressure_uncertainty(x), 0.0)
    while (knots := knots_of(x, [level, _half_width(width)])).size > _MOST_LEVELS:
        level = replace(level, allowed=2 * np.asarray(level.allowed))
    error = largest_error(x, level, knots)
    widened = replace(_half_width(width), value=np.hypot(width, error))
    return table_at(x, knots, [level, widened]), error


def _quintic(table: Table) -> BPoly:
    """The first three columns."""
    return BPoly.from_derivatives(table.knots, np.stack([table.column(i) for i in (1, 2, 3)], axis=1))


def _chamber(scene: Scene, law: CalibratedLaw) -> Table:
    """Squared radius of the free surface, moment and its half-width over the fill ratio."""
    x = np.linspace(0.0, law.max_fill_ratio, _SAMPLES)
    square, moment = surface_radius(disc=scene.disc, fill_ratio=x) ** 2, _quintic(law.moment.along)
    columns = [
        Column(
            value=square,
            allowed=_OF_CHAMBER * float(np.max(square)),
            slope=np.gradient(square, x, edge_order=2),
        ),
        Column(
            value=moment(x), allowed=_OF_CHAMBER * float(np.max(np.abs(moment(x)))), slope=moment(x, nu=1)
        ),
        _half_width(np.maximum(law.moment.half_width(x), 0.0)),
    ]
    return table_at(x, knots_of(x, columns), columns)


def _half_width(value: FloatArray) -> Column:
    return Column(value=value, allowed=_OF_WIDTHS * (value + 0.1 * float(np.max(value))) + 1e-300)
