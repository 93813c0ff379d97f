"""Sensitivity of a judgement to the drawn inputs: the input that decides, and the worthwhile measurements.

The outcome y of a device is 1 if it meets every demand, else 0; where all meet them, the rank of its settling
time; where none does, that of its final amplitude.

The first-order index of an input x is S = Var(E[y | x])/Var(y), here by eighths of its distribution: for n
devices, m_i of them with mean y_i in eighth i, S = (sum m_i (y_i - y)^2/n - 7 v/n)/Var(y), with the mean
variance v within an eighth.  Without any effect S is 0 with a standard deviation of sqrt(2 * 7)/n, about
4/n.
Source: Sobol', "Sensitivity estimates for nonlinear mathematical models", Math. Modelling and Computational
    Experiments 1 (1993); Archer, Saltelli and Sobol', J. Stat. Comput. Simul. 58 (1997).
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import asdict, dataclass
from typing import Any, Final

import numpy as np
import numpy.typing as npt

from ringbalance.controller.balancer import Balancer
from ringbalance.controller.judging.judge import Judgement
from ringbalance.results.requirements import Proportion
from ringbalance.results.rows import Finding, Value

MEETS: Final = "meets"
"""Name of the outcome that a device meets every demand."""
_BINS: Final = 8
_NOTABLE_INDEX: Final = 0.05
"""Index from which an input is worth a measurement."""
_NOTABLE_SIGMA: Final = 3.0
"""Standard deviations of the index of an input without effect, above which an index is significant."""


@dataclass(frozen=True, kw_only=True)
class Deciding:
    """A drawn input and its influence on the outcome."""

    name: str
    """Name as in `Outcomes.inputs`."""
    path: str
    """Path of its key in the scene; empty: a model error."""
    outcome: str
    """`MEETS`, or the rank of the device by "settling_time" or "final_amplitude"."""
    index: float
    noise: float
    """Standard deviation of the index of an input without effect."""
    common: bool
    """True if all devices have the same unknown value; False if it varies between devices."""
    measure: str
    """Code of the finding that says what to measure; empty: nothing can be measured."""
    middle: Proportion
    """Fraction that meets every demand, of the devices with the input in its interquartile range: about the
    fraction if the input were known twice as well."""

    @property
    def decides(self) -> bool:
        """True if the index is notable and significant."""
        return self.index > max(_NOTABLE_INDEX, _NOTABLE_SIGMA * self.noise)

    def document(self) -> dict[str, Any]:
        """The input with a sentence about it for JSON."""
        code = "input_not_known" if self.common else "input_varies"
        sentence = Finding(code=code, values={"input": self.path or self.name, "index": max(self.index, 0.0)})
        return {
            **asdict(self),
            "decides": self.decides,
            "middle": self.middle.document(),
            "text": sentence.text,
        }


@dataclass(frozen=True, kw_only=True)
class Ranking:
    """Drawn inputs by influence."""

    inputs: tuple[Deciding, ...] = ()
    """Sorted by index, the largest first."""

    @property
    def worth_measuring(self) -> tuple[Deciding, ...]:
        """Measurable inputs that decide whether a device meets every demand."""
        return tuple(each for each in self.inputs if each.decides and each.measure and each.outcome == MEETS)

    def findings(self) -> Iterator[Finding]:
        """Findings on what to measure, or that nothing is worth a measurement."""
        for each in self.worth_measuring:
            values: dict[str, Value] = {"input": each.name, "index": each.index}
            values["fraction"] = each.middle.value
            yield Finding(code=each.measure, values=values)
        if not self.worth_measuring and any(each.outcome == MEETS for each in self.inputs):
            yield Finding(code="nothing_to_measure")

    def document(self) -> list[dict[str, Any]]:
        """All inputs for JSON."""
        return [each.document() for each in self.inputs]


def ranked(balancer: Balancer, judgement: Judgement) -> Ranking:
    """Rank the drawn inputs of judged devices by their first-order index; indices of one name are added."""
    meets, outcomes = judgement.meets, judgement.outcomes
    if meets.any() and not meets.all():
        name, values = MEETS, meets.astype(np.float64)
    else:
        name = "settling_time" if meets.all() else "final_amplitude"
        # Ranks, so that a few outlying devices do not decide alone.
        values = np.argsort(np.argsort(getattr(outcomes, name))).astype(np.float64)
    groups: dict[str, list[tuple[float, str]]] = {}
    for part, quantile in outcomes.inputs.items():
        index = first_order_index(values, quantile)
        groups.setdefault(balancer.drawn_input(part).name or part, []).append((index, part))
    inputs = []
    for group, parts in groups.items():
        strongest = max(parts)[1]
        source = balancer.drawn_input(strongest)
        inputs.append(
            Deciding(
                name=group,
                path=source.path,
                outcome=name,
                index=sum(index for index, _ in parts),
                noise=math.sqrt(2 * (_BINS - 1) * len(parts)) / meets.size,
                common=source.common,
                measure=source.measure,
                middle=Proportion.where(meets[np.abs(outcomes.inputs[strongest] - 0.5) < 0.25]),
            )
        )
    return Ranking(inputs=tuple(sorted(inputs, key=lambda each: -each.index)))


def first_order_index(outcome: npt.ArrayLike, quantile: npt.ArrayLike) -> float:
    """First-order index of an input, by eighths of its distribution; 0 for a constant outcome.

    Args: `outcome`: y of every device, shape (n,). `quantile`: of the input, in (0, 1), shape (n,).
    """
    y = np.asarray(outcome, dtype=np.float64)
    variance = float(np.var(y))
    if variance <= 0.0:
        return 0.0
    bins = np.minimum((np.asarray(quantile) * _BINS).astype(np.int64), _BINS - 1)
    size = np.bincount(bins, minlength=_BINS)
    used = size > 1
    size = size[used]
    mean = np.bincount(bins, weights=y, minlength=_BINS)[used] / size
    mean_square = np.bincount(bins, weights=y**2, minlength=_BINS)[used] / size
    within = np.maximum(mean_square - mean**2, 0.0) * size / (size - 1)
    between = float(np.sum(size * (mean - y.mean()) ** 2)) / y.size
    chance = float(np.sum(within)) * (1.0 - 1.0 / max(size.size, 1)) / y.size
    return (between - chance) / variance
