"""Where and by what a report was made: commit, locks, command and machine, for whoever must make it again."""

from __future__ import annotations

import hashlib
import os
import platform
import subprocess
import sys
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Final

from ringbalance.reports.section import Record

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
    found = {"ringbalance": _version("ringbalance") or "not installed", "python": platform.python_version()}
    return found | {name: told for name in _PACKAGES if (told := _version(name))}


def _version(name: str) -> str:
    try:
        return version(name)
    except PackageNotFoundError:
        return ""


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
