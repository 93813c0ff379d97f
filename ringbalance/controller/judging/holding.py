"""Holding of the balance over the hours: devices lose liquid with the gas until the rest no longer suffices.

A device loses liquid at its own rate, that of an hour of its run after it has settled, and meets the demands
up to the loss from which its runs, begun at the initial vibration with the rest, miss them.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import Any, Final

import numpy as np

from ringbalance.controller.balancer import Balancer, Draws
from ringbalance.controller.judging.judge import FIRST_VERDICT_DEVICE, Judgement
from ringbalance.results.numbers import format_given, percent
from ringbalance.results.requirements import MET, MISSED, Proportion
from ringbalance.results.result import Table
from ringbalance.results.rows import Finding, Value
from ringbalance.scene.arrays import BoolArray, FloatArray, finite
from ringbalance.scene.draws import BLOCK
from ringbalance.scene.faults import SceneError

_HOUR_S: Final = 3600.0
_WATCH_TIMES_S: Final = (300.0, 300.0 + _HOUR_S)
"""Times after settling between which the gas of a device is that of holding."""
_LEAST_DEVICES, _MOST_DEVICES = 2 * BLOCK, 4 * BLOCK
_LOSSES: Final = (0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9)
"""Parts of the liquid lost that are tried, up to the first without which the requirement is missed."""
_HALF_STEP: Final = 0.05
_TIMES_S: Final = tuple(each * 10.0**power * _HOUR_S for power in range(-1, 5) for each in (1, 2, 5))


@dataclass(frozen=True, kw_only=True, eq=False)
class Endurance:
    """Devices that still meet every demand after some time of holding."""

    required_fraction: float
    rates: FloatArray
    """Part of the liquid that each device loses in an hour of holding, at most, shape (n,)."""
    losses: FloatArray
    """Parts of the liquid lost, increasing from zero, shape (m,)."""
    meets: BoolArray
    """True for each device that meets every demand without that part, shape (m, n)."""

    @cached_property
    def lives(self) -> tuple[FloatArray, FloatArray]:
        """Time of holding, s, up to which each device meets every demand for certain, negative where it never
        does; and from which on it misses one.

        The rate of a device counts for the first as that of the mean device at least, since an hour has few
        injections.
        """
        levels = np.sum(np.logical_and.accumulate(self.meets, axis=0), axis=0)
        sure, missed = np.append(-1.0, self.losses)[levels], np.append(self.losses, np.inf)[levels]
        with np.errstate(divide="ignore", invalid="ignore"):
            last = np.where(missed > 0.0, missed / self.rates, 0.0)
        return sure / np.maximum(self.rates, self.rates.mean()) * _HOUR_S, last * _HOUR_S

    @property
    def interval(self) -> tuple[float | None, float | None]:
        """Time of holding up to which the requirement is met, s, None where that is undecided from the start;
        and from which on it is missed, None where it may never be; neither where no gas takes liquid."""
        if not self.rates.any():
            return None, None
        (sure, missed), count = (np.sort(each)[::-1] for each in self.lives), self.rates.size
        verdicts = [Proportion(count=i, of=count).verdict(self.required_fraction) for i in range(count + 1)]
        first = sure[verdicts.index(MET) - 1] if MET in verdicts else -1.0
        last = missed[verdicts.count(MISSED) - 1] if MISSED in verdicts else np.inf
        return None if first < 0.0 else float(first), finite(float(last))

    @property
    def over_time(self) -> list[tuple[float, Proportion]]:
        """Fraction that meets every demand for certain by time, s, from the last of most devices to the first
        of fewest."""
        if not self.rates.any():
            return []
        rows = [(time, Proportion.where(self.lives[0] >= time)) for time in _TIMES_S]
        changing = [i for i in range(1, len(rows)) if rows[i][1] != rows[i - 1][1]]
        return rows[changing[0] - 1 : changing[-1] + 1] if changing else rows[-1:]

    @property
    def with_less(self) -> list[tuple[float, Proportion]]:
        """Fraction that meets every demand by the part of the liquid lost."""
        return [
            (float(lost), Proportion.where(met)) for lost, met in zip(self.losses, self.meets, strict=True)
        ]

    @property
    def finding(self) -> Finding:
        """Finding on the interval and the rates."""
        first, last = self.interval
        code = "endures_undecided" if first is None else "endures" if last is None else "endures_until"
        if not self.rates.any():
            return Finding(code="endures_without_gas", values={"of": self.rates.size})
        values: dict[str, Value] = {**self._rates, "first": first, "last": last}
        return Finding(code=code, values=values)

    @property
    def _rates(self) -> dict[str, float]:
        return {"mean": float(self.rates.mean()), "p90": float(np.quantile(self.rates, 0.9))}

    @property
    def table(self) -> Table:
        """Fractions by time and by loss."""
        times = [(f"{format_given(time, 's', digits=2)} of holding", met) for time, met in self.over_time]
        rows = [*times, *((f"{percent(lost)} less liquid", met) for lost, met in self.with_less)]
        return Table(
            caption="Devices that still meet all, begun again at the initial vibration",
            heads=("after", "devices that meet all", "95 % bounds"),
            rows=[(name, percent(p.value), f"{percent(p.low)} to {percent(p.high)}") for name, p in rows],
        )

    def document(self) -> dict[str, Any]:
        """Interval, rates, and fractions by time and by loss, for JSON, SI."""
        return {
            "interval_s": list(self.interval),
            "part_per_hour": self._rates,
            "over_time": [{"time_s": time, "fraction": each.document()} for time, each in self.over_time],
            "with_less": [{"lost": lost, "fraction": each.document()} for lost, each in self.with_less],
            "text": self.finding.text,
        }


def endurance(
    balancer: Balancer, judgement: Judgement, progress: Callable[[str], None] = lambda _: None
) -> Endurance | None:
    """Hours of holding under judged settings; None where these miss the requirement, or no loss is known."""
    if judgement.verdict == MISSED or not np.isfinite(judgement.outcomes.lost).any():
        return None
    settings, required = [judgement.settings], judgement.required_fraction
    count = min(max(judgement.meets.size, _LEAST_DEVICES), _MOST_DEVICES)
    draws = Draws.block(FIRST_VERDICT_DEVICE, count)
    before, after = (balancer.run_all(settings, draws, watch_time=each)[0] for each in _WATCH_TIMES_S)
    settled = before.settled & after.settled
    rates = np.where(settled, after.lost - before.lost, 0.0)
    rates = np.where(settled, rates, rates.max())
    levels: dict[float, BoolArray] = {}

    def verdict(lost: float) -> str:
        progress(f"with {lost:.0%} less liquid")
        try:
            less = balancer.after_loss(lost)
            levels[lost] = Judgement.of(less, settings[0], less.run_all(settings, draws)[0]).meets
        except SceneError:
            levels[lost] = np.zeros_like(settled)
        return Proportion.where(levels[lost]).verdict(required)

    verdicts = [verdict(0.0)]
    for lost in _LOSSES if rates.any() else ():
        verdicts.append(verdict(lost))
        # Half a step less where the verdict changes.
        if verdicts[-2:] != [MET, MET]:
            verdict(round(lost - _HALF_STEP, 2))
        if verdicts[-1] == MISSED:
            break
    losses = sorted(levels)
    meets = np.stack([levels[each] for each in losses])
    return Endurance(required_fraction=required, rates=rates, losses=np.array(losses), meets=meets)
