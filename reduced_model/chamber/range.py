"""Fills at which a chamber is judged, its contributions there, and where its models hold."""

from __future__ import annotations

from collections.abc import Mapping
from functools import lru_cache
from typing import Final

import numpy as np

from ringbalance.mesh.geometry import chamber_volume, liquid_area, surface_radius
from ringbalance.physics.gas import pressure_factor
from ringbalance.physics.pressure.hydrostatics import hydrostatic_pressure
from ringbalance.physics.results import Status, StatusCode
from ringbalance.physics.sloshing import SMALL
from ringbalance.reduced_model.chamber.gravity import closed_ring
from ringbalance.reduced_model.chamber.terms import MEAN, chamber_contributions, wave_height
from ringbalance.reduced_model.contribution import Contribution, percent
from ringbalance.scene.arrays import FloatArray, distinct
from ringbalance.scene.models import Scene
from ringbalance.scene.rules.validity import LARGEST_COMPRESSION, bulk_modulus

FILLS: Final = (0.2, 0.5, 1.0)
"""Shares of max_fill_ratio."""


@lru_cache(maxsize=64)
def chamber_fills(scene: Scene) -> FloatArray:
    """Fill ratios at which a chamber is judged: those of the range at which gravity leaves a closed ring.

    Returns: x, shape (n,); empty where there is none.
    """
    fills = range_fills(scene)
    return fills[closed_ring(scene, fills)]


def range_fills(scene: Scene) -> FloatArray:
    """Fill ratios of `FILLS`, with the one at which sloshing is resonant where that lies within."""
    fills, resonant = scene.disc.max_fill_ratio * np.array(FILLS), _resonant_fill(scene)
    if resonant is None or not fills[0] < resonant < fills[-1]:
        return fills
    return distinct(np.append(fills, resonant))


@lru_cache(maxsize=8)
def range_contributions(scene: Scene) -> Mapping[str, Mapping[str, Contribution]]:
    """Contributions to wall pressure and moment at the worst fill of the range, as `chamber_contributions`.

    Returns: By "pressures" and "moments", over `chamber_fills`; over the whole range where no ring is closed.
    """
    closed = chamber_fills(scene)
    return chamber_contributions(scene, closed if closed.size else range_fills(scene))


def mean_gravity(scene: Scene) -> float:
    """Estimated contribution of gravity to the means over a turn, wall pressure or moment."""
    found = range_contributions(scene)
    return max(found[part][MEAN].value or 0.0 for part in ("pressures", "moments"))


def compression(scene: Scene, fills: FloatArray) -> FloatArray:
    """By how much the liquid is denser on the outer wall, p/K, with the scene's gas pressure on it.

    Returns: Shares along the fills; those above `LARGEST_COMPRESSION` are beyond every model here, and so
        are velocities that such a pressure drives.
    Source: p = f p_gas + rho omega^2 (R2^2 - a^2)/2; `scene.rules.validity`.
    """
    column = hydrostatic_pressure(
        density=scene.liquid.density,
        angular_velocity=scene.rotor.speed,
        inner=surface_radius(disc=scene.disc, fill_ratio=fills),
        outer=scene.disc.outer_radius,
    )
    pressure = column + max(scene.gas.pressure, 0.0) * pressure_factor(scene)
    return np.asarray(pressure / bulk_modulus(scene.liquid))


def chamber_status(scene: Scene) -> Status:
    """Whether linear sloshing, a closed ring and one density hold over the range of fills, by estimates."""
    fills = chamber_fills(scene)
    if fills.size == range_fills(scene).size:
        dense = _dense(scene)
        return _waves(scene, fills) if dense.ok else dense
    lowest = f"above a fill ratio of {fills[0]:.3g} only" if fills.size else "at no fill of this scene"
    return Status(
        code=StatusCode.NO_RING if fills.size == 0 else StatusCode.OUT_OF_RANGE,
        text=(
            f"gravity leaves a closed ring {lowest}: elsewhere liquid runs along the wall every turn and no "
            "model describes it; turn faster or fill more"
        ),
    )


def _dense(scene: Scene) -> Status:
    share = float(compression(scene, np.array([scene.disc.max_fill_ratio]))[0])
    if share <= LARGEST_COMPRESSION:
        return Status()
    pressure = share * bulk_modulus(scene.liquid)
    return Status(
        code=StatusCode.OUT_OF_RANGE,
        text=(
            f"up to {pressure / 1e6:.4g} MPa on the outer wall would make the liquid {percent(share)} denser "
            f"there, and no model holds above {percent(LARGEST_COMPRESSION)}, velocities included: lower "
            "rotor.speed, gas.pressure or disc.max_fill_ratio"
        ),
    )


def _waves(scene: Scene, fills: FloatArray) -> Status:
    """Whether the swinging surface stays small against the ring's depth, by the estimate of its swing."""
    swing = wave_height(scene, fills)
    worst = int(np.argmax(swing))
    if swing[worst] <= SMALL:
        return Status()
    sector = "" if scene.disc.geometry is None else "in a plain sector of the same opening, "
    return Status(
        code=StatusCode.OUT_OF_RANGE,
        text=(
            f"{sector}at a fill ratio of {fills[worst]:.3g} waves may reach about {swing[worst]:.2g} "
            "of the ring's depth, too high for linear sloshing, the finest model: avoid that fill, or turn "
            "faster"
        ),
    )


def _resonant_fill(scene: Scene) -> float | None:
    """Fill ratio at which the lowest mode meets the speed, s = 1, by the same estimate.

    Returns: x; None without gravity across the shaft, or where the mode stays below the speed at any fill.
    Source: tanh(k ln(R2/a)) = 1/k.
    """
    disc, k = scene.disc, np.pi / scene.disc.central_angle
    if scene.environment.shaft == "vertical" or scene.environment.gravity == 0 or k <= 1:
        return None
    radius = disc.outer_radius * float(np.exp(-np.arctanh(1 / k) / k))
    if radius < disc.inner_radius:
        return None
    return float(liquid_area(disc=disc, surface_radius=radius)) * disc.axial_width / chamber_volume(disc=disc)
