"""Every integrator on one operation, and Eq. 20's segments into a stall.

Laws with exact solutions: the paper's, and one without its parabola in time.  Near a stall u goes like the
square root of the distance d: u = c sqrt(d), and with kappa = (S/V) c dt one segment takes d to
d - kappa sqrt(d).  The exact flow stalls after tau = 2 sqrt(d)/((S/V) c).  A segment stays on its side of
the stall only while kappa <= sqrt(d), which is dt <= tau/2: however short the segments, the last ones are too
long.  What steps over lands kappa sqrt(d) - d beyond the stall, kappa^2/4 at the most.  A full tube would let
it flow back from there: the map's slope 1 - kappa/(2 sqrt(d)) leaves (-1, 1) where sqrt(d) < kappa/4, and the
steps end in the cycle d = +-kappa^2/4, in which that slope is zero, so that every start is drawn into it.
"""

# ruff: noqa: ARG002 - every law has the uniform case interface

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import Final

import numpy as np
import numpy.typing as npt

from ringbalance.reduced_model.law.flow_law import Flow, Regime
from ringbalance.reduced_model.law.paper_law import PaperLaw, paper_law
from ringbalance.reduced_model.paper import stall_pressure
from ringbalance.scene.arrays import FloatArray
from ringbalance.scene.models import Scene
from ringbalance.verification.evidence import Curve, Evidence, Level, Series, Table, as_found, figure
from ringbalance.verification.orders import OrderStudy
from ringbalance.verification.reference.marched import marched
from ringbalance.verification.reference.transfers import (
    Drive,
    Integrator,
    adaptive_ode,
    closed_form,
    explicit_segments,
    paper_drive,
)

_COUNTS: Final = (8, 16, 32, 64, 128, 256)
_INSTANTS: Final = 200
_ABOVE_STALL: Final = 1.8
_BELOW_STALL: Final = 0.6
"""Gas pressures in units of the one that empties a chamber."""
_SHARE: Final = 0.9
_KINK: Final = 0.6
"""Fill, in units of the largest, below which the kinked law slows down."""
_WAYS: Final[Mapping[str, Integrator]] = {
    "closed form": closed_form,
    "adaptive, 1e-5": adaptive_ode(tolerance=1e-5),
    "adaptive, 1e-8": adaptive_ode(tolerance=1e-8),
    "adaptive, 1e-11": adaptive_ode(tolerance=1e-11),
    "Eq. 20, 16 segments": explicit_segments(16),
    "Eq. 20, 128 segments": explicit_segments(128),
    "Eq. 20, 1024 segments": explicit_segments(1024),
}
_SEGMENTS: Final = (8, 16, 32, 64, 128)
_PHASES: Final = np.linspace(1.0, 1.3, 31)
"""Durations, in units of the time to the stall: each lets the segments meet the stall differently."""
_STARTS: Final = (0.02, 0.05, 0.1)
_BISECTIONS: Final = 40
_CYCLES: Final = 5
"""Times to the stall after which a tube that stays full has found its cycle."""


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
    march = marched(scene.tube)
    spoiled = 1.001 if defect == "exchange_rate_off" else 1.0
    duration = _SHARE * _end(long)
    study = _explicit(long, duration, frozen=defect == "frozen_velocity")
    stalled, longest, drawn = _stall_study(low, law, spoiled=defect == "stall_rate_off")
    t = np.linspace(0, duration, 21)[1:]
    found = {
        "march_error": _march_error(march, long, duration, spoiled),
        "stall_error": _stall_error(march, low, spoiled),
        "moved_error": _moved_error(march, long, duration),
        "explicit_order": study.settled_order,
        "kinked_difference": _kinked_difference(march, law, long, duration),
        "tapered_march": _tapered_error(long, law, t, march),
        "tapered_adaptive": _tapered_error(long, law, t, adaptive_ode(tolerance=1e-10)),
        **stalled,
    }
    return Evidence(
        found=as_found(**found),
        numbers={"longest_for_per_mille": longest, "time_to_stall": _end(low)},
        series=(drawn,),
        tables=(_side_by_side(march, long, law, duration),),
        convergence=(study.table("fill by explicit segments, relative error", 1.0),),
    )


def _end(drive: Drive) -> float:
    """Time at which the flow ends by itself, s."""
    end = closed_form(drive, np.array([1e9])).event_time
    return math.nan if end is None else end


def _march_error(march: Integrator, drive: Drive, duration: float, spoiled: float) -> float:
    t = np.linspace(0, duration, _INSTANTS + 1)[1:]
    used = replace(drive, exchange_rate=drive.exchange_rate * spoiled)
    return float(np.max(np.abs(march(used, t).fill - closed_form(drive, t).fill)))


def _stall_error(march: Integrator, drive: Drive, spoiled: float) -> float:
    exact = _end(drive)
    used = replace(drive, exchange_rate=drive.exchange_rate * spoiled)
    found = march(used, np.array([2 * exact])).event_time
    return 1.0 if found is None else abs(found / exact - 1)


def _moved_error(march: Integrator, drive: Drive, duration: float) -> float:
    """S times the integral of u along the march's own path, by Gauss's rule in time."""
    abscissa, weight = np.polynomial.legendre.leggauss(20)
    t = duration * (1 + abscissa) / 2
    path = march(drive, np.append(t, duration))
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


def _kinked_difference(march: Integrator, law: PaperLaw, drive: Drive, duration: float) -> float:
    kinked = replace(drive, law=_SlowedLaw(name="kinked", base=law, share=_kinked))
    t = np.linspace(0, duration, 21)[1:]
    return float(np.max(np.abs(march(kinked, t).fill - adaptive_ode(tolerance=1e-11)(kinked, t).fill)))


@dataclass(frozen=True, kw_only=True)
class _TrialLaw:
    """What every such law has of the paper's."""

    name: str
    base: PaperLaw

    @property
    def max_fill_ratio(self) -> float:
        """Of the paper's law."""
        return self.base.max_fill_ratio

    def table(self) -> Mapping[str, FloatArray]:
        """Of the paper's law."""
        return self.base.table()


@dataclass(frozen=True, kw_only=True)
class _SlowedLaw(_TrialLaw):
    """The paper's law, slower in the share of its velocity that a function of the fill gives."""

    share: Callable[[FloatArray, float], FloatArray]
    """From x of the driven chamber and the largest x."""

    def evaluate(
        self,
        *,
        fill_ratio: npt.ArrayLike,
        opposite_fill_ratio: npt.ArrayLike | None = None,
        gas_pressure: npt.ArrayLike,
        primed: npt.ArrayLike = False,
    ) -> Flow:
        """As the paper's law, slowed."""
        flow = self.base.evaluate(
            fill_ratio=fill_ratio,
            opposite_fill_ratio=opposite_fill_ratio,
            gas_pressure=gas_pressure,
            primed=primed,
        )
        share = self.share(np.asarray(fill_ratio, dtype=np.float64), self.max_fill_ratio)
        return replace(flow, velocity=flow.velocity * share)


def _tapered(fill_ratio: FloatArray, largest: float) -> FloatArray:
    """Smooth, and with an exact solution of its own."""
    return np.asarray((1 + fill_ratio / largest) / 2)


def _tapered_fill(drive: Drive, law: PaperLaw, time: FloatArray) -> FloatArray:
    """Exact fill under the tapered law, from a gas pressure that empties the chamber.

    With s = sqrt(alpha + beta x) and u = s (1 + x/x_max)/2 the fill obeys ds/dt = -(S/V) (A + D s^2)/2, so
    s = sqrt(A/D) tan(atan(s_0 sqrt(D/A)) - (S/V) sqrt(A D) t/2).
    """
    a, b = law.velocity_squared_per_pressure, law.pressure_per_fill_difference
    alpha, beta = a * (drive.gas_pressure - b * drive.total), 2 * a * b
    d = 0.5 / law.max_fill_ratio
    rest = beta / 2 - d * alpha
    start = math.atan(math.sqrt(alpha + beta * drive.fill) * math.sqrt(d / rest))
    s = math.sqrt(rest / d) * np.tan(start - drive.exchange_rate * math.sqrt(rest * d) / 2 * time)
    return np.asarray((s**2 - alpha) / beta, dtype=np.float64)


def _tapered_error(drive: Drive, law: PaperLaw, time: FloatArray, way: Integrator) -> float:
    """Largest error in fill of an integrator under the tapered law."""
    found = way(replace(drive, law=_SlowedLaw(name="tapered", base=law, share=_tapered)), time).fill
    return float(np.max(np.abs(found - _tapered_fill(drive, law, time))))


def _side_by_side(march: Integrator, drive: Drive, law: PaperLaw, duration: float) -> Table:
    """Error at the end of a long operation, and what it costs; the closed form is the reference."""
    t = np.array([duration])
    exact = float(closed_form(drive, t).fill[-1])
    rows = []
    for name, way in {"march": march, **_WAYS}.items():
        done, count = way(drive, t), _velocities_taken(drive, law, t, way)
        tapered = math.nan if way is closed_form else _tapered_error(drive, law, t, way)
        error = abs(float(done.fill[-1]) - exact)
        rows.append((name, _number(error), _number(tapered), count))
    columns = ("integrator", "error, paper's law", "error, tapered law", "velocities taken")
    return Table(
        name="integrators side by side: error in fill at the end of a long operation",
        columns={name: [row[i] for row in rows] for i, name in enumerate(columns)},
    )


def _velocities_taken(drive: Drive, law: PaperLaw, time: FloatArray, way: Integrator) -> str:
    """At how many points an integrator asks the law, its table included where it makes one."""
    if way is closed_form:
        return "none"
    sizes: list[int] = []

    def count(fill_ratio: FloatArray, _: float) -> FloatArray:
        sizes.append(fill_ratio.size)
        return np.ones_like(fill_ratio)

    way(replace(drive, law=_SlowedLaw(name="counted", base=law, share=count)), time)
    return f"{sum(sizes)}"


def _number(error: float) -> str:
    if math.isnan(error):
        return "does not apply"
    return f"{error:.1e}" if error > np.finfo(np.float64).eps else "round-off"


@dataclass(frozen=True, kw_only=True)
class _FullTube(_TrialLaw):
    """The paper's law of a tube that stays full: beyond the stall it flows back."""

    name: str = "full tube"

    def evaluate(
        self,
        *,
        fill_ratio: npt.ArrayLike,
        opposite_fill_ratio: npt.ArrayLike | None = None,
        gas_pressure: npt.ArrayLike,
        primed: npt.ArrayLike = False,
    ) -> Flow:
        """u = sign(D) sqrt(|D|) with D the paper's u^2."""
        x, p = np.asarray(fill_ratio, dtype=np.float64), np.asarray(gas_pressure, dtype=np.float64)
        other = self.max_fill_ratio - x if opposite_fill_ratio is None else np.asarray(opposite_fill_ratio)
        squared = self.base.velocity_squared_per_pressure * (
            p + self.base.pressure_per_fill_difference * (x - other)
        )
        velocity = np.sign(squared) * np.sqrt(np.abs(squared))
        return Flow(
            velocity=velocity,
            regime=np.where(velocity < 0, Regime.REVERSE, Regime.SIPHON).astype(np.int64),
            uncertainty=np.zeros_like(velocity),
            primed=np.ones_like(velocity, dtype=np.bool_),
        )


def _stall_study(
    drive: Drive, law: PaperLaw, *, spoiled: bool = False
) -> tuple[Mapping[str, float], float, Series]:
    """Run the segments into the stall; `spoiled`: with the derivation's rate off by a tenth on purpose.

    Returns: What the runs show beside what the derivation says; the length of a segment that steps over by a
        thousandth of the fill at the most, s; and both over the number of segments.
    """
    stall, per_root = _stall(drive, law)
    rate = per_root * (1.1 if spoiled else 1.0)
    end = 2 * math.sqrt(drive.fill - stall) / per_root
    bound = np.array([(rate * end / n) ** 2 / 4 for n in _SEGMENTS])
    over = np.array([_overshoots(drive, stall, end, n) for n in _SEGMENTS])
    cycle = np.array([_cycle(drive, law, stall, end, n) for n in _SEGMENTS])
    # Durations differ a little between the runs of one count, so each is compared with its own bound.
    share = over / (bound[:, None] * _PHASES**2)
    judged = {
        "overshoot_share": float(share.max()),
        # At the number of segments where it is least: the bound is met, not only kept.
        "overshoot_reach": float(share.max(axis=1).min()),
        "cycle_error": float(np.max(np.abs(cycle / bound - 1))),
        "limit_error": max(abs(_longest(drive, stall, d) * rate / math.sqrt(d) - 1) for d in _STARTS),
    }
    drawn = figure(
        "fill beyond the stall against the length of a segment",
        ("segment over the time to the stall", "1", 1 / np.array(_SEGMENTS, dtype=float)),
        Curve("largest step over the stall, Eq. 20", "1", over.max(axis=1), style="paper"),
        Curve("cycle of a tube that stays full", "1", cycle),
        Curve("kappa^2/4", "1", bound, style="reference"),
        log=True,
    )
    return judged, 2 * math.sqrt(1e-3) / rate, drawn


def _stall(drive: Drive, law: PaperLaw) -> tuple[float, float]:
    """Fill of the stall, and (S/V) c."""
    a, b = law.velocity_squared_per_pressure, law.pressure_per_fill_difference
    stall = (drive.total - drive.gas_pressure / b) / 2
    return stall, drive.exchange_rate * math.sqrt(2 * a * b)


def _overshoots(drive: Drive, stall: float, end: float, count: int) -> FloatArray:
    """How far beyond the stall segments land, for durations that are a little different."""
    landed = [explicit_segments(count)(drive, np.array([end * phase])).fill[-1] for phase in _PHASES]
    return np.maximum(stall - np.array(landed), 0.0)


def _cycle(drive: Drive, law: PaperLaw, stall: float, end: float, count: int) -> float:
    """Distance from the stall in which the steps of a tube that stays full end."""
    full = replace(drive, law=_FullTube(base=law))
    way = explicit_segments(_CYCLES * count)
    return abs(float(way(full, np.array([_CYCLES * end])).fill[-1]) - stall)


def _longest(drive: Drive, stall: float, distance: float) -> float:
    """Longest single segment from a distance that ends on the same side of the stall, by runs."""
    near = replace(drive, fill=stall + distance)
    low, high = 0.0, float(closed_form(near, np.array([1e9])).event_time or math.nan)
    for _ in range(_BISECTIONS):
        middle = (low + high) / 2
        stays = float(explicit_segments(1)(near, np.array([middle])).fill[-1]) >= stall
        low, high = (middle, high) if stays else (low, middle)
    return low
