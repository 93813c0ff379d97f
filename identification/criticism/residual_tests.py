"""Whether a fit describes its data: one test of lack of fit and one of order, in each block of residuals.

Lack of fit: the sum of squares of residuals whose noise was stated is chi-square distributed, with the
degrees of freedom that the parameters leave the block.  Order: signs in the order of measurement change as
often as in random order (runs of Wald and Wolfowitz).  The p-values are corrected for the number of tests
(Sidak).
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Final, Literal

import numpy as np
from scipy.stats import chi2

from ringbalance.identification.likelihood import basis_of
from ringbalance.scene.arrays import BoolArray, FloatArray, StringArray

LEVEL: Final = 0.05
"""Chance that a model that is right is said to fail."""
FEWEST: Final = 5
"""Rows of a block that is tested."""
_MOST_NAMED: Final = 3
"""Findings that the sentence names."""


@dataclass(frozen=True, kw_only=True, eq=False)
class LinearFit:
    """Residuals and derivatives at the solution, each row in units of its own standard deviation."""

    residuals: FloatArray
    """(measured - predicted)/sigma, and of priors (value before - fitted)/sigma, shape (n,)."""
    derivatives: FloatArray
    """Of the predictions by the parameters, over sigma, shape (n, p)."""
    block: StringArray
    """What a row is of, such as "injection amplitude_after", shape (n,); rows of one block share a noise."""
    data: BoolArray
    """Whether a row is a measurement; else it is a prior."""
    known_noise: BoolArray
    """Whether its sigma was given; else it was estimated from the residuals of its block."""
    order: FloatArray
    """In which the rows of a file were measured; of priors it does not matter."""

    @cached_property
    def _basis(self) -> FloatArray:
        """Orthonormal basis of what the parameters can do to the predictions."""
        return basis_of(self.derivatives)

    def beyond_parameters(self, rows: FloatArray) -> FloatArray:
        """What no change of the parameters can describe of changes of the predictions, shape (n, ...)."""
        return np.asarray(rows - self._basis @ (self._basis.T @ rows))

    def freedom(self, chosen: BoolArray) -> float:
        """Degrees of freedom that some rows have left: their number less the parameters they determine."""
        return float(np.count_nonzero(chosen) - np.sum(self._basis[chosen] ** 2))


@dataclass(frozen=True, kw_only=True)
class ResidualTest:
    """One test of a block's residuals."""

    test: Literal["size", "runs"]
    block: str
    p_value: float
    """Alone."""
    text: str
    corrected: float = 1.0
    """Chance that a right model has any test as clear as this one."""

    @property
    def fails(self) -> bool:
        """Whether the model is rejected for it."""
        return self.corrected < LEVEL


@dataclass(frozen=True, kw_only=True)
class Criticism:
    """All tests of a fit's residuals, clearest first."""

    findings: tuple[ResidualTest, ...]

    @property
    def describes(self) -> bool:
        """Whether the fit describes the data, as far as these can tell."""
        return not any(each.fails for each in self.findings)

    @property
    def text(self) -> str:
        """One sentence."""
        failed = [each.text for each in self.findings if each.fails]
        if failed:
            more = len(failed) - _MOST_NAMED
            rest = [f"and {more} more such findings"] if more > 0 else []
            return "the fit does not describe the data: " + "; ".join([*failed[:_MOST_NAMED], *rest])
        if not self.findings:
            return "too few measurements to tell whether the fit describes them"
        tests = f"{len(self.findings)} tests, {100 * LEVEL:g} % level"
        return f"nothing in the residuals speaks against the fit ({tests})"

    @classmethod
    def of(cls, fit: LinearFit) -> Criticism:
        """Test the residuals of a fit."""
        tests = [*_sizes(fit), *_runs(fit)]
        corrected = [
            replace(each, corrected=-math.expm1(len(tests) * math.log1p(-min(each.p_value, 1 - 1e-12))))
            for each in tests
        ]
        return cls(findings=tuple(sorted(corrected, key=lambda each: each.p_value)))


def _blocks(fit: LinearFit) -> Iterator[tuple[str, BoolArray]]:
    for name in dict.fromkeys(map(str, fit.block[fit.data])):
        rows = fit.data & (fit.block == name)
        if np.count_nonzero(rows) >= FEWEST and fit.freedom(rows) > 1:
            yield name, rows


def _sizes(fit: LinearFit) -> Iterator[ResidualTest]:
    for block, rows in _blocks(fit):
        if bool(np.all(fit.known_noise[rows])):
            square, freedom = float(np.sum(fit.residuals[rows] ** 2)), fit.freedom(rows)
            times = math.sqrt(square / freedom)
            text = f"residuals of {block} are {times:.2g} times as large as the stated noise"
            yield ResidualTest(test="size", block=block, p_value=float(chi2.sf(square, freedom)), text=text)


def _runs(fit: LinearFit) -> Iterator[ResidualTest]:
    for block, rows in _blocks(fit):
        signs = fit.residuals[rows][np.argsort(fit.order[rows], kind="stable")] > 0
        plus = int(np.count_nonzero(signs))
        if min(plus, signs.size - plus) > 1:
            runs = 1 + int(np.count_nonzero(signs[1:] != signs[:-1]))
            text = f"residuals of {block} keep their sign: {runs} runs in {signs.size} measurements"
            p_value = _runs_probability(plus, signs.size - plus, runs)
            yield ResidualTest(test="runs", block=block, p_value=p_value, text=text)


def _runs_probability(plus: int, minus: int, runs: int) -> float:
    """Probability of at most so many runs among signs in random order.

    Source: Wald and Wolfowitz, Ann. Math. Statist. 11 (1940) 147, recalled; the counting is elementary.
    """
    ways = 0
    for count in range(2, runs + 1):
        half = count // 2
        if count % 2 == 0:
            ways += 2 * math.comb(plus - 1, half - 1) * math.comb(minus - 1, half - 1)
        else:
            ways += math.comb(plus - 1, half) * math.comb(minus - 1, half - 1)
            ways += math.comb(plus - 1, half - 1) * math.comb(minus - 1, half)
    return ways / math.comb(plus + minus, plus)
