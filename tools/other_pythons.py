"""Run tests under every further supported Python of this machine.

    .venv/bin/python tools/other_pythons.py [--ends]

Supported are the versions that pyproject.toml's classifiers name.  Python is looked for as `python3.X` on
the search path and among the versions of pyenv; one that does not start, or has no venv, does not count.
The Python that runs this program is left out, since `make test` has used it.  The oldest and the newest of
the others on this machine run `make test-numbers`, types included; those between, which have the packages of
the newest (requirements/lock.txt), run `make test-short`; with --ends they are left out.  Each has an
environment, `.venv-3.X`.  Before a release, `make test pages VENV=.venv-3.13` runs everything under another
Python.
"""

from __future__ import annotations

import os
import re
import subprocess
import sys
import tomllib
from collections.abc import Iterator, Sequence
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
_ASK = "import sys, ensurepip, venv; print('%d.%d' % sys.version_info[:2])"


def supported(classifiers: Sequence[str]) -> list[str]:
    """Minor versions that classifiers name, such as "3.11", in rising order."""
    matches = (re.fullmatch(r"Programming Language :: Python :: 3\.(\d+)", text) for text in classifiers)
    return [f"3.{minor}" for minor in sorted(int(match[1]) for match in matches if match)]


def starts(python: Path, version: str) -> bool:
    """True if this is an interpreter of that minor version which runs and can make environments."""
    try:
        answer = subprocess.run([python, "-c", _ASK], capture_output=True, text=True, timeout=60, check=False)
    except (OSError, subprocess.TimeoutExpired):
        return False
    return answer.returncode == 0 and answer.stdout.strip() == version


def candidates(version: str) -> Iterator[Path]:
    """Paths at which an interpreter of a minor version may be."""
    for folder in filter(None, os.environ.get("PATH", "").split(os.pathsep)):
        yield Path(folder) / f"python{version}"
    pyenv = Path(os.environ.get("PYENV_ROOT") or Path.home() / ".pyenv")
    yield from sorted((pyenv / "versions").glob(f"{version}.*/bin/python"), reverse=True)


def interpreters(versions: Sequence[str]) -> dict[str, Path | None]:
    """The first interpreter of each minor version that starts; None where there is none."""
    return {
        version: next(
            (path for path in candidates(version) if path.is_file() and starts(path, version)), None
        )
        for version in versions
    }


def main() -> int:
    """Test under each further interpreter; the first that fails ends it."""
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
    running = f"3.{sys.version_info.minor}"
    versions = supported(project["classifiers"])
    others = interpreters([version for version in versions if version != running])
    for version, python in others.items():
        print(f"Python {version}: {python or 'not on this machine, not tested'}", flush=True)
    present = [version for version in versions if version == running or others[version]]
    for version, python in others.items():
        ends = version in (present[0], present[-1])
        if python is not None and (ends or "--ends" not in sys.argv[1:]):
            target = "test-numbers" if ends else "test-short"
            command = ["make", target, f"VENV=.venv-{version}", f"PYTHON={python}"]
            code = subprocess.run(command, cwd=ROOT, stdin=subprocess.DEVNULL, check=False).returncode
            if code != 0:
                print(f"The tests fail under Python {version} ({python}).", file=sys.stderr)
                return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())
