"""What stands behind each predicted quantity: measurements, verification, calibration, or assumption.

A case says in `about` which subjects of `standing.toml` its result is evidence for; everything else of the
table follows.
"""

from __future__ import annotations

import tomllib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from importlib.resources import files
from types import MappingProxyType
from typing import Any, Final, Literal

from ringbalance.verification.typed_record import record_from

HEADS: Final = (
    "Quantity",
    "Validated by measurements",
    "Left out of that, and why",
    "Verified by cases",
    "Calibrated",
    "Assumed",
)
NO_DATA: Final = "no data"
_NEARLY_ALL: Final = 0.99


@dataclass(frozen=True, kw_only=True)
class _Subject:
    """A quantity or a part of the model, and what no case can say of it."""

    title: str
    assumed: str
    calibrated: str = "nothing"
    """What was fitted to measurements, and to which; they are not judged."""
    budgets: tuple[str, ...] = ()
    """Quantities whose uncertainty budget rests on it."""
    balancer: Literal["liquid_ring", "eccentric_mass"] = "liquid_ring"


SUBJECTS: Final[Mapping[str, _Subject]] = MappingProxyType(
    {
        name: record_from(_Subject, table)
        for name, table in tomllib.loads(
            (files("ringbalance.verification") / "standing.toml").read_text(encoding="utf-8")
        ).items()
    }
)
"""By the names that cases give in `about`."""


def standing_rows(
    cases: Sequence[Mapping[str, Any]], *, balancer: str | None = None
) -> list[tuple[str, ...]]:
    """Rows under `HEADS`.

    Args: `cases`: documents of cases, those of measurements with their results. `balancer`: whose subjects;
        default all.
    """
    return [
        _row(subject, [case for case in cases if name in case.get("about", ())])
        for name, subject in SUBJECTS.items()
        if balancer in (None, subject.balancer)
    ]


def budget_standing(cases: Sequence[Mapping[str, Any]], quantity: str) -> str:
    """What of a quantity's uncertainty budget was compared with measurements, and what was not.

    Such as "friction: 1,005 points; rotation, fittings, crest: no data".
    """
    names = [name for name, subject in SUBJECTS.items() if quantity in subject.budgets]
    counts = {
        name: (_points(cases, name, "points"), _points(cases, name, "laminar_points")) for name in names
    }
    parts = [
        f"{name}: {count:,.0f} points{', all laminar' if laminar == count else ''}"
        for name, (count, laminar) in counts.items()
        if count
    ]
    without = [name for name in names if not counts[name][0]]
    return "; ".join([*parts, f"{', '.join(without)}: {NO_DATA}"] if without else parts)


def _points(cases: Sequence[Mapping[str, Any]], name: str, key: str) -> float:
    """Measured points about a subject, all of them or those of a kind."""
    about = (case for case in cases if name in case.get("about", ()) and case["kind"] == "validation")
    return sum(float(case["numbers"].get(key, 0.0)) for case in about)


def _row(subject: _Subject, cases: Sequence[Mapping[str, Any]]) -> tuple[str, ...]:
    validations = [case for case in cases if case["kind"] == "validation"]
    measured = [_measured(case) for case in validations]
    left_out = [text for case in validations if (text := _left_out(case))]
    verified = [case["id"].replace("_", " ") for case in cases if case["kind"].endswith("verification")]
    return (
        subject.title,
        "; ".join(measured) or NO_DATA,
        "; ".join(left_out) or ("nothing" if measured else ""),
        ", ".join(verified) or "by tests alone",
        subject.calibrated,
        subject.assumed,
    )


def _too_wide(numbers: Mapping[str, float]) -> str:
    """What of a band's width would do, where it holds nearly all points."""
    if numbers["share_within"] <= _NEARLY_ALL:
        return ""
    return f" ({100 * numbers['width_needed']:.0f} % of its width would hold 95 %)"


def _name(case: Mapping[str, Any]) -> str:
    return str(case["id"]).removeprefix("measured_").replace("_", " ")


def _measured(case: Mapping[str, Any]) -> str:
    """Such as "ducts: 107 of 125 points, 97.2 % within, bias +1.1 %, ..., of all 125 89.6 % within".

    Points that taught a coefficient are predictions of nothing and not counted.
    """
    if case["verdict"] == "not run":
        return f"{_name(case)}: not run" + (" (a heavy case)" if case["cost"] == "heavy" else "")
    numbers = case["numbers"]
    parts = [_counted(numbers)]
    if "share_within" in numbers:
        parts += [
            f"{_percent(numbers['share_within'])} within" + _too_wide(numbers),
            f"bias {100 * numbers['bias']:+.1f} %",
            f"scatter {100 * numbers['standard_deviation']:.1f} %",
        ]
    if "worst_mean" in numbers:
        parts.append(f"means off by up to {100 * numbers['worst_mean']:+.1f} %")
    if numbers.get("all_points", 0) > numbers.get("points", 0):
        parts.append(f"of all {numbers['all_points']:.0f} {_percent(numbers['all_within'])} within")
    verdict = "" if case["verdict"] == "confirmed" else f" ({case['verdict']})"
    return f"{_name(case)}: {', '.join(parts)}{verdict}"


def _counted(numbers: Mapping[str, float]) -> str:
    if "points" not in numbers:
        return "a correlation of measurements"
    judged, everything = numbers["points"], numbers.get("all_points", 0)
    return f"{judged:.0f} of {everything:.0f} points" if everything > judged else f"{judged:.0f} points"


def _left_out(case: Mapping[str, Any]) -> str:
    """Such as "ducts: 18 points of a flat duct ... (44.4 % within, bias -5.7 %)"."""
    numbers, texts = case.get("numbers", {}), []
    for one in case.get("left_out", ()):
        name = one["name"]
        if f"{name}_points" not in numbers:
            continue
        found = ""
        if not one["taught"]:
            bias = f"bias {100 * numbers[f'{name}_bias']:+.1f} %"
            found = f" ({_percent(numbers[f'{name}_within'])} within, {bias})"
        texts.append(f"{numbers[f'{name}_points']:.0f} points {one['why']}{found}")
    return f"{_name(case)}: {', '.join(texts)}" if texts else ""


def _percent(share: float) -> str:
    return f"{100 * share:.1f} %"
