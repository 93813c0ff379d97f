"""The integral of Eq. 11 against finite elements, and against the force balance of the whole liquid."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping

import numpy as np

from ringbalance.physics.pressure.ring import RingQuantities
from ringbalance.scene.models import Scene
from ringbalance.verification.evidence import (
    Curve,
    Evidence,
    Found,
    Level,
    Reference,
    Series,
    figure,
    from_half_width,
)
from ringbalance.verification.reference.exact_chamber import (
    exact_moment,
    wall_pressure_of,
    whole_ring_pressure,
)
from ringbalance.verification.rings import found_of, mesh_table, ring_of


def reference(scene: Scene) -> Mapping[str, Reference]:
    pressure = float(wall_pressure_of(scene, scene.disc.max_fill_ratio))
    return {"wall_pressure": Reference(value=pressure), "force_balance": Reference(value=1.0)}


def compute(scene: Scene, level: Level, defect: str | None = None) -> Evidence:
    fills = tuple((np.array([0.2, 0.4, 0.6, 0.8, 1.0]) * scene.disc.max_fill_ratio).tolist())
    ring = ring_of(scene, fills)
    pressure = found_of(ring, "wall_pressure", -1)
    if defect == "whole_ring":
        pressure = dataclasses.replace(pressure, value=whole_ring_pressure(scene))
    return Evidence(
        found={"wall_pressure": pressure, "force_balance": _balance(scene, ring)},
        numbers={"whole_ring": 1 - whole_ring_pressure(scene) / float(wall_pressure_of(scene, fills[-1]))},
        series=(_figure(scene, ring),),
        convergence=(mesh_table(ring, "wall_pressure", "Pa", len(fills) - 1),),
        status=ring.status,
    )


def _balance(scene: Scene, ring: RingQuantities) -> Found:
    """Net force of the liquid on all walls along the centre line, over omega^2 U from the closed form."""
    moment = exact_moment(disc=scene.disc, density=scene.liquid.density, fill_ratio=scene.disc.max_fill_ratio)
    centrifugal = scene.rotor.speed**2 * float(moment)
    force = float(ring.resultant_force.value[-1])
    standard_uncertainty = from_half_width(float(ring.resultant_force.uncertainty[-1]))
    return Found(value=force / centrifugal, numerical=standard_uncertainty / centrifugal)


def _figure(scene: Scene, ring: RingQuantities) -> Series:
    integrated = wall_pressure_of(scene, ring.fill_ratio)
    return figure(
        "pressure on the outer wall",
        ("fill ratio", "1", ring.fill_ratio),
        Curve("finite elements", "Pa", ring.wall_pressure.value),
        Curve("Eq. 11 integrated", "Pa", integrated, style="paper"),
    )
