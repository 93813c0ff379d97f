"""Data against fit: every measured number beside the fitted one, both with their uncertainties."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ringbalance.identification.fitting import FitResult
from ringbalance.identification.intervals import covariance
from ringbalance.identification.likelihood import Block
from ringbalance.identification.optimisation import Optimum
from ringbalance.scene.arrays import FloatArray, IntArray
from ringbalance.scene.uncertain import NORMAL_95


@dataclass(frozen=True, kw_only=True, eq=False)
class AgainstFit:
    """Numbers of one column of one kind of data, SI; of a vibration its real and imaginary parts."""

    kind: str
    column: str
    dimension: str | None
    unit: str
    """Of the file's column."""
    component: IntArray
    """Of every number: 0, or 1 of the imaginary part of a vibration."""
    measured: FloatArray
    """Less what is no quantity of the device, such as the vibration without trial weight."""
    measured_uncertainty: FloatArray
    """Expanded (95 %), by the noise that is stated or estimated."""
    fitted: FloatArray
    fitted_uncertainty: FloatArray
    """Expanded (95 %), of all that was fitted together."""

    @property
    def slope(self) -> float | None:
        """Measured over fitted values, a line through zero weighted by noise; None for fitted zeros."""
        square = self._square
        return float(np.sum(self._weights * self.measured * self.fitted) / square) if square else None

    @property
    def slope_uncertainty(self) -> float | None:
        """Of the slope by the noise, expanded (95 %)."""
        return float(NORMAL_95 / np.sqrt(self._square)) if self._square else None

    @property
    def _square(self) -> float:
        return float(np.sum(self._weights * self.fitted**2))

    @property
    def _weights(self) -> FloatArray:
        return np.asarray((NORMAL_95 / self.measured_uncertainty) ** 2)


def against_fit(result: FitResult) -> list[AgainstFit]:
    """One entry for each kind and column that was fitted, in the order of the data."""
    best = result.optimum
    numbers = _numbers(best)
    parts: dict[str, list[tuple[Block, FloatArray]]] = {}
    for block, rows in best.residuals.problem.rows:
        parts.setdefault(block.group, []).append((block, numbers[:, rows]))
    return [_entry(each) for each in parts.values()]


def _entry(parts: Sequence[tuple[Block, FloatArray]]) -> AgainstFit:
    first = parts[0][0]
    kind, name = first.observations.kind, first.column
    column = first.kind.column(name)
    joined = np.concatenate([numbers for _, numbers in parts], axis=1)
    return AgainstFit(
        kind=kind,
        column=name,
        dimension=None if column is None else column.dimension,
        unit="" if column is None else column.unit,
        component=np.concatenate([_component(block) for block, _ in parts]),
        measured=joined[0],
        measured_uncertainty=joined[1],
        fitted=joined[2],
        fitted_uncertainty=joined[3],
    )


def _component(block: Block) -> IntArray:
    rows = len(block.observations)
    return np.arange(block.measured.size) // rows


def _numbers(best: Optimum) -> FloatArray:
    """Measured, its uncertainty, fitted, its uncertainty, of all numbers, shape (4, n)."""
    residuals = best.residuals
    problem, scale = residuals.problem, residuals.scale
    free = problem.free
    effects, _ = best.of_all
    spread = covariance(np.concatenate(best.of_all))
    b, n = residuals.linear_values(best.t)
    fitted = problem.at(best.t) + residuals.held @ (n - residuals.pulled)
    kept = np.r_[: best.t.size, best.t.size + free.shape[1] : effects.shape[1]]
    of_device, spread = effects[:, kept], spread[np.ix_(kept, kept)]
    found = []
    for block, mine in problem.rows:
        lower = np.linalg.inv(block.whiten)
        rows = lower @ (of_device[mine] / scale[mine][:, None])
        noise = lower / scale[mine][None, :]
        found.append(
            [
                lower @ (problem.measured[mine] - free[mine] @ b),
                NORMAL_95 * np.sqrt(np.sum(noise**2, axis=1)),
                lower @ fitted[mine],
                NORMAL_95 * np.sqrt(np.einsum("ij,jk,ik->i", rows, spread, rows)),
            ]
        )
    return np.concatenate([np.array(each) for each in found], axis=1)
