"""Every model of a hierarchy measured: its error against the finest, its counted cost, time and memory.

Counted cost is work times committed seconds per unit, so that a choice never hangs on a clock.
"""

from __future__ import annotations

import json
import time
import tracemalloc
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import lru_cache, partial
from importlib.resources import files
from statistics import median
from typing import Final

import numpy as np
from scipy.optimize import nnls

from ringbalance.verification.selection_studies.hierarchy import Fidelity, ModelHierarchy, Values, Work

_QUICK: Final = 0.1
"""s, below which a run is repeated."""
_QUICK_ONCE: Final = 0.01
"""s, below which a run at another point is looked at where each counts once."""
FLOOR: Final = 3e-8
"""Relative error below which grid convergence, tables and rounding rule: smaller ones count as equal."""
_RESOURCE: Final = "cost_model.json"
_PULL: Final = 0.3
"""Root of the weight of one pull towards a prior."""


@dataclass(frozen=True, kw_only=True)
class CostModel:
    """Seconds per unit of counted work on the machine that it was fitted on."""

    seconds: Mapping[str, float]
    """By kind of work."""
    fitted_on: str
    """How the numbers came about."""

    def cost(self, work: Work) -> float:
        """Cost of some work, s. Raises: ValueError: a kind of work that this model does not know."""
        unknown = sorted(set(work) - set(self.seconds))
        if unknown:
            raise ValueError(f"the cost model knows no work of kind {unknown[0]!r}: fit it again")
        return float(sum(self.seconds[kind] * count for kind, count in work.items()))

    def ranked(self, hierarchy: ModelHierarchy) -> list[Fidelity]:
        """Models of a hierarchy, cheapest over all its points first; equal ones as they stand."""
        points = len(hierarchy.points)
        return sorted(hierarchy.fidelities, key=lambda fidelity: self.cost(fidelity.counted(points)))


@lru_cache(maxsize=1)
def committed_costs() -> CostModel:
    """The cost model that choices rest on, the same on every machine.

    Source: least squares over measured runs of every model, by `ringbalance trade SCENE --save-costs FILE`.
    """
    path = files("ringbalance.verification.selection_studies") / "data" / _RESOURCE
    record = json.loads(path.read_text(encoding="utf-8"))
    return CostModel(seconds=dict(record["seconds"]), fitted_on=record["fitted_on"])


def fitted_costs(
    *, works: Sequence[Work], seconds: Sequence[float], fitted_on: str, prior: CostModel | None = None
) -> CostModel:
    """Fit seconds per unit of work to measured times, each run weighted by its own time.

    Minimises sum (cost/seconds - 1)^2 with no negative coefficient.
    Args: `works`: counts of each run. `seconds`: measured, s, above zero, one per run. `fitted_on`: how the
        times came about. `prior`: pulls each coefficient towards its own with the weight of a tenth of a run,
        so that a kind of work that always comes with others is not lost; kinds without a run keep theirs.
    Raises: ValueError: as many times as runs are needed, at least one, all above zero.
    Source: Lawson and Hanson (1974), non-negative least squares.
    """
    if not works or len(works) != len(seconds) or min(seconds) <= 0:
        raise ValueError("one time above zero is needed for each run, and at least one run")
    known = {} if prior is None else {kind: value for kind, value in prior.seconds.items() if value > 0}
    kinds = sorted({kind for work in works for kind in work} | set(known))
    rows = np.array([[work.get(kind, 0.0) for kind in kinds] for work in works])
    scaled = rows / np.asarray(seconds)[:, None]
    pulls = np.diag([_PULL / known[kind] if kind in known else 0.0 for kind in kinds])
    wanted = [*np.ones(len(works)), *(_PULL if kind in known else 0.0 for kind in kinds)]
    scaled = np.vstack([scaled, pulls])
    sizes = np.maximum(np.linalg.norm(scaled, axis=0), 1e-300)
    found, _ = nnls(scaled / sizes, np.array(wanted))
    return CostModel(
        seconds={kind: float(value) for kind, value in zip(kinds, found / sizes, strict=True)},
        fitted_on=fitted_on,
    )


@dataclass(kw_only=True)
class Clock:
    """Takes processor times and peaks of memory; remembers what the same counted work took before."""

    repeats: int = 3
    """Runs of which the median counts, where one is quick."""
    memory: bool = True
    """Whether memory is traced, too."""
    _known: dict[frozenset[tuple[str, float]], float] = field(default_factory=dict)

    def seconds_of(self, fidelity: Fidelity, points: int) -> float:
        """Processor time of a model over points, with the tables it needs first, s.

        Each part is the median of several runs, or of the points' single runs where these take long.
        """
        before = 0.0
        if fidelity.prepare is not None:
            before = self._remembered(fidelity.fixed_work, partial(self._median, fidelity.prepare))
        if fidelity.fresh is None or self.repeats > 1:
            return before + self._over(fidelity, points)
        # Such a model answers two quantities at once: a light study times it with the first of them.
        counted = {**fidelity.work, "points": float(points)}
        return before + self._remembered(counted, partial(self._over, fidelity, points))

    def _remembered(self, counted: Work, taken: Callable[[], float]) -> float:
        key = frozenset(counted.items())
        if key not in self._known:
            self._known[key] = taken()
        return self._known[key]

    def _over(self, fidelity: Fidelity, points: int) -> float:
        runs = [partial(fidelity.fresh or fidelity.solve, point) for point in range(points)]
        each = [_once(runs[0])]
        if self.repeats > 1 or each[0] < _QUICK_ONCE:
            each += map(_once, runs[1:])
        if max(each) < _QUICK:
            each += map(_once, runs * (self.repeats - 1))
        return median(each) * points

    def _median(self, work: Callable[[], object]) -> float:
        times = [_once(work)]
        while len(times) < self.repeats and times[0] < _QUICK:
            times.append(_once(work))
        return median(times)

    def memory_of(self, fidelity: Fidelity) -> float | None:
        """Peak of memory that Python and NumPy allocate at one point, bytes; None where it is not traced."""
        if not self.memory:
            return None
        tracemalloc.start()
        try:
            (fidelity.fresh or fidelity.solve)(0)
            return float(tracemalloc.get_traced_memory()[1])
        finally:
            tracemalloc.stop()


def _once(work: Callable[[], object]) -> float:
    start = time.process_time()
    work()
    return max(time.process_time() - start, 1e-7)


@dataclass(frozen=True, kw_only=True)
class Measured:
    """One model, measured."""

    fidelity: Fidelity
    error: float
    """Largest relative error against the finest model over the hierarchy's points."""
    counted: Work
    """Over all points."""
    cost: float
    """Of that by the committed cost model, s of its machine."""
    on_front: bool
    """Whether no other model is both cheaper and nearer."""
    seconds: float | None
    """Processor time over all points and of the tables before, medians of several runs; None: not timed."""
    memory: float | None
    """Peak of allocated memory at one point, bytes; None: not measured."""


@dataclass(frozen=True, kw_only=True)
class Trade:
    """The measured model hierarchy of one quantity."""

    hierarchy: ModelHierarchy
    fidelities: tuple[Measured, ...]
    knee: str | None
    """Name of the model at the front's trade-off point; None for a model hierarchy without points."""


def measure(hierarchy: ModelHierarchy, *, values: Values, costs: CostModel, clock: Clock | None) -> Trade:
    """Measure a model hierarchy; one without points has no models to measure, without a clock no times.

    Source: Pareto front over counted cost and error; trade-off point by the largest distance from the chord
        between the front's ends, both axes logarithmic, errors below the finest model's own uncertainty
        counted as that.
    """
    points = len(hierarchy.points)
    if not points:
        return Trade(hierarchy=hierarchy, fidelities=(), knee=None)
    errors = [values.error(fidelity) for fidelity in hierarchy.fidelities]
    counted = [fidelity.counted(points) for fidelity in hierarchy.fidelities]
    spent = [costs.cost(work) for work in counted]
    front = pareto_front(spent, [max(error, FLOOR) for error in errors])
    held = [max(error, hierarchy.top_uncertainty, FLOOR) for error in errors]
    found = tuple(
        Measured(
            fidelity=fidelity,
            error=errors[i],
            counted=counted[i],
            cost=spent[i],
            on_front=i in front,
            seconds=clock.seconds_of(fidelity, points) if clock else None,
            memory=clock.memory_of(fidelity) if clock else None,
        )
        for i, fidelity in enumerate(hierarchy.fidelities)
    )
    return Trade(hierarchy=hierarchy, fidelities=found, knee=found[knee(spent, held)].fidelity.name)


def pareto_front(costs: Sequence[float], errors: Sequence[float]) -> list[int]:
    """Places of entries that none beats in both cost and error, cheapest first; of equals the first."""
    best, found = float("inf"), []
    for i in sorted(range(len(costs)), key=lambda i: (costs[i], errors[i])):
        if errors[i] < best:
            best = errors[i]
            found.append(i)
    return found


def knee(costs: Sequence[float], errors: Sequence[float]) -> int:
    """Place of the entry of the front that lies farthest below the chord between its ends, logarithmically.

    Of a front of one or two it is the last.
    """
    front = pareto_front(costs, errors)
    if len(front) < 3:
        return front[-1]
    x, y = (np.log(np.maximum(np.asarray(v, dtype=np.float64)[front], 1e-300)) for v in (costs, errors))
    x, y = (x - x[0]) / (x[-1] - x[0]), (y - y[-1]) / (y[0] - y[-1])
    return front[int(np.argmax(1 - x - y))]
