"""Waves in imported chambers: plane ones, those of a full ring in closed form, and the order of accuracy."""

from __future__ import annotations

from dataclasses import replace
from functools import lru_cache
from typing import Final

import numpy as np

from ringbalance.mesh.geometry import surface_radius
from ringbalance.physics.sloshing.imported import WaveSystem, answer, frequencies, wave_system
from ringbalance.scene.arrays import FloatArray
from ringbalance.scene.chamber_file.record import CellKind
from ringbalance.scene.models import Disc, Scene
from ringbalance.verification.evidence import Curve, Evidence, Level, as_found, figure
from ringbalance.verification.orders import OrderStudy
from ringbalance.verification.reference.block_chambers import block_chamber, disc_chamber, sector_chamber
from ringbalance.verification.reference.sloshing_exact import CosineWaves, ring_frequencies, still_frequency

_FILL: Final = 0.4
_PLANE_CELLS: Final = {"light": (10, 12, 8), "heavy": (16, 20, 14)}
_RING: Final = (0.6, 0.8, 1.4)
"""Inner radius, surface and width of a full ring, in outer radii."""
_RING_CELLS: Final = {"light": (4, 28, 8), "heavy": (6, 40, 12)}
_RING_WAVES: Final = 7
_LEVELS: Final = {"light": ((4, 4, 3), (6, 6, 5), (8, 8, 6)), "heavy": ((4, 4, 3), (8, 8, 6), (16, 16, 12))}
_SECTOR: Final = (0.5, 0.75, np.pi / 2, 1.2)
"""Inner radius, surface, angle and width of a sector, in outer radii."""
_BOX: Final = (2000.0, 0.5, (1.0, 1.002))
"""Distance from the shaft, depth, and width and length of a box, whose first two waves are 0.1 % apart."""
_BOX_CELLS: Final = {"light": (8, 6, 6), "heavy": (12, 9, 9)}
_CLOSE: Final = 0.01
"""Relative distance of waves that the mutation takes for one."""
_MISSING: Final = 1e3
"""Deviation over uncertainty of a wave that is not listed."""
_STILL: Final = ((1, 0), (0, 1), (1, 1), (2, 0))
"""Half waves round and along of the waves whose order is judged."""


def compute(scene: Scene, level: Level, defect: str | None = None) -> Evidence:
    ring, exact = _spoiled(_ring(level), defect), _exact_ring()
    values, shares, widths = frequencies(ring, _RING_WAVES + 2)
    nearest = np.abs(values[:, None] - exact).argmin(axis=0)
    off = np.abs(values[nearest] - exact)
    plane = shares[nearest] < 0.02
    study = _still(level, defect)
    judged = {
        **_plane(replace(scene.disc, plate_thickness=0.0), level, defect),
        "ring": float((off / exact).max()),
        "ring_plane": float((off / exact)[plane].max()) if plane.any() else 1.0,
        "ring_held": float((off / widths[nearest]).max()),
        "still_order": study.settled_order,
        "still_error": study.finest_error,
        **_pair(level, defect),
    }
    return Evidence(
        found=as_found(**judged),
        numbers={"vortical": float(shares[nearest].max()), "unknowns": float(ring.unknowns)},
        series=(
            figure(
                "waves of a full ring",
                ("wave", "1", np.arange(1.0, _RING_WAVES + 1)),
                Curve("imported mesh", "1", values[nearest]),
                Curve("closed form", "1", exact, style="reference"),
            ),
        ),
        convergence=(study.table("frequencies without Coriolis force, largest relative error", 4.0),),
    )


def _spoiled(system: WaveSystem, defect: str | None) -> WaveSystem:
    reduced = system.reduced
    if defect == "coriolis_off_by_two_percent":
        reduced = replace(reduced, coriolis=1.02 * reduced.coriolis)
    if defect == "gravity_backwards":
        reduced = replace(reduced, coriolis=-reduced.coriolis)
    if defect == "potentials_alone":
        reduced = replace(reduced, levels=(reduced.levels[0],) * 2)
    return replace(system, reduced=reduced)


@lru_cache(maxsize=2)
def _ring(level: Level) -> WaveSystem:
    inner, a, width = _RING
    geometry = sector_chamber(_RING_CELLS[level], radii=(inner, 1.0), angle=2 * np.pi, width=width)
    return wave_system(geometry, a, 0.0, _RING_WAVES + 1, 2)


def _pair(level: Level, defect: str | None) -> dict[str, float]:
    """A box far from the shaft, nearly as wide as long: s^2 = far k tanh(k depth) twice, nearly."""
    system = _box(level)
    if defect == "close_waves_listed_once":
        fast = system.reduced.fast
        kept = np.append(True, np.diff(fast.frequency) > _CLOSE * fast.frequency[1:])
        parts = (part[kept] for part in (fast.frequency, fast.error, fast.vortical_share))
        frequency, error, shares = parts
        fast = replace(fast, frequency=frequency, error=error, vortical_share=shares)
        system = replace(system, reduced=replace(system.reduced, fast=fast))
    values, _, widths = frequencies(system, 3)
    far, depth, sides = _BOX
    k = np.pi * np.sort([1 / sides[0], 1 / sides[1], np.hypot(*np.reciprocal(sides))])
    exact = np.sqrt(far * k * np.tanh(k * depth))
    listed = min(values.size, 3)
    off = np.abs(values[:listed] - exact[:listed])
    return {
        "pair": float((off / exact[:listed]).max()) if listed == 3 else 1.0,
        "pair_held": float((off / widths[:listed]).max()) if listed == 3 else _MISSING,
    }


@lru_cache(maxsize=2)
def _box(level: Level) -> WaveSystem:
    far, depth, (across, along) = _BOX

    def place(cube: FloatArray) -> FloatArray:
        x, y, z = np.moveaxis(cube - 0.5, -1, 0)
        return np.stack([far + 2 * depth * x, across * y, along * z], axis=-1)

    return wave_system(block_chamber(_BOX_CELLS[level], place), far, 0.0, 3, 2)


@lru_cache(maxsize=1)
def _exact_ring() -> FloatArray:
    _, a, width = _RING
    pairs = [(m, n) for m in range(5) for n in range(3) if m + n > 0]
    found = [s for m, n in pairs for s in ring_frequencies(surface_radius=a, width=width, around=m, along=n)]
    return np.unique(np.round(found, 12))[:_RING_WAVES]


def _plane(disc: Disc, level: Level, defect: str | None) -> dict[str, float]:
    """A sector without plates against a sum of cosines."""
    a = float(surface_radius(disc=disc, fill_ratio=_FILL))
    depth = float(np.log(disc.outer_radius / a))
    waves = CosineWaves.of(central_angle=disc.central_angle, depth=depth)
    system = _spoiled(_plane_system(disc, a, level), defect)
    exact = waves.frequencies(modes=2)
    values = frequencies(system, 6)[0]
    off = np.abs(values[:, None] - exact).min(axis=0)
    moment, pressure = answer(system.reduced, system.reduced.levels[-1], 1.0, 0.0)[:2]
    swing = waves.amplification(frequency_ratio=1.0)
    push = waves.pressure_amplification(frequency_ratio=1.0, depth=depth)
    return {
        "plane": float((off / exact).max()),
        "forced": abs(moment / swing - 1),
        "pressure": abs(pressure / push - 1),
    }


@lru_cache(maxsize=2)
def _plane_system(disc: Disc, a: float, level: Level) -> WaveSystem:
    return wave_system(disc_chamber(disc, _PLANE_CELLS[level]), a, 0.0, 6, 2)


def _still(level: Level, defect: str | None) -> OrderStudy:
    """Frequencies without Coriolis force, on meshes that become finer."""
    _, a, angle, width = _SECTOR
    exact = [
        still_frequency(surface_radius=a, width=width, angle=angle, around=m, along=n) for m, n in _STILL
    ]
    worst = []
    for cells in _LEVELS[level]:
        system = _sector(cells, "hexahedron" if defect == "straight_walls" else "hexahedron20")
        first = system.reduced.levels[0]
        squares = np.linalg.eigvalsh(system.reduced.stiffness[:first, :first])
        values = np.sqrt(np.maximum(squares, 0.0))
        worst.append(max(float(np.abs(values / s - 1).min()) for s in exact))
    return OrderStudy.of(size=[1 / cells[0] for cells in _LEVELS[level]], error=worst)


@lru_cache(maxsize=8)
def _sector(cells: tuple[int, int, int], kind: CellKind) -> WaveSystem:
    inner, a, angle, width = _SECTOR
    geometry = sector_chamber(cells, radii=(inner, 1.0), angle=angle, width=width, kind=kind)
    return wave_system(geometry, a, 0.0, 6, 1)
