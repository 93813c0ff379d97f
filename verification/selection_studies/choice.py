"""The cheapest model that keeps a tolerance: chosen by what each thing left out is worth, then checked.

The check runs the next finer model, which holds all that the choice left out and that may be worth a
thousandth of the tolerance, at a few points.  The cheapest model within the tolerance of it is taken: a more
expensive one than first chosen when the estimate was too small, a cheaper one when it was too large.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Final

import numpy as np

from ringbalance.reduced_model.contribution import NEGLIGIBLE, Contribution
from ringbalance.scene.arrays import FloatArray
from ringbalance.verification.selection_studies.cost import CostModel, committed_costs
from ringbalance.verification.selection_studies.hierarchy import Fidelity, ModelHierarchy, relative_error

TOLERANCES: Final = (1e-6, 0.1)
"""Smallest and largest tolerance that a choice is made for."""
RULED_OUT: Final = 100.0
"""Times the tolerance: a model that leaves out a single thing worth more is not tried."""
MARGIN: Final = 1.001
"""A model within this factor of the tolerance is kept at the check: its reference is known no better, and the
next one may cost many times as much."""


@dataclass(frozen=True, kw_only=True)
class Choice:
    """The model chosen for one quantity at one tolerance, and how."""

    quantity: str
    tolerance: float
    first: Fidelity
    """Chosen by the estimates alone."""
    fidelity: Fidelity
    """Kept after the check."""
    reference: Fidelity | None
    """The model it was checked against; None where nothing left out is worth a check."""
    measured: float | None
    """Largest relative difference from the reference at the check points."""
    cost: float
    """Of the model over all points, s of the cost model's machine."""
    checking_cost: float
    """Of all that the check ran."""
    reasons: tuple[str, ...]
    """For people: what is in, what is left out and why, what the check said."""

    @property
    def climbed(self) -> bool:
        """Whether the check sent the choice up."""
        return (
            self.fidelity.name != self.first.name
            and len(self.fidelity.leaves_out - self.first.leaves_out) == 0
        )


class Values:
    """Values of a hierarchy's models at its points, each computed once."""

    def __init__(self, hierarchy: ModelHierarchy) -> None:
        """Start with nothing computed."""
        self.hierarchy = hierarchy
        self._found: dict[tuple[str, int], FloatArray] = {}

    def at(self, fidelity: Fidelity, points: tuple[int, ...]) -> FloatArray:
        """Values of a model at points given by their numbers, shape (points, m)."""
        for point in points:
            if (fidelity.name, point) not in self._found:
                self._found[fidelity.name, point] = fidelity.solve(point)
        return np.array([self._found[fidelity.name, point] for point in points])

    def error(self, fidelity: Fidelity, reference: Fidelity, points: tuple[int, ...]) -> float:
        """Largest relative error of a model against another at points."""
        return relative_error(
            found=self.at(fidelity, points),
            reference=self.at(reference, points),
            relative_to=self.hierarchy.relative_to,
        )


def _check(hierarchy: ModelHierarchy, tolerance: float) -> None:
    low, high = TOLERANCES
    if not (low * (1 - 1e-12) <= tolerance <= high * (1 + 1e-12)):
        raise ValueError(
            f"a tolerance must lie within {low:g} and {high:g} (10 %), not {tolerance:g}: models "
            "are chosen for that range alone"
        )
    if not hierarchy.points:
        raise ValueError(f"{hierarchy.quantity}: {hierarchy.status.text}")


def _predicted_error(fidelity: Fidelity, hierarchy: ModelHierarchy) -> float:
    """Relative, the sum of what a model leaves out and the finest one includes; infinite without a basis."""
    left = sorted(fidelity.leaves_out - hierarchy.top.leaves_out)
    values = [hierarchy.contributions[term].value for term in left]
    return sum((math.inf if value is None else value for value in values), 0.0)


def choose(
    hierarchy: ModelHierarchy,
    tolerance: float,
    *,
    check: bool = True,
    costs: CostModel | None = None,
    values: Values | None = None,
) -> Choice:
    """Choose the cheapest model of a hierarchy for a tolerance, and check it.

    Args: `check`: whether the next finer model is run; without it the estimates alone decide. `costs`:
        default the committed ones. `values`: of the hierarchy's models, to compute none twice.
    Raises: ValueError: a tolerance outside 1e-6 to 0.1, or a model hierarchy without points.
    Source: the rule stands in this module's first lines.
    """
    _check(hierarchy, tolerance)
    model, held = costs or committed_costs(), values or Values(hierarchy)
    ranked = model.ranked(hierarchy)
    first = next((f for f in ranked if _predicted_error(f, hierarchy) <= tolerance), hierarchy.top)
    reference = _next_up(hierarchy, first, tolerance, ranked) if check else None
    kept, tried = first, list[Fidelity]()
    if reference is not None:
        kept, tried = _tried(held, reference, tolerance, ranked)
    measured = None if reference is None else held.error(kept, reference, hierarchy.check)
    spent = [model.of_fidelity(fidelity, points=len(hierarchy.check)) for fidelity in tried]
    return Choice(
        quantity=hierarchy.quantity,
        tolerance=tolerance,
        first=first,
        fidelity=kept,
        reference=reference,
        measured=measured,
        cost=model.of_fidelity(kept, points=len(hierarchy.points)),
        checking_cost=sum(spent, 0.0),
        reasons=_reasons(hierarchy, tolerance, first, kept, reference, measured),
    )


def _tried(
    values: Values, reference: Fidelity, tolerance: float, ranked: list[Fidelity]
) -> tuple[Fidelity, list[Fidelity]]:
    """The cheapest model within the tolerance of the reference, and all that were run to find it."""
    hierarchy, tried = values.hierarchy, [reference]
    for fidelity in ranked:
        if fidelity.name == reference.name:
            break
        if _ruled_out(hierarchy, fidelity, tolerance):
            continue
        tried.append(fidelity)
        if values.error(fidelity, reference, hierarchy.check) <= MARGIN * tolerance:
            return fidelity, tried
    return reference, tried


def _undecided(hierarchy: ModelHierarchy, fidelity: Fidelity, tolerance: float) -> frozenset[str]:
    """What a model leaves out and a thousandth of the tolerance does not cover."""

    def matters(term: str) -> bool:
        value = hierarchy.contributions[term].value
        return value is None or value >= NEGLIGIBLE * tolerance

    return frozenset(term for term in fidelity.leaves_out - hierarchy.top.leaves_out if matters(term))


def _ruled_out(hierarchy: ModelHierarchy, fidelity: Fidelity, tolerance: float) -> bool:
    left = [hierarchy.contributions[term] for term in fidelity.leaves_out - hierarchy.top.leaves_out]
    worth = [0.0 if c.rough else c.value or 0.0 for c in left]
    return max(worth, default=0.0) > RULED_OUT * tolerance


def _next_up(
    hierarchy: ModelHierarchy, fidelity: Fidelity, tolerance: float, ranked: list[Fidelity]
) -> Fidelity | None:
    """The cheapest model that holds all of that, and leaves out nothing that the first one holds."""
    undecided = _undecided(hierarchy, fidelity, tolerance)
    if not undecided:
        # Estimates that are far too large would not be noticed without a look at what lies below.
        return fidelity if ranked[0].name != fidelity.name else None
    for other in ranked:
        # What is negligible may be missing from both: a more expensive solution without it shows nothing.
        new = _undecided(hierarchy, other, tolerance)
        if not new:
            return other
    return hierarchy.top


def _reasons(
    hierarchy: ModelHierarchy,
    tolerance: float,
    first: Fidelity,
    kept: Fidelity,
    reference: Fidelity | None,
    measured: float | None,
) -> tuple[str, ...]:
    told = [_worth(hierarchy.contributions[term], term in kept.leaves_out) for term in _terms(hierarchy)]
    if reference is None:
        told.append("nothing that is left out is worth a check")
    elif kept.name == first.name:
        told.append(
            f"checked: {_measured(measured)} from “{reference.name}” at {len(hierarchy.check)} points"
        )
    elif kept.leaves_out < first.leaves_out or kept.name == reference.name:
        told.append(
            f"refined: the estimates allowed “{first.name}”, the check against “{reference.name}” did not; "
            f"“{kept.name}” is {_measured(measured)} from it"
        )
    else:
        told.append(
            f"the estimates asked for “{first.name}”; checked against “{reference.name}”, “{kept.name}” "
            f"does as well: {_measured(measured)}"
        )
    if tolerance < hierarchy.top_uncertainty:
        told.append(_below_uncertainty(hierarchy, tolerance))
    return tuple(told)


def _terms(hierarchy: ModelHierarchy) -> list[str]:
    """What the models differ in by more than their meshes."""
    return [
        term
        for term in hierarchy.contributions
        if any(term in fidelity.leaves_out for fidelity in hierarchy.fidelities)
    ]


def _worth(contribution: Contribution, left_out: bool) -> str:
    value = "unknown" if contribution.value is None else f"{contribution.value:.1e}"
    return (
        f"{contribution.term}: {'left out' if left_out else 'in'}; worth {value} by {contribution.formula} "
        f"({contribution.source})"
    )


def _measured(measured: float | None) -> str:
    return "0" if measured is None else f"{measured:.1e}"


def _below_uncertainty(hierarchy: ModelHierarchy, tolerance: float) -> str:
    """The sentence for a tolerance that the finest model itself cannot keep."""
    return (
        f"a tolerance of {tolerance:.0e} is below what “{hierarchy.top.name}”, the finest model, is known to "
        f"({hierarchy.top_uncertainty:.1e}: {hierarchy.top_uncertainty_from}): the choice keeps to that "
        "model within the tolerance, not to nature"
    )
