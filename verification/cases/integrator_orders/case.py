"""Every integrator on one operation, and Eq. 20's segments into a stall."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Final

import numpy as np

from ringbalance.controller.liquid_ring.integrators import closed_form, quadrature
from ringbalance.controller.liquid_ring.transfer import Drive
from ringbalance.reduced_model.law.paper_law import PaperLaw, paper_law
from ringbalance.reduced_model.paper import stall_pressure
from ringbalance.scene.arrays import FloatArray
from ringbalance.scene.models import Scene
from ringbalance.verification.cases.integrator_orders.side_by_side import (
    SlowedLaw,
    side_by_side,
    tapered_error,
)
from ringbalance.verification.cases.integrator_orders.stall import stall_study
from ringbalance.verification.evidence import Evidence, Level, as_found
from ringbalance.verification.orders import OrderStudy
from ringbalance.verification.reference.adaptive_ode import adaptive_ode
from ringbalance.verification.reference.explicit_segments import explicit_segments, paper_drive

_COUNTS: Final = (8, 16, 32, 64, 128, 256)
_INSTANTS: Final = 200
_ABOVE_STALL: Final = 1.8
_BELOW_STALL: Final = 0.6
"""Gas pressures in units of the one that empties a chamber."""
_SHARE: Final = 0.9
_KINK: Final = 0.6
"""Fill, in units of the largest, below which the kinked law slows down."""


def _kinked(fill_ratio: FloatArray, largest: float) -> FloatArray:
    """Slower in proportion to the fill once that is below a kink; continuous, not smooth."""
    return np.asarray(np.minimum(1.0, 0.5 + 0.5 * fill_ratio / (_KINK * largest)))


def compute(scene: Scene, level: Level, defect: str | None = None) -> Evidence:
    law = paper_law(scene)
    omega = scene.rotor.speed
    empties = stall_pressure(disc=scene.disc, density=scene.liquid.density, angular_velocity=omega)
    full = law.max_fill_ratio
    long, low = (
        paper_drive(law, gas_pressure=above * empties, fill=full, total=full)
        for above in (_ABOVE_STALL, _BELOW_STALL)
    )
    spoiled = 1.001 if defect == "exchange_rate_off" else 1.0
    duration = _SHARE * _end(long)
    study = _explicit(long, duration, frozen=defect == "frozen_velocity")
    stall = stall_study(low, law, spoiled=defect == "stall_rate_off")
    t = np.linspace(0, duration, 21)[1:]
    found = {
        "quadrature_error": _quadrature_error(long, duration, spoiled),
        "stall_error": _stall_error(low, spoiled),
        "moved_error": _moved_error(long, duration),
        "explicit_order": study.settled_order,
        "kinked_difference": _kinked_difference(law, long, duration),
        "tapered_quadrature": tapered_error(long, law, t, quadrature),
        "tapered_adaptive": tapered_error(long, law, t, adaptive_ode(tolerance=1e-10)),
        "overshoot_share": stall.overshoot_share,
        "overshoot_reach": stall.overshoot_reach,
        "limit_error": stall.limit_error,
        "cycle_error": stall.cycle_error,
    }
    return Evidence(
        found=as_found(**found),
        numbers={"longest_for_per_mille": stall.longest_for_per_mille, "time_to_stall": _end(low)},
        series=(stall.series,),
        tables=(side_by_side(long, law, duration),),
        convergence=(study.table("fill by explicit segments, relative error", 1.0),),
    )


def _end(drive: Drive) -> float:
    """Time at which the flow ends by itself, s."""
    end = closed_form(drive, np.array([1e9])).event_time
    return math.nan if end is None else end


def _quadrature_error(drive: Drive, duration: float, spoiled: float) -> float:
    t = np.linspace(0, duration, _INSTANTS + 1)[1:]
    used = replace(drive, exchange_rate=drive.exchange_rate * spoiled)
    return float(np.max(np.abs(quadrature(used, t).fill - closed_form(drive, t).fill)))


def _stall_error(drive: Drive, spoiled: float) -> float:
    exact = _end(drive)
    used = replace(drive, exchange_rate=drive.exchange_rate * spoiled)
    found = quadrature(used, np.array([2 * exact])).event_time
    return 1.0 if found is None else abs(found / exact - 1)


def _moved_error(drive: Drive, duration: float) -> float:
    """S times the integral of u along the quadrature's own path, by Gauss's rule in time."""
    abscissa, weight = np.polynomial.legendre.leggauss(20)
    t = duration * (1 + abscissa) / 2
    path = quadrature(drive, np.append(t, duration))
    velocity = drive.flow(path.fill[:-1]).velocity
    passed = drive.exchange_rate * duration / 2 * float(weight @ velocity)
    return abs(passed / (drive.fill - float(path.fill[-1])) - 1)


def _explicit(drive: Drive, duration: float, *, frozen: bool) -> OrderStudy:
    t = np.array([duration])
    exact = float(closed_form(drive, t).fill[-1])
    moved = drive.fill - exact
    fills = [float(explicit_segments(count)(drive, t).fill[-1]) for count in _COUNTS]
    if frozen:
        u0 = float(drive.flow(drive.fill).velocity)
        fills = [drive.fill - u0 * drive.exchange_rate * duration] * len(_COUNTS)
    error = [abs(fill - exact) / moved for fill in fills]
    return OrderStudy.of(size=[_COUNTS[0] / count for count in _COUNTS], error=error)


def _kinked_difference(law: PaperLaw, drive: Drive, duration: float) -> float:
    kinked = replace(drive, law=SlowedLaw(name="kinked", base=law, share=_kinked))
    t = np.linspace(0, duration, 21)[1:]
    return float(np.max(np.abs(quadrature(kinked, t).fill - adaptive_ode(tolerance=1e-11)(kinked, t).fill)))
