"""Plane waves in the middle section of an imported chamber, against sums of cosines; their order."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import lru_cache
from typing import Any, Final
from unittest.mock import patch

import numpy as np

from ringbalance.mesh.chamber import FREE_SURFACE
from ringbalance.mesh.geometry import surface_radius
from ringbalance.mesh.section import middle_section
from ringbalance.physics.sloshing import sloshing_modes, sloshing_response
from ringbalance.physics.sloshing_system import SloshingSystem, imported_system, section_system
from ringbalance.scene.arrays import FloatArray
from ringbalance.scene.models import Disc, Scene
from ringbalance.verification.evidence import Curve, Evidence, Level, as_found, figure
from ringbalance.verification.orders import OrderStudy
from ringbalance.verification.reference.block_chambers import disc_chamber
from ringbalance.verification.reference.sloshing_exact import CosineWaves

_FILL: Final = 0.4
_MODES: Final = 3
_CELLS: Final = {"light": (8, 24, 2), "heavy": (16, 48, 4)}
_LEVELS: Final = {"light": (4, 8, 16), "heavy": (6, 12, 24)}
"""Radial cells of the order study."""


def compute(scene: Scene, level: Level, defect: str | None = None) -> Evidence:
    bare = replace(scene.disc, plate_thickness=0.0)
    disc = replace(bare, geometry=disc_chamber(bare, _CELLS[level]))
    depth = float(np.log(bare.outer_radius / surface_radius(disc=bare, fill_ratio=_FILL)))
    waves = CosineWaves.of(central_angle=bare.central_angle, depth=depth)
    exact = waves.frequencies(modes=_MODES)
    if defect == "forcing_backwards":
        waves = replace(waves, mixed=-waves.mixed)
    imported_system.cache_clear()
    with patch("ringbalance.physics.sloshing_system.section_system", _mutated(defect)):
        found = sloshing_modes(disc=disc, fill_ratio=_FILL, modes=_MODES).frequency_ratio
        swing = sloshing_response(
            disc=disc, fill_ratio=_FILL, angular_velocity=1.0, kinematic_viscosity=0.0, gravity=0.0
        )
    imported_system.cache_clear()
    values, widths = found.value[0], found.uncertainty[0]
    study = _still(bare, _LEVELS[level])
    moment = waves.amplification(frequency_ratio=1.0)
    push = waves.pressure_amplification(frequency_ratio=1.0, depth=depth)
    judged = {
        "plane": float(np.abs(values / exact - 1).max()),
        "held": float((np.abs(values - exact) / widths).max()),
        "forced": abs(float(swing.amplification.value[0]) / moment - 1),
        "pressure": abs(float(swing.pressure_amplification.value[0]) / push - 1),
        "still_order": study.settled_order,
        "still_error": study.finest_error,
    }
    return Evidence(
        found=as_found(**judged),
        series=(
            figure(
                "plane waves of an imported sector",
                ("wave", "1", np.arange(1.0, _MODES + 1)),
                Curve("imported mesh", "1", values),
                Curve("sum of cosines", "1", exact, style="reference"),
            ),
        ),
        convergence=(study.table("frequencies without Coriolis force, largest relative error", 2.0),),
    )


def _mutated(defect: str | None) -> Callable[..., SloshingSystem]:
    def system(mesh: Any, *, ends: float) -> SloshingSystem:
        if defect == "an_edge_of_the_surface_taken_for_a_wall":
            surface = mesh.boundaries[FREE_SURFACE]
            mesh = replace(mesh, _boundaries={**mesh.boundaries, FREE_SURFACE: surface[1:]})
        true = section_system(mesh, ends=ends)
        factor = 1.02 if defect == "coriolis_off_by_two_percent" else 1.0
        return replace(true, coriolis=factor * true.coriolis)

    return system


@lru_cache(maxsize=2)
def _still(disc: Disc, levels: tuple[int, ...]) -> OrderStudy:
    """Frequencies without Coriolis force, on meshes that become finer."""
    a = float(surface_radius(disc=disc, fill_ratio=_FILL))
    k = np.pi / disc.central_angle * np.arange(1, _MODES + 1)
    exact = np.sqrt(k * np.tanh(k * np.log(disc.outer_radius / a)))
    return OrderStudy.of(
        size=[1 / n for n in levels],
        error=[float(np.abs(_slow(disc, a, n) / exact - 1).max()) for n in levels],
    )


def _slow(disc: Disc, a: float, radial: int) -> FloatArray:
    cut = middle_section(disc_chamber(disc, (radial, 3 * radial, 2)), surface_radius=a)
    system = section_system(cut.mesh, ends=0.0)
    return replace(system, coriolis=0 * system.coriolis).natural_frequencies()[:_MODES]
