"""Store the heavy results of a report in the package, so that later light reports can show them.

    python tools/keep_evidence.py out/evidence.json [heavy.json ...]

Input: evidence of heavy reports, and output of `ringbalance verify CASE --level heavy --json`.  Only
heavy cases are stored, each with its date and the hash of its scene, and replace earlier results; a light
report takes those with its own scene.
"""

from __future__ import annotations

import json
import sys
from collections.abc import Mapping
from datetime import date
from pathlib import Path
from typing import Any

from ringbalance.reports.evidence import FORMAT
from ringbalance.reports.saved import PACKAGED, heavy_cases, versions
from ringbalance.reports.section import Record
from ringbalance.scene import write_whole

TARGET = Path(__file__).resolve().parents[1] / "reports" / "data" / PACKAGED


def kept_document(document: Mapping[str, Any]) -> Record:
    """Parts of an evidence document that later reports use."""
    return {
        "format": document["format"],
        "versions": document["versions"],
        "verification": heavy_cases(document),
    }


def document_of(path: Path) -> dict[str, Any]:
    """The evidence in a file; cases alone get the date of their file and the present versions."""
    document = json.loads(path.read_text(encoding="utf-8"))
    if isinstance(document, dict):
        return document
    day = date.fromtimestamp(path.stat().st_mtime).isoformat()
    return {"format": FORMAT, "versions": versions(), "verification": document, "times": {"date": day}}


def main(arguments: list[str]) -> int:
    """Write the packaged evidence from files of heavy results."""
    stored = document_of(TARGET)
    cases = {case["id"]: case for case in heavy_cases(stored)}
    for path in map(Path, arguments):
        document = document_of(path)
        cases |= {case["id"]: case for case in heavy_cases(document)}
        stored = kept_document(document)
    stored["verification"] = list(cases.values())
    write_whole(TARGET, json.dumps(stored, allow_nan=False, indent=1, ensure_ascii=False) + "\n")
    print(f"{len(cases)} heavy cases kept in {TARGET}: {', '.join(cases)}")
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
