"""Tables of the tube's loss for the law: u/sqrt(head) over the eighth root of the head."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Final

import numpy as np
import numpy.typing as npt

from ringbalance.physics.tube.loss import corrected_state
from ringbalance.reduced_model.pieces.table import Table, TableColumn, knots_of, pieces_of, spline, table_at
from ringbalance.reduced_model.tube.path import crest_head, reversed_tube
from ringbalance.scene.arrays import FloatArray, plain
from ringbalance.scene.describe import scene_fault
from ringbalance.scene.designs import Designs
from ringbalance.scene.faults import Fault, SceneError
from ringbalance.scene.models import Scene
from ringbalance.scene.toml import toml_text
from ringbalance.scene.typed_record import NotNegative

TABLE_VELOCITIES: Final = (1e-5, 1e3)
"""Range of the tables, m/s: below, the flow creeps and the head is proportional to u; above, to u^2."""
_SAMPLES: Final = 2049
"""Number of possible knots; more would only sharpen the kink where the flow turns turbulent."""
_NOMINAL_KNOTS: Final = 257
SHARE, BACK_SHARE = 3, 5
"""Columns of the whole tube's table with the share lost up to the crest, each followed by its slope: from the
driven chamber, and from the opposite one."""
_OF_TOLERANCE: Final = 1e-7
"""Largest relative error of a velocity between knots, over the scene's tolerance."""
_FINEST_TOLERANCE: Final = 1e-5
"""Tolerance below which the number of knots stays the same."""
_OF_SHARES: Final = 1000.0
"""Allowed relative error of a share over that of a velocity: a share decides on the regime only."""
_OF_HEAD: Final = 2.0
"""Largest ratio of a head's relative error to that of the velocity that it drives."""
_NEWTON_STEPS: Final = 30
_ROUND_OFF: Final = 1e-15
_LEVELLED: Final = 0.05
"""Largest fall of ln(head) that is levelled: a few percent, less than model errors change a head by."""
_RISE: Final = 1e-9
"""Slope d ln(head)/d ln u of a levelled head, too small for the tables to resolve."""


@dataclass(frozen=True, kw_only=True, eq=False)
class TubeHeads:
    """Heads of the full tube in tables for `point`, over the eighth root of a head, (m/s)^(1/4)."""

    siphon: Table
    """Table of (k + 1) u^2/2, between the chambers: u/sqrt(head), and with a crest the share
    (alpha + k_up)/(k + 1) of the head that is lost up to it; where the way back differs, its share too."""
    hump: Table | None
    """Table of (alpha + k_up) u^2/2, from the driven chamber to the lowest pressure on the path, at the end
    of the crest's arc or just behind it: u/sqrt(head); None without a crest."""
    return_hump: Table | None
    """Table as `hump` from the opposite chamber, for reverse flow; None: an equal one, or no crest."""
    interpolation_error: NotNegative = 0.0
    """Largest relative error of a head between knots; zero where it was not checked."""

    @classmethod
    def nominal(cls, designs: Designs) -> tuple[TubeHeads, ...]:
        """Heads of every design, on few knots.

        The knots lie at the same velocities in every scene, so that their error, below 1e-4 of a head, is
        smooth in the scene's values.  Where sampled or fitted model errors make a head fall, it is levelled.
        Raises: ValueError: as `TubeHeads.of`. SceneError: a head that falls without such errors.
        """
        log_u = _places(_NOMINAL_KNOTS)
        lost = [_Lost.of(log_u[:, None], value) for value in _sampled(designs.scene, log_u, falls=np.inf)]
        tables = []
        # A head that is equal in all designs has a single column.
        shape = log_u.size, designs.size
        for way, columns in _columns(lost, 0.0):
            stored = [np.broadcast_to(values, shape) for each in columns for values in each.stored]
            rows = np.stack(stored).transpose(2, 0, 1).reshape(designs.size, -1)
            roots = np.broadcast_to(way.root, shape).T
            tables.append([Table(knots=x, columns=row) for x, row in zip(roots, rows, strict=True)])
        return tuple(map(cls._of_tables, zip(*tables, strict=True)))

    @classmethod
    def of(cls, scene: Scene) -> TubeHeads:
        """Tabulate the heads of a scene's tube, on as many knots as its tolerance asks for.

        Raises: ValueError: arcs of bends longer than the tube. SceneError: a head that falls.
        Source: definition of k; the crest's energy balance with the profile's kinetic-energy factor alpha.
        """
        log_u = _places(2 * _SAMPLES - 1)
        lost = [_Lost.of(log_u, value[:, 0]) for value in _sampled(scene, log_u)]
        columns = _columns(lost, _OF_TOLERANCE * max(scene.tolerance, _FINEST_TOLERANCE))
        heads = cls._of_tables(
            [table_at(way.root, knots_of(way.root, each, shortest=2), each) for way, each in columns]
        )
        missed = [
            table.quintic(e.root) / e.over_root - 1.0 for e, table in zip(lost, heads.tables, strict=False)
        ]
        return replace(heads, interpolation_error=_OF_HEAD * float(np.max(np.abs(missed))))

    @classmethod
    def _of_tables(cls, tables: Sequence[Table]) -> TubeHeads:
        siphon, *ways = tables
        hump, back = (*ways, None, None)[:2]
        return cls(siphon=siphon, hump=hump, return_hump=back)

    @property
    def tables(self) -> tuple[Table, ...]:
        """Tables of the whole tube, and of the ways to a crest, in the order of `point`."""
        return tuple(each for each in (self.siphon, self.hump, self.return_hump) if each is not None)

    def to_crest(self, *, reverse: bool) -> Table | None:
        """Table of the head from the giving chamber to the crest; None without a crest."""
        return self.return_hump or self.hump if reverse else self.hump

    def velocity(self, head: npt.ArrayLike, table: Table | None = None) -> FloatArray:
        """Velocity of a full tube under heads of at least zero, m/s. Args: `table`: default `siphon`."""
        root, table = np.sqrt(np.sqrt(np.sqrt(np.asarray(head, dtype=np.float64)))), table or self.siphon
        slower = np.minimum(root / table.knots[0], 1.0) ** 4
        return np.asarray(root**4 * table.quintic(root) * slower)


@dataclass(frozen=True, kw_only=True)
class _Lost:
    """One head over samples of the velocity; arrays of one shape."""

    root: FloatArray
    """s, the eighth root of the head."""
    over_root: FloatArray
    """u/s^4."""
    log_head: FloatArray
    slope: FloatArray
    """d ln(head)/d(ln u)."""
    curvature: FloatArray
    """Derivative of `slope` by ln u."""

    @classmethod
    def of(cls, log_u: FloatArray, log_head: FloatArray) -> _Lost:
        """Derive a head by ln u; shapes (samples, 1) and (samples, 1 or designs), or both (samples,)."""
        at = np.ravel(log_u)
        curve = spline(at, log_head)
        slope, curvature = curve(at, nu=1), curve(at, nu=2)
        rise = np.diff(log_head, axis=0) / np.diff(log_u, axis=0)
        steepest = np.maximum(np.concatenate([rise[:1], rise]), np.concatenate([rise, rise[-1:]]))
        # The spline of a nearly level head may fall, but every head must have a single velocity.
        falls = slope < steepest / 3
        return cls(
            root=np.exp(log_head / 8),
            over_root=np.exp(log_u - log_head / 2),
            log_head=log_head,
            slope=np.where(falls, steepest / 3, slope),
            curvature=np.where(falls, 0.0, curvature),
        )

    def ratio(self, allowed: float) -> TableColumn:
        """Column of u/s^4 over s, by the derivatives of ln u over ln s."""
        ratio, rise = self.over_root, 8 / self.slope - 4
        turn = -64 * self.curvature / self.slope**3
        slope, curvature = ratio * rise / self.root, ratio * (rise * (rise - 1) + turn) / self.root**2
        return TableColumn(value=ratio, allowed=allowed * ratio, derivatives=(slope, curvature))

    def share(self, way: _Lost, allowed: float) -> TableColumn:
        """Column of the share of this head that is lost on the way to the crest, over s."""
        share = np.exp(way.log_head - self.log_head)
        slope = share * (way.slope / self.slope - 1) * 8 / self.root
        return TableColumn(value=share, allowed=_OF_SHARES * allowed * share, derivatives=(slope,))


def _columns(lost: list[_Lost], allowed: float) -> list[tuple[_Lost, list[TableColumn]]]:
    """Each head with the columns of its table; the way back to the crest only where it differs."""
    siphon, *ways = lost
    alike = len(ways) == 2 and np.array_equal(ways[0].root, ways[1].root)
    ways = ways[:1] if alike else ways
    columns = [siphon.ratio(allowed), *(siphon.share(way, allowed) for way in ways)]
    return [(siphon, columns), *((way, [way.ratio(allowed)]) for way in ways)]


def _places(count: int) -> FloatArray:
    """Evenly spaced ln u over `TABLE_VELOCITIES`."""
    start, stop = (float(v) for v in np.log(TABLE_VELOCITIES))
    return np.linspace(start, stop, count)


def velocities_of(table: Table) -> FloatArray:
    """Velocities at the knots of a table of heads, m/s."""
    return np.asarray(table.knots**4 * table.column(0))


def roots_of(table: Table, velocity: npt.ArrayLike) -> FloatArray:
    """Eighth roots of the heads that velocities above zero lose, (m/s)^(1/4).

    Args: `velocity`: m/s; for a stack of tables of shape (tables, n).
    """
    velocity = np.asarray(velocity, dtype=np.float64)
    knots, at = np.atleast_2d(table.knots), np.atleast_2d(velocities_of(table))
    u = velocity.reshape(len(knots), -1)
    tables, coefficients = np.arange(len(knots))[:, None], table.quintics.reshape(len(knots), 6, -1)
    slowest, fastest = at[:, :1], at[:, -1:]
    inside = np.minimum(np.maximum(u, slowest), fastest)
    piece = pieces_of(at, inside)
    low, high = knots[tables, piece], knots[tables, piece + 1]
    start, end = at[tables, piece], at[tables, piece + 1]
    root = low + (high - low) * (inside - start) / (end - start)
    near = np.ones((len(knots), 1), dtype=np.bool_)
    for _ in range(_NEWTON_STEPS):
        # A piece holds its end, the first one its start, too.
        row = piece - ((root == low) & (piece > 0))
        c, t = coefficients[tables, :, row], root - knots[tables, row + 1]
        c0, c1, c2, c3, c4, c5 = np.moveaxis(c, -1, 0)
        ratio = c0 + t * (c1 + t * (c2 + t * (c3 + t * (c4 + t * c5))))
        slope = c1 + t * (2.0 * c2 + t * (3.0 * c3 + t * (4.0 * c4 + t * (5.0 * c5))))
        change = (inside - root**4 * ratio) / (root**3 * (4 * ratio + root * slope))
        # Each table ends its own steps, whatever tables are stacked with it.
        root = np.where(near, np.minimum(np.maximum(root + change, low), high), root)
        near &= np.any(np.abs(change) > _ROUND_OFF * root, axis=1, keepdims=True)
        if not near.any():
            break
    root = root * np.minimum(u / slowest, 1.0) ** 0.125 * np.maximum(u / fastest, 1.0) ** 0.25
    return np.asarray(root.reshape(velocity.shape))


def _inconsistent(scene: Scene) -> SceneError:
    """Error of a head that falls with growing velocity, by the scene's model errors or without any.

    A bend's friction without rotation counts in its leg; the friction added by rotation is spread along the
    path.  Where bends are nearly the whole tube, its part in a leg falls at the transition faster than the
    leg's head grows.
    """
    problem = "the tube's head does not grow with the velocity"
    if not scene.tube.model_errors:
        reason = "the arcs of its bends take so much of its length that k falls too fast at the transition"
        allowed = "a longer tube, or bends of smaller angle or radius"
        text = f"{problem}: {reason}"
        return SceneError([Fault(file=scene.file, table="tube", key="bends", problem=text, allowed=allowed)])
    fault = scene_fault(
        scene, "tube.model_errors", problem=f"with these corrections {problem}", allowed="smaller ones"
    )
    written = [
        {"cause": each.cause, "even": plain(np.mean(each.even)), "odd": plain(np.mean(each.odd))}
        for each in scene.tube.model_errors
    ]
    return SceneError([replace(fault, value=toml_text(written))])


def _sampled(scene: Scene, log_velocity: FloatArray, *, falls: float = _LEVELLED) -> list[FloatArray]:
    """`log_heads` at samples of ln u, shape (samples, designs).

    Raises: as `TubeHeads.nominal`.
    """
    places = log_velocity[:, None]
    with np.errstate(invalid="ignore", divide="ignore"):
        values = log_heads(scene, places)
    # A head that is equal in all designs may have a single column.
    if scene.tube.model_errors and all(np.all(np.isfinite(value)) for value in values):
        values = [_growing(scene, places, value, falls) for value in values]
    if not all(np.all(np.isfinite(value)) and np.all(np.diff(value, axis=0) > 0) for value in values):
        raise _inconsistent(scene)
    return values


def _growing(scene: Scene, log_velocity: FloatArray, log_head: FloatArray, falls: float) -> FloatArray:
    """Head with model errors, levelled where these make it fall a little.

    Model errors change fast where the flow turns turbulent.  The result is the largest head up to each
    velocity, rising by `_RISE` per unit of ln u, so that every head has a single velocity.
    Raises: SceneError: ln(head) falls by more than `falls`, or is not a number.
    """
    highest = np.maximum.accumulate(log_head, axis=0)
    if not np.all(highest - log_head <= falls):
        raise _inconsistent(scene)
    return highest + _RISE * log_velocity


def log_heads(scene: Scene, log_velocity: FloatArray) -> list[FloatArray]:
    """Natural logarithms of the heads: between the chambers and, with a crest, from either chamber to it."""
    tube, u = scene.tube, np.exp(log_velocity)
    state = corrected_state(scene, u)
    between = np.log((state.k + 1) / 2) + 2 * log_velocity
    if tube.hump_radius is None:
        return [between]
    back = reversed_tube(tube), replace(state, bends=state.bends[::-1])
    to_crest = (
        crest_head(scene=scene, tube=side, state=side_state, velocity=u)
        for side, side_state in ((tube, state), back)
    )
    return [between, *map(np.log, to_crest)]


def entrance_fraction(scene: Scene, u: FloatArray) -> FloatArray:
    """Fraction of the head up to the crest that is lost at the entrance, (alpha + K_ent)/(alpha + k_up).

    Args: `u`: velocities, m/s, of the designs if there are many.
    """
    state = corrected_state(scene, u)
    entrance = (state.kinetic_factor + state.terms.get("entrance", 0.0)) * u**2 / 2
    return np.asarray(entrance / crest_head(scene=scene, tube=scene.tube, state=state, velocity=u))
