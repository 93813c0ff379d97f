"""A case's evidence judged: what assumed inputs may move, and each quantity against its limit."""

from __future__ import annotations

import dataclasses
import itertools
from collections.abc import Callable, Mapping, Sequence
from typing import Any

from ringbalance.verification.assumptions import Assumption, overridden
from ringbalance.verification.case import NEEDS_REFERENCE, CaseDefinition, Quantity
from ringbalance.verification.evidence import CaseCode, Evidence, Found, Reference
from ringbalance.verification.result import QuantityResult
from ringbalance.verification.verdicts import judge_quantity


def references(code: CaseCode, scene: Any) -> Mapping[str, Reference]:
    """What the judged quantities are compared with, by name."""
    given = getattr(code, "reference", {})
    found: Mapping[str, Reference] = given(scene) if callable(given) else given
    return found


def widened(
    evidence: Evidence,
    code: CaseCode,
    scene: Any,
    assumptions: Sequence[Assumption],
    *,
    values: Callable[[Any], Mapping[str, float]],
) -> Evidence:
    """Evidence with the reach of its assumed inputs: the case computed at all corners of their ranges.

    What moves is the error, so an input that moves number and reference alike counts for nothing.
    Args: `values`: the judged numbers on a scene.
    """
    if not assumptions:
        return evidence

    def errors(of: Any) -> Mapping[str, float]:
        against = references(code, of)
        return {
            name: value - (against[name].value if name in against else 0.0)
            for name, value in values(of).items()
        }

    here = errors(scene)
    paths = [one.path for one in assumptions]
    corners = itertools.product(*((one.low, one.high) for one in assumptions))
    moved = [errors(overridden(scene, dict(zip(paths, corner, strict=True)))) for corner in corners]
    found = dict(evidence.found)
    for name, error in here.items():
        changes = [one[name] - error for one in moved]
        found[name] = found[name].moved(min(changes), max(changes))
    return dataclasses.replace(evidence, found=found)


def judge(
    definition: CaseDefinition, evidence: Evidence, against: Mapping[str, Reference]
) -> tuple[QuantityResult, ...]:
    """Every quantity of a case. Raises: ValueError: what was found is not what the case judges."""
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
