"""Construction of calibrated laws: of one chamber and tube with uncertainties, of many scenes without."""

from __future__ import annotations

from collections.abc import Hashable, MutableMapping, Sequence
from dataclasses import replace
from typing import Final, TypeAlias

import numpy as np

from ringbalance.mesh.geometry import chamber_volume, moment_across, surface_radius
from ringbalance.physics.gas import pressure_factor
from ringbalance.reduced_model.chamber.calibration import ChamberCalibration, fill_nodes, pressure_tables
from ringbalance.reduced_model.chamber.contributions import unmodelled_fractions
from ringbalance.reduced_model.chamber.values import (
    RingValues,
    chamber_closed_forms,
    chamber_pressure,
    share_across,
)
from ringbalance.reduced_model.law.calibrated_law import WIDTH, CalibratedLaw, CalibratedMoment, constants_of
from ringbalance.reduced_model.law.flow_law import CALIBRATED
from ringbalance.reduced_model.law.sides import half_width_table
from ringbalance.reduced_model.pieces.table import Table, smooth_table, smooth_tables
from ringbalance.reduced_model.tube.flow import tube_path
from ringbalance.reduced_model.tube.heads import TubeHeads
from ringbalance.scene.arrays import FloatArray
from ringbalance.scene.designs import Designs, alike
from ringbalance.scene.errors import of_flow, with_places
from ringbalance.scene.models import Scene
from ringbalance.scene.uncertain import NORMAL_95

_SYMMETRIC_ANGLE_RAD: Final = 1e-4
"""Angle of a moment below which a chamber counts as symmetric, rad: meshes are never quite symmetric."""


def calibrated_law(
    *, scene: Scene, chamber: ChamberCalibration, heads: TubeHeads, varied: bool = True
) -> CalibratedLaw:
    """Assemble the flow law.

    Args: `varied`: true if the law gets half-widths.

    Source: Eqs. 13 to 18 of the liquid-ring paper, with exact chambers and k(u).
    """
    moment = chamber.moment
    law = _assembled_law(
        scene,
        heads=heads,
        levels=chamber.hydrostatic_pressure.table,
        moment=CalibratedMoment(
            along=moment.table.with_column(
                WIDTH, moment.half_widths(inputs=np.zeros_like(chamber.fill_ratio))
            ),
            across=_across_table(scene, moment.table.knots),
        ),
    )
    if not varied:
        return law
    return replace(law, half_widths=half_width_table(side_laws(scene), gas_pressure=scene.gas.pressure))


def side_laws(scene: Scene) -> tuple[CalibratedLaw, ...]:
    """The nominal law of a scene, and those at both sides of every uncertainty that acts on the flow."""
    errors = of_flow(scene)
    base = with_places(scene, errors)
    sides = [base, *(side for error in errors for side in error.sides(base)), base, base]
    waves = [0.0] * (len(sides) - 2) + [-NORMAL_95, NORMAL_95]
    laws = nominal_laws(sides, gravity=False, waves=waves)
    if not scene.gas.pressure:
        return laws
    # The gas pressure of a side becomes a factor on that of the scene.
    factors = [
        law.gas_factor * side.gas.pressure / scene.gas.pressure for law, side in zip(laws, sides, strict=True)
    ]
    return tuple(law.with_gas_factor(factor) for law, factor in zip(laws, factors, strict=True))


def nominal_law(scene: Scene, *, gravity: bool) -> CalibratedLaw:
    """The calibrated law without finite elements and without uncertainties, in a few milliseconds.

    Its velocities differ by at most 1e-4 from those of `calibrated_law`, because the heads have fewer nodes;
    half-widths are zero.  Meant for many scenes that differ from a calibrated one in values, as in a fit.
    Args: `gravity`: true if the chamber's values include gravity, as `calibrate` decides for the scene.
    Raises: ValueError: bends that do not fit into the tube.
    Source: Eqs. 13 to 18 of the liquid-ring paper; `RingValues.of`, `TubeHeads.nominal`.
    """
    return nominal_laws([scene], gravity=gravity)[0]


Rings: TypeAlias = MutableMapping[Hashable, RingValues]
"""Values of chambers under gravity by disc, liquid density, rotor speed and environment."""


def nominal_laws(
    scenes: Sequence[Scene],
    *,
    gravity: bool,
    waves: Sequence[float] | None = None,
    rings: Rings | None = None,
) -> tuple[CalibratedLaw, ...]:
    """Nominal laws of many scenes; those that differ in numbers alone, but not in fills, are made together.

    Args: `waves`: error of each scene's levels by unmodelled effects, in standard deviations. `rings`: values
        of chambers from earlier calls; missing ones are added.
    """
    rings = {} if rings is None else rings
    laws: dict[int, CalibratedLaw] = {}
    for rows in alike(scenes):
        group = [scenes[row] for row in rows]
        moved = None if waves is None else [waves[row] for row in rows]
        laws |= zip(rows, _nominal(group, rings, gravity=gravity, waves=moved), strict=True)
    return tuple(laws[row] for row in range(len(scenes)))


def _nominal(
    scenes: Sequence[Scene], rings: Rings, *, gravity: bool, waves: Sequence[float] | None
) -> list[CalibratedLaw]:
    """Laws of scenes that differ in numbers alone, with their constants, which is faster than one by one."""
    fills, designs = fill_nodes(largest=scenes[0].disc.max_fill_ratio)[0], Designs.stacked(scenes)
    heads = TubeHeads.nominal(designs)
    if gravity:
        chambers = []
        for scene in scenes:
            key = scene.disc, scene.liquid.density, scene.rotor.speed, scene.environment
            if key not in rings:
                rings[key] = RingValues.of(scene, fill_ratio=fills, gravity=True)
            chambers.append(rings[key])
        pressures = [ring.hydrostatic_pressure.value for ring in chambers]
        moments = np.stack([ring.moment.value for ring in chambers], axis=1)
    else:
        shape, column = (fills.size, designs.size), fills[:, None]
        pressure = chamber_pressure(scene=designs.scene, fill_ratio=column)
        pressures = list(np.broadcast_to(pressure, shape).T)
        moments = np.broadcast_to(chamber_closed_forms(scene=designs.scene, fill_ratio=column)[1], shape)
    if waves is not None:
        share = unmodelled_fractions(scenes[0], fills)["heads"] / NORMAL_95
        pressures = [level * (1 + each * share) for level, each in zip(pressures, waves, strict=True)]
    levels = pressure_tables(scenes, fills, pressures)
    curves = smooth_tables(fills, designs.scene.disc.moment_factor * moments)
    laws = [
        _assembled_law(
            scene,
            heads=head,
            levels=level,
            moment=CalibratedMoment(along=moment.with_column(WIDTH, 0.0), across=_across_table(scene, fills)),
        )
        for scene, head, level, moment in zip(scenes, heads, levels, curves, strict=True)
    ]
    for law, *constants in zip(laws, *constants_of(laws), strict=True):
        vars(law)["constants"] = tuple(constants)
    return laws


def _assembled_law(
    scene: Scene, *, heads: TubeHeads, levels: Table, moment: CalibratedMoment
) -> CalibratedLaw:
    return CalibratedLaw(
        name=CALIBRATED,
        max_fill_ratio=scene.disc.max_fill_ratio,
        ambient_pressure=scene.gas.ambient_pressure,
        chamber_volume=chamber_volume(disc=scene.disc),
        tube_area=scene.tube.area,
        levels=levels,
        path=tube_path(scene),
        heads=heads,
        gas_factor=pressure_factor(scene),
        moment=moment,
    )


def _across_table(scene: Scene, fills: FloatArray) -> Table | None:
    """Moment across a chamber's middle, W(x), kg m; None where it turns the moment by a negligible angle.

    Gravity is left out, because its mean changes U and W essentially alike.
    Args: `fills`: nodes, equally spaced from zero.
    Source: rho int y dV over the liquid, times the scene's factor on moments.
    """
    disc = scene.disc
    if np.max(np.abs(share_across(disc, fills))) <= _SYMMETRIC_ANGLE_RAD:
        return None
    a = surface_radius(disc=disc, fill_ratio=fills)
    value = scene.liquid.density * disc.axial_width * moment_across(disc=disc, surface_radius=a)
    return smooth_table(fills, disc.moment_factor * value)
