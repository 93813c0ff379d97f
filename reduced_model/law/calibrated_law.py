"""Calibrated flow law, from a chamber's free surface and the tube's loss, and moment of a chamber pair."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import Any, Final

import numpy as np
import numpy.typing as npt

from ringbalance.reduced_model.law.flow_law import (
    FILL_SLACK,
    Conditions,
    Flow,
    Regime,
    checked_conditions,
    law_text,
    save_record,
)
from ringbalance.reduced_model.law.half_widths import HalfWidths
from ringbalance.reduced_model.pieces import point
from ringbalance.reduced_model.pieces.query import answer
from ringbalance.reduced_model.pieces.rows import LawRows
from ringbalance.reduced_model.pieces.table import Table
from ringbalance.reduced_model.tube.heads import TubeHeads, roots_of, velocities_of
from ringbalance.reduced_model.tube.regime import CLEARING, TubeEnds, TubePath, priming_pressure
from ringbalance.scene.arrays import BoolArray, ComplexArray, FloatArray, IntArray
from ringbalance.scene.models import HumpGas
from ringbalance.scene.registry import registered
from ringbalance.scene.typed_record import NotNegative, Positive

WIDTH: Final = 3
"""Column of `CalibratedMoment.along` that holds the expanded uncertainty of U."""
_Answers = tuple[FloatArray, IntArray, BoolArray, FloatArray]
_FEW_POINTS: Final = 500
"""Number of points up to which plain Python is faster than loading the compiled code."""


@dataclass(frozen=True, kw_only=True, eq=False)
class CalibratedMoment:
    """Moments of one chamber: U(x) along its middle, W(x) across it; a pair has U(x_A) - U(x_C), W alike."""

    along: Table
    """Table over the fill ratio of U, kg m, its slope, curvature and expanded uncertainty (95 %), kg m; the
    last covers numerical and interpolation errors and left-out terms."""
    across: Table | None = None
    """W, kg m, over the fill ratio, in the sense of the rotation; None for a symmetric chamber."""

    def chamber_moment(self, fill_ratio: npt.ArrayLike) -> FloatArray:
        """U, kg m."""
        return self.along.quintic(fill_ratio)

    def half_width(self, fill_ratio: npt.ArrayLike) -> FloatArray:
        """Expanded uncertainty (95 %) of U, kg m."""
        return self.along.straight(fill_ratio, WIDTH)

    def pair_moment(self, *, fill_ratio: npt.ArrayLike, opposite_fill_ratio: npt.ArrayLike) -> FloatArray:
        return np.asarray(self.chamber_moment(fill_ratio) - self.chamber_moment(opposite_fill_ratio))

    def pair_vector(self, *, fill_ratio: npt.ArrayLike, opposite_fill_ratio: npt.ArrayLike) -> ComplexArray:
        axial = self.pair_moment(fill_ratio=fill_ratio, opposite_fill_ratio=opposite_fill_ratio)
        if self.across is None:
            return np.asarray(axial, dtype=np.complex128)
        transverse = self.across.quintic(fill_ratio) - self.across.quintic(opposite_fill_ratio)
        return np.asarray(axial + 1j * transverse)


@dataclass(frozen=True, kw_only=True, eq=False)
class CalibratedLaw:
    """Flow of the tube for any fills, gas pressure and history: blocked, siphon, separated or reverse.

    The velocity is continuous in fills and pressure, except where the physics jumps: when a column separates
    at rest, and when a chamber's liquid leaves the port open.  The arithmetic is that of `point`, interpreted
    for a few points and compiled for many, bit for bit alike.

    `table()` holds `log_velocity` (ln m/s), `log_head`, `log_hump_head` and `log_return_hump_head`
    (ln m^2/s^2; the last two only with a crest), `fill_ratio`, `hydrostatic_pressure` (Pa), and, of shape
    (1,), `density`, `port_pressure`, `hump_pressure` (only with a crest), `vapour_pressure` (gauge, Pa), and
    `released` and `froude_velocity` (m/s) of `TubePath`.
    """

    name: str
    """ "calibrated"."""
    max_fill_ratio: Positive
    """Liquid of the pair as a fraction of one chamber's volume."""
    ambient_pressure: NotNegative
    """Absolute, Pa."""
    chamber_volume: Positive
    """V, m^3."""
    tube_area: Positive
    """S, m^2."""
    levels: Table
    """Table over the fill ratio of `hydrostatic_pressure`, Pa, with slope and curvature."""
    path: TubePath
    """Path of the tube, with its radii as pressures."""
    heads: TubeHeads
    """Loss of the tube."""
    moment: CalibratedMoment
    """Moment of a pair that goes with this law."""
    gas_factor: Positive = 1.0
    """Gas pressure on the liquid over that at the point of measurement; all arguments are the latter."""

    half_widths: HalfWidths | None = None
    """Expanded uncertainties (95 %); None: half-widths are zero, and no regime is undecided."""

    def __repr__(self) -> str:
        return law_text(self)

    @property
    def density(self) -> float:
        return self.path.density

    @cached_property
    def constants(self) -> tuple[FloatArray, FloatArray]:
        """Numbers and pieces, all that `point` needs to answer a query."""
        numbers, pieces = constants_of([self])
        return numbers[0], pieces[0]

    def with_gas_factor(self, gas_factor: float) -> CalibratedLaw:
        """Copy the law with another `gas_factor`."""
        copy = replace(self, gas_factor=gas_factor)
        numbers, pieces = self.constants
        numbers = numbers.copy()
        numbers[point.GAS_FACTOR] = gas_factor
        vars(copy)["constants"] = numbers, pieces
        return copy

    def carrying_pressures(self, table: Table) -> FloatArray:
        """Pressures at which the flow clears half, none and all of the gas from the crest, Pa."""
        return _carrying_pressures(table, self.density, self.path.froude_velocity)

    def scalars(self) -> dict[int, float]:
        """Scalars of the law by their index in the numbers of `point`."""
        path, heads = self.path, self.heads
        slowest, fastest = velocities_of(heads.siphon)[[0, -1]]
        carry, carry_from = _carried_by(path)
        return {
            point.LARGEST_FILL: self.max_fill_ratio,
            point.AMBIENT: self.ambient_pressure,
            point.LEAST_PRESSURE: -self.ambient_pressure,
            point.GAS_FACTOR: self.gas_factor,
            point.PORT: path.port_pressure,
            point.CREST: path.crest,
            point.COLUMN: path.column_pressure,
            point.TRAPPED: path.trapped,
            point.VAPOUR: path.vapour_pressure,
            point.RELEASED: path.released,
            point.LOWEST: slowest,
            point.HIGHEST: fastest,
            point.WAY_BACK: float(len(heads.tables) - 1),
            point.CARRY: carry,
            point.CARRY_FROM: carry_from,
        }

    @cached_property
    def _lists(self) -> tuple[list[float], FloatArray, Any]:
        """Numbers, cells and pieces in the form that `answer` reads in plain Python."""
        numbers, pieces = self.constants
        return numbers[: point.PLACES].tolist(), numbers[point.PLACES :], _LazyRows(pieces)

    def evaluate(
        self,
        *,
        fill_ratio: npt.ArrayLike,
        opposite_fill_ratio: npt.ArrayLike | None = None,
        gas_pressure: npt.ArrayLike,
        primed: npt.ArrayLike = False,
    ) -> Flow:
        opposite = opposite_fill_ratio
        if opposite is None and isinstance(fill_ratio, _NUMBER):
            opposite = self.max_fill_ratio - fill_ratio
        if self._is_plain(fill_ratio, opposite, gas_pressure, primed):
            query = self._answer(fill_ratio, opposite, gas_pressure, primed)
            return Flow(
                velocity=np.asarray(query[point.VELOCITY]),
                regime=np.asarray(int(query[point.REGIME])),
                uncertainty=np.zeros(()),
                primed=np.asarray(query[point.PRIMED_AFTER] != 0.0),
            )
        conditions = checked_conditions(self, fill_ratio, opposite_fill_ratio, gas_pressure, primed)
        shape = conditions[0].shape
        # Copies: read-only arrays would be another type to compile for.
        x, y, p = (np.array(each).ravel() for each in conditions[:3])
        flat = x, y, p, np.array(conditions[3]).ravel()
        velocity, regime, after, margin = self._answers(flat)
        width = np.zeros_like(velocity)
        if self.half_widths is not None:
            width, regime = self._widened(flat, velocity, regime, margin)
        return Flow(
            velocity=velocity.reshape(shape),
            regime=regime.reshape(shape),
            uncertainty=width.reshape(shape),
            primed=after.reshape(shape),
        )

    def _is_plain(self, x: Any, y: Any, p: Any, primed: Any) -> bool:
        """True for four plain numbers within range, and a law without half-widths."""
        most = self.max_fill_ratio + FILL_SLACK
        return (
            isinstance(x, _NUMBER)
            and isinstance(y, _NUMBER)
            and isinstance(p, _NUMBER)
            and isinstance(primed, _TRUTH)
            and -FILL_SLACK <= x <= most
            and -FILL_SLACK <= y <= most
            and -self.ambient_pressure <= p <= point.GREATEST_PRESSURE
            and self.half_widths is None
        )

    def _answer(self, x: Any, y: Any, p: Any, primed: Any) -> list[float]:
        """A query of `point` with its answer."""
        query = [float(x), float(y), float(p), float(primed), *_REST_OF_QUERY]
        numbers, cells, pieces = self._lists
        answer(numbers, cells, pieces, pieces, query)
        return query

    def _answers(self, conditions: Conditions) -> _Answers:
        """Velocity, regime, primed afterwards and margin over the crest of n queries."""
        n = conditions[0].size
        answers = np.empty(n), np.empty(n, dtype=np.int64), np.empty(n, dtype=np.bool_), np.empty(n)
        if n > _FEW_POINTS:
            answer_each = registered("function", "answer_each")
            answer_each(*self.constants, conditions, np.zeros(point.PLACES_OF_QUERY), answers)
            return answers
        queries = [
            self._answer(*query) for query in zip(*(values.tolist() for values in conditions), strict=True)
        ]
        for column, index in zip(answers, _ANSWER, strict=True):
            column[...] = [query[index] for query in queries]
        return answers

    def _widened(
        self, conditions: Conditions, velocity: FloatArray, regime: IntArray, margin: FloatArray
    ) -> tuple[FloatArray, IntArray]:
        """Half-widths of velocities, m/s, and regimes, undecided where the margin lies within its half-width.

        The half-widths are those with the rest of the pair's liquid opposite.  For another opposite fill, a
        full tube takes those at the wall pressure that gives the same driving pressure.
        """
        assert self.half_widths is not None
        fill, opposite, pressure, primed = conditions
        wall, rest, opposite_wall = map(
            self.hydrostatic_pressure, (fill, self.max_fill_ratio - fill, opposite)
        )
        back = np.maximum(rest, self.path.port_pressure) - np.maximum(opposite_wall, self.path.port_pressure)
        wall = self.gas_factor * pressure + wall + np.where(regime == Regime.SEPARATED, 0.0, back)
        width, of_margin = self.half_widths.at(fill, wall, primed)
        width = np.where(velocity == 0, 0.0, np.hypot(width, self.heads.interpolation_error * velocity))
        opened = self.path.crest & (velocity > 0) & (np.abs(margin) < of_margin)
        return width, np.where(opened, int(Regime.UNDECIDED), regime)

    def hydrostatic_pressure(self, fill_ratio: npt.ArrayLike) -> FloatArray:
        """Pressure of a chamber's liquid at the outer radius R2, rho omega^2 (R2^2 - a^2)/2, Pa."""
        return self.levels.quintic(fill_ratio)

    def ends(
        self,
        *,
        fill_ratio: npt.ArrayLike,
        opposite_fill_ratio: npt.ArrayLike | None = None,
        gas_pressure: npt.ArrayLike = 0.0,
    ) -> TubeEnds:
        """Pressures at the tube's ends for flow out of the driven chamber; not checked."""
        x = np.asarray(fill_ratio, dtype=np.float64)
        y = self.max_fill_ratio - x if opposite_fill_ratio is None else opposite_fill_ratio
        gas, upstream, downstream = np.broadcast_arrays(
            self.gas_factor * np.asarray(gas_pressure, dtype=np.float64),
            np.maximum(self.hydrostatic_pressure(x), 0.0),
            np.maximum(self.hydrostatic_pressure(y), 0.0),
        )
        return TubeEnds(
            upstream_gas=gas,
            downstream_gas=np.zeros_like(gas),
            upstream_hydrostatic=upstream,
            downstream_hydrostatic=downstream,
        )

    def priming_pressure(
        self,
        *,
        fill_ratio: npt.ArrayLike,
        opposite_fill_ratio: npt.ArrayLike | None = None,
        hump_gas: HumpGas,
    ) -> FloatArray | None:
        """Gas pressure that lifts liquid over the crest of an unprimed tube, with `hump_gas` there.

        Returns: Gauge pressure, Pa, of the broadcast shape; None without a crest.
        Source: `regime.priming_pressure`. For the liquid-ring paper's disc a crest at 31.5 mm gives its 0.54
            MPa, vented with the driven chamber nearly empty or trapped at equal fills: an inference, because
            the paper does not say what its figure means.
        """
        if not self.path.crest:
            return None
        path = replace(self.path, trapped=hump_gas == "trapped")
        ends = self.ends(fill_ratio=fill_ratio, opposite_fill_ratio=opposite_fill_ratio)
        return np.asarray(priming_pressure(path, ends)) / self.gas_factor

    def holds(self, fill_ratio: float) -> bool | None:
        """True if a chamber keeps its liquid with the gas off, against a chamber with less.

        None: undecided, as in `TubePath.holds`.
        """
        return self.path.holds(max(float(self.hydrostatic_pressure(fill_ratio)), 0.0))

    def table(self) -> Mapping[str, FloatArray]:
        siphon, path = self.heads.siphon, self.path
        velocity = velocities_of(siphon)
        ways = {"log_hump_head": self.heads.to_crest(reverse=False)}
        ways["log_return_hump_head"] = self.heads.to_crest(reverse=True)
        scalars = (
            "density",
            "port_pressure",
            "hump_pressure",
            "vapour_pressure",
            "released",
            "froude_velocity",
        )
        values = {name: getattr(path, name) for name in scalars}
        return (
            {"log_velocity": np.log(velocity), "log_head": 8 * np.log(siphon.knots)}
            | {name: 8 * np.log(roots_of(way, velocity)) for name, way in ways.items() if way is not None}
            | {"fill_ratio": self.levels.knots.copy(), "hydrostatic_pressure": self.levels.column(0).copy()}
            | {name: np.array([value]) for name, value in values.items() if value is not None}
        )

    def save(self, path: Path | str) -> Path:
        return save_record(path=Path(path), record=self)


def constants_of(laws: Sequence[CalibratedLaw], *, clearing: bool = True) -> tuple[FloatArray, FloatArray]:
    """`CalibratedLaw.constants` of laws with equally many ways and knots, stacked on a first axis.

    Args: `clearing`: false: as if no flow cleared the gas, for `cleared_laws`.
    """
    siphon, *ways = (Table.stacked(each) for each in zip(*(law.heads.tables for law in laws), strict=True))
    density = np.array([law.density for law in laws])
    froude = np.array([law.path.froude_velocity if clearing else 0.0 for law in laws])
    rows = LawRows.of(1 + len(ways), stack=(len(laws),))
    rows.add_levels(Table.stacked([law.levels for law in laws]))
    for row, way in enumerate((siphon, *ways)):
        rows.add_way(row, way, density, more=_carrying_pressures(way, density, froude).T)
        if ways and row == point.SIPHON:
            rows.add_shares(siphon, density)
    scalars = [law.scalars() for law in laws]
    return rows.arrays({index: [values[index] for values in scalars] for index in scalars[0]})


def cleared_laws(laws: Sequence[CalibratedLaw], froude_velocities: Sequence[float]) -> list[CalibratedLaw]:
    """Copy laws with equally many ways and knots, with other Froude velocities.

    Args: `froude_velocities`: `TubePath.froude_velocity` of each copy, m/s.
    """
    density = np.array([law.density for law in laws])
    tables = [Table.stacked(each) for each in zip(*(law.heads.tables for law in laws), strict=True)]
    ways = [_carrying_pressures(each, density, np.array(froude_velocities)) for each in tables]
    copies = []
    for law, froude, *pressures in zip(laws, froude_velocities, *ways, strict=True):
        copy = replace(law, path=replace(law.path, froude_velocity=froude))
        numbers, pieces = (each.copy() for each in law.constants)
        pieces[: len(ways), [point.HALF, point.NONE, point.ALL]] = pressures
        numbers[[point.CARRY, point.CARRY_FROM]] = _carried_by(copy.path)
        vars(copy)["constants"] = numbers, pieces
        copies.append(copy)
    return copies


def _carrying_pressures(table: Table, density: npt.ArrayLike, froude: npt.ArrayLike) -> FloatArray:
    """Pressures at which flows clear half, none and all of the gas from the crest, Pa; also of a stack."""
    low, high = CLEARING
    velocities = np.multiply.outer(froude, [(low + high) / 2, low, high])
    if not np.any(velocities):
        return velocities
    return np.asarray(np.asarray(density)[..., None] * roots_of(table, velocities) ** 8)


class _LazyRows(dict[int, list[float]]):
    """Rows of an array as lists, each made at its first use: a few queries need few of them."""

    def __init__(self, pieces: FloatArray) -> None:
        super().__init__()
        self.pieces = pieces

    def __missing__(self, row: int) -> list[float]:
        self[row] = self.pieces[row].tolist()
        return self[row]


def _carried_by(path: TubePath) -> tuple[float, float]:
    """Constants a, s/m, and b of a u - b, the position of a flow's Froude number in `CLEARING`, 0 to 1."""
    low, high = CLEARING
    froude = path.froude_velocity * (high - low)
    return (1.0 / froude, low / (high - low)) if froude else (0.0, -1.0)


_NUMBER: Final = (float, int)
_TRUTH: Final = (bool, np.bool_)
_REST_OF_QUERY: Final = [0.0] * (point.PLACES_OF_QUERY - 4)
_ANSWER: Final = (point.VELOCITY, point.REGIME, point.PRIMED_AFTER, point.MARGIN)
