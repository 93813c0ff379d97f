"""Compiled code kept in files, one for each signature of a function, and other files that save time.

Numba's own index can lead to code of an earlier source.  Here a file's name depends on all that determines
its content; the file begins with a checksum of the rest, is written whole and synced to the disk.  An
unreadable file is discarded and made again.  A file that cannot be written costs time in later runs and is no
error.  A file that another user may have written is not read, because kept code is executed.
"""

from __future__ import annotations

import contextlib
import hashlib
import inspect
import os
import pickle
import stat
import sys
import time
from collections.abc import Callable, Iterator
from functools import cache
from pathlib import Path
from typing import Any, Final

from numba.core import compiler, serialize

from ringbalance.scene.platform.files import cache_folder, discard, read_kept, write_whole

try:
    import fcntl
except ImportError:
    # Windows: two processes that need the same code both compile it.
    fcntl = None  # type: ignore[assignment]

CODE: Final = ".nbc"
OTHER: Final = ".kept"
"""Ending of files that other packages keep beside the code and can make again."""
_TURN: Final = ".turn"
"""Ending of an empty file, locked by the process that compiles a function."""
_LONGEST_TURN_S: Final = 60.0
"""Longest wait for another process: several times the compile time of the longest function."""
_LONGEST_KEPT_S: Final = 60 * 86400.0
"""Age at which a file is removed when another one is stored."""
_MOST_KEPT_BYTES: Final = 5e8
"""Largest size of all files: beyond, the oldest are removed. Each version of the program keeps some 30 MB."""
_CHECKSUM_BYTES: Final = hashlib.sha256().digest_size

_dumps: Any = serialize.dumps
_rebuild: Any = compiler.CompileResult._rebuild


def code_root() -> Path:
    """Folder of kept files, which may not exist yet; NUMBA_CACHE_DIR moves it."""
    folder = os.environ.get("NUMBA_CACHE_DIR")
    return Path(folder) / "ringbalance" if folder else cache_folder()


def checked_content(path: Path) -> bytes:
    """Content of a kept file without the checksum; raises OSError or ValueError for an unusable one."""
    if _may_be_changed_by_others(path):
        raise PermissionError(f"{path} may have been written by another user")
    data = read_kept(path)
    if hashlib.sha256(data[_CHECKSUM_BYTES:]).digest() != data[:_CHECKSUM_BYTES]:
        raise ValueError(f"{path} is damaged")
    return data[_CHECKSUM_BYTES:]


def write_checked(path: Path, content: bytes) -> None:
    """Store a file for `checked_content`; raises OSError when that is impossible."""
    if path.is_dir():
        discard(path)
    _make_private(path.parent)
    _remove_old()
    write_whole(path, hashlib.sha256(content).digest() + content, private=True)


@cache
def trusted(folder: Path) -> bool:
    """True for a folder whose content may be used: nobody else can have written it.

    A folder of this user that others may write to is made private first; if that fails, one message says so.
    """
    with contextlib.suppress(OSError):
        if folder.exists():
            _make_private(folder)
    foreign = _may_be_changed_by_others(folder)
    if foreign and sys.stderr is not None:
        print(
            f"ringbalance: {folder} belongs to another user, or others may write to it; what it holds is not "
            "used, and every run compiles again; remove it, or set XDG_CACHE_HOME to a folder of your own",
            file=sys.stderr,
        )
    return not foreign


def _make_private(folder: Path) -> None:
    """Make a folder, and missing ones above it, for this user alone; an existing one of this user that others
    may write to becomes private."""
    if not folder.parent.exists():
        _make_private(folder.parent)
    folder.mkdir(mode=0o700, exist_ok=True)
    if _may_be_changed_by_others(folder) and folder.stat().st_uid == os.geteuid():
        folder.chmod(0o700)


def _may_be_changed_by_others(path: Path) -> bool:
    """True if another user can write a file; False if it is missing, or without owners of files (Windows)."""
    if not hasattr(os, "geteuid"):
        return False
    try:
        status = path.stat()
    except OSError:
        return False
    return status.st_uid not in {os.geteuid(), 0} or bool(status.st_mode & (stat.S_IWGRP | stat.S_IWOTH))


class KeptCode:
    """The kept code of one function, in place of numba's own cache.

    Args: `digest`: of all sources whose code the function's code may contain.
    Raises: TypeError: a closure, whose code depends on the values that it encloses.
    """

    def __init__(self, function: Callable[..., Any], digest: str) -> None:
        if function.__closure__:
            raise TypeError(f"{function.__qualname__} is made in another function")
        source, line = inspect.getfile(function), function.__code__.co_firstlineno
        code = hashlib.sha256(function.__code__.co_code).hexdigest()
        self._name = f"{Path(source).stem}.{function.__name__}-{line}"
        # The program's own modules are known by name: copies in several folders share the code.
        own_module = function.__module__.startswith("ringbalance.")
        origin = function.__module__ if own_module else source
        self._known = f"{origin}:{line}:{function.__qualname__}:{digest}:{code}"
        self._turn: int | None = None

    @property
    def cache_path(self) -> str:
        """Folder of kept code, as numba shows it."""
        return str(code_root())

    @contextlib.contextmanager
    def in_turn(self) -> Iterator[None]:
        """Let one process compile code that `load_overload` does not find, while the others wait."""
        try:
            yield
        finally:
            if self._turn is not None:
                os.close(self._turn)
                self._turn = None

    def load_overload(self, sig: object, target_context: Any) -> object:
        """The kept code of a signature; None if it must be compiled."""
        if not trusted(code_root()):
            return None
        target_context.refresh()
        key = (sig, target_context.codegen().magic_tuple())
        code = self._load(key, target_context)
        if code is None and self._turn is None:
            self._turn = _turn(code_root() / f"{self._name}{_TURN}")
            code = self._load(key, target_context)
        return code

    def _load(self, key: object, target_context: object) -> object:
        path = self._path(key)
        try:
            origin, data = pickle.loads(checked_content(path))
            if origin == (self._known, key):
                return _rebuild(target_context, *data)
        except FileNotFoundError:
            return None
        except Exception:
            # A right checksum ensures no format: files of another library release may raise anything.
            pass
        discard(path)
        return None

    def save_overload(self, sig: object, data: Any) -> None:
        """Store the compiled code of a signature, if possible."""
        bound_to_process = data.library.has_dynamic_globals or any(not each.can_cache for each in data.lifted)
        if bound_to_process or not trusted(code_root()):
            return
        key = (sig, data.codegen.magic_tuple())
        try:
            write_checked(self._path(key), _dumps(((self._known, key), data._reduce())))
        except OSError as error:
            _note_unwritable(code_root(), error.strerror or str(error))

    def _path(self, key: object) -> Path:
        digest = hashlib.sha256(f"{self._known}{key}".encode()).hexdigest()[:16]
        return code_root() / f"{self._name}.{digest}{CODE}"


def _turn(path: Path) -> int | None:
    """Descriptor with an exclusive lock until it is closed; None if it is not available in time."""
    if fcntl is None:
        return None
    try:
        _make_private(path.parent)
        held = os.open(path, os.O_RDWR | os.O_CREAT, 0o600)
    except OSError:
        return None
    start = time.monotonic()
    while time.monotonic() < start + _LONGEST_TURN_S:
        try:
            fcntl.flock(held, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            time.sleep(0.05)
        except OSError:
            break
        else:
            return held
    os.close(held)
    return None


@cache
def _remove_old() -> None:
    """Remove, once in a process, old files, and the oldest ones beyond the largest size of all."""
    files = []
    for path in [path for kind in (CODE, OTHER, _TURN) for path in code_root().glob(f"*{kind}")]:
        with contextlib.suppress(OSError):
            status = path.stat()
            files.append((status.st_mtime, status.st_size, path))
    room = _MOST_KEPT_BYTES
    for kept_at, size, path in sorted(files, reverse=True):
        room -= size
        if room < 0 or time.time() - kept_at > _LONGEST_KEPT_S:
            with contextlib.suppress(OSError):
                path.unlink()


@cache
def _note_unwritable(folder: Path, reason: str) -> None:
    if sys.stderr is not None:
        print(
            f"ringbalance: compiled code cannot be kept in {folder} ({reason}); every run compiles it again; "
            "set XDG_CACHE_HOME or NUMBA_CACHE_DIR to a folder that can be written",
            file=sys.stderr,
        )
