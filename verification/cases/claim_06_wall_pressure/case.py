"""Eq. 12 against finite elements over fill, plate thickness, speed and gravity."""

# ruff: noqa: ARG001 - every case has the uniform case interface
from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from typing import Final

import numpy as np

from ringbalance.mesh.geometry import chamber_volume
from ringbalance.physics.pressure.ring import RingQuantities, ring_quantities
from ringbalance.reduced_model.paper.formulas import wall_pressure_paper
from ringbalance.scene.arrays import FloatArray
from ringbalance.scene.models import Disc, Scene
from ringbalance.verification.evidence import (
    Axis,
    Curve,
    Evidence,
    Level,
    Reference,
    Series,
    Table,
)
from ringbalance.verification.paper_numbers import plate_uncertainty, with_plate
from ringbalance.verification.reference.exact_chamber import exact_wall_pressure
from ringbalance.verification.rings import found_of, mesh_table, ring_of
from ringbalance.verification.sensitivity import input_uncertainty

_SHARES: Final = (0.1, 0.3, 0.5, 0.7, 0.9, 1.0)
"""Of the largest fill."""
_JUDGED: Final = {"thin": 0, "half": 2, "full": 5}
_SPEEDS: Final = (0.1, 0.2, 0.5, 1.0)
"""Of the scene's speed, for the table."""


def reference(scene: Scene) -> Mapping[str, Reference]:
    """Eq. 12."""
    fills = np.array(_fills(scene))
    by_eq_12 = _eq_12(scene, scene.disc, fills)
    return {name: Reference(value=float(by_eq_12[index])) for name, index in _JUDGED.items()}


def compute(scene: Scene, level: Level, defect: str | None = None) -> Evidence:
    """Wall pressure by finite elements over the fill range."""
    fills = _fills(scene)
    ring = ring_of(scene, fills)
    x = np.array(fills)
    shortfall = 1 - _eq_12(scene, scene.disc, x) / ring.wall_pressure.value
    bare = with_plate(scene.disc, 0.0)
    bare_ratio = _eq_12(scene, bare, x) / _exact(scene, bare, x)
    gravity = _gravity_table(scene)
    return Evidence(
        found={
            name: found_of(ring, "wall_pressure", index, input_=_standard_uncertainty(scene, fills[index]))
            for name, index in _JUDGED.items()
        },
        numbers={
            "shortfall_full": float(shortfall[-1]),
            "shortfall_thin": float(shortfall[0]),
            "bare_difference": float(np.max(np.abs(bare_ratio - 1))),
            "gravity": float(gravity.columns["change by gravity"][-1]),
        },
        series=(_over_fill(scene, ring), _over_plates(scene)),
        convergence=(mesh_table(ring, "wall_pressure", "Pa", len(fills) - 1),),
        tables=(gravity,),
        status=ring.status,
    )


def _fills(scene: Scene) -> tuple[float, ...]:
    return tuple(share * scene.disc.max_fill_ratio for share in _SHARES)


def _eq_12(scene: Scene, disc: Disc, fill: FloatArray) -> FloatArray:
    return wall_pressure_paper(
        disc=disc,
        density=scene.liquid.density,
        angular_velocity=scene.rotor.speed,
        liquid_volume=fill * chamber_volume(disc=disc),
    )


def _exact(scene: Scene, disc: Disc, fill: FloatArray) -> FloatArray:
    return exact_wall_pressure(
        disc=disc,
        density=scene.liquid.density,
        angular_velocity=scene.rotor.speed,
        fill_ratio=fill,
    )


def _standard_uncertainty(scene: Scene, fill: float) -> float:
    """Input uncertainty of the difference: the plates are in the finite elements and in Eq. 12's volume."""

    def difference(thickness: float) -> float:
        disc, x = with_plate(scene.disc, thickness), np.array([fill])
        return float((_exact(scene, disc, x) - _eq_12(scene, disc, x))[0])

    return input_uncertainty([(difference, scene.disc.plate_thickness, plate_uncertainty(scene))])


def _over_fill(scene: Scene, ring: RingQuantities) -> Series:
    return Series(
        name="pressure on the outer wall",
        x=Axis(name="fill ratio", unit="1", values=ring.fill_ratio),
        y=(
            Curve(
                name="finite elements",
                unit="Pa",
                values=ring.wall_pressure.value,
                uncertainty=ring.wall_pressure.uncertainty,
            ),
            Curve(name="Eq. 12", unit="Pa", values=_eq_12(scene, scene.disc, ring.fill_ratio), style="paper"),
        ),
    )


def _over_plates(scene: Scene) -> Series:
    """Relative error of Eq. 12 against plate thickness, at the smallest and the largest fill."""
    widest = 0.5 * scene.disc.inner_radius * np.sin(scene.disc.central_angle / 2)
    thickness = np.linspace(0, widest, 21)
    fills = np.array([0.02, 1.0]) * scene.disc.max_fill_ratio
    error = np.array(
        [
            _eq_12(scene, with_plate(scene.disc, t), fills) / _exact(scene, with_plate(scene.disc, t), fills)
            - 1
            for t in thickness
        ]
    )
    return Series(
        name="error of Eq. 12 against the thickness of the plates",
        x=Axis(name="plate thickness", unit="m", values=thickness),
        y=(
            Curve(name="thin ring", unit="1", values=error[:, 0], style="paper"),
            Curve(name="largest fill", unit="1", values=error[:, 1], style="paper"),
        ),
    )


def _gravity_table(scene: Scene) -> Table:
    """Mean wall pressure over a turn with gravity, relative to that without, at falling speeds."""
    speeds = [share * scene.rotor.speed for share in _SPEEDS]
    rings = [_with_gravity(scene, speed) for speed in speeds]
    middle = scene.disc.max_fill_ratio / 2
    plain = [float(_exact(_at_speed(scene, speed), scene.disc, np.array(middle))) for speed in speeds]
    pairs = list(zip(rings, plain, strict=True))
    return Table(
        name="gravity across the shaft: change of the mean wall pressure, and its ripple over a turn",
        columns={
            "speed": speeds,
            "change by gravity": [float(ring.wall_pressure.value[0]) / exact - 1 for ring, exact in pairs],
            "ripple": [float(ring.ripple["wall_pressure"][0]) / exact for ring, exact in pairs],
            "ring": ["closed" if bool(ring.closed[0]) else "no closed ring" for ring in rings],
        },
        units={"speed": "rad/s", "change by gravity": "1", "ripple": "1"},
    )


def _at_speed(scene: Scene, speed: float) -> Scene:
    return dataclasses.replace(scene, rotor=dataclasses.replace(scene.rotor, speed=speed))


def _with_gravity(scene: Scene, speed: float) -> RingQuantities:
    return ring_quantities(
        disc=scene.disc,
        density=scene.liquid.density,
        angular_velocity=speed,
        fill_ratio=scene.disc.max_fill_ratio / 2,
        gravity=scene.environment.gravity,
        dimension=2,
    )
