"""Which drawn input decides whether a device meets what is asked, and what is worth measuring.

Where all devices meet it, the input that decides how soon they settle, and where none does, what remains.

The first-order index of an input x is S = Var(E[y | x])/Var(y), here by eighths of its distribution: of n
devices with m_i of mean y_i in each, S = (sum m_i (y_i - y)^2/n - 7 v/n)/Var(y), with the mean variance v
within an eighth.  Without any effect it is 0 with a standard deviation of sqrt(2 * 7)/n, about 4/n.
Source: Sobol', "Sensitivity estimates for nonlinear mathematical models", Math. Modelling and Computational
    Experiments 1 (1993); Archer, Saltelli and Sobol', J. Stat. Comput. Simul. 58 (1997).
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass
from typing import Any, Final

import numpy as np
import numpy.typing as npt

from ringbalance.controller.balancer import Balancer
from ringbalance.controller.judging.judge import Judgement
from ringbalance.results.requirements import Proportion
from ringbalance.results.rows import Finding, Value
from ringbalance.scene.arrays import FloatArray

MEETS: Final = "meets"
"""Whether a device meets every demand."""
SETTLING_TIME, FINAL_AMPLITUDE = "settling_time", "final_amplitude"
"""Names of `Outcomes`."""
_PARTS: Final = 8
_NOTABLE: Final = 0.05
"""Index from which an input is worth a measurement."""
_ABOVE_NOISE: Final = 3.0
"""Times its standard deviation without any effect."""


@dataclass(frozen=True, kw_only=True)
class Deciding:
    """One drawn input and how much of the outcome it decides."""

    name: str
    """As in `Outcomes.inputs`."""
    path: str
    """Of its key in the scene; empty: an error of a model."""
    outcome: str
    """That it is about: `MEETS`, or in the order of the devices `SETTLING_TIME` or `FINAL_AMPLITUDE`."""
    index: float
    """First-order index of that outcome."""
    noise: float
    """Standard deviation of the index of an input without any effect."""
    common: bool
    """Whether all devices have it alike, so that it is merely not known."""
    measure: str
    """Code of the finding that says what to measure; empty: nothing can be."""
    middle: Proportion
    """Of the devices in the middle half of its distribution: were it known twice as well."""

    @property
    def decides(self) -> bool:
        """Whether its index is notable, and above what chance gives."""
        return self.index > max(_NOTABLE, _ABOVE_NOISE * self.noise)

    @property
    def finding(self) -> Finding:
        """What measuring it would bring."""
        values: dict[str, Value] = {"input": self.name, "index": self.index, "fraction": self.middle.value}
        return Finding(code=self.measure, values=values)

    @property
    def shared(self) -> Finding:
        """How much it decides, and whether it varies between devices."""
        code = "input_not_known" if self.common else "input_varies"
        return Finding(code=code, values={"input": self.path or self.name, "index": max(self.index, 0.0)})

    def document(self) -> dict[str, Any]:
        """For JSON."""
        middle = self.middle.document()
        return {**asdict(self), "decides": self.decides, "middle": middle, "text": self.shared.text}


@dataclass(frozen=True, kw_only=True)
class Ranking:
    """Drawn inputs by what they decide."""

    inputs: tuple[Deciding, ...] = ()
    """The one that decides most first."""

    @property
    def worth_measuring(self) -> tuple[Deciding, ...]:
        """Those that decide whether a device meets what is asked, and can be measured."""
        return tuple(each for each in self.inputs if each.decides and each.measure and each.outcome == MEETS)

    def findings(self) -> Iterator[Finding]:
        """What to measure, or that nothing is."""
        found = self.worth_measuring
        yield from (each.finding for each in found)
        if not found and any(each.outcome == MEETS for each in self.inputs):
            yield Finding(code="nothing_to_measure")

    def document(self) -> list[dict[str, Any]]:
        """For JSON."""
        return [each.document() for each in self.inputs]


def ranked(balancer: Balancer, judgement: Judgement) -> Ranking:
    """The inputs of judged devices."""
    name, outcome = _outcome(judgement)
    groups: dict[str, list[tuple[float, str]]] = {}
    for of, place in judgement.outcomes.inputs.items():
        index = _first_order_index(outcome, place)
        groups.setdefault(balancer.drawn_input(of).name or of, []).append((index, of))
    rows = [_row(balancer, judgement, group, each, name) for group, each in groups.items()]
    return Ranking(inputs=tuple(sorted(rows, key=lambda each: -each.index)))


def _outcome(judgement: Judgement) -> tuple[str, FloatArray]:
    """Name of what differs between the devices, and each one's."""
    met, outcomes = judgement.meets, judgement.outcomes
    if met.any() and not met.all():
        return MEETS, met.astype(np.float64)
    name = SETTLING_TIME if met.all() else FINAL_AMPLITUDE
    # Ranks, so that a few devices far from all others do not decide alone.
    return name, np.argsort(np.argsort(getattr(outcomes, name))).astype(np.float64)


def _row(
    balancer: Balancer, judgement: Judgement, name: str, inputs: Sequence[tuple[float, str]], outcome: str
) -> Deciding:
    """A row of inputs that are ranked as one, whose first-order indices add up."""
    most = max(inputs)[1]
    drawn, met = balancer.drawn_input(most), judgement.meets
    half = np.abs(judgement.outcomes.inputs[most] - 0.5) < 0.25
    return Deciding(
        name=name,
        path=drawn.path,
        outcome=outcome,
        index=sum(index for index, _ in inputs),
        noise=math.sqrt(2 * (_PARTS - 1) * len(inputs)) / met.size,
        common=drawn.common,
        measure=drawn.measure,
        middle=Proportion(count=int(np.count_nonzero(met[half])), of=int(np.count_nonzero(half))),
    )


def _first_order_index(outcome: Sequence[float] | FloatArray, place: npt.ArrayLike) -> float:
    """S of an input by eighths of its distribution; 0 where the outcome is the same everywhere.

    Args: `outcome`: y of every device, shape (n,). `place`: of the input in its distribution, in (0, 1).
    """
    y = np.asarray(outcome, dtype=np.float64)
    part = np.minimum((np.asarray(place) * _PARTS).astype(np.int64), _PARTS - 1)
    size = np.bincount(part, minlength=_PARTS)
    there, parts = size > 1, int(np.count_nonzero(size > 1))
    mean = np.bincount(part, weights=y, minlength=_PARTS)[there] / size[there]
    square = np.bincount(part, weights=y**2, minlength=_PARTS)[there] / size[there]
    within = np.maximum(square - mean**2, 0.0) * size[there] / (size[there] - 1)
    whole = float(np.var(y))
    if whole <= 0.0:
        return 0.0
    between = float(np.sum(size[there] * (mean - y.mean()) ** 2)) / y.size
    chance = float(np.sum(within)) * (1.0 - 1.0 / max(parts, 1)) / y.size
    return (between - chance) / whole
