"""Plain text of the pages of two kept reports, with which tests compare the words of the templates."""

from __future__ import annotations

import json
import lzma
import re
from collections.abc import Iterator, Sequence
from html import unescape
from pathlib import Path
from typing import Any, Final

from ringbalance.reports.page import render

FOLDER: Final = Path(__file__).resolve().parents[1] / "tests" / "reports" / "golden"
NAMES: Final = ("ring", "masses")
CASES: Final = {
    "claim_01_volume",
    "claim_09_drag_coefficient",
    "claim_10_working_pressure",
    "bent_tube_3d",
    "k_by_fluids",
    "extremes",
    "manufactured_2d",
    "measured_smooth_tubes",
    "driven_stability",
    "driven_fig7_positioning",
}
"""Cases in the kept evidence; their words are not part of the templates."""
_DIGITS: Final = 6
_BLOCKS: Final = "p|li|tr|h\\d|figure|table|caption|section|dt|dd|ul|ol|article|details|summary|div"


def kept_evidence(name: str) -> dict[str, Any]:
    """The evidence of a kept report."""
    document: dict[str, Any] = json.loads(lzma.decompress((FOLDER / f"{name}.json.xz").read_bytes()))
    return document


def page_text(page: str) -> str:
    """Text of a page, a line for each block, cells between bars."""
    bare = re.sub(r"(?s)<(svg|style|script|head)\b.*?</\1>", " ", page)
    blocks = re.sub(rf"</?(?:{_BLOCKS})\b[^>]*>", "\n", bare)
    cells = re.sub(r"</?(?:td|th)\b[^>]*>", " | ", blocks)
    plain = unescape(re.sub(r"<[^>]+>", "", cells.replace("<br>", " ")))
    lines = (re.sub(r"\s+", " ", line) for line in plain.split("\n"))
    texts = (re.sub(r"[ |]*\|[ |]*", " | ", line).strip() for line in lines if line.strip(" |"))
    return "\n".join(texts) + "\n"


def report_text(evidence: dict[str, Any]) -> str:
    """Text of report and annex, without the hash of the evidence."""
    text = "\n".join(page_text(page) for page in render(evidence).values())
    return re.sub(r"(?<=evidence\.json\n)SHA-256 \w+", "SHA-256 ...", text)


def _shortened(value: Any) -> Any:
    """Evidence with numbers to six digits and with only the kept cases."""
    if isinstance(value, dict):
        return {key: _shortened(each) for key, each in value.items()}
    if isinstance(value, list):
        return [_shortened(each) for each in value if not _left_out(each)]
    return float(f"{value:.{_DIGITS}g}") if isinstance(value, float) else value


def _left_out(value: Any) -> bool:
    return isinstance(value, dict) and "verdict" in value and "claim" in value and value["id"] not in CASES


def packed(folder: Path) -> bytes:
    """Evidence of a report's folder as it is kept, without three dates and a commit that change daily."""
    document = _shortened(json.loads((folder / "evidence.json").read_bytes()))
    document["times"] |= {"date": "2030-01-02", "kept_cases": {}}
    document["provenance"] |= {"commit": "0123456789abcdef", "dirty": False, "machine": "a machine"}
    document["pictures"] |= {"drawn": False, "files": []}
    return lzma.compress(json.dumps(document).encode(), preset=9)


def files(words: Sequence[str]) -> Iterator[tuple[Path, bytes]]:
    """Texts of both reports; before them the evidence to keep, if folders of new reports are given."""
    for name, folder in zip(NAMES, words, strict=False):
        yield FOLDER / f"{name}.json.xz", packed(Path(folder))
    for name in NAMES:
        yield FOLDER / f"{name}.txt", report_text(kept_evidence(name)).encode()
