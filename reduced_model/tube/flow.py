"""Flow through the tubes of one scene or of many designs, each velocity solved from the loss itself."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from functools import partial
from typing import Final, TypeVar

import numpy as np

from ringbalance.physics.gas import applied_pressure, pressure_factor, vented_pressure
from ringbalance.physics.tube.loss import corrected_state
from ringbalance.reduced_model.chamber.values import chamber_pressure
from ringbalance.reduced_model.tube.path import crest_head
from ringbalance.reduced_model.tube.regime import (
    CLEARING_UNCERTAINTY,
    RELEASED,
    ColumnFlow,
    TubeEnds,
    TubePath,
    column_flow,
)
from ringbalance.scene.arrays import BoolArray, FloatArray, IntArray, plain
from ringbalance.scene.designs import Designs
from ringbalance.scene.fitted import CAVITY_ERROR, CLEARING_ERROR
from ringbalance.scene.models import Scene
from ringbalance.scene.uncertain import NORMAL_95

Radius = TypeVar("Radius", float, FloatArray)
_LEAST, _MOST = np.log(1e-9), np.log(1e6)
"""Bounds of ln u for the search of velocities, u in m/s."""
_NODES: Final = np.linspace(-8.0, 0.2, 22)
"""ln u of the nodes for starting values, relative to the velocity whose head takes the whole pressure."""
_COMMON: Final = 18
"""Index of the node near which most velocities lie."""
_SLOPES: Final = (0.3, 5.0)
"""Smallest and largest d ln(head)/d ln u at the nodes; the former also of a step of the search."""
_STEEPEST_SLOPE: Final = 50.0
"""Largest d ln(head)/d ln u of a step of the search, within a transition."""
_HEAD_ERROR: Final = 1e-6
"""Relative error of a head below which one last step follows, which leaves about a thousandth of it."""
_LEAST_STEP: Final = 1e-14
_STEPS: Final = 80


def tube_path(scene: Scene) -> TubePath:
    """Radii of the tube as pressures of a column that reaches from there to the outer radius R2.

    Source: p(r) = rho omega^2 r^2/2 of liquid at rest in the rotating frame.
    """
    hump, error = scene.tube.hump_radius, scene.tube.model_error
    crest = 0.0 if hump is None else hump
    froude = 1 + CLEARING_UNCERTAINTY * error(CLEARING_ERROR) / NORMAL_95
    # With dissolved gas the uncertainty spans the whole range of the cavity's pressure.
    released = plain(np.clip(RELEASED * (1 + error(CAVITY_ERROR) / NORMAL_95), 0.0, 1.0))
    return TubePath(
        density=scene.liquid.density,
        port_pressure=column_pressure(scene=scene, radius=scene.tube.port_radius),
        hump_pressure=None if hump is None else column_pressure(scene=scene, radius=hump),
        trapped=scene.tube.hump_gas == "trapped",
        vapour_pressure=scene.liquid.vapour_pressure - vented_pressure(scene),
        released=released if scene.liquid.dissolved_gas == "saturated" else 0.0,
        froude_velocity=froude * abs(scene.rotor.speed) * plain(np.sqrt(crest * scene.tube.bore)),
    )


def column_pressure(*, scene: Scene, radius: Radius) -> Radius:
    """Pressure of a liquid column from a radius r to the outer radius, rho omega^2 (R2^2 - r^2)/2, Pa.

    Source: Eq. 11 of the liquid-ring paper, integrated.
    """
    outer = scene.disc.outer_radius
    # The factors keep full relative accuracy for a film of a micrometre, where R2^2 - r^2 cancels.
    return scene.liquid.density * scene.rotor.speed**2 * ((outer - radius) * (outer + radius)) / 2


def column_radius(*, scene: Scene, pressure: float) -> float:
    """Inner radius of the column that a pressure at the outer radius supports, m; zero beyond the axis."""
    pull = scene.liquid.density * scene.rotor.speed**2 / 2
    return math.sqrt(max(scene.disc.outer_radius**2 - pressure / pull, 0.0))


@dataclass(frozen=True, kw_only=True, eq=False)
class _Inverse:
    """ln u over ln(head), in cubic pieces between nodes, for starting values of roots; shape (nodes, n)."""

    log_velocity: FloatArray
    log_head: FloatArray
    slope: FloatArray
    """d ln(head)/d ln u."""

    @classmethod
    def through(cls, log_velocity: FloatArray, log_head: FloatArray) -> _Inverse:
        chord = np.diff(log_head, axis=0) / np.diff(log_velocity, axis=0)
        inner = (chord[1:] + chord[:-1]) / 2
        slope = np.clip(np.concatenate([chord[:1], inner, chord[-1:]]), *_SLOPES)
        return cls(log_velocity=log_velocity, log_head=log_head, slope=slope)

    def take(self, rows: IntArray) -> _Inverse:
        return _Inverse(**{name: table[:, rows] for name, table in vars(self).items()})

    def through_head(self, node: int, log_head: FloatArray) -> _Inverse:
        """Scale the heads of each design by the factor that gives `log_head` at a node."""
        return replace(self, log_head=self.log_head + (log_head - self.log_head[node]))

    def __call__(self, log_head: FloatArray) -> tuple[FloatArray, FloatArray]:
        """ln u and d ln(head)/d ln u at a head."""
        last = self.log_head.shape[0] - 2
        cell = np.clip(np.count_nonzero(self.log_head < log_head, axis=0) - 1, 0, last)
        column = np.arange(log_head.size)
        y0, y1, x0, x1, m0, m1 = (
            table[at, column]
            for table in (self.log_head, self.log_velocity, self.slope)
            for at in (cell, cell + 1)
        )
        width = y1 - y0
        t = (log_head - y0) / width
        inside = np.clip(t, 0.0, 1.0)
        back = 1 - inside
        x = back**2 * ((1 + 2 * inside) * x0 + inside * width / m0)
        x = x + inside**2 * ((1 + 2 * back) * x1 - back * width / m1)
        slope = m0 * back + m1 * inside
        return x + (t - inside) * width / slope, slope


def _log_heads(scene: Scene, log_velocity: FloatArray) -> list[FloatArray]:
    """ln of the head between the chambers and, with a crest, of that up to it, over ln u."""
    u = np.exp(log_velocity)
    state = corrected_state(scene, u)
    heads = [np.asarray(np.log((state.k + 1) / 2) + 2 * log_velocity)]
    if scene.tube.hump_radius is not None:
        heads.append(np.log(crest_head(scene=scene, tube=scene.tube, state=state, velocity=u)))
    return heads


@dataclass(frozen=True, eq=False)
class Waves:
    """Unmodelled effects on the chambers' liquid, as a factor on its levels."""

    fill_ratio: FloatArray
    """Fill ratios of the nodes of `share`."""
    share: FloatArray
    """Relative expanded uncertainty (95 %) of the level at each node."""
    deviation: FloatArray
    """Error of each of n designs, in standard deviations."""

    def take(self, rows: IntArray) -> Waves:
        """Select the waves of some of the designs."""
        return replace(self, deviation=self.deviation[rows])

    def factor(self, fill_ratio: FloatArray) -> FloatArray:
        """Factor on the level at fills, whose last axis runs over the designs."""
        share = np.interp(fill_ratio, self.fill_ratio, self.share)
        return 1.0 + self.deviation / NORMAL_95 * share


@dataclass(frozen=True, eq=False)
class TubeFlow:
    """The tubes of designs; arrays of shape (n,)."""

    designs: Designs
    path: TubePath
    gas_factor: FloatArray | float
    between: _Inverse
    """Velocity over the head between the chambers."""
    to_crest: _Inverse | None = None
    """Velocity over the head from the driven chamber to the lowest pressure at a crest; None without one."""
    waves: Waves | None = field(default=None, kw_only=True)
    """Error of the chambers' levels; None: no error."""
    curve: Callable[[FloatArray], FloatArray] | None = field(default=None, kw_only=True)
    """Level over the fill ratio with gravity, Pa, of a single scene; None: the closed form."""

    @classmethod
    def of(
        cls,
        designs: Designs,
        *,
        waves: Waves | None = None,
        curve: Callable[[FloatArray], FloatArray] | None = None,
    ) -> TubeFlow:
        """Make the tubes of designs, with the nodes for starting values of roots."""
        scene, path, factor = designs.scene, tube_path(designs.scene), pressure_factor(designs.scene)
        highest = factor * np.abs(applied_pressure(scene.gas)) + chamber_pressure(
            scene=scene, fill_ratio=scene.disc.max_fill_ratio
        )
        fastest = np.log(2 * np.maximum(highest, 1.0) / path.density * np.ones(designs.size)) / 2
        log_velocity = fastest + _NODES[:, None]
        heads = [_Inverse.through(log_velocity, head) for head in _log_heads(scene, log_velocity)]
        return cls(designs, path, factor, *heads, waves=waves, curve=curve)

    def of_neighbours(self, designs: Designs, rows: IntArray) -> TubeFlow:
        """Make the tubes of designs that differ little from some of these, with starting values by these."""
        log_velocity = self.between.log_velocity[_COMMON, rows]
        tables = (self.between, self.to_crest) if self.to_crest else (self.between,)
        pairs = zip(tables, _log_heads(designs.scene, log_velocity), strict=True)
        heads = [table.take(rows).through_head(_COMMON, head) for table, head in pairs]
        return TubeFlow(designs, tube_path(designs.scene), pressure_factor(designs.scene), *heads)

    def take(self, rows: IntArray) -> TubeFlow:
        """Select the tubes of some of the designs."""
        if rows.size == self.designs.size:
            return self
        part = self.designs.take(rows)
        tables = (self.between, self.to_crest) if self.to_crest else (self.between,)
        heads = [table.take(rows) for table in tables]
        waves = None if self.waves is None else self.waves.take(rows)
        return TubeFlow(part, tube_path(part.scene), pressure_factor(part.scene), *heads, waves=waves)

    def level(self, fill_ratio: FloatArray) -> FloatArray:
        """Hydrostatic pressure of a chamber's liquid at the outer radius, Pa, with the error of `waves`."""
        if self.curve is not None:
            # A level of an empty chamber rounded below zero would leave a port on the wall open.
            return np.maximum(self.curve(fill_ratio), 0.0)
        level = chamber_pressure(scene=self.designs.scene, fill_ratio=fill_ratio)
        return level if self.waves is None else level * self.waves.factor(fill_ratio)

    def ends(self, level: FloatArray, opposite: FloatArray, *, driven: bool = True) -> TubeEnds:
        """Pressures at the tube's ends, Pa, for levels of both chambers. Args: `driven`: with the gas on."""
        gas = self.gas_factor * applied_pressure(self.designs.scene.gas) if driven else 0.0
        return TubeEnds(
            upstream_gas=gas + 0 * level,
            downstream_gas=0 * level,
            upstream_hydrostatic=level,
            downstream_hydrostatic=opposite,
        )

    def flow(
        self, ends: TubeEnds, *, primed: bool | BoolArray, exactly: bool = True
    ) -> ColumnFlow[FloatArray]:
        """Flow out of the driven chambers. Args: `exactly`: to 1e-9 of a head, else to about a hundredth."""
        return column_flow(
            self.path,
            ends,
            primed=primed,
            siphon=partial(self.velocity, to_crest=False, exactly=exactly),
            separation=partial(self.velocity, to_crest=True, exactly=exactly),
        )

    def velocity(
        self, pressure: FloatArray, where: BoolArray, *, to_crest: bool, exactly: bool = True
    ) -> FloatArray:
        """Velocity under a pressure difference, m/s; zero where the second argument is false."""
        head, inverse = pressure / self.path.density, self.to_crest if to_crest else self.between
        assert inverse is not None
        flows = where & (head > 0)
        target = np.log(np.where(flows, head, 1.0))
        log_velocity, slope = inverse(target)
        if exactly:
            log_head = partial(self.log_head, to_crest=to_crest)
            log_velocity = growing_root(log_head, target, log_velocity, slope, flows)
        return np.where(flows, np.exp(log_velocity), 0.0)

    def log_head(
        self, rows: IntArray, *, to_crest: bool, lowest: bool = True
    ) -> Callable[[FloatArray], FloatArray]:
        """ln of the head, m^2/s^2, over ln u, of some designs: between the chambers, or up to the crest."""
        scene = self.designs.scene if rows.size == self.designs.size else self.designs.take(rows).scene

        def head(log_velocity: FloatArray) -> FloatArray:
            u = np.exp(log_velocity)
            state = corrected_state(scene, u)
            if to_crest:
                return np.log(
                    crest_head(scene=scene, tube=scene.tube, state=state, velocity=u, lowest=lowest)
                )
            return np.asarray(np.log((state.k + 1) / 2) + 2 * log_velocity)

        return head

    def drag_coefficient(self, velocity: FloatArray) -> FloatArray:
        """k at velocities; NaN where these are zero."""
        state = corrected_state(self.designs.scene, np.where(velocity > 0, velocity, 1.0))
        return np.where(velocity > 0, state.k, np.nan)


def growing_root(
    function_of: Callable[[IntArray], Callable[[FloatArray], FloatArray]],
    target: FloatArray,
    start: FloatArray,
    slope: FloatArray,
    where: BoolArray,
) -> FloatArray:
    """Roots x of growing functions, y(x) = `target`, by safeguarded secant steps.

    Args: `function_of`: y(x) of rows with some numbers. `slope`: dy/dx near `start`. `where`: rows to solve.
    Returns: x one step after the error of y falls below 1e-6, with about a thousandth of that error left;
        every row independent of the others; `start` where `where` is false.
    """
    x, rows = start.copy(), np.flatnonzero(where)
    low, high = np.full(start.shape, _LEAST), np.full(start.shape, _MOST)
    slope, before, missed = slope.copy(), start.copy(), np.full(start.shape, np.nan)
    done = np.zeros(start.shape, dtype=np.bool_)
    function = function_of(rows)
    for _ in range(_STEPS):
        if rows.size == 0:
            break
        point = x[rows]
        miss = function(point) - target[rows]
        low[rows], high[rows] = np.where(miss < 0, point, low[rows]), np.where(miss > 0, point, high[rows])
        step = point - before[rows]
        chord = (miss - missed[rows]) / np.where(np.abs(step) > _LEAST_STEP, step, np.nan)
        slope[rows] = np.where(np.isfinite(chord), np.clip(chord, _SLOPES[0], _STEEPEST_SLOPE), slope[rows])
        following = point - miss / slope[rows]
        inside = (following > low[rows]) & (following < high[rows])
        left = (np.abs(miss) > _HEAD_ERROR) & (high[rows] - low[rows] > _LEAST_STEP)
        before[rows], missed[rows] = point, miss
        following = np.where(inside, following, np.where(left, (low[rows] + high[rows]) / 2, point))
        # A converged row stays, while others still step.
        x[rows] = np.where(done[rows], point, following)
        done[rows] |= ~left
        left = ~done[rows]
        if np.count_nonzero(left) <= rows.size / 2:
            rows = rows[left]
            function = function_of(rows)
    return x
