"""Results of heavy cases kept from earlier runs: those of an output folder, and those packaged."""

from __future__ import annotations

import json
from collections.abc import Mapping
from importlib.resources import files
from pathlib import Path
from types import MappingProxyType
from typing import Any, Final

from ringbalance.scene.faults import toml_text

Record = dict[str, Any]

PACKAGED: Final = "heavy_evidence.json"
NOT_RUN: Final = "not run"
_TEXTS: Final = (
    "id",
    "kind",
    "verdict",
    "title",
    "claim",
    "explanation",
    "consequence",
    "status",
    "scene_sha256",
)
_LISTS: Final = ("quantities", "series", "convergence", "tables", "mutations", "equations", "doubts")
_KINDS: Final[Mapping[str, type]] = MappingProxyType(
    dict.fromkeys(_TEXTS, str) | dict.fromkeys(_LISTS, list) | {"reference": dict, "numbers": dict}
)
"""Of a heavy case's record, which a report may take over."""
_NAMES: Final[Mapping[type, str]] = MappingProxyType({str: "a text", list: "a list", dict: "an object"})


def heavy_cases(document: Mapping[str, Any]) -> list[Record]:
    """The heavy cases that an evidence document holds, each stamped with the date on which it was run."""
    date = document.get("times", {}).get("date", "")
    return [
        {**case, "date": case.get("date") or date}
        for case in document.get("verification", [])
        if case.get("cost") == "heavy" and case.get("verdict", NOT_RUN) != NOT_RUN
    ]


def saved_cases(folder: Path | None = None) -> list[Record]:
    """All heavy results at hand, the oldest first: those of the program, and those of a report's folder.

    Raises: OSError: an evidence file that cannot be read, or is none.
    """
    found = _packaged()
    if folder is not None and (folder / "evidence.json").is_file():
        found += heavy_cases(_read(folder / "evidence.json"))
    return sorted(found, key=lambda case: str(case["date"]))


def _packaged() -> list[Record]:
    source = files("ringbalance.reports").joinpath("data", PACKAGED)
    return heavy_cases(json.loads(source.read_text(encoding="utf-8"))) if source.is_file() else []


def _read(path: Path) -> Record:
    try:
        document = json.loads(path.read_bytes())
        problem = _problem(document)
    except (ValueError, RecursionError) as error:
        problem = "it is nested too deeply" if isinstance(error, RecursionError) else str(error)
    if problem:
        raise OSError(
            f"{path} is not an evidence file: {problem}; its heavy results would be kept, so move it away or "
            "choose another folder"
        )
    return dict(document)


def _problem(document: Any) -> str:
    """What a report could not work with in an evidence document; empty when there is nothing."""
    # NaN and infinity, which no evidence holds, raise ValueError.
    json.dumps(document, allow_nan=False)
    if not isinstance(document, dict):
        return "it holds no object"
    times, cases = document.get("times", {}), document.get("verification", [])
    if not isinstance(times, dict) or not isinstance(times.get("date", ""), str):
        return '"times" is no object with a date'
    if not isinstance(cases, list) or not all(isinstance(case, dict) for case in cases):
        return '"verification" is no list of cases'
    for place, case in enumerate(cases):
        kinds = _KINDS if case.get("cost") == "heavy" else {}
        for key, kind in kinds.items():
            if not isinstance(case.get(key), kind):
                return f'"{key}" of verification[{place}] is {_shown(case.get(key))}, not {_NAMES[kind]}'
    return ""


def _shown(value: Any) -> str:
    return "missing" if value is None else toml_text(value)
