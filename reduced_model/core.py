"""Calibration of many designs at once, as arrays and without meshes.

Chamber by closed forms, regimes by `column_flow`; velocities are solved on the loss itself, not on a table.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial
from typing import Final

import numpy as np

from ringbalance.mesh.geometry import chamber_volume, surface_radius
from ringbalance.reduced_model.chamber.values import measured_closed_forms
from ringbalance.reduced_model.crater import Crater
from ringbalance.reduced_model.fill_limits import NEARLY_EMPTY, drawn_fill, first_gas, first_stalled
from ringbalance.reduced_model.law.flow_law import Regime
from ringbalance.reduced_model.tube.flow import TubeFlow, Waves
from ringbalance.reduced_model.tube.regime import (
    ColumnFlow,
    TubeEnds,
    can_flow,
    cavity_pressure,
    driving_pressure,
    priming_pressure,
    resting_pressure,
    stall_pressure,
)
from ringbalance.scene.arrays import BoolArray, FloatArray, IntArray
from ringbalance.scene.designs import Designs

_DESIGNS_TOGETHER: Final = 8192
"""Number of designs whose arrays fit into a processor's cache."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Answers:
    """Results of calibrating n designs: arrays of shape (n,), SI, NaN where a quantity does not exist.

    Gravity is neglected, except for a single scene with the tables of its chamber. The loss coefficient k is
    that at the velocity of each design, not at one velocity for all.
    """

    chamber_volume: FloatArray
    """V, m^3."""
    wall_pressure: FloatArray
    """Mean liquid pressure on the outer wall at the largest fill, Pa."""
    moment: FloatArray
    """Moment of a chamber at the largest fill, kg m."""
    moment_per_mass: FloatArray
    """lambda at equal fills, per transferred mass, m."""
    regime: IntArray
    """`Regime` of an unprimed tube at equal fills under the design's gas pressure."""
    velocity: FloatArray
    """Velocity u at equal fills, m/s; zero where the tube is blocked."""
    drag_coefficient: FloatArray
    """Loss coefficient k at `velocity`; NaN where the tube is blocked."""
    crest_pressure: FloatArray
    """Gauge pressure at the end of the crest's arc at equal fills, Pa; NaN where the tube is blocked."""
    cavitation_margin: FloatArray
    """Lowest pressure in a full siphon less the cavity pressure, Pa; if blocked, that of a primed tube."""
    stall_pressure: FloatArray
    """Gauge pressure at which a full siphon stalls with the driven chamber empty, Pa."""
    priming_pressure_vented: FloatArray
    """Gauge pressure that starts a flow, crest gas vented, driven chamber empty, Pa."""
    priming_pressure_trapped: FloatArray
    """Gauge pressure that starts a flow, crest gas trapped, equal fills, Pa."""
    residual_fill_ratio: FloatArray
    """Fill of the driven chamber at which gas enters its port."""
    stalled_fill_ratio: FloatArray
    """Fill of the driven chamber at which an injection moves no liquid any more."""
    least_fill_ratio: FloatArray
    """Smallest fill to which injections can bring a chamber."""
    largest_fill_ratio: FloatArray
    """Fill of the opposite chamber at `least_fill_ratio`."""
    residual_depth: FloatArray
    """Depth of the liquid over the port as gas enters it, m; zero if the chamber empties before."""
    usable_volume: FloatArray
    """Volume that a pair can move from one chamber to the other, m^3."""
    usable_moment: FloatArray
    """Largest moment that injections can give a pair, kg m."""
    reach: FloatArray
    """Largest unbalance that all pairs together cancel in any direction, kg m.

    Each of n pairs, pi/n apart, gives a moment between -U and U along its axis: together a regular polygon of
    2 n sides, U/sin(pi/(2 n)) to its corners and U cot(pi/(2 n)) to its sides: U with four chambers, 1.73 U
    with six, as a chamber that has nothing to give leaves its share to other pairs.
    Source: elementary geometry (a sum of segments is a zonotope).
    """
    crater_depth: FloatArray
    """Depth of the gas jet's crater at equal fills, m; NaN where the scene gives no gas hole, as below."""
    crater_ratio: FloatArray
    """Depth of that crater over the ring's at `least_fill_ratio`."""
    blowing_number: FloatArray
    """Blowing number of the gas jet at equal fills; droplets from about 1 on."""
    loop_factor: FloatArray
    """Change of the vibration per valve-open time at equal fills, kappa lambda rho S u, times the scene's
    proportional gain."""

    @classmethod
    def of(cls, designs: Designs, *, near: TubeFlow | None = None, waves: Waves | None = None) -> Answers:
        """Calibrate designs.

        Args: `near`: tubes of n designs of which these are variations, in blocks of n; halves the cost.
            `waves`: errors of the chambers' levels.
        Source: Eqs. 2 to 18 of the liquid-ring paper, with exact chambers, the siphon crest and k(u).
        """
        parts = []
        for rows in np.array_split(np.arange(designs.size), -(-designs.size // _DESIGNS_TOGETHER)):
            part = designs if designs.size <= _DESIGNS_TOGETHER else designs.take(rows)
            moved = None if waves is None else waves.take(rows)
            tube = (
                near.of_neighbours(part, rows % near.designs.size) if near else TubeFlow.of(part, waves=moved)
            )
            parts.append(cls.of_tubes(tube))
        if len(parts) == 1:
            return parts[0]
        return cls(
            **{name: np.concatenate([getattr(part, name) for part in parts]) for name in vars(parts[0])}
        )

    @classmethod
    def of_tubes(
        cls, tube: TubeFlow, *, moments: Callable[[FloatArray], FloatArray] | None = None
    ) -> Answers:
        """Evaluate all answers for the designs of tubes.

        Args: `moments`: moment of a chamber as a function of the fill ratio, kg m; default the closed form.
        """
        designs, scene = tube.designs, tube.designs.scene
        top, rho = scene.disc.max_fill_ratio * np.ones(designs.size), scene.liquid.density
        wall, _, ratio = measured_closed_forms(scene=scene, fill_ratio=np.array([top / 2, top]))
        half, full = tube.level(np.array([top / 2, top]))
        equal, uneven = tube.ends(half, half), tube.ends(0 * full, full)
        flow = tube.flow(equal, primed=np.zeros(designs.size, dtype=np.bool_))
        primed = tube.flow(equal, primed=True)
        rest = tube.flow(tube.ends(half, half, driven=False), primed=True)
        running = np.where(rest.primed, primed.velocity, flow.velocity)
        residual = _residual_fill(tube, top)
        stalled = _stalled_fill(tube, top)
        least = np.minimum(np.maximum(residual, stalled), top / 2)
        fills = np.array([least, top - least, top])
        if moments is None:
            _, moment, _ = measured_closed_forms(scene=scene, fill_ratio=fills)
        else:
            moment = moments(fills)
        usable, volume = moment[1] - moment[0], chamber_volume(disc=scene.disc) * np.ones(designs.size)
        depth = scene.tube.port_radius - surface_radius(disc=scene.disc, fill_ratio=residual)
        rate = scene.rotor.influence_coefficient * ratio[0] * rho * scene.tube.area * running
        crest, nothing = tube.path.crest, np.full(designs.size, np.nan)
        craters = np.full((3, 2, designs.size), np.nan)
        if scene.disc.gas_hole_diameter is not None:
            craters[:] = list(vars(Crater.of(scene, np.array([top / 2, least]))).values())
        separated = np.where(flow.separated, Regime.SEPARATED, Regime.SIPHON)
        lowest = _lowest(tube, flow, equal) if crest else (nothing, nothing)
        priming = (nothing, nothing)
        if crest:
            vented, trapped = (replace(tube.path, trapped=each) for each in (False, True))
            priming = priming_pressure(vented, uneven), priming_pressure(trapped, equal)
        return cls(
            chamber_volume=volume,
            wall_pressure=wall[1],
            moment=moment[2],
            moment_per_mass=ratio[0],
            regime=np.where(flow.velocity > 0, separated, Regime.BLOCKED).astype(np.int64),
            velocity=flow.velocity,
            drag_coefficient=tube.drag_coefficient(flow.velocity),
            crest_pressure=lowest[0],
            cavitation_margin=lowest[1],
            stall_pressure=np.maximum(stall_pressure(tube.path, uneven), 0.0) / tube.gas_factor,
            priming_pressure_vented=priming[0] / tube.gas_factor,
            priming_pressure_trapped=priming[1] / tube.gas_factor,
            residual_fill_ratio=residual,
            stalled_fill_ratio=stalled,
            least_fill_ratio=least,
            largest_fill_ratio=top - least,
            residual_depth=np.where(residual > 0, np.maximum(depth, 0.0), 0.0),
            usable_volume=(top - 2 * least) * volume,
            usable_moment=usable,
            reach=usable / np.tan(np.pi / np.asarray(scene.disc.chambers)),
            crater_depth=craters[0, 0],
            crater_ratio=craters[1, 1],
            blowing_number=craters[2, 0],
            loop_factor=scene.controller.proportional * rate,
        )


def _lowest(tube: TubeFlow, flow: ColumnFlow[FloatArray], ends: TubeEnds) -> tuple[FloatArray, FloatArray]:
    """Gauge pressure at the end of the crest's arc, NaN if blocked, and margin of a full siphon, Pa."""
    path, rows = tube.path, np.arange(tube.designs.size)
    flows, driving = flow.velocity > 0, driving_pressure(path, ends)
    siphon = flow.siphon_velocity
    if np.any(~flows & (driving > 0)):
        siphon = np.where(flows, siphon, tube.velocity(driving, ~flows, to_crest=False))
    pressures = []
    for u, lowest in ((flow.velocity, False), (siphon, True)):
        head = tube.log_head(rows, to_crest=True, lowest=lowest)(np.log(np.where(u > 0, u, 1.0)))
        pressures.append(resting_pressure(path, ends) - path.density * np.where(u > 0, np.exp(head), 0.0))
    at_end, full = pressures
    return np.where(flows, at_end, np.nan), full - cavity_pressure(path, ends)


def _residual_fill(tube: TubeFlow, top: FloatArray) -> FloatArray:
    """Fill ratio of the driven chamber at which gas enters its port."""

    def draws_down_to(rows: IntArray, fills: FloatArray, *, exactly: bool = True) -> FloatArray:
        part = tube.take(rows)
        scene = part.designs.scene
        driven, opposite = part.level(np.array([fills, top[rows] - fills]))
        flow = part.flow(part.ends(driven, opposite), primed=True, exactly=exactly)
        return drawn_fill(scene, flow_rate=scene.tube.area * flow.velocity)

    return first_gas(tube.designs.scene, draws_down_to, top=top, about=partial(draws_down_to, exactly=False))


def _stalled_fill(tube: TubeFlow, top: FloatArray) -> FloatArray:
    """Fill at which an injection moves no liquid any more; zero where the gas drives a chamber empty.

    An injection starts with the liquid that the tube holds while the gas is off.
    """

    def moves(rows: IntArray, fills: FloatArray) -> BoolArray:
        part = tube.take(rows)
        scene, path = part.designs.scene, part.path
        driven, opposite = part.level(np.array([fills, scene.disc.max_fill_ratio - fills]))
        rest, held = part.ends(driven, opposite, driven=False), np.zeros(fills.shape, dtype=np.bool_)
        if path.crest:
            # Only over a crest may a column be held while the gas is off.
            held = np.asarray(can_flow(path, rest, True) | can_flow(path, rest.reversed(), True))
        return np.asarray(can_flow(path, part.ends(driven, opposite), held))

    return np.nan_to_num(first_stalled(moves, start=top / 2, end=NEARLY_EMPTY * top))
