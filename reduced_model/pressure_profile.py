"""Pressure along the tube's path, from the driven chamber over the crest to the opposite one.

In a tube at rest without liquid over its crest each leg is full up to a level, with gas or a cavity between.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from scipy.optimize import brentq

from ringbalance.physics.gas import applied_pressure, vented_pressure
from ringbalance.physics.tube.loss import corrected_state
from ringbalance.physics.tube.state import TubeState
from ringbalance.reduced_model.law.calibrated_law import CalibratedLaw
from ringbalance.reduced_model.law.flow_law import Regime
from ringbalance.reduced_model.tube.flow import column_pressure, column_radius
from ringbalance.reduced_model.tube.heads import BACK_SHARE, SHARE, roots_of
from ringbalance.reduced_model.tube.path import (
    Places,
    crest_span,
    lowest_place,
    path_radius,
    reversed_tube,
    share_at_radius,
)
from ringbalance.reduced_model.tube.regime import (
    TubeEnds,
    TubePath,
    back_pressure,
    cavity_pressure,
    covered,
    discharges_openly,
    driving_pressure,
    resting_pressure,
)
from ringbalance.scene.arrays import BoolArray, FloatArray
from ringbalance.scene.models import Scene, Tube


@dataclass(frozen=True, kw_only=True, eq=False)
class HumpProfile:
    """State of the tube along its path; arrays of one shape, from the driven to the opposite chamber.

    A path coordinate appears twice where the pressure steps (ends, bends) or the tube stops being full.
    """

    path: FloatArray
    """Path coordinate s, m, from 0 to the tube's length, non-decreasing."""
    radius: FloatArray
    """Radius r of the path, m."""
    pressure: FloatArray
    """Gauge pressure, Pa; of gas or cavity where the tube is not full; first and last in the chambers."""
    full: BoolArray
    """True where liquid fills the bore."""
    regime: Regime
    """Regime of the flow."""
    velocity: float
    """Velocity u, m/s; negative in reverse, zero when blocked."""
    hump_path: float | None
    """Path coordinate of the lowest crest pressure, the end of the crest's arc, m; None without a crest."""
    hump_pressure: float | None
    """Gauge pressure over the crest, Pa; None without a crest."""
    cavity_pressure: float | None
    """Gauge pressure at which a column separates at the crest, Pa: of vapour, or of the downstream chamber's
    gas."""
    cavitation_margin: float | None
    """Pressure over the crest of a full siphon under these conditions, less the cavity pressure, Pa.
    Negative: no such siphon exists, so the flow is separated or a resting column separates.  When blocked,
    it is that of a primed tube."""
    cavitation_margin_uncertainty: float | None
    """Expanded uncertainty (95 %) of the cavitation margin, Pa."""

    @classmethod
    def of(
        cls,
        *,
        scene: Scene,
        law: CalibratedLaw,
        fill_ratio: float,
        opposite_fill_ratio: float | None = None,
        gas_pressure: float | None = None,
        primed: bool = False,
        points: int = 401,
    ) -> HumpProfile:
        """Compute the pressure along the path at one operating state.

        p(s) = p_A + P_A - rho omega^2 (R2^2 - r^2)/2 - K(s) rho u^2/2, with K the loss up to there plus
        alpha, the kinetic-energy factor of the velocity profile.

        Where the column is separated the cavity reaches from the crest to the column that the opposite
        chamber supports; the momentum of what falls onto it is left out.
        Args:
            fill_ratio: x of the driven chamber.
            opposite_fill_ratio: default max_fill_ratio - fill_ratio.
            gas_pressure: gauge, Pa, in the driven chamber; default the scene's.
            primed: True if the tube holds a continuous column beforehand.
            points: number of evenly spaced points of the path; more where something changes.
        Raises: ValueError: a fill ratio outside the range, a NaN, a negative absolute pressure, or under 2
            points.
        Range: legs as in `path`; the scene does not give where the bends lie: evenly over both legs.
        Source: Eqs. 13 to 18 of the liquid-ring paper, taken along the path.
        """
        if points < 2:
            raise ValueError("points must be at least 2")
        gas = applied_pressure(scene.gas) if gas_pressure is None else gas_pressure
        other = law.max_fill_ratio - fill_ratio if opposite_fill_ratio is None else opposite_fill_ratio
        flow = law.evaluate(fill_ratio=fill_ratio, opposite_fill_ratio=other, gas_pressure=gas, primed=primed)
        ends = law.ends(fill_ratio=fill_ratio, opposite_fill_ratio=other, gas_pressure=gas)
        reverse = bool(driving_pressure(law.path, ends) < 0)
        tube, from_upstream = (reversed_tube(scene.tube), ends.reversed()) if reverse else (scene.tube, ends)
        humped, velocity, half_width = scene.tube.hump_radius is not None, float(flow.velocity), None
        if law.half_widths is not None:
            # The gas of the driven chamber holds a reverse flow back: seen from upstream none drives it.
            fill = np.asarray(other if reverse else fill_ratio)
            wall = from_upstream.upstream_hydrostatic if reverse else ends.upstream_pressure()
            half_width = float(law.half_widths.at(fill, wall, np.asarray(True))[1])
        if Regime(int(flow.regime)) is Regime.BLOCKED and not bool(flow.primed):
            line = _blocked(scene, law, ends, primed, points)
        else:
            over_crest = _pressure_over_crest(law, from_upstream, reverse, abs(velocity))
            line = _flowing(scene, law.path, tube, abs(velocity), from_upstream, over_crest, points)
            if reverse:
                line = _Line(share=1 - line.share[::-1], pressure=line.pressure[::-1], full=line.full[::-1])
        crest, cavity, margin = crest_span(scene.tube)[0 if reverse else 1], None, None
        if humped:
            cavity = float(cavity_pressure(law.path, from_upstream))
            driving = np.maximum(driving_pressure(law.path, from_upstream), 0.0)
            column = BACK_SHARE if reverse and law.heads.return_hump else SHARE
            lost = law.heads.siphon.cubic((driving / law.density) ** 0.125, column) * driving
            margin = float(resting_pressure(law.path, from_upstream) - cavity - lost)
        return cls(
            path=line.share * scene.tube.length,
            radius=path_radius(tube=scene.tube, share=line.share),
            pressure=line.pressure,
            full=line.full,
            regime=Regime(int(flow.regime)),
            velocity=velocity,
            hump_path=crest * scene.tube.length if humped else None,
            hump_pressure=float(line.pressure[np.argmin(np.abs(line.share - crest))]) if humped else None,
            cavity_pressure=cavity,
            cavitation_margin=margin,
            cavitation_margin_uncertainty=half_width if humped else None,
        )


@dataclass(frozen=True, kw_only=True, eq=False)
class _Line:
    """State along s/L; arrays of one shape."""

    share: FloatArray
    pressure: FloatArray
    full: BoolArray


def _pressure_over_crest(law: CalibratedLaw, ends: TubeEnds, reverse: bool, velocity: float) -> float | None:
    """Gauge pressure of the cavity or gas that flowing liquid spills into, Pa; None: full tube, or at
    rest."""
    way = law.heads.to_crest(reverse=reverse)
    if way is None or velocity == 0:
        return None
    full, part = (law.density * float(roots_of(table, velocity)) ** 8 for table in (law.heads.siphon, way))
    if full > driving_pressure(law.path, ends) * (1 - 1e-9):
        return None
    return float(resting_pressure(law.path, ends)) - part


def _flowing(
    scene: Scene,
    path: TubePath,
    tube: Tube,
    velocity: float,
    ends: TubeEnds,
    cavity: float | None,
    points: int,
) -> _Line:
    """Pressure along a tube with flowing liquid or a column at rest, from its upstream end."""
    terms = corrected_state(replace(scene, tube=tube), velocity) if velocity else None
    head = scene.liquid.density * velocity**2 / 2
    if cavity is not None and terms is not None:
        return _separated(scene, path, tube, terms, ends, cavity, head, points)
    at = Places.even(tube=tube, points=points)
    lost = 0.0 if terms is None else head * at.loss_before(tube=tube, state=terms)
    hydrostatic = column_pressure(scene=scene, radius=path_radius(tube=tube, share=at.share))
    return _Line(
        share=at.share,
        pressure=np.asarray(ends.upstream_pressure() - hydrostatic - lost),
        full=np.ones(at.share.shape, dtype=np.bool_),
    )


def _separated(
    scene: Scene,
    path: TubePath,
    tube: Tube,
    terms: TubeState,
    ends: TubeEnds,
    cavity: float,
    head: float,
    points: int,
) -> _Line:
    """Pressure along a separated column: full up to the crest, a cavity, the downstream chamber's column."""
    top = ends.downstream_gas + back_pressure(path, ends)

    def behind(at: Places) -> FloatArray:
        """Pressure of a full tube seen from its downstream end."""
        lost = float(terms.k) + 1 - at.loss_before(tube=tube, state=terms)
        return np.asarray(
            top - column_pressure(scene=scene, radius=path_radius(tube=tube, share=at.share)) + head * lost
        )

    first = Places.even(tube=tube, points=points)
    crest = lowest_place(tube, float(terms.spread_loss) * head / scene.liquid.density, scene.rotor.speed**2)
    again = 1.0 if discharges_openly(path, ends) else _full_again(first, behind, cavity, crest)
    at = Places.even(tube=tube, points=points, doubled=(crest, again))
    from_top = ends.upstream_pressure() - column_pressure(
        scene=scene, radius=path_radius(tube=tube, share=at.share)
    )
    ahead = from_top - head * at.loss_before(tube=tube, state=terms)
    near = (at.share < crest) | ((at.share == crest) & ~at.after)
    far = (at.share > again) | ((at.share == again) & at.after)
    pressure = np.where(near, ahead, np.where(far, behind(at), cavity))
    return _Line(share=at.share, pressure=pressure, full=near | far)


def _full_again(at: Places, behind: Callable[[Places], FloatArray], cavity: float, hump: float) -> float:
    """Fraction of the path beyond which the pressure of the downstream column exceeds that of the cavity."""
    low = np.flatnonzero((behind(at) < cavity) & (at.share >= hump))
    if low.size == 0:
        return hump
    last = int(low[-1])
    if last + 1 >= at.share.size:
        return 1.0
    start, stop = float(at.share[last]), float(at.share[last + 1])
    if start == stop:
        return start

    def above(share: float) -> float:
        inside = Places(share=np.array([share]), after=np.array([share < stop]))
        return float(behind(inside)[0] - cavity)

    return float(brentq(above, start, stop))


def _blocked(scene: Scene, law: CalibratedLaw, ends: TubeEnds, primed: bool, points: int) -> _Line:
    """Pressure along a blocked tube: two columns at rest and the space between; without a crest, each
    chamber's pressure up to the middle."""
    path, is_covered = law.path, bool(covered(law.path, ends))
    near, far = ends.upstream_pressure(), ends.downstream_pressure()
    is_open = discharges_openly(path, ends)
    if not path.crest:
        at = Places.even(tube=scene.tube, points=points, doubled=(0.5,))
        first = (at.share < 0.5) | ((at.share == 0.5) & ~at.after)
        pressure = np.where(first, near, far) - path.port_pressure
        return _Line(share=at.share, pressure=pressure, full=np.ones(first.shape, dtype=np.bool_))
    cavity = float(cavity_pressure(path, ends)) if primed and is_covered else None
    first, last, between = _rest(scene, path, ends, cavity)
    at = Places.even(tube=scene.tube, points=points, doubled=(first, last))
    hydrostatic = column_pressure(scene=scene, radius=path_radius(tube=scene.tube, share=at.share))
    in_near = ((at.share < first) | ((at.share == first) & ~at.after)) & is_covered
    in_far = ((at.share > last) | ((at.share == last) & at.after)) & (not is_open)
    pressure = np.where(in_near, near - hydrostatic, np.where(in_far, far - hydrostatic, between))
    # At an uncovered port the pressure is that of the chamber's gas.
    pressure[0] = pressure[0] if is_covered else max(pressure[0], ends.upstream_gas)
    return _Line(share=at.share, pressure=pressure, full=in_near | in_far)


def _rest(scene: Scene, path: TubePath, ends: TubeEnds, cavity: float | None) -> tuple[float, float, float]:
    """Path fractions s/L at which the columns of a tube at rest end, and the gauge pressure between, Pa.

    A separated column leaves a cavity at a given pressure.  An unprimed tube holds gas: vented, it is at the
    opposite chamber's pressure; trapped, it is compressed isothermally from the hydrostatic pressures alone
    until it leaves at the opposite port, and at least to the pressure that keeps the driven column below the
    crest.
    Args: `ends`: pressures at the tube's ends, the driven chamber upstream; one that leaves its port open
        supports no column. `cavity`: pressure of the cavity of a separated column, gauge, Pa; None for gas.
    Source: hydrostatics in the rotating frame; Boyle's law.
    """
    is_covered, is_open = covered(path, ends), discharges_openly(path, ends)
    near, far = ends.upstream_pressure(), ends.downstream_pressure()

    def leg(pressure: float, *, far_leg: bool) -> float:
        """Fraction of the path where a column ends that a pressure at the outer wall supports."""
        radius = column_radius(scene=scene, pressure=max(pressure, 0.0))
        return share_at_radius(tube=scene.tube, radius=radius, far_leg=far_leg)

    def filled(pressure: float, near: float) -> tuple[float, float]:
        """Fractions of the path where the two columns end, under a pressure between them."""
        first = leg(near - pressure, far_leg=False) if is_covered else 0.0
        return first, 1.0 if is_open else leg(far - pressure, far_leg=True)

    if cavity is not None:
        between = cavity
    elif not is_covered:
        between = float(np.clip(ends.upstream_gas, 0.0, max(far - path.port_pressure, 0.0)))
    elif scene.tube.hump_gas == "vented":
        between = 0.0
    else:
        # The gas that fills the tube between the columns is kept.
        ambient, largest = vented_pressure(scene), max(far - path.port_pressure, 0.0)
        first, last = filled(0.0, ends.upstream_hydrostatic)

        def excess(pressure: float) -> float:
            start, stop = filled(pressure, near)
            return float((ambient + pressure) * (stop - start) - ambient * (last - first))

        between = 0.0
        if largest > 0:
            root = (
                largest if excess(largest) < 0 else 0.0 if excess(0.0) >= 0 else brentq(excess, 0.0, largest)
            )
            between = float(np.clip(max(root, near - path.column_pressure), 0.0, largest))
    return *filled(between, near), between
