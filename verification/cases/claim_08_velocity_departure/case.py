"""The velocity's fall under the true wall pressure, by Eq. 19's own arithmetic, and by the calibrated law."""

from __future__ import annotations

from typing import Final

import numpy as np

from ringbalance.reduced_model.paper import departure, flat_strip_area, stall_pressure
from ringbalance.scene.arrays import FloatArray
from ringbalance.scene.models import Disc, Scene
from ringbalance.verification.evidence import Curve, Evidence, Found, Level, Series, figure
from ringbalance.verification.loops import flow_law_of
from ringbalance.verification.paper_numbers import (
    DENSITY,
    DEPARTURE_HIGH,
    DEPARTURE_LOW,
    HIGH_PRESSURE,
    LOW_PRESSURE,
    RING_RADIUS,
    at_paper_density,
    rounded_radius,
)
from ringbalance.verification.reference.exact_chamber import wall_pressure_of

_PRESSURES: Final = {"low": LOW_PRESSURE, "high": HIGH_PRESSURE}
_POINTS: Final = 41


reference = {
    f"{what}_{name}": number.reference
    for name, number in {"low": DEPARTURE_LOW, "high": DEPARTURE_HIGH}.items()
    for what in ("departure", "arithmetic")
}


def values(scene: Scene) -> dict[str, float]:
    given = at_paper_density(scene)
    return {f"departure_{name}": _physics(given, p).value for name, p in _PRESSURES.items()}


def compute(scene: Scene, level: Level, defect: str | None = None) -> Evidence:
    given = at_paper_density(scene)
    arithmetic = {f"arithmetic_{name}": _arithmetic(given, p) for name, p in _PRESSURES.items()}
    physics = {f"departure_{name}": _physics(given, p) for name, p in _PRESSURES.items()}
    if defect == "eq_12_used":
        physics = {name: found.with_correction() for name, found in physics.items()}
    share = np.linspace(0, 1, _POINTS)
    fall = _relative_velocity(given, LOW_PRESSURE, share[::-1] if defect == "chambers_exchanged" else share)
    level_now = _level(given, given.disc)
    return Evidence(
        found={
            **physics,
            **arithmetic,
            "slope": Found(value=float(np.min(np.diff(fall)) * (_POINTS - 1))),
        },
        numbers={
            **{f"rounded_{name}": _eq_19(given, p, RING_RADIUS.value) for name, p in _PRESSURES.items()},
            "shortfall": 1 - _stall(given) / level_now,
            "law_low": _by_law(given, LOW_PRESSURE),
            "law_high": _by_law(given, HIGH_PRESSURE),
        },
        series=tuple(_figure(given, pressure, share) for pressure in _PRESSURES.values()),
    )


def _level(scene: Scene, disc: Disc) -> float:
    """True wall pressure of a full chamber, Pa."""
    return float(wall_pressure_of(scene, disc.max_fill_ratio, disc=disc, density=DENSITY))


def _stall(scene: Scene) -> float:
    """The same by Eq. 12."""
    return stall_pressure(disc=scene.disc, density=DENSITY, angular_velocity=scene.rotor.speed)


def _physics(scene: Scene, pressure: float) -> Found:
    level = _level(scene, scene.disc)
    by_eq_12 = _eq_19(scene, pressure, RING_RADIUS.value)
    return Found(value=1 - float(np.sqrt((pressure - level) / (pressure + level))), corrected=by_eq_12)


def _arithmetic(scene: Scene, pressure: float) -> Found:
    rounding = rounded_radius(lambda radius: _eq_19(scene, pressure, radius))
    return Found(value=_eq_19(scene, pressure), input=rounding)


def _eq_19(scene: Scene, pressure: float, radius: float | None = None) -> float:
    """Fall of the velocity by Eq. 19, with the liquid volume that a radius of the ring implies by Eq. 3."""
    disc, area = scene.disc, flat_strip_area
    volume = None if radius is None else disc.axial_width * float(area(disc=disc, surface_radius=radius))
    fall = departure(
        disc=disc,
        density=DENSITY,
        angular_velocity=scene.rotor.speed,
        gas_pressure=pressure,
        pair_volume=volume,
    )
    return float(fall)


def _relative_velocity(scene: Scene, pressure: float, share: FloatArray) -> FloatArray:
    """u(x)/u(x_max) with the true wall pressure and one k."""
    largest = scene.disc.max_fill_ratio
    fills = (share * largest, (1 - share) * largest)
    own, other = (wall_pressure_of(scene, x, density=DENSITY) for x in fills)
    squared = pressure + own - other
    return np.asarray(np.sqrt(squared / squared[-1]), dtype=np.float64)


def _law_velocity(scene: Scene, pressure: float, share: FloatArray) -> FloatArray:
    law = flow_law_of(scene)
    return law.evaluate(fill_ratio=share * law.max_fill_ratio, gas_pressure=pressure, primed=True).velocity


def _by_law(scene: Scene, pressure: float) -> float:
    ends = _law_velocity(scene, pressure, np.array([0.0, 1.0]))
    return 1 - float(ends[0] / ends[1])


def _figure(scene: Scene, pressure: float, share: FloatArray) -> Series:
    level = _stall(scene)
    eq_19 = np.sqrt((pressure + level * (2 * share - 1)) / (pressure + level))
    law = _law_velocity(scene, pressure, share)
    return figure(
        f"velocity over that of a full chamber, {pressure / 1e6:.1f} MPa",
        ("fill ratio", "1", share * scene.disc.max_fill_ratio),
        Curve("Eq. 19", "1", eq_19, style="paper"),
        Curve("true wall pressure, one k", "1", _relative_velocity(scene, pressure, share)),
        Curve("calibrated law of the scene", "1", law / law[-1], style="reference"),
    )
