"""Waves on the ring: natural frequencies and swings against exact waves, in the sector and in a mesh."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import lru_cache
from typing import Any, Final
from unittest.mock import patch

import numpy as np
import numpy.typing as npt

from ringbalance.mesh.chamber import FREE_SURFACE
from ringbalance.mesh.geometry import surface_radius
from ringbalance.mesh.section import middle_section
from ringbalance.physics.results import Estimate
from ringbalance.physics.sloshing import (
    SloshingResponse,
    default_sloshing_cells,
    sloshing_modes,
    sloshing_response,
)
from ringbalance.physics.sloshing_system import (
    SloshingSystem,
    imported_system,
    section_system,
    sloshing_system,
)
from ringbalance.scene.arrays import FloatArray
from ringbalance.scene.models import Disc, Scene
from ringbalance.verification.evidence import Convergence, Evidence, FigureCurve, Level, as_found, figure
from ringbalance.verification.reference.chambers import CosineWaves, disc_chamber

_BACKWARDS: Final = "forcing_backwards"
"""Mutation of the reference alone."""
_MODES: Final = 4
_FILLS: Final = (0.1, 0.25, 0.5)
_IMPORTED_FILL: Final = 0.4
_IMPORTED_MODES: Final = 3
_CELLS: Final = {"light": (8, 24, 2), "heavy": (16, 48, 4)}
_LEVELS: Final = {"light": (3, 5, 9), "heavy": (5, 9, 17)}
"""Radial cells of the order study: odd, so that a surface at half the depth cuts every mesh alike."""


def sloshing(scene: Scene, level: Level, defect: str | None = None) -> Evidence:
    """Natural frequencies of the ring, and its swing, against exact waves and sums of cosines."""
    bare = replace(scene.disc, plate_thickness=0.0)
    factor = 1.01 if defect == "coriolis_off_by_a_percent" else 1.0
    swing = _swing(bare, _FILLS)
    if defect == "pressure_swings_as_the_moment":
        swing = replace(swing, pressure_amplification=swing.amplification)
    still = _ring_frequencies(bare, 0.0) / _without_coriolis(bare, _depths(bare, _FILLS), _MODES)
    turning = _ring_frequencies(bare, factor) / _exact_frequencies(bare)
    return Evidence(
        quantities=as_found(
            still=np.abs(still - 1).max(),
            frequencies=np.abs(turning - 1).max(),
            **_swing_errors(bare, _FILLS, swing, backwards=defect == _BACKWARDS),
        )
    )


def _depths(disc: Disc, fills: Sequence[float]) -> FloatArray:
    """Depths H = ln(R2/a)."""
    return np.asarray(np.log(disc.outer_radius / surface_radius(disc=disc, fill_ratio=fills)))


def _without_coriolis(disc: Disc, depths: npt.ArrayLike, modes: int) -> FloatArray:
    """Frequencies over the speed, sqrt(k tanh(k H)) with k = n pi/theta, shape (depths, modes)."""
    k = np.pi / disc.central_angle * np.arange(1, modes + 1)
    return np.asarray(np.sqrt(k * np.tanh(np.multiply.outer(depths, k))))


@lru_cache(maxsize=4)
def _waves(disc: Disc, fills: tuple[float, ...]) -> tuple[CosineWaves, ...]:
    depths = _depths(disc, fills).tolist()
    return tuple(CosineWaves.of(central_angle=disc.central_angle, depth=depth) for depth in depths)


@lru_cache(maxsize=1)
def _exact_frequencies(disc: Disc) -> FloatArray:
    return np.array([waves.frequencies(modes=_MODES) for waves in _waves(disc, _FILLS)])


@lru_cache(maxsize=4)
def _ring_frequencies(disc: Disc, factor: float) -> FloatArray:
    """Natural frequencies with a factor on the Coriolis force: zero without rotation, or a mutation."""
    cells = default_sloshing_cells(disc=disc, modes=_MODES)[0]
    radii = surface_radius(disc=disc, fill_ratio=_FILLS).tolist()
    systems = (sloshing_system(disc=disc, surface_radius=a, cells=cells) for a in radii)
    return np.array([_frequencies(system, factor)[:_MODES] for system in systems])


def _frequencies(system: SloshingSystem, factor: float) -> FloatArray:
    return replace(system, coriolis=factor * system.coriolis).natural_frequencies()


def _swing(disc: Disc, fills: tuple[float, ...]) -> SloshingResponse:
    return sloshing_response(
        disc=disc, fill_ratio=fills, angular_velocity=1.0, kinematic_viscosity=0.0, gravity=0.0
    )


def _swing_errors(
    disc: Disc, fills: tuple[float, ...], swing: SloshingResponse, *, backwards: bool
) -> dict[str, float]:
    """Relative errors of moment and wall pressure.

    Gravity that turns backwards has the same effect as a reversed Coriolis force of the reference.
    """
    turned = [replace(each, mixed=-each.mixed) if backwards else each for each in _waves(disc, fills)]
    moments = [waves.amplification(frequency_ratio=1.0) for waves in turned]
    pressures = [
        waves.pressure_amplification(frequency_ratio=1.0, depth=depth)
        for waves, depth in zip(turned, _depths(disc, fills).tolist(), strict=True)
    ]
    return {
        "forced": np.abs(swing.amplification.value / np.array(moments) - 1).max(),
        "pressure": np.abs(swing.pressure_amplification.value / np.array(pressures) - 1).max(),
    }


def imported_waves(scene: Scene, level: Level, defect: str | None = None) -> Evidence:
    """Plane waves in the middle section of an imported chamber, against sums of cosines; their order."""
    bare, fills = replace(scene.disc, plate_thickness=0.0), (_IMPORTED_FILL,)
    exact = _waves(bare, fills)[0].frequencies(modes=_IMPORTED_MODES)
    frequencies, swing = _imported(bare, _CELLS[level], None if defect == _BACKWARDS else defect)
    values, widths = frequencies.value[0], frequencies.uncertainty[0]
    study = _still_study(bare, _LEVELS[level])
    shown = figure(
        "plane waves of an imported sector",
        ("wave", "1", np.arange(1.0, _IMPORTED_MODES + 1)),
        FigureCurve("imported mesh", "1", values),
        FigureCurve("sum of cosines", "1", exact, style="reference"),
    )
    return Evidence(
        quantities=as_found(
            plane=np.abs(values / exact - 1).max(),
            held=(np.abs(values - exact) / widths).max(),
            **_swing_errors(bare, fills, swing, backwards=defect == _BACKWARDS),
            still_order=study.settled_order,
            still_error=study.finest_error,
        ),
        series=(shown,),
        convergence=(study,),
    )


@lru_cache(maxsize=4)
def _imported(
    bare: Disc, cells: tuple[int, int, int], defect: str | None
) -> tuple[Estimate, SloshingResponse]:
    """Natural frequencies over the speed and the swing of an imported sector without plates."""
    disc, fills = replace(bare, geometry=disc_chamber(bare, cells)), (_IMPORTED_FILL,)

    def system(mesh: Any, *, ends: float) -> SloshingSystem:
        if defect == "an_edge_of_the_surface_taken_for_a_wall":
            surface = mesh.boundaries[FREE_SURFACE]
            mesh = replace(mesh, _boundaries={**mesh.boundaries, FREE_SURFACE: surface[1:]})
        true = section_system(mesh, ends=ends)
        factor = 1.02 if defect == "coriolis_off_by_two_percent" else 1.0
        return replace(true, coriolis=factor * true.coriolis)

    imported_system.cache_clear()
    with patch("ringbalance.physics.sloshing_system.section_system", system):
        frequencies = sloshing_modes(disc=disc, fill_ratio=fills, modes=_IMPORTED_MODES).frequency_ratio
        swing = _swing(disc, fills)
    imported_system.cache_clear()
    return frequencies, swing


@lru_cache(maxsize=2)
def _still_study(disc: Disc, levels: tuple[int, ...]) -> Convergence:
    """Frequencies without Coriolis force at half the depth, on meshes that become finer."""
    a = (disc.inner_radius + disc.outer_radius) / 2
    exact = _without_coriolis(disc, np.log(disc.outer_radius / a), _IMPORTED_MODES)
    errors = []
    for radial in levels:
        cut = middle_section(disc_chamber(disc, (radial, 3 * radial, 2)), surface_radius=a)
        frequencies = _frequencies(section_system(cut.mesh, ends=0.0), 0.0)[:_IMPORTED_MODES]
        errors.append(float(np.abs(frequencies / exact - 1).max()))
    quantity = "frequencies without Coriolis force, largest relative error"
    return Convergence.of_errors(quantity, 2.0, size=[1 / n for n in levels], error=errors)
