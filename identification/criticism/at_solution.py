"""A fit near its solution as plain arrays: residuals, derivatives, and what the rows were measured at."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ringbalance.identification.criticism.linear_fit import LinearFit
from ringbalance.identification.data.kinds import KINDS
from ringbalance.identification.data.observations import Observations
from ringbalance.identification.predict.kinds import rows_of
from ringbalance.identification.result import FitResult
from ringbalance.scene.arrays import FloatArray, StringArray

ORDER = "the order of measurement"


@dataclass(frozen=True, kw_only=True, eq=False)
class AtSolution:
    """Rows are those of all files, then held inputs, then priors."""

    fit: LinearFit
    """Of a vibration the part along its predicted change, and the part across."""
    covariates: Mapping[str, FloatArray]
    """By name, shape (n,); NaN where a row has none."""
    turn: FloatArray
    """Rotation of the rows of vibrations into these parts, shape (measured, measured)."""

    def turned(self, rows: FloatArray) -> FloatArray:
        """Rows of the fit's own order, with those of vibrations along and across."""
        count = self.turn.shape[0]
        return np.concatenate([self.turn @ rows[:count], rows[count:]])


def at_solution(result: FitResult) -> AtSolution:
    """The fit linearised at its optimum; what is no parameter but was fitted too counts as one."""
    best = result.optimum
    problem, residuals = best.residuals.problem, best.residuals
    count, parts = problem.measured.size, best.at
    turn = _turn(result)
    more = np.zeros((parts.size - residuals.base.shape[0], residuals.base.shape[1]))
    whole = np.hstack([-best.slopes, np.concatenate([residuals.base, more])])
    data = np.arange(parts.size) < count
    known = np.zeros(parts.size, dtype=np.bool_)
    known[:count] = problem.group < 0
    blocks = np.concatenate([_names(b.observations, b.measured.size) for b in problem.blocks])
    rest = np.full(parts.size - count, "beforehand")
    return AtSolution(
        fit=LinearFit(
            residuals=np.concatenate([turn @ parts[:count], parts[count:]]),
            derivatives=np.concatenate([turn @ whole[:count], whole[count:]]),
            block=np.concatenate([blocks, rest]),
            data=data,
            known_noise=known,
        ),
        covariates=_covariates(result, parts.size),
        turn=turn,
    )


def _names(observations: Observations, size: int) -> StringArray:
    title = Path(observations.file).name
    if size == len(observations):
        return np.full(size, title)
    parts = ("along the predicted change", "across the predicted change")
    return np.repeat([f"{title} {part}" for part in parts], len(observations))


def _turn(result: FitResult) -> FloatArray:
    """Rotates a vibration's real and imaginary part into those along its predicted change and across."""
    problem, t = result.optimum.residuals.problem, result.optimum.t
    predicted, turn, at = problem.at(t), np.eye(problem.measured.size), 0
    for block in problem.blocks:
        size, rows = block.measured.size, len(block.observations)
        if size == 2 * rows:
            along = rows_of(block.observations, predicted[at : at + size])
            angle = np.arctan2(along[:, 1], along[:, 0])
            i = at + np.arange(rows)
            turn[i, i] = turn[i + rows, i + rows] = np.cos(angle)
            turn[i, i + rows], turn[i + rows, i] = np.sin(angle), -np.sin(angle)
        at += size
    return turn


def _covariates(result: FitResult, size: int) -> Mapping[str, FloatArray]:
    """What was set, and the order; angles apart, which have no least and no largest."""
    problem, found, at = result.optimum.residuals.problem, {ORDER: np.full(size, np.nan)}, 0
    for block in problem.blocks:
        observations = block.observations
        width = block.measured.size // len(observations)
        mine = slice(at, at + block.measured.size)
        found[ORDER][mine] = np.tile(np.arange(float(len(observations))), width)
        for column in KINDS[observations.kind].columns:
            values = observations.columns.get(column.name)
            if values is None or column.measured or column.amplitude or column.dimension == "angle":
                continue
            found.setdefault(column.words, np.full(size, np.nan))[mine] = np.tile(values, width)
        at += block.measured.size
    return found
