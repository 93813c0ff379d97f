"""The velocity's fall under the true wall pressure, by Eq. 19's own arithmetic, and by the calibrated law."""

# ruff: noqa: ARG001 - every case has the uniform case interface
from __future__ import annotations

from collections.abc import Mapping
from typing import Final

import numpy as np

from ringbalance.reduced_model.paper.formulas import departure, flat_strip_area, stall_pressure
from ringbalance.scene.arrays import FloatArray
from ringbalance.scene.models import Disc, Scene
from ringbalance.verification.calibrations import calibration_of
from ringbalance.verification.evidence import (
    Axis,
    Curve,
    Evidence,
    Found,
    Level,
    Reference,
    Series,
)
from ringbalance.verification.paper_numbers import (
    DENSITY,
    DEPARTURE_HIGH,
    DEPARTURE_LOW,
    HIGH_PRESSURE,
    LOW_PRESSURE,
    RING_RADIUS,
    at_paper_density,
    plate_uncertainty,
    with_plate,
)
from ringbalance.verification.reference.exact_chamber import exact_wall_pressure
from ringbalance.verification.sensitivity import input_uncertainty

_PRESSURES: Final = {"low": LOW_PRESSURE, "high": HIGH_PRESSURE}
_POINTS: Final = 41


def reference(scene: Scene) -> Mapping[str, Reference]:
    """The printed departures, for the physics and for the arithmetic."""
    printed = {"low": DEPARTURE_LOW, "high": DEPARTURE_HIGH}
    return {
        f"{what}_{name}": number.reference
        for name, number in printed.items()
        for what in ("departure", "arithmetic")
    }


def compute(scene: Scene, level: Level, defect: str | None = None) -> Evidence:
    """Departures by three routes."""
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
    pressure = exact_wall_pressure(
        disc=disc,
        density=DENSITY,
        angular_velocity=scene.rotor.speed,
        fill_ratio=disc.max_fill_ratio,
    )
    return float(pressure)


def _stall(scene: Scene) -> float:
    """The same by Eq. 12."""
    return float(stall_pressure(disc=scene.disc, density=DENSITY, angular_velocity=scene.rotor.speed))


def _physics(scene: Scene, pressure: float) -> Found:
    def fall(thickness: float) -> float:
        level = _level(scene, with_plate(scene.disc, thickness))
        return 1 - float(np.sqrt((pressure - level) / (pressure + level)))

    thickness = scene.disc.plate_thickness
    standard_uncertainty = input_uncertainty([(fall, thickness, plate_uncertainty(scene))])
    return Found(value=fall(thickness), input=standard_uncertainty)


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
    own, other = (
        exact_wall_pressure(
            disc=scene.disc, density=DENSITY, angular_velocity=scene.rotor.speed, fill_ratio=x
        )
        for x in (share * largest, (1 - share) * largest)
    )
    squared = pressure + own - other
    return np.asarray(np.sqrt(squared / squared[-1]), dtype=np.float64)


def _law_velocity(scene: Scene, pressure: float, share: FloatArray) -> FloatArray:
    law = calibration_of(scene).flow_law
    return law.evaluate(fill_ratio=share * law.max_fill_ratio, gas_pressure=pressure, primed=True).velocity


def _by_law(scene: Scene, pressure: float) -> float:
    ends = _law_velocity(scene, pressure, np.array([0.0, 1.0]))
    return 1 - float(ends[0] / ends[1])


def _figure(scene: Scene, pressure: float, share: FloatArray) -> Series:
    level = _stall(scene)
    eq_19 = np.sqrt((pressure + level * (2 * share - 1)) / (pressure + level))
    law = _law_velocity(scene, pressure, share)
    return Series(
        name=f"velocity over that of a full chamber, {pressure / 1e6:.1f} MPa",
        x=Axis(name="fill ratio", unit="1", values=share * scene.disc.max_fill_ratio),
        y=(
            Curve(name="Eq. 19", unit="1", values=eq_19, style="paper"),
            Curve(
                name="true wall pressure, one k",
                unit="1",
                values=_relative_velocity(scene, pressure, share),
            ),
            Curve(name="calibrated law of the scene", unit="1", values=law / law[-1], style="reference"),
        ),
    )
