"""One operation under a flow law, by the program's time integration and by Eq. 20's segments.

Exact references are the closed form of the paper's law, and for other laws t = (V/S) int dx/u to a fill x.
Near a stall u varies as the square root of the distance d: u = c sqrt(d), and with kappa = (S/V) c dt one
segment takes d to d - kappa sqrt(d). The exact flow stalls after tau = 2 sqrt(d)/((S/V) c). A segment stays
on its side of the stall only while kappa <= sqrt(d), which is dt <= tau/2: however short the segments, the
last ones are too long. One that steps over lands kappa sqrt(d) - d beyond the stall, kappa^2/4 at the most. A
full tube would let it flow back from there: the map's slope 1 - kappa/(2 sqrt(d)) leaves (-1, 1) where
sqrt(d) < kappa/4, and the steps end in the cycle d = +-kappa^2/4, in which that slope is zero, so that
it attracts every start.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Any, Final, cast

import numpy as np
import numpy.typing as npt
from scipy.integrate import quad

from ringbalance.reduced_model.injection.dynamics import EVENTS, Dynamics, Event
from ringbalance.reduced_model.injection.events import command
from ringbalance.reduced_model.injection.pair import at_rest, fills_at
from ringbalance.reduced_model.law.flow_law import Flow, FlowLaw
from ringbalance.reduced_model.law.paper_law import PaperLaw, paper_law
from ringbalance.reduced_model.paper import stall_pressure
from ringbalance.scene.arrays import FloatArray
from ringbalance.scene.models import Scene, Tube
from ringbalance.verification.evidence import (
    Convergence,
    Evidence,
    FigureCurve,
    Found,
    Level,
    NotRunError,
    Series,
    as_found,
    figure,
)

_LONG_FRACTION: Final = 0.9
"""Fraction of the time until the chamber is empty or the flow stalls, where no scheme has its order."""
_SHORT_FRACTION: Final = 0.1
"""Duration of a controller's usual command over that of the long operation."""
_COUNTS: Final = (4, 8, 16, 32, 64, 128, 256, 512)
_INSTANTS: Final = 200
_ABOVE_STALL: Final = 1.8
_BELOW_STALL: Final = 0.6
"""Gas pressures in units of the one that empties a chamber."""
_KINK: Final = 0.6
"""Fill, in units of the largest, below which the kinked law slows down."""
_SEGMENTS: Final = (8, 16, 32, 64, 128)
_PHASES: Final = np.linspace(1.0, 1.3, 31)
"""Durations over the time to the stall; with each the segments meet the stall at other positions."""
_STARTS: Final = (0.02, 0.05, 0.1)
_BISECTIONS: Final = 40
_STALL_TIMES: Final = 5
"""Number of times to the stall after which a tube that stays full is in its cycle."""


@dataclass(frozen=True, kw_only=True)
class _Operation:
    """One chamber under a constant gas pressure that empties; its tube is dry, the other one vented.

    dx/dt = -(S/V) u(x, x_max - x, p).
    """

    law: FlowLaw
    fill: float
    """x at the start; the pair holds the largest fill in all."""
    exchange_rate: float
    """S/V, 1/m."""
    gas_pressure: float

    @classmethod
    def from_full(cls, law: PaperLaw, gas_pressure: float) -> _Operation:
        """Operation that begins at the largest fill."""
        rate = law.tube_area / law.chamber_volume
        return cls(law=law, fill=law.max_fill_ratio, exchange_rate=rate, gas_pressure=gas_pressure)

    def velocity(self, fill: npt.ArrayLike) -> FloatArray:
        """Velocity at fills of the driven chamber, m/s."""
        largest = self.law.max_fill_ratio
        x, pressure = np.clip(fill, 0.0, largest), self.gas_pressure
        flow = self.law.evaluate(
            fill_ratio=x, opposite_fill_ratio=largest - x, gas_pressure=pressure, primed=True
        )
        return flow.velocity

    def _parabola(self) -> tuple[float, float, float]:
        """Flow by the paper's law u^2 = a (p + b (2 x - x_max)), so that u falls evenly in time.

        Returns: u at the start, m/s; its fall, m/s^2; time until u or the fill is zero, s, or nan.
        """
        law, rate = cast(PaperLaw, self.law), self.exchange_rate
        a, b = law.velocity_squared_per_pressure, law.pressure_per_fill_difference
        squared = a * (self.gas_pressure + b * (2 * self.fill - law.max_fill_ratio))
        if squared <= 0 or self.gas_pressure <= 0:
            return 0.0, 0.0, math.nan
        first, slowing = math.sqrt(squared), a * b * rate
        left = squared - 2 * slowing * self.fill / rate
        if left <= 0:
            return first, slowing, first / slowing
        return first, slowing, 2 * self.fill / rate / (first + math.sqrt(left))

    @property
    def end(self) -> float:
        """Time at which the flow ends by itself, s; nan where it does not begin."""
        return self._parabola()[2]

    def exact(self, time: npt.ArrayLike) -> FloatArray:
        """Fills x0 - (S/V) (u0 t - u' t^2/2): Eqs. 19 and 20 in the limit of small segments."""
        first, slowing, end = self._parabola()
        t = np.minimum(time, end)
        return np.asarray(np.maximum(self.fill - self.exchange_rate * t * (first - slowing * t / 2), 0.0))

    def by_segments(self, duration: float, count: int) -> float:
        """Fill after equal explicit segments, x_i = x_(i-1) - u_(i-1) S dt/V: Eq. 20.

        Near a stall a segment may step over it; the law then answers with zero, and the fill stays there.
        """
        x = self.fill
        for _ in range(count):
            x = max(x - float(self.velocity(x)) * self.exchange_rate * duration / count, 0.0)
        return x

    def marched(self, tube: Tube, time: FloatArray) -> tuple[FloatArray, float | None]:
        """Fills by the integrator of all runs, under the law alone, and the time when the flow ended, s."""
        dynamics = Dynamics(
            law=self.law,
            tube=tube,
            inertia=False,
            line=None,
            valve_lag=0.0,
            gas_pressure=self.gas_pressure,
            ambient_pressure=1e5,
            dead_volume=0.0,
            tube_area=self.exchange_rate,
            chamber_volume=1.0,
            max_fill_ratio=self.law.max_fill_ratio,
        )
        plant = dynamics.plant(total=self.law.max_fill_ratio)
        pair = at_rest(plant, fill=self.fill)
        command(plant[0], pair[0], 0, 2 * float(time[-1]) + 1)
        fills = fills_at(plant, pair, time)
        flows = EVENTS[int(pair["event"][0])] is Event.NONE
        return fills, None if flows else float(pair["ended"][0])


def _moved(operation: _Operation, duration: float, count: int | None = None) -> float:
    """Fill ratio transferred, by `count` segments; None: exactly."""
    if count is None:
        return operation.fill - float(operation.exact(duration))
    return operation.fill - operation.by_segments(duration, count)


def segments(scene: Scene, level: Level, defect: str | None = None) -> Evidence:
    """Explicit segments against the closed form over one long operation.

    Raises: NotRunError: the gas pressure does not start the flow.
    """
    operation = _Operation.from_full(paper_law(scene), scene.gas.pressure)
    duration, exact = _LONG_FRACTION * operation.end, _moved(operation, _LONG_FRACTION * operation.end)
    if math.isnan(duration):
        raise NotRunError("the gas pressure of this scene does not start the flow by Eq. 19: raise it")
    moved = [_moved(operation, duration, count) for count in _COUNTS]
    if defect == "frozen_velocity":
        first = float(operation.velocity(operation.fill))
        moved = [first * operation.exchange_rate * duration] * len(_COUNTS)
    study = Convergence.of_errors(
        "moved fill ratio, relative",
        1.0,
        size=[_COUNTS[0] / count for count in _COUNTS],
        error=[abs(fill / exact - 1) for fill in moved],
    )
    # Richardson's extrapolation at first order; half of the last correction bounds what it has left.
    limit = moved[-1] + (moved[-1] - moved[-2])
    counts = np.array(_COUNTS, dtype=np.float64)
    shown = figure(
        "error of the moved fill against the number of segments",
        ("segments", "1", counts),
        FigureCurve("Eq. 20", "1", np.array(study.error), style="paper"),
        FigureCurve("first order", "1", (study.error or ())[0] * counts[0] / counts, style="reference"),
        log=True,
    )
    return Evidence(
        quantities=as_found(
            moved_fill=Found.within(limit, abs(limit - moved[-1]) / 2).against(exact),
            order=study.settled_order,
            finest_error=study.finest_error,
        ),
        numbers={
            "duration": duration,
            "moved": exact,
            "single": abs(_moved(operation, duration, 1) / exact - 1),
            "segments_percent": _segments_for(operation, duration, 1e-2),
            "segments_per_mille": _segments_for(operation, duration, 1e-3),
            "short": _SHORT_FRACTION * duration,
            "short_segments": _segments_for(operation, _SHORT_FRACTION * duration, 1e-3),
        },
        series=(shown,),
        convergence=(study,),
    )


def _segments_for(operation: _Operation, duration: float, tolerance: float) -> float:
    """Smallest number of segments within a tolerance: first guessed from the error of many, then counted."""
    exact, many = _moved(operation, duration), _COUNTS[-1]

    def error(count: int) -> float:
        return abs(_moved(operation, duration, count) / exact - 1)

    count = max(1, math.ceil(many * error(many) / tolerance))
    while error(count) > tolerance:
        count += 1
    return float(count)


def orders(scene: Scene, level: Level, defect: str | None = None) -> Evidence:
    """The march on one operation, and Eq. 20's segments into a stall."""
    law, tube = paper_law(scene), scene.tube
    empties = stall_pressure(
        disc=scene.disc, density=scene.liquid.density, angular_velocity=scene.rotor.speed
    )
    long, low = (_Operation.from_full(law, share * empties) for share in (_ABOVE_STALL, _BELOW_STALL))
    spoiled = 1.001 if defect == "exchange_rate_off" else 1.0
    used, used_low = (replace(each, exchange_rate=each.exchange_rate * spoiled) for each in (long, low))
    duration = _LONG_FRACTION * long.end
    t, fine = (np.linspace(0, duration, count + 1)[1:] for count in (20, _INSTANTS))
    _, stalls = used_low.marched(tube, np.array([2 * low.end]))
    kinked = _KinkedLaw(law)
    path, _ = replace(used, law=kinked).marched(tube, t)
    # Exact time (V/S) int dx/u to each fill of the march under the kinked law.
    exact = replace(long, law=kinked)
    kink = _KINK * law.max_fill_ratio

    def slowness(x: float) -> float:
        return 1 / (exact.exchange_rate * float(exact.velocity(x)))

    steps = [
        quad(slowness, end, start, points=[kink] if end < kink < start else None, epsabs=0, epsrel=1e-12)[0]
        for start, end in pairwise([exact.fill, *path.tolist()])
    ]
    late_fill = (np.cumsum(steps) - t) * (exact.exchange_rate * exact.velocity(path))
    stalled, longest, stall_figure = _stall_study(low, law, spoiled=defect == "stall_rate_off")
    return Evidence(
        quantities=as_found(
            march_error=np.max(np.abs(used.marched(tube, fine)[0] - long.exact(fine))),
            stall_error=1.0 if stalls is None else abs(stalls / low.end - 1),
            kinked_difference=np.max(np.abs(late_fill)),
            **stalled,
        ),
        numbers={"longest_for_per_mille": longest, "time_to_stall": low.end},
        series=(stall_figure,),
    )


@dataclass(frozen=True)
class _KinkedLaw:
    """The paper's law, slower in proportion to the fill once that is below a kink; continuous, not smooth."""

    base: PaperLaw
    name: str = "kinked"

    @property
    def max_fill_ratio(self) -> float:
        """Largest fill ratio of the paper's law."""
        return self.base.max_fill_ratio

    def evaluate(self, **arguments: Any) -> Flow:
        """Evaluate the paper's law, slowed."""
        flow = self.base.evaluate(**arguments)
        share = np.asarray(arguments["fill_ratio"]) / (_KINK * self.max_fill_ratio)
        return replace(flow, velocity=flow.velocity * np.minimum(1.0, 0.5 + 0.5 * share))


def _stall_study(
    operation: _Operation, law: PaperLaw, *, spoiled: bool = False
) -> tuple[dict[str, float], float, Series]:
    """Run the segments into the stall; `spoiled`: with the derivation's rate wrong by a tenth.

    Returns: The runs compared with the derivation; the length of a segment that steps over by a thousandth of
        the fill at the most, s; and both over the number of segments.
    """
    a, b = law.velocity_squared_per_pressure, law.pressure_per_fill_difference
    stall = (law.max_fill_ratio - operation.gas_pressure / b) / 2
    per_root = operation.exchange_rate * math.sqrt(2 * a * b)  # (S/V) c
    rate = per_root * (1.1 if spoiled else 1.0)
    end = 2 * math.sqrt(operation.fill - stall) / per_root
    counts = np.array(_SEGMENTS, dtype=np.float64)
    bound = (rate * end / counts) ** 2 / 4
    durations = (end * _PHASES).tolist()
    over = np.array(
        [
            [max(stall - operation.by_segments(duration, count), 0.0) for duration in durations]
            for count in _SEGMENTS
        ]
    )
    cycle = np.zeros(counts.size)
    for index, count in enumerate(_SEGMENTS):
        # Segments of a tube that stays full: u = sign(d) c sqrt(|d|).
        distance = operation.fill - stall
        for _ in range(_STALL_TIMES * count):
            distance -= per_root * end / count * math.copysign(math.sqrt(abs(distance)), distance)
        cycle[index] = abs(distance)
    # Durations differ between the runs of one count, so each run has its own bound.
    share = over / (bound[:, None] * _PHASES**2)
    judged = {
        "overshoot_share": share.max(),
        # Least over the numbers of segments: the bound is reached, not only respected.
        "overshoot_reach": share.max(axis=1).min(),
        "cycle_error": np.max(np.abs(cycle / bound - 1)),
        "limit_error": max(abs(_longest(operation, stall, d) * rate / math.sqrt(d) - 1) for d in _STARTS),
    }
    shown = figure(
        "fill beyond the stall against the length of a segment",
        ("segment over the time to the stall", "1", 1 / counts),
        FigureCurve("largest step over the stall, Eq. 20", "1", over.max(axis=1), style="paper"),
        FigureCurve("cycle of a tube that stays full", "1", cycle),
        FigureCurve("kappa^2/4", "1", bound, style="reference"),
        log=True,
    )
    return judged, 2 * math.sqrt(1e-3) / rate, shown


def _longest(operation: _Operation, stall: float, distance: float) -> float:
    """Longest single segment from a distance that ends on the same side of the stall, by runs."""
    near = replace(operation, fill=stall + distance)
    low, high = 0.0, near.end
    for _ in range(_BISECTIONS):
        middle = (low + high) / 2
        stays = near.by_segments(middle, 1) >= stall
        low, high = (middle, high) if stays else (low, middle)
    return low
