"""The cheapest rung that keeps a tolerance: chosen by what each thing left out is worth, then checked.

The check runs the next rung up, which holds all that the choice left out and that may be worth a thousandth
of the tolerance, at a few points.  The cheapest rung within the tolerance of it is taken: a dearer one than
first chosen when the estimate was too small, a cheaper one when it was too large.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np
import numpy.typing as npt

from ringbalance.reduced_model.cost_model import CostModel, committed_costs
from ringbalance.reduced_model.rungs import Contribution, Ladder, Rung, relative_error

FloatArray = npt.NDArray[np.float64]

TOLERANCES: Final = (1e-6, 0.1)
"""Smallest and largest tolerance that a choice is made for."""
NEGLIGIBLE: Final = 1e-3
"""Of the tolerance: what is worth less is left out unchecked."""
HOPELESS: Final = 100.0
"""Times the tolerance: a rung that leaves out a single thing worth more is not tried."""
MARGIN: Final = 1.001
"""A rung within this factor of the tolerance is kept at the check: its reference is known no better, and the
next one may cost many times as much."""


@dataclass(frozen=True, kw_only=True)
class Choice:
    """The rung chosen for one quantity at one tolerance, and how."""

    quantity: str
    tolerance: float
    first: Rung
    """Chosen by the estimates alone."""
    rung: Rung
    """Kept after the check."""
    reference: Rung | None
    """The rung it was checked against; None where nothing left out is worth a check."""
    measured: float | None
    """Largest relative difference from the reference at the check points."""
    cost: float
    """Of the rung over all points, s of the cost model's machine."""
    checking_cost: float
    """Of all that the check ran."""
    reasons: tuple[str, ...]
    """For people: what is in, what is left out and why, what the check said."""

    @property
    def climbed(self) -> bool:
        """Whether the check sent the choice up."""
        return self.rung.name != self.first.name and len(self.rung.leaves_out - self.first.leaves_out) == 0


class Values:
    """Values of a ladder's rungs at its points, each computed once."""

    def __init__(self, ladder: Ladder) -> None:
        """Start with nothing computed.

        Args:
            ladder: the ladder.
        """
        self.ladder = ladder
        self._found: dict[tuple[str, int], FloatArray] = {}

    def at(self, rung: Rung, points: tuple[int, ...]) -> FloatArray:
        """Values of a rung at points.

        Args:
            rung: of the ladder.
            points: their numbers.

        Returns:
            Shape (points, m).
        """
        for point in points:
            if (rung.name, point) not in self._found:
                self._found[rung.name, point] = rung.solve(point)
        return np.array([self._found[rung.name, point] for point in points])

    def error(self, rung: Rung, reference: Rung, points: tuple[int, ...]) -> float:
        """Largest relative error of a rung against another at points.

        Args:
            rung: of the ladder.
            reference: of the ladder.
            points: their numbers.

        Returns:
            Relative error.
        """
        return relative_error(
            found=self.at(rung, points),
            reference=self.at(reference, points),
            relative_to=self.ladder.relative_to,
        )


def checked_tolerance(tolerance: float) -> float:
    """Check a tolerance.

    Args:
        tolerance: relative.

    Returns:
        The tolerance.

    Raises:
        ValueError: outside 1e-6 to 10 %, or no number.
    """
    low, high = TOLERANCES
    if not (low * (1 - 1e-12) <= tolerance <= high * (1 + 1e-12)):
        raise ValueError(
            f"a tolerance must lie within {low:g} and {high:g} (10 %), not {tolerance:g}: models "
            "are chosen for that range alone"
        )
    return tolerance


def predicted_error(rung: Rung, ladder: Ladder) -> float:
    """Sum of what a rung leaves out and the highest one holds, by the estimates; infinite without a basis.

    Args:
        rung: the rung.
        ladder: the ladder it stands on.

    Returns:
        Relative error.

    Source: errors of one sign at worst.
    """
    left = sorted(rung.leaves_out - ladder.top.leaves_out)
    values = [ladder.contributions[term].value for term in left]
    return float("inf") if any(v is None for v in values) else float(sum(v for v in values if v is not None))


def choose(
    ladder: Ladder,
    tolerance: float,
    *,
    check: bool = True,
    costs: CostModel | None = None,
    values: Values | None = None,
) -> Choice:
    """Choose the cheapest rung of a ladder for a tolerance, and check it.

    Args:
        ladder: the ladder; it must have points.
        tolerance: relative, from 1e-6 to 0.1.
        check: whether the next rung up is run; without it the estimates alone decide.
        costs: default the committed ones.
        values: of the ladder's rungs, to compute none twice.

    Returns:
        Choice.

    Raises:
        ValueError: a tolerance out of range, or a ladder without points.

    Source: the rule stands in this module's first lines.
    """
    checked_tolerance(tolerance)
    if not ladder.points:
        raise ValueError(f"{ladder.quantity}: {ladder.status.text}")
    model = costs or committed_costs()
    ranked = ranked_rungs(ladder, model)
    first = next((rung for rung in ranked if predicted_error(rung, ladder) <= tolerance), ladder.top)
    held = values or Values(ladder)
    reference = _next_up(ladder, first, tolerance, ranked) if check else None
    if reference is None:
        return _record(ladder, tolerance, model, first, first, None, None, 0.0)
    kept, tried = first, [reference]
    for rung in ranked:
        if rung.name == reference.name:
            kept = reference
            break
        if _hopeless(ladder, rung, tolerance):
            continue
        tried.append(rung)
        if held.error(rung, reference, ladder.check) <= MARGIN * tolerance:
            kept = rung
            break
    measured = held.error(kept, reference, ladder.check)
    spent = sum(model.of_rung(rung, points=len(ladder.check)) for rung in tried)
    return _record(ladder, tolerance, model, first, kept, reference, measured, spent)


def ranked_rungs(ladder: Ladder, costs: CostModel) -> list[Rung]:
    """Rungs of a ladder by their cost over all its points; equal ones as they stand.

    Args:
        ladder: the ladder.
        costs: the cost model.

    Returns:
        The rungs, cheapest first.
    """
    return sorted(ladder.rungs, key=lambda rung: costs.of_rung(rung, points=len(ladder.points)))


def _doubtful(ladder: Ladder, rung: Rung, tolerance: float) -> frozenset[str]:
    """What a rung leaves out and a thousandth of the tolerance does not cover."""

    def matters(term: str) -> bool:
        value = ladder.contributions[term].value
        return value is None or value >= NEGLIGIBLE * tolerance

    return frozenset(term for term in rung.leaves_out - ladder.top.leaves_out if matters(term))


def _hopeless(ladder: Ladder, rung: Rung, tolerance: float) -> bool:
    left = [ladder.contributions[term] for term in rung.leaves_out - ladder.top.leaves_out]
    worth = [0.0 if c.rough else c.value or 0.0 for c in left]
    return max(worth, default=0.0) > HOPELESS * tolerance


def _next_up(ladder: Ladder, rung: Rung, tolerance: float, ranked: list[Rung]) -> Rung | None:
    """The cheapest rung that holds all of that, and leaves out nothing that the first one holds."""
    doubtful = _doubtful(ladder, rung, tolerance)
    if not doubtful:
        # Estimates that are far too large would not be noticed without a look at what lies below.
        return rung if ranked[0].name != rung.name else None
    for other in ranked:
        # What is negligible may be missing from both: a dearer solution without it tells the same.
        new = _doubtful(ladder, other, tolerance)
        if not new:
            return other
    return ladder.top


def _record(
    ladder: Ladder,
    tolerance: float,
    model: CostModel,
    first: Rung,
    kept: Rung,
    reference: Rung | None,
    measured: float | None,
    spent: float,
) -> Choice:
    points = len(ladder.points)
    return Choice(
        quantity=ladder.quantity,
        tolerance=tolerance,
        first=first,
        rung=kept,
        reference=reference,
        measured=measured,
        cost=model.of_rung(kept, points=points),
        checking_cost=spent,
        reasons=_reasons(ladder, tolerance, first, kept, reference, measured),
    )


def _reasons(
    ladder: Ladder,
    tolerance: float,
    first: Rung,
    kept: Rung,
    reference: Rung | None,
    measured: float | None,
) -> tuple[str, ...]:
    told = [_worth(ladder.contributions[term], term in kept.leaves_out) for term in _terms(ladder)]
    if reference is None:
        told.append("nothing that is left out is worth a check")
    elif kept.name == first.name:
        told.append(f"checked: {_measured(measured)} from “{reference.name}” at {len(ladder.check)} points")
    elif kept.leaves_out < first.leaves_out or kept.name == reference.name:
        told.append(
            f"climbed: the estimates allowed “{first.name}”, the check against “{reference.name}” did not; "
            f"“{kept.name}” is {_measured(measured)} from it"
        )
    else:
        told.append(
            f"the estimates asked for “{first.name}”; checked against “{reference.name}”, “{kept.name}” "
            f"does as well: {_measured(measured)}"
        )
    if tolerance < ladder.top_uncertainty:
        told.append(below_uncertainty(ladder, tolerance))
    return tuple(told)


def _terms(ladder: Ladder) -> list[str]:
    """What the rungs differ in by more than their meshes."""
    return [term for term in ladder.contributions if any(term in rung.leaves_out for rung in ladder.rungs)]


def _worth(contribution: Contribution, left_out: bool) -> str:
    value = "unknown" if contribution.value is None else f"{contribution.value:.1e}"
    return (
        f"{contribution.term}: {'left out' if left_out else 'in'}; worth {value} by {contribution.formula} "
        f"({contribution.source})"
    )


def _measured(measured: float | None) -> str:
    return "0" if measured is None else f"{measured:.1e}"


def below_uncertainty(ladder: Ladder, tolerance: float) -> str:
    """The sentence for a tolerance that the highest rung itself cannot keep.

    Args:
        ladder: the ladder.
        tolerance: relative.

    Returns:
        The sentence.
    """
    return (
        f"a tolerance of {tolerance:.0e} is below what “{ladder.top.name}”, the highest rung, is known to "
        f"({ladder.top_uncertainty:.1e}: {ladder.top_uncertainty_from}): the choice keeps to that rung "
        "within the tolerance, not to nature"
    )
