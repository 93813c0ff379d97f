"""Volumes and the ring's inner radius from the exact area."""

# ruff: noqa: ARG001 - every case has the uniform case interface
from __future__ import annotations

from collections.abc import Callable, Mapping

import numpy as np

from ringbalance.mesh.geometry import chamber_volume, surface_radius
from ringbalance.reduced_model.paper.formulas import surface_radius_paper
from ringbalance.scene.models import Disc, Scene
from ringbalance.verification.evidence import Axis, Curve, Evidence, Found, Level, Reference, Series
from ringbalance.verification.paper_numbers import (
    INITIAL_LIQUID_VOLUME,
    MAX_LIQUID_VOLUME,
    RING_RADIUS,
    plate_uncertainty,
    with_plate,
)
from ringbalance.verification.sensitivity import input_uncertainty

_HALF = 0.5
_QUARTER = 0.25


def reference(scene: Scene) -> Mapping[str, Reference]:
    """The printed radius and volumes."""
    return {
        "ring_radius": RING_RADIUS.reference,
        "max_liquid": MAX_LIQUID_VOLUME.reference,
        "initial_liquid": INITIAL_LIQUID_VOLUME.reference,
    }


def compute(scene: Scene, level: Level, defect: str | None = None) -> Evidence:
    """Radius and volumes from the exact area."""

    def found(quantity: Callable[[Disc], float]) -> Found:
        return Found(
            value=quantity(scene.disc),
            input=input_uncertainty(
                [
                    (
                        lambda t: quantity(with_plate(scene.disc, t)),
                        scene.disc.plate_thickness,
                        plate_uncertainty(scene),
                    )
                ]
            ),
        )

    bare = with_plate(scene.disc, 0.0)
    return Evidence(
        found={
            "ring_radius": found(_half_full_radius),
            "max_liquid": found(lambda disc: _HALF * chamber_volume(disc=disc)),
            "initial_liquid": found(lambda disc: _QUARTER * chamber_volume(disc=disc)),
        },
        numbers={"radius_bare": _half_full_radius(bare)},
        series=(_radius_over_fill(scene.disc, bare),),
    )


def _half_full_radius(disc: Disc) -> float:
    return float(surface_radius(disc=disc, fill_ratio=_HALF))


def _radius_over_fill(disc: Disc, bare: Disc) -> Series:
    x = np.linspace(0, _HALF, 51)
    by_eq_3 = surface_radius_paper(disc=disc, liquid_volume=x * chamber_volume(disc=disc) * (1 - 1e-9))
    curves = (
        Curve(name="exact area", unit="m", values=surface_radius(disc=disc, fill_ratio=x)),
        Curve(name="Eq. 3", unit="m", values=by_eq_3, style="paper"),
        Curve(name="no plates", unit="m", values=surface_radius(disc=bare, fill_ratio=x), style="reference"),
    )
    return Series(name="inner radius of the ring", x=Axis(name="fill ratio", unit="1", values=x), y=curves)
