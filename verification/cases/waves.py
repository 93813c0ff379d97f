"""Waves on the ring: natural frequencies and swings against exact waves, in the sector and in a mesh."""

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
from ringbalance.physics.sloshing import (
    SloshingResponse,
    default_sloshing_cells,
    resonant_fills,
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
from ringbalance.verification.evidence import Curve, Evidence, Level, Series, as_found, figure
from ringbalance.verification.orders import OrderStudy
from ringbalance.verification.reference.block_chambers import disc_chamber
from ringbalance.verification.reference.sloshing_exact import CosineWaves

_SLOSHING_MODES: Final = 4
_FILLS: Final = (0.1, 0.25, 0.5)
_POINTS: Final = {"light": 13, "heavy": 49}
_COARSE: Final = ((8, 24), (4, 12), (2, 6))
"""Meshes of the figures: three digits."""
_CORIOLIS: Final = {"coriolis_off_by_a_percent": 1.01}


def sloshing(scene: Scene, level: Level, defect: str | None = None) -> Evidence:
    """Natural frequencies of the ring against exact waves and sums of cosines, and the fills to avoid."""
    bare = replace(scene.disc, plate_thickness=0.0)
    ratios = _frequencies(bare, _CORIOLIS.get(defect or "", 1.0)) / _exact_frequencies(bare)
    judged = {
        "still": _still_deviation(bare),
        "frequencies": float(np.abs(ratios - 1).max()),
        **_forced_deviations(bare, defect),
    }
    return replace(
        _overview(scene, _POINTS[level]),
        found=as_found(**judged),
    )


@lru_cache(maxsize=2)
def _overview(scene: Scene, points: int) -> Evidence:
    """What is shown of the scene's own disc; nothing of it is judged, so no mutation changes it."""
    fills = np.linspace(0.02, 1.0, points) * scene.disc.max_fill_ratio
    ratios = sloshing_modes(
        disc=scene.disc, fill_ratio=fills, modes=_SLOSHING_MODES, cells=_COARSE
    ).frequency_ratio.value
    swings = _response(scene, fills).amplification.value
    equal = _response(scene, np.array([scene.disc.initial_fill]))
    met = dict(resonant_fills(disc=scene.disc, modes=_SLOSHING_MODES))
    return Evidence(
        found={},
        numbers={
            "first": float(ratios[-1, 0]),
            "third": met.get(3, 0.0),
            "double": float(np.interp(2.0, swings[fills > 0.2], fills[fills > 0.2])),
            "equal": float(equal.amplification.value[0]),
            "equal_pressure": float(equal.pressure_amplification.value[0]),
        },
        series=(_frequencies_figure(fills, ratios), _swings_figure(fills, swings)),
    )


def _depths(disc: Disc) -> FloatArray:
    return np.asarray(np.log(disc.outer_radius / surface_radius(disc=disc, fill_ratio=_FILLS)))


@lru_cache(maxsize=4)
def _waves(disc: Disc) -> tuple[CosineWaves, ...]:
    return tuple(CosineWaves.of(central_angle=disc.central_angle, depth=float(h)) for h in _depths(disc))


def _still_deviation(disc: Disc) -> float:
    k = np.pi / disc.central_angle * np.arange(1, _SLOSHING_MODES + 1)
    exact = np.sqrt(k * np.tanh(np.outer(_depths(disc), k)))
    return float(np.abs(_frequencies(disc, 0.0) / exact - 1).max())


@lru_cache(maxsize=4)
def _frequencies(disc: Disc, factor: float) -> FloatArray:
    """With a factor on the Coriolis force: zero for a chamber that does not turn, or a mutation."""
    turned = [replace(system, coriolis=factor * system.coriolis) for system in _systems(disc)]
    return np.array([system.natural_frequencies()[:_SLOSHING_MODES] for system in turned])


@lru_cache(maxsize=1)
def _systems(disc: Disc) -> tuple[SloshingSystem, ...]:
    cells = default_sloshing_cells(disc=disc, modes=_SLOSHING_MODES)[0]
    radii = surface_radius(disc=disc, fill_ratio=_FILLS)
    return tuple(sloshing_system(disc=disc, surface_radius=float(a), cells=cells) for a in radii)


@lru_cache(maxsize=1)
def _exact_frequencies(disc: Disc) -> FloatArray:
    return np.array([waves.frequencies(modes=_SLOSHING_MODES) for waves in _waves(disc)])


def _forced_deviations(disc: Disc, defect: str | None) -> dict[str, float]:
    """Of the swings of moment and wall pressure.

    Turning gravity backwards is the same as turning the Coriolis force of the reference round.
    """
    found = _swinging(disc)
    moments, pressures = [], []
    for waves, depth in zip(_waves(disc), _depths(disc), strict=True):
        turned = replace(waves, mixed=-waves.mixed) if defect == "forcing_backwards" else waves
        moments.append(turned.amplification(frequency_ratio=1.0))
        pressures.append(turned.pressure_amplification(frequency_ratio=1.0, depth=float(depth)))
    taken = found.amplification if defect == "pressure_swings_as_the_moment" else found.pressure_amplification
    return {
        "forced": float(np.abs(found.amplification.value / np.array(moments) - 1).max()),
        "pressure": float(np.abs(taken.value / np.array(pressures) - 1).max()),
    }


@lru_cache(maxsize=1)
def _swinging(disc: Disc) -> SloshingResponse:
    return sloshing_response(
        disc=disc, fill_ratio=_FILLS, angular_velocity=1.0, kinematic_viscosity=0.0, gravity=0.0
    )


def _response(scene: Scene, fills: FloatArray) -> SloshingResponse:
    return sloshing_response(
        disc=scene.disc,
        fill_ratio=fills,
        angular_velocity=scene.rotor.speed,
        kinematic_viscosity=scene.liquid.kinematic_viscosity,
        gravity=scene.environment.gravity,
        cells=_COARSE,
    )


def _frequencies_figure(fills: FloatArray, ratios: FloatArray) -> Series:
    return figure(
        "natural frequencies over the speed",
        ("fill ratio", "1", fills),
        *(Curve(f"mode {n + 1}", "1", np.array(column)) for n, column in enumerate(ratios.T)),
        Curve("gravity, once a turn", "1", np.ones_like(fills), style="reference"),
    )


def _swings_figure(fills: FloatArray, swings: FloatArray) -> Series:
    return figure(
        "swing of the moment over that of a surface that follows gravity at once",
        ("fill ratio", "1", fills),
        Curve("with inertia and Coriolis force", "1", swings),
        Curve("quasi-static", "1", np.ones_like(fills), style="reference"),
    )


_FILL: Final = 0.4
_IMPORTED_WAVES_MODES: Final = 3
_CELLS: Final = {"light": (8, 24, 2), "heavy": (16, 48, 4)}
_LEVELS: Final = {"light": (4, 8, 16), "heavy": (6, 12, 24)}
"""Radial cells of the order study."""


def imported_waves(scene: Scene, level: Level, defect: str | None = None) -> Evidence:
    """Plane waves in the middle section of an imported chamber, against sums of cosines; their order."""
    bare = replace(scene.disc, plate_thickness=0.0)
    disc = replace(bare, geometry=disc_chamber(bare, _CELLS[level]))
    depth = float(np.log(bare.outer_radius / surface_radius(disc=bare, fill_ratio=_FILL)))
    waves = CosineWaves.of(central_angle=bare.central_angle, depth=depth)
    exact = waves.frequencies(modes=_IMPORTED_WAVES_MODES)
    if defect == "forcing_backwards":
        waves = replace(waves, mixed=-waves.mixed)
    imported_system.cache_clear()
    with patch("ringbalance.physics.sloshing_system.section_system", _mutated(defect)):
        found = sloshing_modes(disc=disc, fill_ratio=_FILL, modes=_IMPORTED_WAVES_MODES).frequency_ratio
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
                ("wave", "1", np.arange(1.0, _IMPORTED_WAVES_MODES + 1)),
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
    k = np.pi / disc.central_angle * np.arange(1, _IMPORTED_WAVES_MODES + 1)
    exact = np.sqrt(k * np.tanh(k * np.log(disc.outer_radius / a)))
    return OrderStudy.of(
        size=[1 / n for n in levels],
        error=[float(np.abs(_slow(disc, a, n) / exact - 1).max()) for n in levels],
    )


def _slow(disc: Disc, a: float, radial: int) -> FloatArray:
    cut = middle_section(disc_chamber(disc, (radial, 3 * radial, 2)), surface_radius=a)
    system = section_system(cut.mesh, ends=0.0)
    return replace(system, coriolis=0 * system.coriolis).natural_frequencies()[:_IMPORTED_WAVES_MODES]
