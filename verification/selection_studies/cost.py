"""What a model costs: counted work times committed seconds per unit; a choice never hangs on a clock."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache
from importlib.resources import files
from typing import Final

import numpy as np

from ringbalance.physics import deferred
from ringbalance.verification.selection_studies.hierarchy import Fidelity, ModelHierarchy, Work

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
    found, _ = deferred.nnls(scaled / sizes, np.array(wanted))
    return CostModel(
        seconds={kind: float(value) for kind, value in zip(kinds, found / sizes, strict=True)},
        fitted_on=fitted_on,
    )
