"""Decay rates along the turning tube: creeping flow at rest, fast rotation, and the bound that k(u) uses."""

from __future__ import annotations

from types import MappingProxyType
from typing import Final

import numpy as np

from ringbalance.physics.tube.development import developing_length
from ringbalance.physics.tube.rotation_table import rotating_friction_ratio
from ringbalance.scene.models import Scene
from ringbalance.verification.evidence import Evidence, Level, Reference, Table, as_found
from ringbalance.verification.navier_stokes.rotating_section import SectionMesh
from ringbalance.verification.navier_stokes.system import FlowSystem
from ringbalance.verification.reference.entry_length import slowest_decay

_CREEPING: Final = 2 * (4.46629832 + 1.46746761j)
"""Per diameter: root of z (J0^2 + J1^2) = 2 J0 J1 per radius."""
_GEOSTROPHIC: Final = 47.211
"""lambda sqrt(R), least eigenvalue of geostrophic flow over the section's depth with Ekman friction."""
_FAST: Final = (1e3, 1e4)
_POINTS: Final = {
    "light": ((20.0, 0.0), (100.0, 100.0)),
    "heavy": ((100.0, 0.0), (20.0, 200.0), (1e3, 100.0)),
}
_MESHES: Final = MappingProxyType(
    {
        "light": (
            SectionMesh(around=4, across=7, wall_ratio=30.0),
            SectionMesh(around=6, across=11, wall_ratio=50.0),
        ),
        "heavy": (
            SectionMesh(around=6, across=10, wall_ratio=15.0),
            SectionMesh(around=14, across=24, wall_ratio=200.0),
        ),
    }
)
_SPEED: Final = MappingProxyType({None: 1.0, "radius_for_bore": 1.0, "coriolis_too_weak": 0.7})


reference = {"fast": Reference(value=_GEOSTROPHIC)}


def compute(scene: Scene, level: Level, defect: str | None = None) -> Evidence:
    coarse, fine = (cells.system() for cells in _MESHES[level])
    rates = slowest_decay(system=coarse, reynolds=0.0, rotation_reynolds=0.0, count=12).rates
    exact = _CREEPING / (2 if defect == "radius_for_bore" else 1)
    fast = [_scaled(fine, rotation, _SPEED[defect]) for rotation in _FAST]
    # The limit is approached as R^(-1/4), which two rates take off.
    step = (_FAST[1] / _FAST[0]) ** 0.25
    lengths = [_lengths(coarse, *point) for point in _POINTS[level]]
    shares = [found / bound for found, bound in lengths]
    return Evidence(
        found=as_found(
            creeping=np.min(np.abs(rates + exact)) / abs(exact),
            fast=(fast[1] * step - fast[0]) / (step - 1),
            bound=max(shares),
        ),
        numbers={"slower": fast[0], "faster": fast[1], "least": min(shares)},
        tables=(
            Table(
                name="way on which a disturbance falls by e",
                columns={
                    "Re": [re for re, _ in _POINTS[level]],
                    "R": [rotation for _, rotation in _POINTS[level]],
                    "found": [found for found, _ in lengths],
                    "bound": [bound for _, bound in lengths],
                },
                units={"found": "d", "bound": "d"},
            ),
        ),
    )


def _scaled(system: FlowSystem, rotation: float, speed: float) -> float:
    found = slowest_decay(system=system, reynolds=0.0, rotation_reynolds=speed * rotation, count=1)
    return float(-found.rates[0].real * rotation**0.5)


def _lengths(system: FlowSystem, reynolds: float, rotation: float) -> tuple[float, float]:
    ratio = rotating_friction_ratio(reynolds=reynolds, rotation_reynolds=rotation).value
    bound = developing_length(reynolds=reynolds, rotation_reynolds=rotation, friction_ratio=ratio)
    found = slowest_decay(system=system, reynolds=reynolds, rotation_reynolds=rotation, count=1)
    return found.length, float(bound)
