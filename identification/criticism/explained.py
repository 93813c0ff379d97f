"""How much of what a file measured the fit explains, and how much it calls noise.

An estimated noise takes whatever the prediction leaves over, so that one which has nothing to do with the
data leaves residuals without any pattern.  The share explained of a file is

    1 - (|e|^2/(n - h))/(|P y|^2/(n - m)),

y what was measured, e the residuals, h what parameters and held inputs take up of the n numbers, P the
projection off the m columns of the null hypothesis "no effect": a mean, and unknowns that are no parameters.
Below a half the noise is larger than the effect.  The file fails then, unless the noise is stated (the size
of the residuals is tested against it) or twice as large as the effect that the scene predicts: of repetitions
of one measurement, or of too weak ones, no share is to be expected.
Source: adjusted coefficient of determination.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Final

import numpy as np

from ringbalance.identification.likelihood import Block, basis_of
from ringbalance.identification.optimisation import Optimum
from ringbalance.scene.arrays import FloatArray

LEAST_SHARE: Final = 0.5
_HIDDEN: Final = 4.0
"""Variance of the noise over that of the effect which the scene predicts, from which none is to be seen."""


@dataclass(frozen=True, kw_only=True)
class Explained:
    """One file."""

    file: str
    share: float
    """Of the variance, by the fit; below zero where no effect at all explains more."""
    fails: bool
    """Whether what was measured is mostly called noise, though the scene predicts an effect."""

    @property
    def text(self) -> str:
        """What it means."""
        percent = f"{100 * max(self.share, 0.0):.2g} %"
        name = Path(self.file).name
        return f"the fit explains {percent} of the variance of {name} and calls the rest noise"


def shares_explained(best: Optimum) -> tuple[Explained, ...]:
    """The share of each file whose rows leave one."""
    return tuple(_shares(best))


def _shares(best: Optimum) -> Iterator[Explained]:
    problem, residuals = best.residuals.problem, best.residuals
    scale, parts, expected = residuals.scale, best.at, problem.at(problem.start)
    taken = residuals.leverage(best.slopes)
    for block, rows in problem.rows:
        null = basis_of(scale[rows, None] * _null(block))
        left = block.measured.size - null.shape[1]
        freedom = block.measured.size - float(np.sum(taken[rows]))
        if left < 1 or freedom < 1:
            continue
        measured, effect = (
            _square_off(null, scale[rows] * values[rows]) / left for values in (problem.measured, expected)
        )
        noise = float(np.sum(parts[rows] ** 2)) / freedom
        if measured > 0:
            share = 1 - noise / measured
            seen = block.estimated and noise < _HIDDEN * effect
            yield Explained(
                file=block.observations.file, share=share, fails=bool(seen and share < LEAST_SHARE)
            )


def _null(block: Block) -> FloatArray:
    """Whitened columns of what may be without any effect: a mean of each part, and free unknowns."""
    count = len(block.observations)
    mean = np.kron(np.eye(block.measured.size // count), np.ones((count, 1)))
    return np.asarray(block.whiten @ np.concatenate([mean, block.free], axis=1))


def _square_off(null: FloatArray, values: FloatArray) -> float:
    return float(np.sum((values - null @ (null.T @ values)) ** 2))
