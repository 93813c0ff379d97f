"""Stall by Eq. 19, stall by the true wall pressure, and priming over the crest, beside the printed range."""

# ruff: noqa: ARG001 - every case has the uniform case interface
from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np

from ringbalance.mesh.geometry import surface_radius
from ringbalance.reduced_model.paper.formulas import PAPER_DRAG_COEFFICIENT, stall_pressure, velocity_paper
from ringbalance.scene.models import Disc, Scene
from ringbalance.verification.evidence import (
    Axis,
    Curve,
    Evidence,
    Found,
    Level,
    NotRunError,
    Reference,
    Series,
)
from ringbalance.verification.paper_numbers import (
    DENSITY,
    HIGHEST_PRESSURE,
    LOWEST_PRESSURE,
    plate_uncertainty,
    with_plate,
)
from ringbalance.verification.reference.exact_chamber import exact_wall_pressure
from ringbalance.verification.sensitivity import input_uncertainty


def reference(scene: Scene) -> Mapping[str, Reference]:
    """The lower end of the printed range, for both readings."""
    return {"by_eq_19": LOWEST_PRESSURE.reference, "by_priming": LOWEST_PRESSURE.reference}


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
                input=input_uncertainty(
                    [
                        (
                            lambda t: _stall(scene, with_plate(scene.disc, t)),
                            scene.disc.plate_thickness,
                            plate_uncertainty(scene),
                        )
                    ]
                ),
            ),
            # Anything between the two bounds is equally likely: a rectangular distribution.
            "by_priming": Found(
                value=_priming(scene, scene.tube.hump_radius), input=(high - low) / (2 * math.sqrt(3))
            ),
        },
        numbers={
            "by_ring": float(_wall(scene, scene.disc.max_fill_ratio)),
            "scene_hump": scene.tube.hump_radius,
            "priming_low": low,
            "priming_high": high,
            "velocity_high": _velocity(scene, HIGHEST_PRESSURE.value),
        },
        series=(_figure(scene),),
    )


def _stall(scene: Scene, disc: Disc) -> float:
    return float(stall_pressure(disc=disc, density=DENSITY, angular_velocity=scene.rotor.speed))


def _wall(scene: Scene, fill: float) -> float:
    return float(
        exact_wall_pressure(
            disc=scene.disc, density=DENSITY, angular_velocity=scene.rotor.speed, fill_ratio=fill
        )
    )


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
    return Series(
        name="pressure that starts the flow from an almost empty chamber",
        x=Axis(name="inner radius of the siphon crest", unit="m", values=radius),
        y=(
            Curve(name="priming, other chamber vented", unit="Pa", values=priming),
            Curve(name="0.54 MPa", unit="Pa", values=lowest, style="paper"),
            Curve(name="stall by Eq. 19", unit="Pa", values=stall, style="reference"),
        ),
    )
