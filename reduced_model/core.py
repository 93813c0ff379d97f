"""The calibration of many designs at once: arrays in, arrays out, without gravity, tables and meshes.

Chamber by closed forms, tube by its loss, regimes by `column_flow`; velocities are found on the loss itself.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Final

import numpy as np
import numpy.typing as npt

from ringbalance.mesh.geometry import chamber_volume, liquid_area
from ringbalance.physics.tube.draw_down import port_depth
from ringbalance.reduced_model.chamber.values import chamber_pressure, measured_closed_forms
from ringbalance.reduced_model.law.flow_law import Regime
from ringbalance.reduced_model.tube.flow import TubeFlow
from ringbalance.reduced_model.tube.regime import (
    ColumnFlow,
    TubeEnds,
    can_flow,
    cavity_pressure,
    priming_pressure,
    resting_pressure,
    stall_pressure,
)
from ringbalance.scene.arrays import BoolArray, FloatArray, IntArray
from ringbalance.scene.designs import Designs
from ringbalance.scene.models import Scene

_ROUNDS: Final = 60
_TOGETHER: Final = 4096
"""Designs whose arrays fit into a processor's cache."""
_STEEPEST: Final = 0.9
_GENTLE: Final = 0.1
"""dg/dx before it is known, about."""
_SAME_FILL: Final = 1e-8
"""Error of a fill, of which the last step leaves a hundredth."""
_ROUNDING: Final = 1e-12
_NOTHING: Final = 1e-9
"""Below this a fill ratio is not told from zero."""
_SCAN: Final = 17
_REFINEMENTS: Final = 6
"""Of a scan, each to a sixteenth: 1e-8 of a fill is left."""
NEARLY_EMPTY: Final = 1e-6
"""Share of a pair's liquid with which a chamber's last liquid is looked at."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Answers:
    """What a calibration answers of n designs: arrays of shape (n,), SI, NaN where one has no such thing.

    Gravity is left out.  Where an input differs between designs all that depends on it does: the coefficient
    of loss k is that at the velocity of each design, not at one velocity for all.
    """

    chamber_volume: FloatArray
    """V, m^3."""
    wall_pressure: FloatArray
    """At the largest fill, Pa."""
    moment: FloatArray
    """Of a chamber at the largest fill, kg m."""
    moment_per_mass: FloatArray
    """lambda at equal fills, per transferred mass, m."""
    regime: IntArray
    """`Regime` of the flow at equal fills under the design's gas pressure, gas over the crest beforehand."""
    velocity: FloatArray
    """u of that flow, m/s; zero where it is blocked."""
    primed_velocity: FloatArray
    """The same of a tube that holds a column beforehand, m/s."""
    drag_coefficient: FloatArray
    """k at u or, blocked, at the velocity of a primed tube; u follows."""
    crest_pressure: FloatArray
    """At the end of the crest's arc in that flow, gauge, Pa."""
    cavitation_margin: FloatArray
    """Lowest pressure of a full siphon less the cavity's, Pa."""
    stall_pressure: FloatArray
    """Gauge pressure at which a full siphon stalls with the driven chamber empty, Pa."""
    priming_pressure_vented: FloatArray
    """That starts a flow, crest gas vented, driven chamber empty, Pa."""
    priming_pressure_trapped: FloatArray
    """The same with that gas trapped, at equal fills, Pa."""
    residual_fill_ratio: FloatArray
    """Of the driven chamber, at which gas enters its port."""
    stalled_fill_ratio: FloatArray
    """Of the driven chamber, at which an injection moves no liquid any more."""
    least_fill_ratio: FloatArray
    """To which injections can bring a chamber."""
    usable_moment: FloatArray
    """Largest moment of a pair to which injections can bring it, kg m."""
    reach: FloatArray
    """Largest unbalance that all pairs together cancel in whatever direction it lies, kg m."""
    holds: BoolArray
    """Whether the fullest chamber keeps its liquid with the gas off."""
    vibration_rate: FloatArray
    """Change of the vibration per valve-open time at equal fills, kappa lambda rho S u, m/s."""
    loop_factor: FloatArray
    """The same times the scene's proportional gain."""

    @classmethod
    def of(cls, designs: Designs) -> Answers:
        """Calibrate designs.

        Source: Eqs. 2 to 18 of the liquid-ring paper, with exact chambers, the siphon crest and k(u).
        """
        parts = [
            cls._of(designs if designs.size <= _TOGETHER else designs.take(rows))
            for rows in np.array_split(np.arange(designs.size), -(-designs.size // _TOGETHER))
        ]
        if len(parts) == 1:
            return parts[0]
        return cls(
            **{name: np.concatenate([getattr(part, name) for part in parts]) for name in vars(parts[0])}
        )

    @classmethod
    def _of(cls, designs: Designs) -> Answers:
        scene, tube = designs.scene, TubeFlow.of(designs)
        top, rho = scene.disc.max_fill_ratio * np.ones(designs.size), scene.liquid.density
        wall, moment, ratio = measured_closed_forms(scene=scene, fill_ratio=np.array([top / 2, top]))
        half, full = chamber_pressure(scene=scene, fill_ratio=np.array([top / 2, top]))
        equal, uneven = tube.ends(half, half), tube.ends(0 * full, full)
        flow = tube.flow(equal, primed=np.zeros(designs.size, dtype=np.bool_))
        primed = tube.flow(equal, primed=True)
        at = np.where(flow.velocity > 0, flow.velocity, primed.velocity)
        rest = tube.flow(tube.ends(half, half, driven=False), primed=True)
        running = np.where(rest.primed, primed.velocity, flow.velocity)
        residual = _residual_fill(tube, top)
        stalled = _stalled_fill(tube, top)
        least = np.minimum(np.maximum(residual, stalled), top / 2)
        _, ends, _ = measured_closed_forms(scene=scene, fill_ratio=np.array([least, top - least]))
        usable = ends[1] - ends[0]
        holds = np.zeros(designs.size, dtype=np.bool_)
        if tube.path.crest:
            holds = chamber_pressure(scene=scene, fill_ratio=top - least) <= tube.path.return_pressure
        rate = scene.rotor.influence_coefficient * ratio[0] * rho * scene.tube.area * running
        crest, nothing = tube.path.crest, np.full(designs.size, np.nan)
        separated = np.where(flow.separated, Regime.SEPARATED, Regime.SIPHON)
        share = 1 / np.tan(np.pi / np.asarray(scene.disc.chambers))
        lowest = _lowest(tube, flow, equal) if crest else (nothing, nothing)
        priming = (nothing, nothing)
        if crest:
            vented, trapped = (replace(tube.path, trapped=kept) for kept in (False, True))
            priming = priming_pressure(vented, uneven), priming_pressure(trapped, equal)
        return cls(
            chamber_volume=chamber_volume(disc=scene.disc) * np.ones(designs.size),
            wall_pressure=wall[1],
            moment=moment[1],
            moment_per_mass=ratio[0],
            regime=np.where(flow.velocity > 0, separated, Regime.BLOCKED).astype(np.int64),
            velocity=flow.velocity,
            primed_velocity=primed.velocity,
            drag_coefficient=tube.drag_coefficient(at),
            crest_pressure=lowest[0],
            cavitation_margin=lowest[1],
            stall_pressure=np.maximum(stall_pressure(tube.path, uneven), 0.0) / tube.gas_factor,
            priming_pressure_vented=priming[0] / tube.gas_factor,
            priming_pressure_trapped=priming[1] / tube.gas_factor,
            residual_fill_ratio=residual,
            stalled_fill_ratio=stalled,
            least_fill_ratio=least,
            usable_moment=usable,
            reach=np.where(residual >= stalled, share, 1.0) * usable,
            holds=holds,
            vibration_rate=rate,
            loop_factor=scene.controller.proportional * rate,
        )


def _lowest(tube: TubeFlow, flow: ColumnFlow[FloatArray], ends: TubeEnds) -> tuple[FloatArray, FloatArray]:
    """Pressure at the end of the crest's arc, and the margin of a full siphon, where something flows, Pa."""
    path, rows = tube.path, np.arange(tube.designs.size)
    flows = flow.velocity > 0
    heads = (
        np.exp(tube.log_head(rows, to_crest=True, lowest=lowest)(np.log(np.where(flows, u, 1.0))))
        for u, lowest in ((flow.velocity, False), (flow.siphon_velocity, True))
    )
    at_end, full = (resting_pressure(path, ends) - path.density * head for head in heads)
    return np.where(flows, at_end, np.nan), np.where(flows, full - cavity_pressure(path, ends), np.nan)


def _residual_fill(tube: TubeFlow, top: FloatArray) -> FloatArray:
    """Fill at which gas enters the port of a chamber that a running tube empties: the largest such fill.

    x = g(x), g the fill at which the layer over the port is as deep as `port_depth` for the flow at x: from
    the top down g falls with the flow, so the largest of such fills is the first to be met.
    """
    about = _fixed_point(tube, top, start=top, exactly=False)
    x = _fixed_point(tube, top, start=about, exactly=True)
    return np.where(x > _NOTHING, x, 0.0)


def _fixed_point(tube: TubeFlow, top: FloatArray, *, start: FloatArray, exactly: bool) -> FloatArray:
    x, high, low = start.copy(), top.copy(), np.zeros_like(top)
    before, drawn, rows = top.copy(), np.full(top.shape, np.nan), np.arange(top.size)
    done = np.zeros(top.shape, dtype=np.bool_)
    scene = tube.designs.scene
    # Above, the opposite chamber leaves its port open, and its gas over the crest lets less liquid flow.
    covered = top - _fill_at(scene, scene.tube.port_radius)
    covered = np.where(covered < top, covered * (1 - _ROUNDING), top)
    part = tube
    for _ in range(_ROUNDS):
        if rows.size == 0:
            break
        here = x[rows]
        now = _drawn_fill(part, here, top[rows], exactly=exactly)
        least = np.where(here > covered[rows], covered[rows], 0.0)
        high[rows] = np.where(now < here, np.clip(now, least, high[rows]), high[rows])
        low[rows] = np.where(now > here, np.maximum(now, low[rows]), low[rows])
        step = here - before[rows]
        slope = (now - drawn[rows]) / np.where(step == 0, np.nan, step)
        slope = np.where(np.isfinite(slope), np.clip(slope, 0.0, _STEEPEST), _GENTLE)
        then = np.clip(here + (now - here) / (1 - slope), np.maximum(low[rows], least), high[rows])
        # Gas at any fill above: the top itself, or where the other port is covered.
        stays = (now >= here) & ((here == top[rows]) | (here == covered[rows]))
        left = (np.abs(now - here) > _SAME_FILL) & ~stays
        before[rows], drawn[rows] = here, np.where(then > least, now, np.nan)
        x[rows] = np.where(stays | done[rows], here, then)
        done[rows] |= ~left
        left = ~done[rows]
        if np.count_nonzero(left) <= rows.size / 2:
            rows = rows[left]
            part = tube.take(rows)
    return x


def _drawn_fill(tube: TubeFlow, fill_ratio: FloatArray, top: FloatArray, *, exactly: bool) -> FloatArray:
    """Fill down to which the flow at a fill draws gas."""
    scene = tube.designs.scene
    own, other = chamber_pressure(scene=scene, fill_ratio=np.array([fill_ratio, top - fill_ratio]))
    flow = tube.flow(tube.ends(own, other), primed=True, exactly=exactly)
    depth = port_depth(scene, flow_rate=scene.tube.area * flow.velocity)
    return np.minimum(_fill_at(scene, scene.tube.port_radius - depth), top)


def _fill_at(scene: Scene, radius: npt.ArrayLike) -> FloatArray:
    """Fill ratio whose surface lies at a radius, or nearest to it."""
    disc = scene.disc
    level = np.clip(radius, disc.inner_radius, disc.outer_radius)
    whole = liquid_area(disc=disc, surface_radius=disc.inner_radius)
    return np.clip(liquid_area(disc=disc, surface_radius=level) / whole, 0.0, 1.0)


def _stalled_fill(tube: TubeFlow, top: FloatArray) -> FloatArray:
    """Fill at which an injection moves no liquid any more; zero where the gas drives a chamber empty.

    Looked for from equal fills down, by a scan and finer ones of the step in which the flow stops: an
    injection starts with what the tube holds while the gas is off.
    """
    start, end = top / 2, NEARLY_EMPTY * top
    moves = _moves(tube, start, end)
    stops, first = ~moves.all(axis=0), np.argmin(moves, axis=0)
    stalled = np.where(stops, start, 0.0)
    rows = np.flatnonzero(stops & (first > 0))
    if rows.size == 0:
        return stalled
    tube, start, end, first = tube.take(rows), start[rows], end[rows], first[rows]
    for _ in range(_REFINEMENTS):
        step = (end - start) / (_SCAN - 1)
        start, end = start + (first - 1) * step, start + first * step
        first = np.argmin(_moves(tube, start, end), axis=0)
        first = np.where(first == 0, _SCAN - 1, first)
    stalled[rows] = end
    return stalled


def _moves(tube: TubeFlow, start: FloatArray, end: FloatArray) -> BoolArray:
    """Whether liquid moves at fills from `start` to `end`, shape (fills, n)."""
    scene, path = tube.designs.scene, tube.path
    fills = start + np.linspace(0.0, 1.0, _SCAN)[:, None] * (end - start)
    own, other = chamber_pressure(
        scene=scene, fill_ratio=np.array([fills, scene.disc.max_fill_ratio - fills])
    )
    rest, held = tube.ends(own, other, driven=False), np.zeros(fills.shape, dtype=np.bool_)
    if path.crest:
        # Only over a crest may a column be held while the gas is off.
        held = np.asarray(can_flow(path, rest, True) | can_flow(path, rest.reversed(), True))
    return np.asarray(can_flow(path, tube.ends(own, other), held))
