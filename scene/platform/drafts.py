"""Drafts: hidden files and folders in which an output grows until it is whole.

A draft is locked for as long as its writer lives, so one that nobody locks was left by a process that was
killed; whoever writes to the same folder next removes it. Where files cannot be locked, its age decides.
"""

from __future__ import annotations

import os
import re
import secrets
import shutil
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import BinaryIO, Final

try:
    import fcntl
except ImportError:  # Windows has no such locks.
    fcntl = None  # type: ignore[assignment]

_PREFIX: Final = ".ringbalance-"
_NAME: Final = re.compile(re.escape(_PREFIX) + "[0-9a-f]{16}")
_LOCK: Final = "lock"
_FILES: Final = "files"
_BEGINNING: Final = 60.0
"""s in which a folder that is being made gets its lock."""
_LONGEST_WORK: Final = 86400.0
"""s after which a draft counts as abandoned where files cannot be locked."""


def draft_path(folder: Path) -> Path:
    """A fresh name for a draft in a folder."""
    return folder / f"{_PREFIX}{secrets.token_hex(8)}"


@contextmanager
def draft_folder(folder: Path) -> Iterator[Path]:
    """A locked folder for outputs that grow, removed at the end whatever happens.

    Yields: The folder to write into.
    Raises: OSError: nothing can be made there.
    """
    path = draft_path(folder)
    path.mkdir(mode=0o700)
    try:
        with open(path / _LOCK, "xb") as lock:
            _lock(lock, without_locks=True)
            (path / _FILES).mkdir()
            yield path / _FILES
    finally:
        shutil.rmtree(path, ignore_errors=True)


def replace_whole(target: Path, content: bytes) -> None:
    """Write a file through a draft beside it. Raises: OSError: it cannot be; nothing is left behind."""
    draft = draft_path(target.parent)
    try:
        with open(draft, "xb") as stream:
            _lock(stream, without_locks=True)
            stream.write(content)
            stream.flush()
            # After a power cut the old content or the new one is there: the content reaches the disk first.
            os.fsync(stream.fileno())
            if fcntl is not None:
                # Under the lock, so that nobody takes the draft for an abandoned one.
                os.replace(draft, target)
        if fcntl is None:
            os.replace(draft, target)
    except BaseException:
        draft.unlink(missing_ok=True)
        raise
    _sync_folder(target.parent)


def _sync_folder(folder: Path) -> None:
    """Bring a new name to the disk, where the system can: some file systems, and Windows, cannot."""
    with suppress(OSError):
        handle = os.open(folder, os.O_RDONLY)
        try:
            os.fsync(handle)
        finally:
            os.close(handle)


def remove_abandoned(folder: Path) -> None:
    """Remove the drafts of killed processes; those of living ones stay, and what cannot be removed."""
    with suppress(OSError):
        names = [name for name in os.listdir(folder) if _NAME.fullmatch(name)]
        for path in (folder / name for name in names):
            with suppress(OSError):
                _remove_if_abandoned(path)


def _remove_if_abandoned(path: Path) -> None:
    if path.is_symlink():
        return
    age = time.time() - path.stat().st_mtime
    lock = path / _LOCK if path.is_dir() else path
    if not lock.exists():
        if age > _BEGINNING:
            _remove(path)
    elif fcntl is None:
        if age > _LONGEST_WORK:
            _remove(path)
    else:
        with open(lock, "r+b") as stream:
            if age > 1.0 and _lock(stream, without_locks=age > _LONGEST_WORK):
                _remove(path)


def _remove(path: Path) -> None:
    if path.is_dir():
        shutil.rmtree(path, ignore_errors=True)
    else:
        path.unlink()


def _lock(stream: BinaryIO, *, without_locks: bool) -> bool:
    """Lock an open file until it is closed; False when another process has it locked."""
    if fcntl is None:
        return without_locks
    try:
        fcntl.flock(stream.fileno(), fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        return False
    except OSError:
        return without_locks
    return True
