"""What running a case gives: each quantity judged, the case's verdict, the evidence, and its mutations."""

from __future__ import annotations

import dataclasses
import itertools
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from ringbalance.verification.assumptions import Assumption, overridden
from ringbalance.verification.case import NEEDS_REFERENCE, CaseDefinition, Quantity, fill
from ringbalance.verification.evidence import COVERAGE_FACTOR, Evidence, Found, Level, Reference
from ringbalance.verification.verdicts import Comparison, Verdict, judge_quantity


@dataclass(frozen=True, kw_only=True)
class QuantityResult:
    """One judged quantity; its numbers are None when the case was not run."""

    quantity: Quantity
    verdict: Verdict
    found: Found | None = None
    reference: Reference | None = None
    comparison: Comparison | None = None

    @property
    def half_width(self) -> float | None:
        """Of the comparison that decided the quantity: 2 u_val, and as far as assumed inputs move it.

        Zero where nothing uncertain entered; None where the case was not run.
        """
        found, comparison = self.found, self.comparison
        if found is None or comparison is None:
            return None
        reach = max(map(abs, found.reach))
        certain = found.numerical == 0 and found.input == 0
        judged_alone = self.quantity.metric not in NEEDS_REFERENCE
        return reach if certain and judged_alone else comparison.half_width + reach


@dataclass(frozen=True, kw_only=True)
class MutationResult:
    """What became of a case with a defect built in on purpose."""

    id: str
    what: str
    expect: Verdict
    verdict: Verdict
    status: str
    judged: bool
    """False when the run broke down before anything was judged."""

    @property
    def caught(self) -> bool:
        """Whether the case was judged with this defect, and came out as it must."""
        return self.judged and self.verdict is self.expect


@dataclass(frozen=True, kw_only=True)
class CaseResult:
    """One case, run or not."""

    definition: CaseDefinition
    verdict: Verdict
    quantities: tuple[QuantityResult, ...]
    evidence: Evidence | None
    status: str
    """How the run ended; why it did not take place."""
    level: Level
    scene_name: str
    scene_sha256: str
    time_s: float = 0.0
    assumptions: tuple[Assumption, ...] = ()
    """Inputs that nobody gave and that the verdict rests on."""
    mutations: tuple[MutationResult, ...] = ()

    @property
    def broken(self) -> bool:
        """True when a mutation was run and not caught: the case proves nothing."""
        return any(not mutation.caught for mutation in self.mutations)

    @property
    def numbers(self) -> Mapping[str, float]:
        """All numbers that the case's text may ask for.

        For each quantity q: q, q_low and q_high (as far as assumed inputs move it), q_reference, q_error,
        q_relative (error over reference), q_uncertainty (95 % half-width of the comparison), q_limit; and
        the evidence's own.
        """
        named: dict[str, float] = {}
        for result in self.quantities:
            named |= _named_numbers(result)
        return named | dict(self.evidence.numbers if self.evidence else {})

    def filled(self, text: str) -> str:
        """A text of the case with its numbers put in; empty when it needs numbers and the case was not run.

        Raises: ValueError: the text asks for a number that the evidence does not hold.
        """
        if self.evidence is None and "{" in text:
            return ""
        return fill(text, self.numbers)


def _named_numbers(result: QuantityResult) -> dict[str, float]:
    name, found, comparison = result.quantity.name, result.found, result.comparison
    if found is None or comparison is None:
        return {}
    low, high = found.reach
    named = {
        name: found.value,
        f"{name}_low": found.value + low,
        f"{name}_high": found.value + high,
        f"{name}_error": comparison.error,
        f"{name}_uncertainty": comparison.half_width,
        f"{name}_limit": result.quantity.limit,
    }
    if found.corrected is not None:
        named[f"{name}_corrected"] = found.corrected
    reference = result.reference
    if reference is not None:
        named[f"{name}_reference"] = reference.value
        named[f"{name}_reference_uncertainty"] = COVERAGE_FACTOR * reference.uncertainty
        if reference.value != 0:
            named[f"{name}_relative"] = comparison.error / reference.value
    return named


def widened(
    evidence: Evidence, scene: Any, assumptions: Sequence[Assumption], *, at: Callable[[Any], Evidence]
) -> Evidence:
    """Evidence with the reach of its assumed inputs: the case computed at all corners of their ranges.

    What moves is the error, so an input that moves number and reference alike counts for nothing.
    Args: `at`: what is judged on another scene, or a part of it.
    """
    if not assumptions:
        return evidence

    def errors(of: Any) -> Mapping[str, float]:
        there = at(of)
        exact = {name: reference.value for name, reference in there.reference.items()}
        return {name: found.value - exact.get(name, 0.0) for name, found in there.found.items()}

    here = errors(scene)
    paths = [one.path for one in assumptions]
    corners = itertools.product(*((one.low, one.high) for one in assumptions))
    moved = [errors(overridden(scene, dict(zip(paths, corner, strict=True)))) for corner in corners]
    found = dict(evidence.found)
    for name, error in here.items():
        changes = [one[name] - error for one in moved]
        found[name] = found[name].moved(min(changes), max(changes))
    return dataclasses.replace(evidence, found=found)


def judge(definition: CaseDefinition, evidence: Evidence) -> tuple[QuantityResult, ...]:
    """Every quantity of a case. Raises: ValueError: what was found is not what the case judges."""
    against = evidence.reference
    names = {quantity.name for quantity in definition.quantity}
    if set(evidence.found) != names or not set(against) <= names:
        raise ValueError(
            f"{definition.id}: judged are {sorted(names)}, found {sorted(evidence.found)}, "
            f"referenced {sorted(against)}"
        )
    return tuple(
        _judge_one(definition, quantity, evidence.found[quantity.name], against.get(quantity.name))
        for quantity in definition.quantity
    )


def _judge_one(
    definition: CaseDefinition, quantity: Quantity, found: Found, reference: Reference | None
) -> QuantityResult:
    judgement = judge_quantity(
        kind=definition.kind,
        metric=quantity.metric,
        limit=quantity.limit,
        found=found,
        reference=reference if quantity.metric in NEEDS_REFERENCE else None,
    )
    return QuantityResult(
        quantity=quantity,
        verdict=judgement.verdict,
        found=found,
        reference=reference,
        comparison=judgement.comparison,
    )
