"""Results of cases kept from earlier runs, so that a report runs only what its scene requires.

Heavy cases: those of an output folder, and those packaged.  Light cases that look at no scene: what this very
program has found before, on the same packages and the same kind of processor.  And by what a report was made,
for whoever must make it again.
"""

from __future__ import annotations

import contextlib
import hashlib
import json
import os
import platform
import subprocess
import sys
from collections.abc import Mapping
from importlib.resources import files
from pathlib import Path
from types import MappingProxyType
from typing import Any, Final

from ringbalance.reports.section import Record
from ringbalance.scene.platform.files import discard
from ringbalance.scene.platform.kept_code import (
    OTHER,
    checked_content,
    code_root,
    trusted,
    write_checked,
)
from ringbalance.scene.platform.program import program_digest, version_of
from ringbalance.scene.toml import toml_text

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
    heavy = [(place, case) for place, case in enumerate(cases) if case.get("cost") == "heavy"]
    problems = (_case_problem(case, f"verification[{place}]") for place, case in heavy)
    return next(filter(None, problems), "")


def _case_problem(case: Any, place: str) -> str:
    """What a report could not work with in a case's record; empty when there is nothing."""
    if not isinstance(case, dict):
        return f"{place} is no object"
    for key, kind in _KINDS.items():
        if not isinstance(case.get(key), kind):
            return f'"{key}" of {place} is {_shown(case.get(key))}, not {_NAMES[kind]}'
    return ""


def _shown(value: Any) -> str:
    return "missing" if value is None else toml_text(value)


_PREFIX: Final = "cases-"


def looks_at_no_scene(case: Mapping[str, Any]) -> bool:
    """Whether a case's record is the same for every scene, and cheap enough to be run again unasked."""
    return bool(case["judged_on"] == "paper" and case["cost"] == "light")


def kept_cases() -> dict[str, Record]:
    """By its id, each light case that looks at no scene: its record and the date on which it was run."""
    path = _kept_file()
    if not trusted(path.parent):
        return {}
    try:
        found: dict[str, Record] = json.loads(checked_content(path))
        _check_kept(found)
    except FileNotFoundError:
        return {}
    except (OSError, ValueError, RecursionError):
        discard(path)
        return {}
    return found


def _check_kept(kept: object) -> None:
    """Raises: ValueError: a report could not work with what was kept."""
    json.dumps(kept, allow_nan=False)
    if not isinstance(kept, dict):
        raise ValueError("it holds no object")
    for name, entry in kept.items():
        if not isinstance(entry, dict) or not isinstance(entry.get("date"), str):
            raise ValueError(f'"{name}" has no date')
        problem = _case_problem(entry.get("record"), name)
        if problem:
            raise ValueError(problem)


def keep_cases(kept: Mapping[str, Record]) -> None:
    """Keep what `kept_cases` gives."""
    path = _kept_file()
    if not trusted(path.parent):
        return
    # Without them the next report runs the cases again.
    with contextlib.suppress(OSError):
        write_checked(path, json.dumps(kept, allow_nan=False).encode())


def _kept_file() -> Path:
    return code_root() / f"{_PREFIX}{program_digest()[:16]}{OTHER}"


_PACKAGES: Final = (
    *("numpy", "scipy", "scikit-fem", "pyamg", "fluids", "meshio"),
    *("matplotlib", "pyvista", "vtk", "jinja2"),
)
_ROOT: Final = Path(__file__).resolve().parents[1]
_LOCK: Final = _ROOT / "requirements" / "lock.txt"
_PATIENCE: Final = 10.0


def provenance() -> Record:
    """Commit and whether files differ from it, hash of the lock file, command, and kind of machine.

    Returns: Texts; empty where this copy of the program is no checkout. The machine's name is left out.
    """
    return {
        "commit": _git("rev-parse", "HEAD"),
        "dirty": bool(_git("status", "--porcelain", "--untracked-files=no")),
        "lock_sha256": hashlib.sha256(_LOCK.read_bytes()).hexdigest() if _LOCK.is_file() else "",
        "command": " ".join([Path(sys.argv[0]).name, *map(_bare, sys.argv[1:])]),
        "machine": f"{platform.system()} {platform.machine()}, {os.cpu_count()} logical processors",
    }


def versions() -> Record:
    """Versions of this program, of Python and of the packages that numbers come from."""
    found = {
        "ringbalance": version_of("ringbalance") or "not installed",
        "python": platform.python_version(),
    }
    return found | {name: told for name in _PACKAGES if (told := version_of(name))}


def _bare(argument: str) -> str:
    """An argument without the folders of its file, which say nothing to another machine."""
    return Path(argument).name if os.sep in argument else argument


def _git(*arguments: str) -> str:
    if not (_ROOT / ".git").exists():
        return ""
    try:
        done = subprocess.run(
            ["git", "-C", str(_ROOT), *arguments],
            capture_output=True,
            text=True,
            timeout=_PATIENCE,
            check=True,
        )
    except (OSError, subprocess.SubprocessError):
        return ""
    return done.stdout.strip()
