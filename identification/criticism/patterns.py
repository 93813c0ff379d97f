"""Whether a fit describes its data, by patterns that its residuals would not have by chance.

Each pattern z, such as a rise of one block's residuals with the gas pressure, is a further column of a linear
model: t = z^T r/sqrt(z^T M z), with M what the parameters leave over, is standard normal when the model is
right, however many parameters were fitted.  The p-values of all patterns are corrected by the distribution of
the largest of them, which knows how they overlap.
Source: least squares with a further column; correction by the largest statistic as in Westfall and Young,
Resampling-Based Multiple Testing (1993), recalled.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Final, Literal

import numpy as np
from scipy.special import chdtrc, ndtr, ndtri, stdtr

from ringbalance.identification.likelihood import basis_of
from ringbalance.scene.arrays import BoolArray, FloatArray, StringArray, distinct


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


LEVEL: Final = 0.05
"""Chance that a model that is right is said to fail."""
FEWEST: Final = 5
"""Rows of a block in which a pattern is looked for."""
_DRAWS: Final = 4000
_SEED: Final = 20260
_LEAST: Final = 1e-2
"""Of a pattern's square that the parameters must leave; of less they could describe it."""
_MOST_NAMED: Final = 3
"""Findings that the sentence names."""
Shape = Literal["rise", "bend"]


@dataclass(frozen=True, kw_only=True)
class Finding:
    """One test of the residuals."""

    test: Literal["pattern", "size", "runs"]
    block: str
    against: str
    """What the residuals go with, such as "pressure"; empty for their size."""
    p_value: float
    """Alone."""
    corrected: float
    """Chance that a right model shows any finding as clear as this one."""
    text: str

    @property
    def fails(self) -> bool:
        """Whether the model is rejected for it."""
        return self.corrected < LEVEL


@dataclass(frozen=True, kw_only=True)
class Criticism:
    """All tests of a fit's residuals, clearest first."""

    findings: tuple[Finding, ...]

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
        return f"no pattern in the residuals ({len(self.findings)} tests, {100 * LEVEL:g} % level)"

    @classmethod
    def of(cls, fit: LinearFit, covariates: Mapping[str, FloatArray]) -> Criticism:
        """Test the residuals of a fit.

        Args: `covariates`: by name, shape (n,); NaN where a row has none, as priors have. "order" is that in
            which the rows of a file were measured.
        """
        tests = [*_patterns(fit, covariates), *_sizes(fit), *_runs(fit, covariates.get("order"))]
        patterns = [t for t in tests if t.contrast is not None]
        families = len(tests) - len(patterns) + bool(patterns)
        worst = _max_correction(patterns)
        found = [
            Finding(
                test=each.test,
                block=each.block,
                against=each.against,
                p_value=each.p_value,
                corrected=-math.expm1(
                    families * math.log1p(-min(worst.get(id(each), each.p_value), 1 - 1e-12))
                ),
                text=each.text,
            )
            for each in tests
        ]
        return cls(findings=tuple(sorted(found, key=lambda f: (f.corrected, f.p_value))))


@dataclass(frozen=True, kw_only=True, eq=False)
class _Test:
    test: Literal["pattern", "size", "runs"]
    block: str
    against: str
    p_value: float
    text: str
    contrast: FloatArray | None = None
    """Of unit length; None for a test that is no pattern."""


def _blocks(fit: LinearFit) -> Iterator[tuple[str, BoolArray]]:
    for name in dict.fromkeys(map(str, fit.block[fit.data])):
        rows = fit.data & (fit.block == name)
        if np.count_nonzero(rows) >= FEWEST and fit.freedom(rows) > 1:
            yield name, rows


def _patterns(fit: LinearFit, covariates: Mapping[str, FloatArray]) -> Iterator[_Test]:
    for block, rows in _blocks(fit):
        for against, values in covariates.items():
            usable = rows & np.isfinite(values)
            for shape, pattern in _shapes(values[usable]):
                whole = np.zeros(fit.residuals.size)
                whole[usable] = pattern
                found = _pattern_test(fit, rows, whole, block, against, shape)
                if found is not None:
                    yield found


def _shapes(values: FloatArray) -> Iterator[tuple[Shape, FloatArray]]:
    """A straight line from -1 to 1 over the values and, where there are three different ones, a parabola."""
    different = distinct(values).size
    if values.size < FEWEST or different < 2:
        return
    line = 2 * (values - values.min()) / np.ptp(values) - 1
    yield "rise", line
    if different > 2:
        yield "bend", 2 * line**2 - 1


def _pattern_test(
    fit: LinearFit, rows: BoolArray, pattern: FloatArray, block: str, against: str, shape: Shape
) -> _Test | None:
    beyond = fit.beyond_parameters(pattern)
    left = float(pattern @ beyond)
    if left < _LEAST * float(pattern @ pattern):
        return None
    projected = float(beyond @ fit.residuals)
    score = projected / math.sqrt(left)
    freedom = fit.freedom(rows) - 1
    if bool(np.all(fit.known_noise[rows])):
        p_value = 2 * float(ndtr(-abs(score)))
    else:
        rest = max(float(np.sum(fit.residuals[rows] ** 2)) - score**2, 1e-300)
        p_value = 2 * float(stdtr(freedom, -abs(score) * math.sqrt(freedom / rest)))
    return _Test(
        test="pattern",
        block=block,
        against=against,
        p_value=p_value,
        text=_pattern_text(block, against, shape, 2 * projected / left),
        contrast=beyond / math.sqrt(left),
    )


def _pattern_text(block: str, against: str, shape: Shape, size: float) -> str:
    of, size_text = f"residuals of {block}", f"{abs(size):.2g} standard deviations"
    if shape == "rise":
        way = "rise" if size > 0 else "fall"
        return f"{of} {way} with {against}, by {size_text} over its range"
    middle = "below" if size > 0 else "above"
    return f"{of} bend with {against}: in the middle of its range {size_text} {middle} the ends"


def _sizes(fit: LinearFit) -> Iterator[_Test]:
    """Sum of squares of blocks whose noise was given: too large for it."""
    for block, rows in _blocks(fit):
        if bool(np.all(fit.known_noise[rows])):
            square, freedom = float(np.sum(fit.residuals[rows] ** 2)), fit.freedom(rows)
            yield _Test(
                test="size",
                block=block,
                against="",
                p_value=float(chdtrc(freedom, square)),
                text=f"residuals of {block} are {math.sqrt(square / freedom):.2g} times as large as the "
                "stated noise",
            )


def _runs(fit: LinearFit, order: FloatArray | None) -> Iterator[_Test]:
    """Signs in the order of measurement: fewer changes than chance makes."""
    if order is None:
        return
    for block, rows in _blocks(fit):
        usable = rows & np.isfinite(order)
        signs = fit.residuals[usable][np.argsort(order[usable], kind="stable")] > 0
        plus = int(np.count_nonzero(signs))
        if usable.any() and min(plus, signs.size - plus) > 1:
            runs = 1 + int(np.count_nonzero(signs[1:] != signs[:-1]))
            yield _Test(
                test="runs",
                block=block,
                against="order",
                p_value=_runs_probability(plus, signs.size - plus, runs),
                text=f"residuals of {block} keep their sign: {runs} runs in {signs.size} measurements",
            )


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


def _max_correction(patterns: list[_Test]) -> Mapping[int, float]:
    """Chance that the clearest of all patterns is as clear as each of them, when the model is right."""
    if not patterns:
        return {}
    contrasts = np.array([t.contrast for t in patterns])
    values, vectors = np.linalg.eigh(contrasts @ contrasts.T)
    root = vectors * np.sqrt(np.maximum(values, 0.0))
    draws = np.random.default_rng(_SEED).standard_normal((_DRAWS, len(patterns))) @ root.T
    largest = np.max(np.abs(draws), axis=1)
    found = {}
    for each in patterns:
        score = -float(ndtri(max(each.p_value, 1e-300) / 2))
        exceeded = (1 + np.count_nonzero(largest >= score)) / (1 + _DRAWS)
        # Where no draw is as large, Bonferroni's bound is closer.
        found[id(each)] = float(min(exceeded, len(patterns) * each.p_value))
    return found
