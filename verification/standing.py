"""Basis of each predicted quantity: measurements, verification, calibration, or assumption.

A case names in `about` the subjects of `standing.toml` that its result is evidence for; the rest of the table
follows from the cases.
"""

from __future__ import annotations

import tomllib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from importlib.resources import files
from types import MappingProxyType
from typing import Any, Final, Literal

from ringbalance.scene.typed_record import record_from

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
    """A quantity or a part of the model, with its assumptions and calibration, which no case gives."""

    title: str
    assumed: str
    calibrated: str = "nothing"
    """Parameters fitted to measurements, with these measurements, which are not judged."""
    budgets: tuple[str, ...] = ()
    """Quantities whose uncertainty budget rests on it."""
    balancer: Literal["liquid_ring", "eccentric_mass"] = "liquid_ring"


SUBJECTS: Final[Mapping[str, _Subject]] = MappingProxyType(
    {
        name: record_from(_Subject, table, file="standing.toml")
        for name, table in tomllib.loads(
            (files("ringbalance.verification") / "standing.toml").read_text(encoding="utf-8")
        ).items()
    }
)
"""Subjects by the names that cases give in `about`."""


def standing_rows(
    cases: Sequence[Mapping[str, Any]], *, balancer: str | None = None
) -> list[tuple[str, ...]]:
    """Rows under `HEADS`.

    Args: `cases`: documents of cases, those of measurements with their results. `balancer`: whose subjects;
        default all.
    """
    rows: list[tuple[str, ...]] = []
    for name, subject in SUBJECTS.items():
        if balancer not in (None, subject.balancer):
            continue
        about = [case for case in cases if name in case.get("about", ())]
        validations = [case for case in about if case["kind"] == "validation"]
        measured = [_measured(case) for case in validations]
        left_out = [text for case in validations if (text := _left_out(case))]
        verified = [case["id"].replace("_", " ") for case in about if case["kind"].endswith("verification")]
        rows.append(
            (
                subject.title,
                "; ".join(measured) or NO_DATA,
                "; ".join(left_out) or ("nothing" if measured else ""),
                ", ".join(verified) or "by tests alone",
                subject.calibrated,
                subject.assumed,
            )
        )
    return rows


def budget_standing(cases: Sequence[Mapping[str, Any]], quantity: str) -> str:
    """Standing of a quantity's uncertainty budget: the parts that were compared with measurements or not.

    For example "friction: 1,005 points; rotation, fittings, crest: no data".
    """

    def points(name: str, key: str) -> float:
        """Measured points about a subject, all of them or those of a kind."""
        about = (case for case in cases if name in case.get("about", ()) and case["kind"] == "validation")
        return sum(float(case["numbers"].get(key, 0.0)) for case in about)

    parts, without = [], []
    for name in (name for name, subject in SUBJECTS.items() if quantity in subject.budgets):
        if count := points(name, "points"):
            laminar = ", all laminar" if points(name, "laminar_points") == count else ""
            parts.append(f"{name}: {count:,.0f} points{laminar}")
        else:
            without.append(name)
    return "; ".join([*parts, f"{', '.join(without)}: {NO_DATA}"] if without else parts)


def _name(case: Mapping[str, Any]) -> str:
    return str(case["id"]).removeprefix("measured_").replace("_", " ")


def _measured(case: Mapping[str, Any]) -> str:
    """Statistics of a validation: "ducts: 107 of 125 points, 97.2 % within, bias +1.1 %, ...".

    Points to which a coefficient was fitted are no predictions and are not counted.
    """
    if case["verdict"] == "not run":
        return f"{_name(case)}: not run" + (" (a heavy case)" if case["cost"] == "heavy" else "")
    numbers = case["numbers"]
    points, all_points = numbers.get("points"), numbers.get("all_points", 0)
    if points is None:
        parts = ["a correlation of measurements"]
    else:
        parts = [
            f"{points:.0f} of {all_points:.0f} points" if all_points > points else f"{points:.0f} points"
        ]
    if "share_within" in numbers:
        too_wide = numbers["share_within"] > _NEARLY_ALL
        needed = f" ({100 * numbers['width_needed']:.0f} % of its width would hold 95 %)" if too_wide else ""
        parts += [
            f"{_percent(numbers['share_within'])} within" + needed,
            f"bias {100 * numbers['bias']:+.1f} %",
            f"scatter {100 * numbers['standard_deviation']:.1f} %",
        ]
    if "worst_mean" in numbers:
        parts.append(f"means off by up to {100 * numbers['worst_mean']:+.1f} %")
    if all_points > (points or 0):
        parts.append(f"of all {all_points:.0f}: {_percent(numbers['all_within'])} within")
    verdict = "" if case["verdict"] == "confirmed" else f" ({case['verdict']})"
    return f"{_name(case)}: {', '.join(parts)}{verdict}"


def _left_out(case: Mapping[str, Any]) -> str:
    """Readings that a validation leaves out: "ducts: 18 points of a flat duct ... (44.4 % within, ...)"."""
    numbers, texts = case.get("numbers", {}), []
    for readings in case.get("left_out", ()):
        name = readings["name"]
        if f"{name}_points" not in numbers:
            continue
        statistics = ""
        if not readings["taught"]:
            bias = f"bias {100 * numbers[f'{name}_bias']:+.1f} %"
            statistics = f" ({_percent(numbers[f'{name}_within'])} within, {bias})"
        texts.append(f"{numbers[f'{name}_points']:.0f} points {readings['why']}{statistics}")
    return f"{_name(case)}: {', '.join(texts)}" if texts else ""


def _percent(fraction: float) -> str:
    return f"{100 * fraction:.1f} %"
