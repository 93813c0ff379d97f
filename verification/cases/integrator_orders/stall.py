"""Eq. 20's segments near a stall, where u goes like the square root of the distance: limit and cycle.

With d the distance to the stall, u = c sqrt(d) and kappa = (S/V) c dt, one segment takes d to
d - kappa sqrt(d).  The exact flow stalls after tau = 2 sqrt(d)/((S/V) c).  A segment stays on its side of
the stall only while kappa <= sqrt(d), which is dt <= tau/2: however short the segments, the last ones are too
long.  What steps over lands kappa sqrt(d) - d beyond the stall, kappa^2/4 at the most.  A full tube would let
it flow back from there: the map's slope 1 - kappa/(2 sqrt(d)) leaves (-1, 1) where sqrt(d) < kappa/4, and the
steps end in the cycle d = +-kappa^2/4, in which that slope is zero, so that every start is drawn into it.
"""

# ruff: noqa: ARG002 - every law has the uniform case interface
from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Final

import numpy as np
import numpy.typing as npt

from ringbalance.controller.liquid_ring.integrators import closed_form
from ringbalance.controller.liquid_ring.transfer import Drive
from ringbalance.reduced_model.law.flow_law import Flow, Regime
from ringbalance.reduced_model.law.paper_law import PaperLaw
from ringbalance.scene.arrays import FloatArray
from ringbalance.verification.cases.integrator_orders.side_by_side import TrialLaw
from ringbalance.verification.evidence import Curve, Series, figure
from ringbalance.verification.reference.explicit_segments import explicit_segments

_COUNTS: Final = (8, 16, 32, 64, 128)
_PHASES: Final = np.linspace(1.0, 1.3, 31)
"""Durations, in units of the time to the stall: each lets the segments meet the stall differently."""
_STARTS: Final = (0.02, 0.05, 0.1)
_BISECTIONS: Final = 40
_CYCLES: Final = 5
"""Times to the stall after which a tube that stays full has found its cycle."""


@dataclass(frozen=True, kw_only=True)
class _FullTube(TrialLaw):
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


@dataclass(frozen=True, kw_only=True)
class _StallStudy:
    """What the runs show, each beside what the derivation says."""

    overshoot_share: float
    """Largest step over the stall, over kappa^2/4."""
    overshoot_reach: float
    """The same for the number of segments at which it is least: the bound is met, not only kept."""
    cycle_error: float
    """Amplitude in which the steps of a tube that stays full end, over kappa^2/4, less one."""
    limit_error: float
    """Longest segment that does not step over, relative to half the time to the stall, less one."""
    longest_for_per_mille: float
    """Segment that steps over by a thousandth of the fill at the most, s."""
    series: Series


def stall_study(drive: Drive, law: PaperLaw, *, spoiled: bool = False) -> _StallStudy:
    """Run the segments into the stall; `spoiled`: with the derivation's rate off by a tenth on purpose."""
    stall, per_root = _stall(drive, law)
    rate = per_root * (1.1 if spoiled else 1.0)
    end = 2 * math.sqrt(drive.fill - stall) / per_root
    bound = np.array([(rate * end / n) ** 2 / 4 for n in _COUNTS])
    over = np.array([_overshoots(drive, stall, end, n) for n in _COUNTS])
    cycle = np.array([_cycle(drive, law, stall, end, n) for n in _COUNTS])
    # Durations differ a little between the runs of one count, so each is compared with its own bound.
    share = over / (bound[:, None] * _PHASES**2)
    return _StallStudy(
        overshoot_share=float(share.max()),
        overshoot_reach=float(share.max(axis=1).min()),
        cycle_error=float(np.max(np.abs(cycle / bound - 1))),
        limit_error=max(abs(_longest(drive, stall, d) * rate / math.sqrt(d) - 1) for d in _STARTS),
        longest_for_per_mille=2 * math.sqrt(1e-3) / rate,
        series=figure(
            "fill beyond the stall against the length of a segment",
            ("segment over the time to the stall", "1", 1 / np.array(_COUNTS, dtype=float)),
            Curve("largest step over the stall, Eq. 20", "1", over.max(axis=1), style="paper"),
            Curve("cycle of a tube that stays full", "1", cycle),
            Curve("kappa^2/4", "1", bound, style="reference"),
            log=True,
        ),
    )


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
