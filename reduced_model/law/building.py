"""From a calibrated chamber and the tube's heads to the flow law."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Final

import numpy as np

from ringbalance.mesh.geometry import chamber_volume, moment_across, surface_radius
from ringbalance.physics.gas import pressure_factor
from ringbalance.reduced_model.chamber.calibration import ChamberCalibration, fill_nodes, pressure_table
from ringbalance.reduced_model.chamber.range import mean_gravity
from ringbalance.reduced_model.chamber.values import RingValues, share_across
from ringbalance.reduced_model.law.calibrated_law import CalibratedLaw, CalibratedMoment
from ringbalance.reduced_model.tables import HermiteTable, flat_table, table_from_samples
from ringbalance.reduced_model.tube.directed_flow import DriveUncertainty
from ringbalance.reduced_model.tube.flow import tube_path
from ringbalance.reduced_model.tube.heads import TubeHeads
from ringbalance.scene.arrays import FloatArray
from ringbalance.scene.joint import FITTED, direction_sides, independent_half_widths
from ringbalance.scene.models import Scene

# Density and speed act on both chambers and on the tube at once, so the law handles them separately.
_SHARED: Final = ("density", "speed")
_VARIED_FILLS: Final = np.array([0.2, 0.5, 0.8])
"""Of the greatest fill ratio: where the velocity's dependence on fitted inputs is looked at."""
_VARIED_PRESSURES: Final = np.array([0.7, 1.0, 1.4])
"""Of the scene's gas pressure."""
_LITTLE: Final = 1e-2
"""Of the largest effect of a direction, below which it is left out: its square counts."""
_NEXT_TO_NOTHING: Final = 1e-4
"""Angle, rad: no mesh of a symmetric chamber is quite symmetric."""


def calibrated_law(*, scene: Scene, chamber: ChamberCalibration, heads: TubeHeads) -> CalibratedLaw:
    """Put the flow law together.

    Source: Eqs. 13 to 18 of the liquid-ring paper, with exact chambers and k(u).
    """
    own = [
        e.hydrostatic_pressure
        for name, e in chamber.input_effects.items()
        if name not in _SHARED and name != FITTED
    ]
    inputs = np.sqrt(sum((e**2 for e in own), start=np.zeros_like(chamber.fill_ratio)))
    no_inputs = np.zeros_like(chamber.fill_ratio)
    law = _put_together(
        scene,
        heads=heads,
        hydrostatic_pressure=chamber.hydrostatic_pressure.table,
        hydrostatic_pressure_uncertainty=chamber.hydrostatic_pressure.uncertainty_table(inputs=inputs),
        inputs=_drive_uncertainty(scene),
        moment=CalibratedMoment(
            chamber_moment=chamber.moment.table,
            half_width=chamber.moment.uncertainty_table(inputs=no_inputs),
            across=_across_table(scene, chamber.moment.table.nodes),
        ),
    )
    return replace(law, variants=_variants(scene)) if scene.fitted.quantities else law


def _variants(scene: Scene) -> tuple[CalibratedLaw, ...]:
    """Nominal laws along the directions of the fitted inputs that the velocity depends on, low and high.

    The directions are turned to the singular vectors of the velocity's changes over fills and pressures.
    """
    gravity = mean_gravity(scene) > scene.tolerance

    def laws(turned: FloatArray | None = None) -> tuple[CalibratedLaw, ...]:
        sides = direction_sides(scene, turned=turned).values()
        return tuple(_variant(scene, side, gravity=gravity) for both in sides for side in both)

    pressure = _VARIED_PRESSURES * scene.gas.pressure
    fill = _VARIED_FILLS[:, None] * scene.disc.max_fill_ratio
    velocities = np.array(
        [law.evaluate(fill_ratio=fill, gas_pressure=pressure, primed=True).velocity.ravel() for law in laws()]
    )
    changes = (velocities[1::2] - velocities[::2]).T
    _, size, turned = np.linalg.svd(changes, full_matrices=False)
    return laws(turned[size > _LITTLE * size[0]].T) if size[0] > 0 else ()


def _variant(scene: Scene, side: Scene, *, gravity: bool) -> CalibratedLaw:
    """Law of a scene beside another one; gas pressures are asked for as that has them."""
    law, asked = nominal_law(side, gravity=gravity), scene.gas.pressure
    return replace(law, gas_factor=law.gas_factor * side.gas.pressure / asked) if asked else law


def nominal_law(scene: Scene, *, gravity: bool) -> CalibratedLaw:
    """The calibrated law without finite elements and without uncertainties, in a few milliseconds.

    Its velocities are within 1e-4 of those of `calibrated_law`, by fewer nodes of the heads; half-widths are
    zero.  For the many scenes that differ from a calibrated one in their values, such as those of a fit.
    Args: `gravity`: whether the chamber's values hold gravity, as `calibrate` decides for the scene.
    Raises: ValueError: bends that do not fit into the tube.
    Source: Eqs. 13 to 18 of the liquid-ring paper; `RingValues.of`, `TubeHeads.nominal`.
    """
    fills = fill_nodes(largest=scene.disc.max_fill_ratio)[0]
    ends = {"start": 0.0, "stop": float(fills[-1])}
    ring = RingValues.of(scene, fill_ratio=fills, gravity=gravity)
    exact = flat_table(**ends)
    return _put_together(
        scene,
        heads=TubeHeads.nominal(scene),
        hydrostatic_pressure=pressure_table(scene, fills, ring.hydrostatic_pressure.value)[0],
        hydrostatic_pressure_uncertainty=exact,
        inputs=DriveUncertainty(),
        moment=CalibratedMoment(
            chamber_moment=table_from_samples(value=scene.disc.moment_factor * ring.moment.value, **ends),
            half_width=exact,
            across=_across_table(scene, fills),
        ),
    )


def _put_together(
    scene: Scene,
    *,
    heads: TubeHeads,
    hydrostatic_pressure: HermiteTable,
    hydrostatic_pressure_uncertainty: HermiteTable,
    inputs: DriveUncertainty,
    moment: CalibratedMoment,
) -> CalibratedLaw:
    return CalibratedLaw(
        name="calibrated",
        max_fill_ratio=scene.disc.max_fill_ratio,
        ambient_pressure=scene.gas.ambient_pressure,
        chamber_volume=chamber_volume(disc=scene.disc),
        tube_area=scene.tube.area,
        hydrostatic_pressure=hydrostatic_pressure,
        hydrostatic_pressure_uncertainty=hydrostatic_pressure_uncertainty,
        path=tube_path(scene),
        heads=heads,
        inputs=inputs,
        gas_factor=pressure_factor(scene),
        moment=moment,
    )


def _drive_uncertainty(scene: Scene) -> DriveUncertainty:
    width = independent_half_widths(scene)
    hump = scene.tube.hump_radius or 0.0
    moved = scene.liquid.density * scene.rotor.speed**2 * hump * width.get("hump_radius", 0.0)
    return DriveUncertainty(
        relative_density=width.get("density", 0.0) / scene.liquid.density,
        relative_speed=width.get("speed", 0.0) / abs(scene.rotor.speed),
        relative_gas_pressure=width.get("pressure", 0.0) / scene.gas.pressure if scene.gas.pressure else 0.0,
        hump_pressure=moved,
        vapour_pressure=math.hypot(width.get("vapour_pressure", 0.0), width.get("ambient_pressure", 0.0)),
    )


def _across_table(scene: Scene, fills: FloatArray) -> HermiteTable | None:
    """W(x), the moment across a chamber's middle, kg m; None where it turns moments by next to nothing.

    Gravity is left out, whose mean changes U and W alike in the first place.
    Args: `fills`: nodes, equally spaced from zero.
    Source: rho int y dV over the liquid, times the scene's factor on moments.
    """
    disc = scene.disc
    if np.max(np.abs(share_across(disc, fills))) <= _NEXT_TO_NOTHING:
        return None
    a = surface_radius(disc=disc, fill_ratio=fills)
    value = scene.liquid.density * disc.axial_width * moment_across(disc=disc, surface_radius=a)
    return table_from_samples(start=0.0, stop=float(fills[-1]), value=disc.moment_factor * value)
