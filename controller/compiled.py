"""Functions compiled to machine code by numba, kept between runs, and compiled anew when any of them changes.

Numba looks only at a function's own file to see whether a kept one is stale, though it holds the code of
every compiled function that it calls.  The folder that it is kept in is therefore named after all of their
sources.
"""

from __future__ import annotations

import contextlib
import hashlib
import os
from collections.abc import Callable, Iterator
from functools import cache
from pathlib import Path
from typing import Any, Final, ParamSpec, TypeVar, cast

import numba

from ringbalance.scene.files import cache_folder

P = ParamSpec("P")
R = TypeVar("R")

SETTINGS: Final[Any] = numba.config


def compiled(function: Callable[P, R]) -> Callable[P, R]:
    """Compile a function of numbers and arrays, in strict floating point and free of the interpreter's lock.

    Args:
        function: in the part of Python that numba knows; it may call other compiled functions.  The plain
            function stays at hand as the result's `py_func`.

    Returns:
        The function, compiled at its first call, or taken from an earlier process.

    Source: the documentation of numba, `@jit`.
    """
    with _kept_in(_folder()):
        try:
            return _compile(function, kept=True)
        except RuntimeError:
            # Numba found no folder that it may write to: compile in every process instead.
            return _compile(function, kept=False)


def _compile(function: Callable[P, R], *, kept: bool) -> Callable[P, R]:
    found = numba.njit(function, cache=kept, nogil=True, fastmath=False, error_model="numpy")
    return cast(Callable[P, R], found)


@contextlib.contextmanager
def _kept_in(folder: Path) -> Iterator[None]:
    """Numba reads the folder once, when a function is decorated, and from nowhere but its configuration."""
    before = SETTINGS.CACHE_DIR
    SETTINGS.CACHE_DIR = str(folder)
    try:
        yield
    finally:
        SETTINGS.CACHE_DIR = before


@cache
def _folder() -> Path:
    """The user's folder for what can be made again, unless numba has been given one."""
    given = os.environ.get("NUMBA_CACHE_DIR")
    return (Path(given) / "ringbalance" if given else cache_folder()) / _digest()


def _digest() -> str:
    """Of every source of this room that holds compiled functions."""
    total = hashlib.sha256(numba.__version__.encode())
    for path in sorted(Path(__file__).parent.rglob("*.py")):
        source = path.read_bytes()
        if b"controller.compiled import" in source or path.name == Path(__file__).name:
            total.update(source)
    return total.hexdigest()[:16]
