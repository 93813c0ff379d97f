"""Compare every traced number of a report with its evidence: python tools/check_traces.py OUT."""

from __future__ import annotations

import json
import re
import sys
from collections.abc import Iterable
from html import unescape
from pathlib import Path
from typing import Any, Final

from ringbalance.reports.traced import evidence_at
from ringbalance.results.numbers import MINUS, SCALES

_TRACED: Final = re.compile(r'<span data-from="([^"]+)">(.*?)</span>')
_NUMBER: Final = re.compile(
    rf"\(?\+?({MINUS}?\d+(?:\u202f\d{{3}})*(?:\.\d+)?)(?:\u202f×\u202f10([⁻⁰¹²³⁴⁵⁶⁷⁸⁹]+))?"
)
_OUTER: Final = re.compile("\\)\u202f×\u202f10([⁻⁰¹²³⁴⁵⁶⁷⁸⁹]+)")
_RAISED: Final = str.maketrans("⁻⁰¹²³⁴⁵⁶⁷⁸⁹", "-0123456789")
_FACTORS: Final = frozenset({1.0, 100.0, 1e3, *(scale[1] for scales in SCALES.values() for scale in scales)})
SAME: Final = (
    ("calibration.quantities.velocity.value", "consequences.gain.-1.velocity_m_s"),
    ("calibration.quantities.lambda.value", "consequences.gain.-1.moment_per_transferred_mass_m"),
    ("calibration.quantities.wall_pressure.value", "calibration.chamber.wall_pressure_Pa.-1"),
    ("calibration.quantities.moment.value", "calibration.chamber.moment_kg_m.-1"),
)
"""Groups of paths in the evidence with the same quantity; liquids under `fifty` are for a primed tube."""
_APART: Final = 5e-3
"""Largest relative difference of two values of one quantity, which is printed to three digits."""


def traces(pages: Iterable[str]) -> list[tuple[str, str]]:
    """Path in the evidence and printed text of each traced number on some pages."""
    return [(path, unescape(text)) for page in pages for path, text in _TRACED.findall(page)]


def printed(text: str) -> tuple[float, float] | None:
    """A printed number and half of its last digit, both in the printed unit; None for a text without one."""
    match = _NUMBER.match(text)
    if match is None:
        return None
    outer = _OUTER.search(text) if text.startswith("(") else None
    digits = match[1].replace("\u202f", "").replace(MINUS, "-")
    power = 10.0 ** int((outer[1] if outer else match[2] or "0").translate(_RAISED))
    return float(digits) * power, 0.5 * 10.0 ** (_idle_zeros(text) - len(digits.partition(".")[2])) * power


def _idle_zeros(text: str) -> int:
    """Number of insignificant final zeros of an integer, by its uncertainty: 1 in 920 ± 100."""
    parts = [part.split("\u202f×")[0] for part in text.split("±")]
    numbers = [match[0] for part in parts if (match := re.search(r"\d+(?:\u202f\d{3})*(?:\.\d+)?", part))]
    if any("." in part for part in numbers):
        return 0
    bare = [part.replace("\u202f", "") for part in numbers]
    return min(len(part) - len(part.rstrip("0")) for part in bare)


def agrees(text: str, value: float | str) -> bool:
    """True if a printed text agrees with a value in one of the units used for printing."""
    number = printed(text)
    if number is None or isinstance(value, str):
        return text == value
    return any(abs(number[0] - value * factor) <= 1.001 * number[1] for factor in _FACTORS)


def untrue(pages: Iterable[str], evidence: Any) -> list[tuple[str, str]]:
    """Traced numbers that disagree with the evidence."""
    return [(path, text) for path, text in traces(pages) if not agrees(text, evidence_at(evidence, path))]


def apart(evidence: Any) -> list[dict[str, float]]:
    """Quantities for which the evidence has two values, each with its paths."""
    groups = [{path: value for path in group if (value := _held(evidence, path))} for group in SAME]
    return [held for held in groups if held and max(held.values()) > (1 + _APART) * min(held.values())]


def _held(evidence: Any, path: str) -> float | None:
    try:
        numbers: float | None = evidence_at(evidence, path)
    except (KeyError, IndexError):
        return None
    return numbers


def main(folder: Path) -> int:
    """Check a report's folder; exit code 1 when numbers disagree with the evidence or with each other."""
    pages = [(folder / name).read_text(encoding="utf-8") for name in ("report.html", "annex.html")]
    evidence = json.loads((folder / "evidence.json").read_bytes())
    wrong = untrue(pages, evidence)
    print(f"{len(traces(pages))} traced numbers, {len(wrong)} wrong")
    for path, text in wrong:
        print(f"{path}: printed {text}, evidence {evidence_at(evidence, path)}")
    twice = apart(evidence)
    for held in twice:
        print(f"one quantity, several values: {held}")
    return bool(wrong or twice)


if __name__ == "__main__":
    sys.exit(main(Path(sys.argv[1])))
