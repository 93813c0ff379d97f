"""Check of the machine, from versions to processes, with advice where something is missing."""

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
from ringbalance.controller.balancer import balancer_class_of
from ringbalance.reports.pictures.opengl import find_opengl
from ringbalance.scene.faults import SceneError
from ringbalance.scene.kinds import scene_kind
from ringbalance.scene.platform.kept_code import CODE, code_root, trusted
from ringbalance.scene.platform.terminal import results_console
from ringbalance.scene.registry import installed_balancers, known_balancers

State = Literal["ok", "absent", "broken"]
_WORDS: Final = {"ok": "ok", "absent": "not there", "broken": "to mend"}


class MachineCheck(NamedTuple):
    """One thing that the program needs or can make use of."""

    name: str
    state: State
    """`absent` costs a picture, time or an extra; with `broken` a command fails or repeats its work."""
    text: str
    advice: str = ""
    """Remedy; empty: none needed."""


def checks() -> Iterator[MachineCheck]:
    """Check everything; takes a second or two, since it asks the graphics driver."""
    folder = os.path.dirname(ringbalance.__file__)
    yield MachineCheck("ringbalance", "ok", f"{ringbalance.__version__} at {folder}")
    system = f"{platform.system()} {platform.machine()}"
    yield MachineCheck("Python", "ok", f"{platform.python_version()}, {system}")
    for line in requires("ringbalance") or ():
        requirement, _, marker = line.partition(";")
        name = re.split(r"[^A-Za-z0-9._-]", requirement.strip(), maxsplit=1)[0]
        extra = re.search(r"extra\s*==\s*['\"]([^'\"]+)", marker)
        try:
            yield MachineCheck(name, "ok", version(name))
        except PackageNotFoundError:
            if extra is None:
                advice = "install ringbalance again: pip install ringbalance"
                yield MachineCheck(name, "broken", "not installed", advice)
            else:
                advice = f'pip install "ringbalance[{extra[1]}]"'
                yield MachineCheck(name, "absent", f"of the extra {extra[1]}", advice)
    opengl = find_opengl()
    yield MachineCheck("off-screen pictures", "ok" if opengl.available else "absent", opengl.text)
    compiler = shutil.which(os.environ.get("CC", "cc"))
    if compiler is None:
        yield MachineCheck("C compiler", "absent", "none found; only what is exported to C needs one")
    else:
        yield MachineCheck("C compiler", "ok", compiler)
    yield from _balancers()
    yield _kept_code()
    yield _processes()


def doctor(options: SimpleNamespace) -> int:
    """Run the command `doctor`. Returns: Exit code: 1 where something is broken."""
    results = list(checks())
    if options.json:
        print(json_format.dumps({"checks": [check._asdict() for check in results]}))
    else:
        table = Table("", "", "", box=None, show_header=False, padding=(0, 2, 0, 0))
        for check in results:
            text = f"{check.text}\n{check.advice}" if check.advice else check.text
            table.add_row(_WORDS[check.state], check.name, escape(text))
        results_console().print(table, highlight=False)
    return int(any(check.state == "broken" for check in results))


def _balancers() -> Iterator[MachineCheck]:
    """Check that balancers of other packages can be used."""
    for name, package in installed_balancers().items():
        taken, advice = name in known_balancers(), f"ask who made {package}, or uninstall it"
        try:
            scene_kind(name)
            balancer_class_of(name)
        except SceneError as error:
            yield MachineCheck(f"balancer {name}", "broken", error.faults[0].problem, advice)
            continue
        text = f"of {package}"
        if taken:
            text += ", which is not used: the program has a balancer of that name"
        yield MachineCheck(f"balancer {name}", "broken" if taken else "ok", text, advice if taken else "")


def _kept_code() -> MachineCheck:
    """Check the folder of compiled code, which is used only if no other user can write to it."""
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
    """Check that processes can share work; this requires semaphores, which some containers lack."""
    count = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count()
    try:
        get_context("spawn").Semaphore()
    except (OSError, ImportError) as error:
        advice = "make /dev/shm writable; until then one process does all the work"
        return MachineCheck("processes", "absent", f"{count} processors, no semaphores: {error}", advice)
    return MachineCheck("processes", "ok", f"{count} processors; each process uses one thread")
