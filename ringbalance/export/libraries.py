"""The libraries inside a unit for co-simulation, compiled from its source.

By the machine's compiler for machines like it, or by the cross-compiler of the package `ziglang` for all.
"""

from __future__ import annotations

import platform
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Final, Literal

from ringbalance.export.hosts import template
from ringbalance.scene.platform.display import announced

Version = Literal["fmi2", "fmi3"]
EXTRA: Final = "export-all"
"""Extra of the project that installs the cross-compiler."""
_OPTIONS: Final = ("-std=c99", "-ffp-contract=off", "-fvisibility=hidden", "-fPIC", "-shared")
_SUFFIXES: Final = {"linux": ".so", "darwin": ".dylib", "windows": ".dll"}
_SYSTEMS: Final = {"linux": "linux-gnu.2.17", "darwin": "macos", "windows": "windows-gnu"}
"""Names of the cross-compiler; the oldest C library that it links for is that of 2012."""
_SMALL: Final = (
    *("-s", "-Os", "-fomit-frame-pointer", "-fno-math-errno", "-fno-ident"),
    *("-fno-vectorize", "-fno-slp-vectorize"),
)
"""Options for small libraries: six of them are most of a unit."""
_OF_PROCESSOR: Final = {"x86_64": ("-Xclang", "-Oz"), "aarch64": ()}
_PLAIN: Final = ("-fno-unwind-tables", "-fno-asynchronous-unwind-tables")
_OF_SYSTEM: Final = {
    "linux": (*_PLAIN, "-fno-plt", "-flto", "-Wl,--hash-style=sysv", "-lm"),
    "darwin": (*_PLAIN, "-Wl,-x"),
    "windows": ("-nostdlib", "-I.", "-lkernel32"),
}
"""Options by system: no unwind tables, which only exceptions of other languages need, but Windows always
requires; and no names that nothing outside needs."""
_HEADERS: Final = {
    "math.h": "double sqrt(double);\n",
    "stdlib.h": "#include <stddef.h>\nvoid *malloc(size_t);\nvoid free(void *);\n",
    "string.h": "#include <stddef.h>\nvoid *memcpy(void *, const void *, size_t);\n"
    "int strcmp(const char *, const char *);\n",
}
"""C headers for Windows, whose C library would take the cross-compiler minutes and a unit 30 kB."""
_PROCESSORS: Final = ("x86_64", "aarch64")
_PYTHON_NAMES: Final = {"AMD64": "x86_64", "arm64": "aarch64"}
_FOLDERS_2: Final = {"linux": "linux64", "darwin": "darwin64", "windows": "win64"}
"""Folders of FMI 2.0, which names no processor but x86."""


def local_library(sources: Mapping[str, str], name: str, version: Version) -> dict[str, bytes]:
    """Library for machines like this one, by its path in the unit; none without a compiler that works."""
    compiler = next((tool for each in ("cc", "gcc", "clang") if (tool := shutil.which(each))), None)
    processor = _PYTHON_NAMES.get(platform.machine(), platform.machine())
    path = _path(version, name, sys.platform, processor)
    if compiler is None or path is None:
        return {}
    try:
        return {path: _compiled([compiler, "-O2"], sources, Path(path).name, ["-lm"])}
    except OSError:
        return {}


def every_library(sources: Mapping[str, str], name: str, version: Version) -> dict[str, bytes]:
    """Libraries for Linux, macOS and Windows on both processors, as far as the standard names them.

    The cross-compiler keeps what it compiles in its own cache: some seconds for a system the first time.

    Raises: OSError: the cross-compiler fails.
    """
    machines = [(system, processor) for system in _SYSTEMS for processor in _PROCESSORS]
    paths = {each: path for each in machines if (path := _path(version, name, *each))}
    libraries = {}
    for done, ((system, processor), path) in enumerate(paths.items(), start=1):
        with announced(f"compiling for {system} on {processor}, {done} of {len(paths)} ..."):
            target = f"{processor}-{_SYSTEMS[system]}"
            compiler = [sys.executable, "-m", "ziglang", "cc", "-target", target, *_SMALL]
            compiler += _OF_PROCESSOR[processor]
            further = {**_HEADERS, "windows.c": template("windows")} if system == "windows" else {}
            texts = {**sources, **further}
            libraries[path] = _compiled(compiler, texts, Path(path).name, _OF_SYSTEM[system])
    return libraries


def _compiled(
    compiler: Sequence[str], sources: Mapping[str, str], library: str, further: Sequence[str]
) -> bytes:
    """Compile a library. Args: `further`: options after the sources. Raises: OSError: the compiler fails."""
    with tempfile.TemporaryDirectory() as folder:
        for file, text in sources.items():
            Path(folder, file).write_text(text, encoding="utf-8")
        compiled = [file for file in sources if file.endswith(".c")]
        command = [*compiler, *_OPTIONS, *compiled, *further, "-o", library]
        done = subprocess.run(command, cwd=folder, capture_output=True, text=True, check=False)
        if done.returncode:
            message = (done.stderr.strip() or "no message").splitlines()[-1]
            raise OSError(f"{Path(compiler[0]).name} does not compile {library}: {message}")
        return Path(folder, library).read_bytes()


def _path(version: Version, name: str, system: str, processor: str) -> str | None:
    """Path of a library in the unit; None: the standard, or this program, names no such machine."""
    if system not in _SUFFIXES or processor not in _PROCESSORS:
        return None
    if version == "fmi2" and processor != "x86_64":
        return None
    folder = _FOLDERS_2[system] if version == "fmi2" else f"{processor}-{system}"
    return f"binaries/{folder}/{name}{_SUFFIXES[system]}"
