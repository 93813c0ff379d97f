"""What a busy engineer reads first: verdict counts, calibrated numbers, what changes in the closed loop."""

from __future__ import annotations

import math
from collections import Counter
from typing import Final

from ringbalance.reports.numbers import (
    PLUS_MINUS,
    THIN_SPACE,
    given,
    number,
    percent,
    short,
    shown,
    shown_apart,
)
from ringbalance.reports.section import Record

CLAIM_VERDICTS: Final = ("confirmed", "confirmed with correction", "refuted", "inconclusive", "not run")
CHECK_VERDICTS: Final = ("passed", "failed", "inconclusive", "not run")
_TONES: Final = {
    "confirmed": "good",
    "passed": "good",
    "confirmed with correction": "fair",
    "refuted": "bad",
    "failed": "bad",
    "inconclusive": "open",
    "not run": "idle",
}
_RUNS: Final = {
    "blocked": "is blocked",
    "siphon": "runs as a full siphon",
    "separated": "runs separated",
    "reverse": "runs in reverse",
    "cannot be told": "runs full or separated, which cannot be told",
}


def tone(verdict: str) -> str:
    """Colour group of a verdict."""
    return _TONES.get(verdict, "open")


def claims(evidence: Record, *, paper: str = "liquid_ring") -> list[Record]:
    """Cases that judge one paper, in its order."""
    found = [
        case
        for case in evidence["verification"]
        if case["kind"] == "claim" and case.get("paper", "liquid_ring") == paper
    ]
    return sorted(found, key=lambda case: (case.get("number") or math.inf, case["id"]))


def checks(evidence: Record) -> list[Record]:
    """Cases that judge this program's own solvers."""
    return [case for case in evidence["verification"] if case["kind"] != "claim"]


def verdict_counts(cases: list[Record], verdicts: tuple[str, ...]) -> list[Record]:
    """Number of cases under each verdict, in a fixed order, without the empty ones."""
    tally = Counter(case["verdict"] for case in cases)
    return [{"verdict": v, "tone": tone(v), "count": tally[v]} for v in verdicts if tally[v]]


def counted(cases: list[Record]) -> list[str]:
    """How many claims have each verdict, as words."""
    counts = verdict_counts(cases, CLAIM_VERDICTS)
    return [f"{c['count']} {'is' if c['count'] == 1 else 'are'} {c['verdict']}" for c in counts]


def lead_sentence(evidence: Record) -> str:
    """The whole result in two sentences, counted from the verdicts."""
    parts = counted(claims(evidence))
    own = checks(evidence)
    run = [case for case in own if case["verdict"] != "not run"]
    passed = sum(case["verdict"] == "passed" for case in run)
    told = f"Of {len(claims(evidence))} claims of the liquid-ring paper {_series(parts)}. "
    foreign = sum(elsewhere(case, evidence) for case in claims(evidence))
    if foreign:
        told += (
            f"{foreign} of them hold for the paper’s own disc alone and were judged on it, not on this one. "
        )
    return told + f"Of {len(run)} checks of this program itself that were run, {passed} passed."


def _series(parts: list[str]) -> str:
    if len(parts) < 2:
        return parts[0] if parts else "none was judged"
    return f"{', '.join(parts[:-1])} and {parts[-1]}"


def elsewhere(case: Record, evidence: Record) -> bool:
    """Whether a case was judged on another disc than the report's, such as the paper's own.

    Returns: True when its numbers are not those of the report's scene.
    """
    judged = case.get("scene_sha256")
    return bool(judged) and judged != evidence["scene"]["values_sha256"]


def headlines(evidence: Record) -> list[Record]:
    """Claims worth a line in the summary: judged on this disc and so marked, else those that did not hold."""
    every = [case for case in claims(evidence) if not elsewhere(case, evidence)]
    marked = [case for case in every if case.get("headline")]
    return marked or [case for case in every if tone(case["verdict"]) in {"bad", "fair"}]


def key_numbers(evidence: Record) -> list[Record]:
    """The calibrated numbers with their expanded uncertainties (95 %)."""
    point, paper, calibration = evidence["operating_point"], evidence["paper"], evidence["calibration"]
    return [
        _lambda_number(calibration["lambda"], paper),
        _drag_number(point, paper),
        _pressure_number(calibration["chamber"]),
        _velocity_number(point),
        *_priming_number(point, paper),
        _stall_number(point),
    ]


def _key(label: str, parts: tuple[str, str], paper: str, note: str) -> Record:
    value, sign, half_width = parts[0].partition(PLUS_MINUS)
    # A power of ten stands behind both numbers, so such a text is left in one piece.
    whole = value.startswith("(")
    return {
        "label": label,
        "value": parts[0] if whole else value,
        "half_width": f"±{THIN_SPACE}{half_width}" if sign and not whole else "",
        "unit": parts[1],
        "paper": paper,
        "note": note,
    }


def _lambda_number(record: Record, paper: Record) -> Record:
    half_width = math.hypot(record["uncertainty_m"], record["input_uncertainty_m"])
    parts = shown_apart(record["per_transferred_mass_m"], "m", half_width)
    varies = percent(record["variation_over_range"])
    note = f"Moment per transferred mass; varies by {varies} over the fill range."
    said = f"{given(paper['lambda_m'], 'm')} within {short(100 * paper['lambda_spread'])} %"
    return _key("Lever arm λ", parts, said, note)


def _drag_number(point: Record, paper: Record) -> Record:
    parts = shown_apart(point["k"], "1", point["k_uncertainty"])
    said = f"about {short(paper['drag_coefficient'])}"
    if point["k"] is None:
        return _key("Drag coefficient k", parts, said, "Nothing flows at the scene’s gas pressure.")
    note = (
        f"At {shown(point['k_at_velocity_m_s'], 'm/s', digits=3)}, Re {number(point['reynolds'], digits=2)}, "
    )
    return _key("Drag coefficient k", parts, said, note + f"{point['flow_state']}.")


def _pressure_number(chamber: Record) -> Record:
    half_width = math.hypot(
        chamber["wall_pressure_uncertainty"][-1], chamber["wall_pressure_input_uncertainty"][-1]
    )
    parts = shown_apart(chamber["wall_pressure_Pa"][-1], "Pa", half_width)
    said = f"{shown(chamber['wall_pressure_paper_Pa'][-1], 'Pa')} by Eq. 12"
    note = f"Of the liquid, at the largest fill ratio of {short(chamber['fill_ratio'][-1])}."
    return _key("Wall pressure", parts, said, note)


def _velocity_number(point: Record) -> Record:
    parts = shown_apart(point["velocity_m_s"], "m/s", point["velocity_uncertainty"], digits=3)
    said = f"{shown(point['velocity_paper_m_s'], 'm/s', digits=3)} by Eq. 19"
    note = f"At {given(point['gas_pressure_Pa'], 'Pa')} and equal fills; the tube {_RUNS[point['regime']]}."
    return _key("Velocity in the tube", parts, said, note)


def _priming_number(point: Record, paper: Record) -> list[Record]:
    if point["priming_pressure_vented_Pa"] is None:
        return []
    parts = shown_apart(point["priming_pressure_vented_Pa"], "Pa", point["priming_uncertainty"])
    low = given(paper["working_range_Pa"][0], "Pa")
    trapped = shown(point["priming_pressure_trapped_Pa"], "Pa")
    note = f"Over the siphon crest, gas vented, driven chamber empty. Gas trapped, equal fills: {trapped}."
    return [_key("Priming pressure", parts, f"works from {low}", note)]


def _stall_number(point: Record) -> Record:
    parts = shown_apart(point["stall_pressure_Pa"], "Pa", point["stall_uncertainty"])
    said = f"{shown(point['stall_pressure_paper_Pa'], 'Pa')} by Eq. 19"
    return _key("Stall pressure", parts, said, "Below it a full siphon stops before the chamber is empty.")
