"""Whether data can tell one law from another, after each has been fitted to them."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Final, Literal

import numpy as np
from scipy.special import chdtri, ndtri

from ringbalance.identification.criticism.residual_tests import LinearFit
from ringbalance.scene.arrays import FloatArray

_LEVEL: Final = 0.05
NEEDED: Final = float((ndtri(0.9) - ndtri(_LEVEL / 2)) ** 2)
"""Separation of laws that are told apart: 9 of 10 normal statistics show it at the 5 % level."""
Outcome = Literal["other", "between", "fitted", "undecided"]
_SAID: Final[Mapping[Outcome, str]] = {
    "other": "the data prefer {} to the fitted law, so that the fitted values may be wrong by more than "
    "their intervals",
    "between": "the data lie between the fitted law and {}",
    "fitted": "the data prefer the fitted law to {}",
    "undecided": "these data cannot tell the fitted law from {}",
}
"""By outcome; with the other law, or all those of one outcome."""


@dataclass(frozen=True, kw_only=True)
class LawComparison:
    """The fitted law against another one."""

    other: str
    separation: float
    """Square of what separates their predictions beyond all parameters, in variances of the data."""
    preference: float
    """Sum of squares of the other law's residuals, its parameters fitted too, less that of the fitted law."""

    @property
    def outcome(self) -> Outcome:
        """Which of both the data prefer."""
        if self.separation < NEEDED:
            return "undecided"
        if abs(self.preference) < float(chdtri(1, _LEVEL)):
            return "between"
        return "fitted" if self.preference > 0 else "other"

    @property
    def text(self) -> str:
        """What the data say."""
        return _SAID[self.outcome].format(self.other)

    @classmethod
    def of(cls, fit: LinearFit, *, other: str, residuals: FloatArray) -> LawComparison:
        """Compare by linear re-fits from the solution.

        Args: `other`: the other law in words. `residuals`: with its predictions at the fitted parameters,
            over sigma, shape (n,).
        """
        own, others = fit.beyond_parameters(fit.residuals), fit.beyond_parameters(residuals)
        return cls(
            other=other,
            separation=float(np.sum((others - own) ** 2)),
            preference=float(others @ others - own @ own),
        )


def summaries(comparisons: Sequence[LawComparison]) -> Iterator[tuple[Outcome, str]]:
    """What the data say of all of them, one sentence for each outcome, the gravest first."""
    for outcome, sentence in _SAID.items():
        others = [each.other for each in comparisons if each.outcome == outcome]
        if others:
            yield outcome, sentence.format(" or ".join(filter(None, (", ".join(others[:-1]), others[-1]))))
