"""Stall by Eq. 19, stall by the true wall pressure, and priming over the crest, beside the printed range."""

from __future__ import annotations

import numpy as np

from ringbalance.mesh.geometry import surface_radius
from ringbalance.reduced_model.paper.formulas import PAPER_DRAG_COEFFICIENT, stall_pressure, velocity_paper
from ringbalance.scene.models import Disc, Scene
from ringbalance.verification.comparison import from_range
from ringbalance.verification.evidence import Curve, Evidence, Found, Level, NotRunError, Series, figure
from ringbalance.verification.paper_numbers import DENSITY, HIGHEST_PRESSURE, LOWEST_PRESSURE, plate_effect
from ringbalance.verification.reference.exact_chamber import wall_pressure_of

reference = dict.fromkeys(("by_eq_19", "by_priming"), LOWEST_PRESSURE.reference)


def compute(scene: Scene, level: Level, defect: str | None = None) -> Evidence:
    """Stall and priming pressures. Raises: NotRunError: a scene without a crest."""
    if scene.tube.hump_radius is None:
        raise NotRunError("the scene's tube has no siphon crest to prime over")
    ring_radius = float(surface_radius(disc=scene.disc, fill_ratio=scene.disc.max_fill_ratio))
    low, high = (_priming(scene, radius) for radius in (ring_radius, scene.disc.inner_radius))
    return Evidence(
        found={
            "by_eq_19": Found(
                value=_stall(scene, scene.disc),
                input=plate_effect(scene, lambda disc: _stall(scene, disc)),
            ),
            # Anything between the two bounds is equally likely: a rectangular distribution.
            "by_priming": Found(value=_priming(scene, scene.tube.hump_radius), input=from_range((low, high))),
        },
        numbers={
            "by_ring": float(wall_pressure_of(scene, scene.disc.max_fill_ratio, density=DENSITY)),
            "scene_hump": scene.tube.hump_radius,
            "priming_low": low,
            "priming_high": high,
            "velocity_high": _velocity(scene, HIGHEST_PRESSURE.value),
        },
        series=(_figure(scene),),
    )


def _stall(scene: Scene, disc: Disc) -> float:
    return float(stall_pressure(disc=disc, density=DENSITY, angular_velocity=scene.rotor.speed))


def _priming(scene: Scene, hump_radius: float) -> float:
    """Gas pressure that lifts an almost empty chamber's liquid over the crest, the other side vented."""
    lift = (scene.disc.outer_radius - hump_radius) * (scene.disc.outer_radius + hump_radius) / 2
    return DENSITY * scene.rotor.speed**2 * lift


def _velocity(scene: Scene, pressure: float) -> float:
    return float(
        velocity_paper(
            disc=scene.disc,
            density=DENSITY,
            angular_velocity=scene.rotor.speed,
            drag_coefficient=PAPER_DRAG_COEFFICIENT,
            gas_pressure=pressure,
            fill_ratio=scene.disc.max_fill_ratio / 2,
        )
    )


def _figure(scene: Scene) -> Series:
    radius = np.linspace(scene.disc.inner_radius, scene.disc.outer_radius, 61)
    priming = np.array([_priming(scene, float(r)) for r in radius])
    lowest = np.full(radius.shape, LOWEST_PRESSURE.value)
    stall = np.full(radius.shape, _stall(scene, scene.disc))
    return figure(
        "pressure that starts the flow from an almost empty chamber",
        ("inner radius of the siphon crest", "m", radius),
        Curve("priming, other chamber vented", "Pa", priming),
        Curve("0.54 MPa", "Pa", lowest, style="paper"),
        Curve("stall by Eq. 19", "Pa", stall, style="reference"),
    )
