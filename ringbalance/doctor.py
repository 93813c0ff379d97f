"""What this machine gives the program, from versions to processes, and what to do where something lacks."""

from __future__ import annotations

import json as json_format
import os
import platform
import re
import shutil
from collections.abc import Iterator
from importlib.metadata import PackageNotFoundError, requires, version
from multiprocessing import get_context
from types import SimpleNamespace
from typing import Final, Literal, NamedTuple

from rich.markup import escape
from rich.table import Table

import ringbalance
from ringbalance.reports.pictures.opengl import find_opengl
from ringbalance.scene.platform.kept_code import CODE, code_root, trusted
from ringbalance.scene.platform.terminal import results_console

State = Literal["ok", "absent", "broken"]
_WORDS: Final = {"ok": "ok", "absent": "not there", "broken": "to mend"}


class MachineCheck(NamedTuple):
    """One thing that the program needs, or is better with."""

    name: str
    state: State
    """`absent` costs a picture, time or an extra; with `broken` a command fails or repeats its work."""
    text: str
    advice: str = ""
    """What to do; empty where nothing is to be done."""


def checks() -> Iterator[MachineCheck]:
    """Look at everything; takes a second or two, since it asks the graphics driver."""
    yield MachineCheck(
        "ringbalance", "ok", f"{ringbalance.__version__} at {os.path.dirname(ringbalance.__file__)}"
    )
    yield MachineCheck(
        "Python", "ok", f"{platform.python_version()}, {platform.system()} {platform.machine()}"
    )
    yield from _packages()
    yield _pictures()
    yield _compiler()
    yield _kept_code()
    yield _processes()


def doctor(options: SimpleNamespace) -> int:
    """Run the command `doctor`. Returns: Exit code: 1 where something is broken."""
    made = list(checks())
    if options.json:
        print(json_format.dumps({"checks": [check._asdict() for check in made]}))
    else:
        _print(made)
    return int(any(check.state == "broken" for check in made))


def _print(made: list[MachineCheck]) -> None:
    table = Table("", "", "", box=None, show_header=False, padding=(0, 2, 0, 0))
    for check in made:
        text = f"{check.text}\n{check.advice}" if check.advice else check.text
        table.add_row(_WORDS[check.state], check.name, escape(text))
    results_console().print(table, highlight=False)


def _packages() -> Iterator[MachineCheck]:
    """The packages that the program asks for, each with its version, those of extras included."""
    for asked in requires("ringbalance") or ():
        requirement, _, marker = asked.partition(";")
        name = re.split(r"[^A-Za-z0-9._-]", requirement.strip(), maxsplit=1)[0]
        extra = re.search(r"extra\s*==\s*['\"]([^'\"]+)", marker)
        try:
            yield MachineCheck(name, "ok", version(name))
        except PackageNotFoundError:
            yield _missing(name, extra.group(1) if extra else None)


def _missing(name: str, extra: str | None) -> MachineCheck:
    if extra is None:
        return MachineCheck(
            name, "broken", "not installed", "install ringbalance again: pip install ringbalance"
        )
    return MachineCheck(name, "absent", f"of the extra {extra}", f'pip install "ringbalance[{extra}]"')


def _pictures() -> MachineCheck:
    opengl = find_opengl()
    return MachineCheck("off-screen pictures", "ok" if opengl.available else "absent", opengl.text)


def _compiler() -> MachineCheck:
    path = shutil.which(os.environ.get("CC", "cc"))
    if path is None:
        return MachineCheck("C compiler", "absent", "none found; only what is exported to C needs one")
    return MachineCheck("C compiler", "ok", path)


def _kept_code() -> MachineCheck:
    """Compiled code is kept between runs where this user alone can write."""
    folder = code_root()
    if folder.exists() and not trusted(folder):
        advice = "remove the folder, or set XDG_CACHE_HOME to one of your own"
        return MachineCheck("compiled code", "broken", f"{folder}: others may write to it", advice)
    above = next(path for path in (folder, *folder.parents) if path.exists())
    if not os.access(above, os.W_OK):
        advice = "set XDG_CACHE_HOME to a folder that can be written; until then every run compiles again"
        return MachineCheck("compiled code", "broken", f"{folder} cannot be written", advice)
    sizes = [path.stat().st_size for path in folder.glob(f"*{CODE}")]
    return MachineCheck("compiled code", "ok", f"{folder}: {len(sizes)} functions, {sum(sizes) / 1e6:.0f} MB")


def _processes() -> MachineCheck:
    """Whether processes can share work: that takes semaphores, which some containers lack."""
    count = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count()
    try:
        get_context("spawn").Semaphore()
    except (OSError, ImportError) as error:
        advice = "make /dev/shm writable; until then one process does all the work"
        return MachineCheck("processes", "absent", f"{count} processors, no semaphores: {error}", advice)
    return MachineCheck("processes", "ok", f"{count} processors; each process uses one thread")
