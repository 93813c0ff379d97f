"""Judgements: the fraction of drawn devices that meets every demand under given controller settings."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, Final

import numpy as np

from ringbalance.controller.balancer import WATCH_TIME_S, Balancer, Demand, Draws, Outcomes, Settings
from ringbalance.results.requirements import OPEN, Proportion
from ringbalance.results.rows import Value
from ringbalance.scene.arrays import BoolArray, finite

MOST_DRAWS: Final = 1024
"""Devices after which an open verdict stays open, for a balancer whose runs are fast."""
FIRST_VERDICT_DEVICE: Final = 1 << 20
"""Number of the first device of a verdict; settings are chosen on the devices from 0 on."""
FIRST_CHOOSING_DEVICE: Final = 1 << 19
"""Number of the first device that serves to choose between the final settings, remedies or designs of a
search: a choice on the devices of the verdict would make the verdict too favourable."""
_MAX_CAUSES: Final = 3


@dataclass(frozen=True, kw_only=True, eq=False)
class Judgement:
    """Outcomes of drawn devices under one choice of settings, compared with the demands."""

    settings: Settings
    """Values that differ from the scene's, by path, SI."""
    required_fraction: float
    demands: tuple[Demand, ...]
    outcomes: Outcomes
    reported: tuple[Demand, ...] = ()
    """Quantities that decide no verdict."""

    @classmethod
    def of(cls, balancer: Balancer, settings: Settings, outcomes: Outcomes) -> Judgement:
        """Judge outcomes by the demands of a balancer."""
        return cls(
            settings=settings,
            required_fraction=balancer.required_fraction(),
            demands=balancer.demands(),
            outcomes=outcomes,
            reported=balancer.reported(),
        )

    def extended(self, outcomes: Outcomes) -> Judgement:
        """Add the outcomes of further devices."""
        return replace(self, outcomes=self.outcomes.joined(outcomes))

    @cached_property
    def meets(self) -> BoolArray:
        """True for each device that meets every demand, shape (n,)."""
        return np.asarray(np.all([demand.met(self.outcomes) for demand in self.demands], axis=0))

    @property
    def fraction(self) -> Proportion:
        """Fraction of the devices that meet every demand."""
        return Proportion.where(self.meets)

    @property
    def verdict(self) -> str:
        """`MET`, `MISSED` or `OPEN`, by the 95 % interval of the fraction."""
        return self.fraction.verdict(self.required_fraction)

    def fraction_of(self, demand: Demand) -> Proportion:
        """Fraction of the devices that meet one demand."""
        return Proportion.where(demand.met(self.outcomes))

    def settling_time(self, fraction: float) -> tuple[float, float] | None:
        """Time within which a fraction of all devices has settled, and its upper 95 % bound, s.

        None where the bound is open, because too few devices settle.
        """
        times = np.sort(self.outcomes.settling_time)
        count = _least_count_above(fraction, of=times.size)
        if count is None or not math.isfinite(times[count - 1]):
            return None
        return float(times[math.ceil(fraction * times.size) - 1]), float(times[count - 1])

    def time(self, fraction: float) -> float:
        """Time by which a fraction of the devices has settled, s; infinite where fewer settle."""
        times = np.sort(self.outcomes.settling_time)
        return float(times[max(math.ceil(fraction * times.size * (1 - 1e-12)), 1) - 1])

    @property
    def settling_times(self) -> dict[str, float | None]:
        """Times within which 50 % ("p50") and 90 % ("p90") of all devices have settled, s."""
        times = {"p50": self.settling_time(0.5), "p90": self.settling_time(0.9)}
        return {name: None if time is None else finite(time[0]) for name, time in times.items()}

    @property
    def amplitude_reached(self) -> float | None:
        """Amplitude that the required fraction comes below (95 % bound), m; None: too few devices ran."""
        amplitudes = np.sort(self.outcomes.final_amplitude)
        count = _least_count_above(self.required_fraction, of=amplitudes.size)
        return None if count is None else finite(float(amplitudes[count - 1]))

    @property
    def crater_reached(self) -> float | None:
        """Part of the ring's depth that the gas jet digs at most in nine tenths of the devices, or None."""
        craters = self.outcomes.crater[~np.isnan(self.outcomes.crater)]
        return float(np.quantile(craters, 0.9)) if craters.size else None

    @property
    def causes(self) -> list[str]:
        """The most frequent ways in which devices missed a demand, each with its count."""
        missed = {demand.code: ~demand.met(self.outcomes) for demand in self.demands}
        causes: Counter[str] = Counter()
        for device in np.flatnonzero(~self.meets).tolist():
            cause = self.outcomes.ended[device]
            if cause == "settled":
                cause = " and ".join(f"{code} missed" for code, misses in missed.items() if misses[device])
            causes[cause] += 1
        return [f"{cause.replace('_', ' ')} {count}" for cause, count in causes.most_common(_MAX_CAUSES)]

    @property
    def sentence_values(self) -> dict[str, Value]:
        """Values that a `Finding` about this judgement prints."""
        fraction = self.fraction.document()
        return {"share": fraction.pop("value"), **fraction, "asked": self.required_fraction}

    def document(self) -> dict[str, Any]:
        """Verdict, fraction, settling times and endings for JSON, SI."""
        return {
            "verdict": self.verdict,
            "fraction": self.fraction.document(),
            "settling_time_s": self.settling_times,
            "ended": dict(Counter(self.outcomes.ended)),
        }

    def demands_document(self) -> list[dict[str, Any]]:
        """Every demand with the fraction of devices that meets it, for JSON, SI."""
        return [
            {
                "code": demand.code,
                "sense": demand.sense,
                "required": demand.required,
                "unit": demand.unit,
                "stated": demand.stated,
                "amplitude_m": demand.amplitude,
                "fraction": self.fraction_of(demand).document(),
            }
            for demand in self.demands
        ]


def best_of(
    balancer: Balancer, settings: Sequence[Settings], *, progress: Callable[[str], None] | None = None
) -> Settings:
    """Choose the settings that serve most devices, on other devices than verdicts; the first of equals."""
    if len(settings) == 1:
        return settings[0]
    few = balancer.verdict_draws[0]
    tried = judged_all(
        balancer, settings, first=few, most=few, start=FIRST_CHOOSING_DEVICE, progress=progress
    )
    return max(tried, key=lambda each: each.fraction.value).settings


def judged_all(
    balancer: Balancer,
    settings: Sequence[Settings],
    *,
    first: int | None = None,
    most: int | None = None,
    start: int = FIRST_VERDICT_DEVICE,
    watch_time: float = WATCH_TIME_S,
    complete: bool = True,
    deadline: float = math.inf,
    progress: Callable[[str], None] | None = None,
) -> tuple[Judgement, ...]:
    """Judge settings on the same devices, whose number doubles until each verdict is known.

    Args: `first`, `most`: numbers of devices, default the balancer's `verdict_draws`. `start`: number of the
        first device. `watch_time`: as in `Balancer.run_all`. `complete`, `deadline`: as in `Draws`.
        `progress`: called with a text.
    """
    most = most or balancer.verdict_draws[1]
    count, block = 0, min(first or balancer.verdict_draws[0], most)
    judgements: dict[int, Judgement] = {}
    undecided = list(range(len(settings)))
    while undecided and count < most:
        if progress is not None:
            progress(f"{count} of at most {most} drawn devices")
        draws = Draws.block(start + count, block, complete=complete, deadline=deadline)
        outcomes = balancer.run_all([settings[i] for i in undecided], draws, watch_time=watch_time)
        for i, new in zip(undecided, outcomes, strict=True):
            before = judgements.get(i)
            judgements[i] = before.extended(new) if before else Judgement.of(balancer, settings[i], new)
        undecided = [i for i in undecided if judgements[i].verdict == OPEN]
        count += block
        block = min(count, most - count)
    return tuple(judgements[i] for i in range(len(settings)))


def plain_settings(settings: Settings) -> dict[str, Any]:
    """Settings for JSON: tuples as lists."""
    return {path: list(value) if isinstance(value, tuple) else value for path, value in settings.items()}


def _least_count_above(fraction: float, *, of: int) -> int | None:
    """Least number of `of` devices whose lower 95 % bound is at least `fraction`; None: not even all."""
    counts = range(1, of + 1)
    return next((count for count in counts if Proportion(count=count, of=of).low >= fraction), None)
