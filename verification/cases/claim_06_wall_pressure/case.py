"""Eq. 12 against finite elements over fill, plate thickness, speed and gravity."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from typing import Final

import numpy as np

from ringbalance.mesh.geometry import chamber_volume
from ringbalance.physics.pressure.ring import RingQuantities, ring_quantities
from ringbalance.reduced_model.paper import wall_pressure_paper
from ringbalance.scene.arrays import FloatArray
from ringbalance.scene.models import Disc, Scene
from ringbalance.verification.evidence import Curve, Evidence, Found, Level, Reference, Series, Table, figure
from ringbalance.verification.paper_numbers import with_plate
from ringbalance.verification.reference.exact_chamber import wall_pressure_of, whole_ring_pressure
from ringbalance.verification.rings import found_of, mesh_table, ring_of

_SHARES: Final = (0.1, 0.3, 0.5, 0.7, 0.9, 1.0)
"""Of the largest fill."""
_JUDGED: Final = {"thin": 0, "half": 2, "full": 5}
_SPEEDS: Final = (0.1, 0.2, 0.5, 1.0)
"""Of the scene's speed, for the table."""


def reference(scene: Scene) -> Mapping[str, Reference]:
    fills = np.array(_fills(scene))
    by_eq_12 = _eq_12(scene, scene.disc, fills)
    return {name: Reference(value=float(by_eq_12[index])) for name, index in _JUDGED.items()} | {
        "without_plates": Reference(value=1.0)
    }


def values(scene: Scene) -> Mapping[str, float]:
    pressure = wall_pressure_of(scene, np.array(_fills(scene)))
    return {name: float(pressure[index]) for name, index in _JUDGED.items()}


def compute(scene: Scene, level: Level, defect: str | None = None) -> Evidence:
    fills = _fills(scene)
    ring = ring_of(scene, fills)
    x = np.array(fills)
    shortfall = 1 - _eq_12(scene, scene.disc, x) / ring.wall_pressure.value
    bare = with_plate(scene.disc, 0.0)
    by_eq_12 = _eq_12(scene, bare, x)
    # What Eq. 12 gives for a volume is its pressure in a ring that no plates take anything from.
    same_volume = x * chamber_volume(disc=scene.disc) / chamber_volume(disc=bare)
    corrected = wall_pressure_of(scene, same_volume, disc=bare)
    gravity = _gravity_table(scene)
    return Evidence(
        found={
            name: dataclasses.replace(
                found_of(ring, "wall_pressure", index), corrected=float(corrected[index])
            )
            for name, index in _JUDGED.items()
        }
        | {"without_plates": _shape(scene, bare, float(by_eq_12[-1]), whole_ring=defect == "whole_ring")},
        numbers={
            "shortfall_full": float(shortfall[-1]),
            "shortfall_thin": float(shortfall[0]),
            "bare_difference": float(np.max(np.abs(by_eq_12 / wall_pressure_of(scene, x, disc=bare) - 1))),
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


def _shape(scene: Scene, bare: Disc, by_eq_12: float, *, whole_ring: bool) -> Found:
    """Finite elements over Eq. 12 at the largest fill of a disc without plates."""
    given = dataclasses.replace(scene, disc=bare)
    pressure = found_of(ring_of(given, (bare.max_fill_ratio,)), "wall_pressure", 0)
    if whole_ring:
        pressure = dataclasses.replace(pressure, value=whole_ring_pressure(given))
    return pressure.scaled(1 / by_eq_12)


def _over_fill(scene: Scene, ring: RingQuantities) -> Series:
    return figure(
        "pressure on the outer wall",
        ("fill ratio", "1", ring.fill_ratio),
        Curve("finite elements", "Pa", ring.wall_pressure.value, uncertainty=ring.wall_pressure.uncertainty),
        Curve("Eq. 12", "Pa", _eq_12(scene, scene.disc, ring.fill_ratio), style="paper"),
    )


def _over_plates(scene: Scene) -> Series:
    """Relative error of Eq. 12 against plate thickness, at the smallest and the largest fill."""
    widest = 0.5 * scene.disc.inner_radius * np.sin(scene.disc.central_angle / 2)
    thickness = np.linspace(0, widest, 21)
    fills = np.array([0.02, 1.0]) * scene.disc.max_fill_ratio
    discs = [with_plate(scene.disc, t) for t in thickness]
    ratio = [_eq_12(scene, disc, fills) / wall_pressure_of(scene, fills, disc=disc) for disc in discs]
    error = np.array(ratio) - 1
    return figure(
        "error of Eq. 12 against the thickness of the plates",
        ("plate thickness", "m", thickness),
        Curve("thin ring", "1", error[:, 0], style="paper"),
        Curve("largest fill", "1", error[:, 1], style="paper"),
    )


def _gravity_table(scene: Scene) -> Table:
    """Mean wall pressure over a turn with gravity, relative to that without, at falling speeds."""
    speeds = [share * scene.rotor.speed for share in _SPEEDS]
    rings = [_with_gravity(scene, speed) for speed in speeds]
    middle = scene.disc.max_fill_ratio / 2
    plain = [float(wall_pressure_of(_at_speed(scene, speed), middle)) for speed in speeds]
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
