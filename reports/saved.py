"""Results of heavy cases kept from earlier runs: those of an output folder, and those packaged."""

from __future__ import annotations

import json
from collections.abc import Mapping
from importlib.resources import files
from pathlib import Path
from typing import Any, Final

Record = dict[str, Any]

PACKAGED: Final = "heavy_evidence.json"
NOT_RUN: Final = "not run"


def heavy_cases(document: Mapping[str, Any]) -> list[Record]:
    """The heavy cases that an evidence document holds, each stamped with the date on which it was run.

    Args:
        document: of `collect_evidence`, or what `kept_document` made of it.

    Returns:
        Case records.
    """
    date = document.get("times", {}).get("date", "")
    return [
        {**case, "date": case.get("date") or date}
        for case in document.get("verification", [])
        if case.get("cost") == "heavy" and case.get("verdict", NOT_RUN) != NOT_RUN
    ]


def kept_document(document: Mapping[str, Any]) -> Record:
    """What is worth keeping of an evidence document for later reports.

    Args:
        document: of `collect_evidence` at the heavy level.

    Returns:
        Format, versions and the heavy cases with their dates.
    """
    return {
        "format": document["format"],
        "versions": document["versions"],
        "verification": heavy_cases(document),
    }


def saved_cases(folder: Path | None = None) -> list[Record]:
    """All heavy results at hand, the oldest first: those of the program, and those of a report's folder.

    Args:
        folder: of an earlier report; None for none.

    Returns:
        Case records, each with its date and the hash of its scene.

    Raises:
        OSError: an evidence file that cannot be read, or is none.
    """
    found = _packaged()
    if folder is not None and (folder / "evidence.json").is_file():
        found += heavy_cases(_read(folder / "evidence.json"))
    return sorted(found, key=lambda case: str(case["date"]))


def _packaged() -> list[Record]:
    source = files("ringbalance.reports").joinpath("data", PACKAGED)
    return heavy_cases(json.loads(source.read_text(encoding="utf-8"))) if source.is_file() else []


def _read(path: Path) -> Mapping[str, Any]:
    try:
        document = json.loads(path.read_text(encoding="utf-8"))
    except ValueError as error:
        raise OSError(f"{path} is not an evidence file; move it away: {error}") from error
    return document if isinstance(document, dict) else {}
