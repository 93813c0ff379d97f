"""Stall by Eq. 19, stall by the true wall pressure, and priming over the crest, beside the printed range."""

from __future__ import annotations

import numpy as np

from ringbalance.physics.pressure.hydrostatics import hydrostatic_pressure
from ringbalance.reduced_model.paper import PAPER_DRAG_COEFFICIENT, stall_pressure, velocity_from_pressures
from ringbalance.scene.models import Scene
from ringbalance.verification.evidence import Curve, Evidence, Level, NotRunError, Series, as_found, figure
from ringbalance.verification.paper_numbers import DENSITY, HIGHEST_PRESSURE, LOWEST_PRESSURE
from ringbalance.verification.reference.exact_chamber import wall_pressure_of

reference = dict.fromkeys(("by_eq_19", "by_priming"), LOWEST_PRESSURE.reference)


def compute(scene: Scene, level: Level, defect: str | None = None) -> Evidence:
    """Stall and priming pressures. Raises: NotRunError: a scene without a crest."""
    if scene.tube.hump_radius is None:
        raise NotRunError("the scene's tube has no siphon crest to prime over")
    return Evidence(
        found=as_found(by_eq_19=_stall(scene), by_priming=_priming(scene, scene.tube.hump_radius)),
        numbers={
            "by_ring": float(wall_pressure_of(scene, scene.disc.max_fill_ratio, density=DENSITY)),
            "scene_hump": scene.tube.hump_radius,
            "velocity_high": _velocity(HIGHEST_PRESSURE.value),
        },
        series=(_figure(scene),),
    )


def _stall(scene: Scene) -> float:
    return stall_pressure(disc=scene.disc, density=DENSITY, angular_velocity=scene.rotor.speed)


def _priming(scene: Scene, hump_radius: float) -> float:
    """Gas pressure that lifts an almost empty chamber's liquid over the crest, the other side vented."""
    omega, outer = scene.rotor.speed, scene.disc.outer_radius
    return hydrostatic_pressure(density=DENSITY, angular_velocity=omega, inner=hump_radius, outer=outer)


def _velocity(pressure: float) -> float:
    """At equal fills, where gas alone drives."""
    return float(
        velocity_from_pressures(
            density=DENSITY, drag_coefficient=PAPER_DRAG_COEFFICIENT, pressure_difference=pressure
        )
    )


def _figure(scene: Scene) -> Series:
    radius = np.linspace(scene.disc.inner_radius, scene.disc.outer_radius, 61)
    priming = np.array([_priming(scene, float(r)) for r in radius])
    lowest = np.full(radius.shape, LOWEST_PRESSURE.value)
    stall = np.full(radius.shape, _stall(scene))
    return figure(
        "pressure that starts the flow from an almost empty chamber",
        ("inner radius of the siphon crest", "m", radius),
        Curve("priming, other chamber vented", "Pa", priming),
        Curve("0.54 MPa", "Pa", lowest, style="paper"),
        Curve("stall by Eq. 19", "Pa", stall, style="reference"),
    )
