"""The velocity's fall under the true wall pressure, by Eq. 19's own arithmetic, and by the calibrated law."""

from __future__ import annotations

from typing import Final

import numpy as np

from ringbalance.reduced_model.paper.formulas import departure, flat_strip_area, stall_pressure
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
    plate_effect,
)
from ringbalance.verification.reference.exact_chamber import wall_pressure_of

_PRESSURES: Final = {"low": LOW_PRESSURE, "high": HIGH_PRESSURE}
_POINTS: Final = 41


reference = {
    f"{what}_{name}": number.reference
    for name, number in {"low": DEPARTURE_LOW, "high": DEPARTURE_HIGH}.items()
    for what in ("departure", "arithmetic")
}


def compute(scene: Scene, level: Level, defect: str | None = None) -> Evidence:
    given = at_paper_density(scene)
    arithmetic = {f"arithmetic_{name}": _arithmetic(given, p) for name, p in _PRESSURES.items()}
    physics = {f"departure_{name}": _physics(given, p) for name, p in _PRESSURES.items()}
    if defect == "eq_12_used":
        physics = {f"departure_{name}": arithmetic[f"arithmetic_{name}"] for name in _PRESSURES}
    share = np.linspace(0, 1, _POINTS)
    fall = _relative_velocity(given, LOW_PRESSURE, share)
    level_now = _level(given, given.disc)
    return Evidence(
        found={
            **physics,
            **arithmetic,
            "slope": Found(value=float(np.min(np.diff(fall)) * (_POINTS - 1))),
        },
        numbers={
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
    return float(stall_pressure(disc=scene.disc, density=DENSITY, angular_velocity=scene.rotor.speed))


def _physics(scene: Scene, pressure: float) -> Found:
    def fall(disc: Disc) -> float:
        level = _level(scene, disc)
        return 1 - float(np.sqrt((pressure - level) / (pressure + level)))

    return Found(value=fall(scene.disc), input=plate_effect(scene, fall))


def _arithmetic(scene: Scene, pressure: float) -> Found:
    rounded = scene.disc.axial_width * float(
        flat_strip_area(disc=scene.disc, surface_radius=RING_RADIUS.value)
    )

    def by_eq_18(pair_volume: float | None) -> float:
        return float(
            departure(
                disc=scene.disc,
                density=DENSITY,
                angular_velocity=scene.rotor.speed,
                gas_pressure=pressure,
                pair_volume=pair_volume,
            )
        )

    return Found(value=by_eq_18(None), corrected=by_eq_18(rounded))


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
