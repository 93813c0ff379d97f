"""Tests of a fit: lack of fit by its residuals, and the share of variance explained in each file.

Size: with stated noise, the sum of squares of the residuals is chi-square distributed, with the degrees of
freedom that the parameters leave to the block.  Order: the signs in the order of measurement change as often
as in random order (runs test of Wald and Wolfowitz).  The p-values are corrected for the number of tests
(Sidak).

An estimated noise absorbs whatever the prediction does not explain, so that even a prediction unrelated to
the data leaves residuals without pattern.  The explained share of a file is

    1 - (|e|^2/(n - h))/(|P y|^2/(n - m)),

y the n measured numbers, e the residuals, h the sum of the leverages of parameters and held inputs, P the
projection orthogonal to the m columns of the null hypothesis "no effect": a mean, and unknowns that are no
parameters.  Below one half the noise is larger than the effect.  The file then fails, unless the noise is
stated (then the size of the residuals is tested) or at least twice as large as the effect that the scene
predicts: repetitions of one measurement, or too weak ones, cannot be expected to show an effect.
Source: adjusted coefficient of determination.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Final, Literal

import numpy as np
from scipy.special import chdtrc

from ringbalance.identification.fitting import FitResult
from ringbalance.identification.likelihood import basis_of
from ringbalance.identification.optimisation import Optimum
from ringbalance.identification.readings import ComparedColumn, Reading, compared_columns, other_readings
from ringbalance.results.rows import text_of
from ringbalance.scene.arrays import BoolArray, FloatArray, StringArray

LEVEL: Final = 0.05
"""Significance level: probability that a true model fails."""
MIN_TESTED_ROWS: Final = 5
"""Smallest number of rows of a block that is tested."""
_MOST_NAMED_FINDINGS: Final = 3
"""Largest number of findings that the sentence names."""
_LEAST_SHARE: Final = 0.5
_HIDDEN: Final = 4.0
"""Ratio of noise variance to variance of the predicted effect, from which on the effect is hidden."""


@dataclass(frozen=True, kw_only=True, eq=False)
class _LinearFit:
    """Residuals and derivatives at the optimum, each row in units of its standard deviation."""

    residuals: FloatArray
    """(measured - predicted)/sigma, and for priors (value before - fitted)/sigma, shape (n,)."""
    derivatives: FloatArray
    """Derivatives of the predictions by the parameters, over sigma, shape (n, p)."""
    block: StringArray
    """File of each row, such as "run.csv", shape (n,), in the order of measurement; empty for a prior."""
    known_noise: BoolArray
    """True for rows with a stated sigma; False for one estimated from the residuals of the block."""

    @classmethod
    def of(cls, best: Optimum) -> _LinearFit:
        """Linearise a fit at its optimum; every other fitted unknown counts as a parameter.

        Real and imaginary parts of a vibration become the parts along and across its predicted change.
        """
        problem, residuals = best.residuals.problem, best.residuals
        size = problem.measured.size
        predicted, turn, titles = problem.at(best.t), np.eye(size), []
        for block, mine in problem.rows:
            rows, title = len(block.observations), Path(block.observations.file).name
            if block.measured.size == rows:
                titles += [title] * rows
                continue
            for part in ("along the predicted change", "across the predicted change"):
                titles += [f"{title} {part}"] * rows
            change = block.observations.rows_of(predicted[mine])
            angle = np.arctan2(change[:, 1], change[:, 0])
            i = mine.start + np.arange(rows)
            turn[i, i] = turn[i + rows, i + rows] = np.cos(angle)
            turn[i, i + rows], turn[i + rows, i] = np.sin(angle), -np.sin(angle)
        priors = best.at.size - size
        more = np.zeros((best.at.size - residuals.base.shape[0], residuals.base.shape[1]))
        derivatives = np.hstack([-best.slopes, np.concatenate([residuals.base, more])])
        return cls(
            residuals=np.concatenate([turn @ best.at[:size], best.at[size:]]),
            derivatives=np.concatenate([turn @ derivatives[:size], derivatives[size:]]),
            block=np.array([*titles, *[""] * priors]),
            known_noise=np.concatenate([problem.group < 0, np.zeros(priors, dtype=np.bool_)]),
        )


@dataclass(frozen=True, kw_only=True)
class _ResidualTest:
    """One test of a block's residuals."""

    test: Literal["size", "runs"]
    block: str
    p_value: float
    """p-value of this test alone."""
    text: str
    corrected: float = 1.0
    """p-value corrected for the number of tests."""

    @property
    def fails(self) -> bool:
        """True if this test rejects the model."""
        return self.corrected < LEVEL


@dataclass(frozen=True, kw_only=True)
class _Criticism:
    """All tests of a fit's residuals, the most significant first."""

    findings: tuple[_ResidualTest, ...]

    @property
    def describes(self) -> bool:
        """True if no test rejects the fit."""
        return not any(each.fails for each in self.findings)

    @property
    def text(self) -> str:
        """Result of all tests, as one sentence."""
        failed = [each.text for each in self.findings if each.fails]
        if failed:
            more = len(failed) - _MOST_NAMED_FINDINGS
            rest = [text_of("more_findings", count=more)] if more > 0 else []
            return text_of(
                "residuals_against_fit", findings="; ".join([*failed[:_MOST_NAMED_FINDINGS], *rest])
            )
        if not self.findings:
            return text_of("residuals_too_few")
        return text_of("residuals_sound", tests=len(self.findings), level=LEVEL)

    @classmethod
    def of(cls, fit: _LinearFit) -> _Criticism:
        """Test the residuals of a fit, block by block."""
        tests, basis = [], basis_of(fit.derivatives)
        for block in filter(None, dict.fromkeys(map(str, fit.block))):
            rows = fit.block == block
            count, residuals = int(np.count_nonzero(rows)), fit.residuals[rows]
            freedom = float(count - np.sum(basis[rows] ** 2))
            if count < MIN_TESTED_ROWS or freedom <= 1:
                continue
            if np.all(fit.known_noise[rows]):
                square = float(np.sum(residuals**2))
                text = text_of("residuals_too_large", block=block, times=math.sqrt(square / freedom))
                p_value = float(chdtrc(freedom, square))
                tests.append(_ResidualTest(test="size", block=block, p_value=p_value, text=text))
            signs = residuals > 0
            plus = int(np.count_nonzero(signs))
            if min(plus, count - plus) > 1:
                runs = 1 + int(np.count_nonzero(signs[1:] != signs[:-1]))
                text = text_of("residuals_keep_sign", block=block, runs=runs, count=count)
                p_value = _runs_probability(plus, count - plus, runs)
                tests.append(_ResidualTest(test="runs", block=block, p_value=p_value, text=text))
        corrected = [
            replace(each, corrected=-math.expm1(len(tests) * math.log1p(-min(each.p_value, 1 - 1e-12))))
            for each in tests
        ]
        return cls(findings=tuple(sorted(corrected, key=lambda each: each.p_value)))


def _runs_probability(plus: int, minus: int, runs: int) -> float:
    """Probability of at most so many runs among signs in random order.

    Source: Wald and Wolfowitz, Ann. Math. Statist. 11 (1940) 147, from memory; the counting is elementary.
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


@dataclass(frozen=True, kw_only=True)
class _Explained:
    """Explained share of one file."""

    file: str
    share: float
    """Fraction of the variance that the fit explains; below zero if "no effect" explains more."""
    fails: bool
    """True if the fit attributes most of the variance to noise, although the scene predicts an effect."""

    @property
    def text(self) -> str:
        """Sentence on a file that is hardly explained."""
        return text_of("hardly_explained", share=max(self.share, 0.0), file=Path(self.file).name)


def _shares_explained(best: Optimum) -> Iterator[_Explained]:
    """Yield the explained share of each file with enough rows."""
    problem, residuals = best.residuals.problem, best.residuals
    scale, left_over, expected = residuals.scale, best.at, problem.at(problem.start)
    taken = residuals.leverage(best.slopes)
    for block, rows in problem.rows:
        count, size = len(block.observations), block.measured.size
        # Null hypothesis "no effect": a mean of each part, and free unknowns.
        mean = np.kron(np.eye(size // count), np.ones((count, 1)))
        null_columns = block.whiten @ np.concatenate([mean, block.free], axis=1)
        null = basis_of(scale[rows, None] * null_columns)
        left = size - null.shape[1]
        freedom = size - float(np.sum(taken[rows]))
        if left < 1 or freedom < 1:
            continue
        scaled = [scale[rows] * values[rows] for values in (problem.measured, expected)]
        measured, effect = (
            float(np.sum((values - null @ (null.T @ values)) ** 2)) / left for values in scaled
        )
        noise = float(np.sum(left_over[rows] ** 2)) / freedom
        if measured > 0:
            share = 1 - noise / measured
            seen = block.estimated and noise < _HIDDEN * effect
            fails = bool(seen and share < _LEAST_SHARE)
            yield _Explained(file=block.observations.file, share=share, fails=fails)


@dataclass(frozen=True, kw_only=True)
class Review:
    """Criticism of a fit."""

    criticism: _Criticism
    explained: tuple[_Explained, ...] = ()
    """Explained share of each file."""
    readings: tuple[Reading, ...] = ()
    """Alternative readings of the files, the most likely first."""
    ranges: tuple[ComparedColumn, ...] = ()
    """Columns compared with the ranges of the scene."""

    @property
    def _read_wrongly(self) -> tuple[str, ...]:
        """Evidence of misread files, one sentence each."""
        named = [each.text for each in self.readings if each.named]
        unexplained = [each.text for each in self.explained if each.fails]
        return (*named, *unexplained, *(each.text for each in self.ranges if each.fails))

    @property
    def undecided(self) -> tuple[str, ...]:
        """Senses of angles that the data leave undecided, those of most files first, one sentence each."""
        senses = sorted((each for each in self.readings if each.undecided), key=lambda r: -len(r.files))
        return tuple({each.code: each.text for each in reversed(senses) if not each.named}.values())

    @property
    def describes(self) -> bool:
        """True if the fit describes the data and no evidence speaks against their reading."""
        return self.criticism.describes and not self._read_wrongly

    @property
    def text(self) -> str:
        """Verdict on the fit; with evidence of a misreading, inconspicuous residuals are not mentioned."""
        if not self._read_wrongly:
            return self.criticism.text
        residuals = [] if self.criticism.describes else [self.criticism.text]
        return text_of("read_against_fit", findings="; ".join([*self._read_wrongly, *residuals]))

    @classmethod
    def of(cls, result: FitResult) -> Review:
        """Test the residuals of a fit and compare alternative readings of its data."""
        best = result.optimum
        ranges = tuple(compared_columns(best.residuals.problem))
        explained = tuple(_shares_explained(best))
        unexplained = [each.file for each in explained if each.fails]
        return cls(
            criticism=_Criticism.of(_LinearFit.of(best)),
            explained=explained,
            readings=other_readings(best, ranges, stated=result.stated, unexplained=unexplained),
            ranges=ranges,
        )
