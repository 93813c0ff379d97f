"""Choice of the next measurement: the one that narrows a parameter's interval most.

Candidates are rows of every kind of data for the balancer, over the ranges of the scene or of the data.
Their noise is that of the fit; for kinds that were not measured it is assumed, and the text says so.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace
from itertools import product
from typing import Final

import numpy as np

from ringbalance.identification.fitting import FitResult
from ringbalance.identification.identifiability import Identified
from ringbalance.identification.kinds.kind import Observations
from ringbalance.identification.likelihood import DataBlock
from ringbalance.identification.parameters import inputs_of
from ringbalance.identification.reading import KINDS, kinds_of
from ringbalance.results.rows import text_of
from ringbalance.scene.arrays import FloatArray
from ringbalance.scene.narrowing import AnyScene

_ASSUMED_NOISE: Final = 0.01
"""Assumed standard deviation of a kind without measurements, relative to the largest prediction."""
_BEYOND: Final = (0.5, 1.0, 2.0)
"""Candidate settings over the median of the data."""
_WORTHWHILE: Final = 0.9
"""Ratio of interval widths, after over before, up to which one measurement is recommended."""
_AT_ALL: Final = 0.99
_RANK: Final = 1e-12
_WORDS: Final = {"gas_time": "valve-open time"}
"""Word in sentences by column, if it differs from the column's name."""


@dataclass(frozen=True, kw_only=True)
class NextMeasurement:
    """Ranking of measurements by their effect on one parameter."""

    parameter: str
    gains: tuple[_Gain, ...]
    """Gains of the candidates, the best first."""

    @property
    def text(self) -> str:
        """Recommendation in one sentence."""
        best = self.gains[0]
        if best.ratio > _AT_ALL:
            return text_of("no_measurement_narrows", parameter=self.parameter)
        code = "measurement_narrows" if best.ratio else "measurement_bounds"
        code = "best_narrows_little" if best.ratio > _WORTHWHILE else code
        return text_of(code, parameter=self.parameter, candidate=best.candidate, share=best.ratio)


def next_measurement(result: FitResult, parameter: str | None = None) -> NextMeasurement:
    """Rank candidates for a parameter; None: the parameter that the data identify least.

    Raises: KeyError: the parameter was not fitted.
    """
    order = list(Identified)
    # Least identified by verdict, then the widest interval in the scale t.
    least = max(result.parameters, key=lambda p: (order.index(p.verdict), p.profile.high - p.profile.low))
    chosen = result.parameter(parameter or least.name)
    slopes = np.concatenate(result.optimum.of_all)
    gains = _expected_gains(
        slopes.T @ slopes, parameter=result.parameters.index(chosen), candidates=_candidates(result)
    )
    return NextMeasurement(parameter=chosen.name, gains=gains)


def _candidates(result: FitResult) -> Iterator[MeasurementCandidate]:
    """Yield rows of every kind, with derivatives in the columns of `Optimum.of_all`."""
    best = result.optimum
    problem, residuals, t = best.residuals.problem, best.residuals, best.t
    scene, measured = problem.scene_at(t), {block.observations.kind: block for block in problem.blocks}
    offered = [
        _offered_rows(scene, kind, measured[kind].observations if kind in measured else None)
        for kind in kinds_of(scene.balancer)
    ]
    offered_problem = replace(
        problem, blocks=tuple(DataBlock(observations=each) for each in offered if len(each))
    )
    changed = [(problem.scene, inputs_of(problem.scene).changed(n, sd)) for n, sd in result.held.items()]
    by_parameters, by_held = offered_problem.quick_slopes(t), offered_problem.held_effects(t, changed)
    ends = np.cumsum([0, *(each.free.shape[1] for each in problem.blocks)])
    for block, mine in offered_problem.rows:
        count, size = len(block.observations), block.measured.size
        before, noise = measured.get(block.observations.kind), 1.0
        free = np.zeros((size, problem.free.shape[1]))
        for each, at in zip(problem.blocks, ends.tolist(), strict=False):
            if each is before and each.free.shape[1]:
                # Candidates join the first series of their kind.
                first = np.unique(each.observations.series) == each.observations.series[0]
                columns = np.kron(np.eye(2), np.tile(first.astype(np.float64), (count, 1)))
                free[:, at : at + each.free.shape[1]] = columns
        if before is None:
            parts = np.reshape(offered_problem.at(t)[mine], (-1, count))
            noise = _ASSUMED_NOISE * max(float(np.max(np.hypot.reduce(parts, axis=0))), 1e-300)
        elif before.estimated:
            noise = float(residuals.noise[problem.estimated_groups.index(before.group)])
        rows = np.hstack([by_parameters[mine], free, by_held[mine]]) / noise
        assumed = "" if before is not None else f" (noise of {100 * _ASSUMED_NOISE:g} % assumed)"
        for i in range(count):
            text = f"{_words_of(block.observations, i)}{assumed}"
            yield MeasurementCandidate(text=text, derivatives=rows[i::count])


def _offered_rows(scene: AnyScene, kind: str, measured: Observations | None) -> Observations:
    """All rows of a kind's grid, each a separate series."""
    grid = dict(KINDS[kind].offers(scene))
    if measured is not None:
        for name in ("gas_time", "pressure_difference", "unbalance", "voltage"):
            values = measured.columns[name] if name in grid else np.empty(0)
            # Runs without trial weight do not count in the median.
            if np.any(values > 0):
                grid[name] = [x * float(np.median(values[values > 0])) for x in _BEYOND]
    rows = list(product(*grid.values()))
    count = len(rows)
    columns = {name: np.array([row[i] for row in rows]) for i, name in enumerate(grid)}
    # Values that are not set: median of the data, or one without data.
    named = {c.name for c in KINDS[kind].columns if c.measured or c.amplitude}
    middles, widths = dict.fromkeys(named - {"mass"}, 1.0), {}
    if measured is not None:
        middles = {name: float(np.median(v)) for name, v in measured.columns.items() if name in named}
        widths = {name: float(np.median(v)) for name, v in measured.uncertainty.items()}
    return Observations(
        kind=kind,
        file="",
        lines=np.arange(1, count + 1),
        series=np.array([f"{i}" for i in range(count)]),
        chamber=np.full(count, "A" if KINDS[kind].has_chamber else ""),
        columns={name: np.full(count, value) for name, value in middles.items() if name not in columns}
        | columns,
        uncertainty={name: np.full(count, width) for name, width in widths.items()},
    )


def _words_of(offered: Observations, row: int) -> str:
    """Text of a row, such as "transfer with fill ratio 0.25, pressure 0.7 MPa, valve-open time 200 ms"."""
    said = []
    for column in KINDS[offered.kind].columns:
        values = offered.columns.get(column.name)
        if values is None or column.measured or column.amplitude:
            continue
        said.append(
            f"{_WORDS.get(column.name, column.name.replace('_', ' '))} {column.written(float(values[row]))}"
        )
    return f"{offered.kind.replace('_', ' ')} with {', '.join(said)}"


@dataclass(frozen=True, kw_only=True, eq=False)
class MeasurementCandidate:
    """Possible next measurement."""

    text: str
    derivatives: FloatArray
    """Derivatives of its m predictions by the p unknowns, over the standard deviation, shape (m, p)."""


@dataclass(frozen=True, kw_only=True)
class _Gain:
    """Effect of a candidate on one parameter."""

    candidate: str
    before: float
    """Standard deviation before; infinite if not determined."""
    after: float

    @property
    def ratio(self) -> float:
        """Ratio of interval widths, after over before; zero if only the one before is infinite."""
        return 1.0 if self.after == self.before else self.after / self.before


def _expected_gains(
    information: FloatArray, *, parameter: int, candidates: Iterable[MeasurementCandidate]
) -> tuple[_Gain, ...]:
    """Gains of all candidates, largest first.

    sigma'^2 = [(F + J^T J)^-1]_ii against sigma^2 = [F^-1]_ii.
    Args: `information`: F of the fit with its priors, shape (p, p); may be singular. `parameter`: i.
    Source: linear propagation; exact for predictions that are linear in the parameters.
    """
    before = _deviation(information, parameter)
    gains = [
        _Gain(
            candidate=each.text,
            before=before,
            after=_deviation(information + each.derivatives.T @ each.derivatives, parameter),
        )
        for each in candidates
    ]
    return tuple(sorted(gains, key=lambda gain: (gain.after, gain.candidate)))


def _deviation(information: FloatArray, parameter: int) -> float:
    """Standard deviation of one parameter; infinite if an undetermined direction contains it."""
    scale = np.sqrt(np.diag(information))
    if not scale[parameter] > 0:
        return float("inf")
    scale = np.where(scale > 0, scale, 1.0)
    values, vectors = np.linalg.eigh(information / np.outer(scale, scale))
    part = vectors[parameter] ** 2
    lost = values <= _RANK * values[-1]
    if float(np.sum(part[lost])) > 1e-8:
        return float("inf")
    return float(np.sqrt(np.sum(part[~lost] / values[~lost])) / scale[parameter])
