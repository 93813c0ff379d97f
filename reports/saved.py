"""Results of cases from earlier runs, so that a report runs only what its scene requires; its provenance.

Heavy cases come from the output folder and from the package.  Light cases that look at no scene come from
earlier runs of this very program, with the same packages, on the same kind of processor.
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
"""Types of the keys of a case's record that a report may reuse."""
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
    packaged = files("ringbalance.reports").joinpath("data", PACKAGED)
    cases = heavy_cases(json.loads(packaged.read_text(encoding="utf-8"))) if packaged.is_file() else []
    path = None if folder is None else folder / "evidence.json"
    if path is not None and path.is_file():
        try:
            document = json.loads(path.read_bytes())
            problem = _problem(document)
        except (ValueError, RecursionError) as error:
            problem = "it is nested too deeply" if isinstance(error, RecursionError) else str(error)
        if problem:
            raise OSError(
                f"{path} is not an evidence file: {problem}; its heavy results would be kept, so move it "
                "away or choose another folder"
            )
        cases += heavy_cases(document)
    return sorted(cases, key=lambda case: str(case["date"]))


def _problem(document: Any) -> str:
    """Reason why a report cannot use an evidence document; empty: none."""
    # NaN and infinity, which no evidence holds, raise ValueError.
    json.dumps(document, allow_nan=False)
    if not isinstance(document, dict):
        return "it holds no object"
    times, cases = document.get("times", {}), document.get("verification", [])
    if not isinstance(times, dict) or not isinstance(times.get("date", ""), str):
        return '"times" is no object with a date'
    if not isinstance(cases, list) or not all(isinstance(case, dict) for case in cases):
        return '"verification" is no list of cases'
    heavy = [(i, case) for i, case in enumerate(cases) if case.get("cost") == "heavy"]
    problems = (_case_problem(case, f"verification[{i}]") for i, case in heavy)
    return next(filter(None, problems), "")


def _case_problem(case: Any, name: str) -> str:
    """Reason why a report cannot use a case's record; empty: none."""
    if not isinstance(case, dict):
        return f"{name} is no object"
    for key, kind in _KINDS.items():
        if not isinstance(value := case.get(key), kind):
            text = "missing" if value is None else toml_text(value)
            return f'"{key}" of {name} is {text}, not {_NAMES[kind]}'
    return ""


_PREFIX: Final = "cases-"


def kept_cases() -> dict[str, Record]:
    """Light cases that depend on no scene, by id, each with its `record` and the `date` of its run."""
    path = _kept_file()
    if not trusted(path.parent):
        return {}
    try:
        entries: Any = json.loads(checked_content(path))
        json.dumps(entries, allow_nan=False)
        if not isinstance(entries, dict):
            raise ValueError("it holds no object")
        for name, entry in entries.items():
            if not isinstance(entry, dict) or not isinstance(entry.get("date"), str):
                raise ValueError(f'"{name}" has no date')
            if problem := _case_problem(entry.get("record"), name):
                raise ValueError(problem)
    except FileNotFoundError:
        return {}
    except (OSError, ValueError, RecursionError):
        discard(path)
        return {}
    return dict(entries)


def keep_cases(entries: Mapping[str, Record]) -> None:
    """Store entries for `kept_cases`."""
    path = _kept_file()
    if not trusted(path.parent):
        return
    # Without them the next report runs the cases again.
    with contextlib.suppress(OSError):
        write_checked(path, json.dumps(entries, allow_nan=False).encode())


def _kept_file() -> Path:
    return code_root() / f"{_PREFIX}{program_digest()[:16]}{OTHER}"


_PACKAGES: Final = (
    *("numpy", "scipy", "numba", "llvmlite", "scikit-fem", "pyamg", "fluids", "meshio"),
    *("matplotlib", "pyvista", "vtk", "jinja2"),
)
_ROOT: Final = Path(__file__).resolve().parents[1]
_LOCK: Final = _ROOT / "requirements" / "lock.txt"
_GIT_TIMEOUT_S: Final = 10.0


def provenance() -> Record:
    """Commit and whether files differ from it, hash of the lock file, command, and kind of machine.

    Returns: Texts; empty where this copy of the program is no checkout. The machine's name is left out.
    """
    # Folders are those of this machine alone.
    program, *words = sys.argv
    arguments = [Path(word).name if os.sep in word else word for word in words]
    return {
        "commit": _git("rev-parse", "HEAD"),
        "dirty": bool(_git("status", "--porcelain", "--untracked-files=no")),
        "lock_sha256": hashlib.sha256(_LOCK.read_bytes()).hexdigest() if _LOCK.is_file() else "",
        "command": " ".join([Path(program).name, *arguments]),
        "machine": f"{platform.system()} {platform.machine()}, {os.cpu_count()} logical processors",
    }


def versions() -> Record:
    """Versions of this program, of Python and of the packages that numbers come from."""
    return {
        "ringbalance": version_of("ringbalance") or "not installed",
        "python": platform.python_version(),
        **{name: version for name in _PACKAGES if (version := version_of(name))},
    }


def _git(*arguments: str) -> str:
    if not (_ROOT / ".git").exists():
        return ""
    try:
        done = subprocess.run(
            ["git", "-C", str(_ROOT), *arguments],
            capture_output=True,
            text=True,
            timeout=_GIT_TIMEOUT_S,
            check=True,
        )
    except (OSError, subprocess.SubprocessError):
        return ""
    return done.stdout.strip()
