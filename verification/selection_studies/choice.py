"""The cheapest model that keeps a tolerance: chosen by what each thing left out is worth, then checked.

The check runs the next finer model, which holds all that the choice left out and that may be worth a
thousandth of the tolerance, at a few points.  The cheapest model within the tolerance of it is taken: a more
expensive one than first chosen when the estimate was too small, a cheaper one when it was too large.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Final

from ringbalance.reduced_model.contribution import NEGLIGIBLE, Contribution
from ringbalance.verification.selection_studies.hierarchy import Fidelity, ModelHierarchy, Values
from ringbalance.verification.selection_studies.measure import CostModel, committed_costs

TOLERANCES: Final = (0.1, 1e-2, 1e-3, 1e-4, 1e-5, 1e-6)
"""At which choices are shown and judged; none is made outside of their range."""
_RULED_OUT: Final = 100.0
"""Times the tolerance: a model that leaves out a single thing worth more is not tried."""
MARGIN: Final = 1.001
"""A model within this factor of the tolerance is kept at the check: its reference is known no better, and the
next one may cost many times as much."""


@dataclass(frozen=True, kw_only=True)
class Choice:
    """The model chosen for one quantity at one tolerance, and how."""

    tolerance: float
    first: Fidelity
    """Chosen by the estimates alone."""
    fidelity: Fidelity
    """Kept after the check."""
    reference: Fidelity | None
    """The model it was checked against; None where nothing left out needs a check."""
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
        return self.fidelity.name != self.first.name and self.fidelity.leaves_out <= self.first.leaves_out


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
    model, found, few = costs or committed_costs(), values or Values(hierarchy), hierarchy.check
    ranked = model.ranked(hierarchy)
    first = next((f for f in ranked if _predicted_error(f, hierarchy) <= tolerance), hierarchy.top)
    reference = _next_up(hierarchy, first, tolerance, ranked) if check else None
    kept, tried = first, list[Fidelity]()
    if reference is not None:
        kept, tried = _tried(found, reference, tolerance, ranked)
    measured = None if reference is None else found.error(kept, reference, few)
    return Choice(
        tolerance=tolerance,
        first=first,
        fidelity=kept,
        reference=reference,
        measured=measured,
        cost=model.cost(kept.counted(len(hierarchy.points))),
        checking_cost=sum((model.cost(fidelity.counted(len(few))) for fidelity in tried), 0.0),
        reasons=tuple(_reasons(hierarchy, tolerance, first, kept, reference, measured)),
    )


def _check(hierarchy: ModelHierarchy, tolerance: float) -> None:
    low, high = min(TOLERANCES), max(TOLERANCES)
    if not (low * (1 - 1e-12) <= tolerance <= high * (1 + 1e-12)):
        raise ValueError(
            f"a tolerance must lie within {low:g} and {high:g} (10 %), not {tolerance:g}: models "
            "are chosen for that range alone"
        )
    if not hierarchy.points:
        raise ValueError(f"{hierarchy.quantity}: {hierarchy.status.text}")


def _left_out(fidelity: Fidelity, hierarchy: ModelHierarchy) -> list[Contribution]:
    """What a model leaves out and the finest one includes."""
    return [hierarchy.contributions[t] for t in sorted(fidelity.leaves_out - hierarchy.top.leaves_out)]


def _predicted_error(fidelity: Fidelity, hierarchy: ModelHierarchy) -> float:
    """Relative, the sum of what is left out; infinite without a basis."""
    return sum((math.inf if c.value is None else c.value for c in _left_out(fidelity, hierarchy)), 0.0)


def _undecided(hierarchy: ModelHierarchy, fidelity: Fidelity, tolerance: float) -> bool:
    """Whether a model leaves out anything that may be worth a thousandth of the tolerance."""
    left = _left_out(fidelity, hierarchy)
    return any(c.value is None or c.value >= NEGLIGIBLE * tolerance for c in left)


def _next_up(
    hierarchy: ModelHierarchy, fidelity: Fidelity, tolerance: float, ranked: list[Fidelity]
) -> Fidelity | None:
    """The cheapest model that leaves nothing undecided, maybe this one; None where that is the cheapest."""
    if _undecided(hierarchy, fidelity, tolerance):
        # What is negligible may be missing from both: a more expensive solution without it shows nothing.
        return next((f for f in ranked if not _undecided(hierarchy, f, tolerance)), hierarchy.top)
    # Estimates that are far too large would not be noticed without a look at what lies below.
    return fidelity if ranked[0].name != fidelity.name else None


def _tried(
    values: Values, reference: Fidelity, tolerance: float, ranked: list[Fidelity]
) -> tuple[Fidelity, list[Fidelity]]:
    """The cheapest model within the tolerance of the reference, and all that were run to find it."""
    hierarchy, tried = values.hierarchy, [reference]
    for fidelity in ranked:
        if fidelity.name == reference.name:
            break
        worth = [0.0 if c.rough else c.value or 0.0 for c in _left_out(fidelity, hierarchy)]
        if max(worth, default=0.0) > _RULED_OUT * tolerance:
            continue
        tried.append(fidelity)
        if values.error(fidelity, reference, hierarchy.check) <= MARGIN * tolerance:
            return fidelity, tried
    return reference, tried


def _number(value: float | None) -> str:
    return "unknown" if value is None else f"{value:.1e}" if value else "0"


def _reasons(
    hierarchy: ModelHierarchy,
    tolerance: float,
    first: Fidelity,
    kept: Fidelity,
    reference: Fidelity | None,
    measured: float | None,
) -> Iterator[str]:
    for term, c in hierarchy.contributions.items():
        # What the models differ in by more than their meshes.
        if any(term in fidelity.leaves_out for fidelity in hierarchy.fidelities):
            state = "left out" if term in kept.leaves_out else "in"
            yield f"{term}: {state}; estimated contribution {_number(c.value)} by {c.formula} ({c.source})"
    off = _number(measured or 0.0)
    if reference is None:
        yield "nothing that is left out needs a check"
    elif kept.name == first.name == reference.name:
        yield "it leaves out nothing that a finer model would have to check"
    elif kept.name == first.name:
        yield f"checked: {off} from “{reference.name}” at {len(hierarchy.check)} points"
    elif kept.leaves_out < first.leaves_out or kept.name == reference.name:
        yield (
            f"refined: the estimates allowed “{first.name}”, the check against “{reference.name}” did not; "
            f"“{kept.name}” is {off} from it"
        )
    else:
        yield (
            f"the estimates asked for “{first.name}”; checked against “{reference.name}”, “{kept.name}” "
            f"does as well: {off}"
        )
    if tolerance < hierarchy.top_uncertainty:
        top, width = hierarchy.top.name, hierarchy.top_uncertainty
        yield (
            f"a tolerance of {tolerance:.0e} is below what “{top}”, the finest model, is known to "
            f"({width:.1e}: {hierarchy.top_uncertainty_from}): the choice keeps to that model within the "
            "tolerance, not to nature"
        )
