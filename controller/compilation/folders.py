"""Folders of compiled code: one for each version of the sources in each checkout, old ones removed.

A folder is named after the checkout's path and a digest of the sources.  A folder's time of modification is
its last use.  Removing one under a running program is harmless: that program compiles what it still needs.
"""

from __future__ import annotations

import contextlib
import hashlib
import os
import re
import shutil
import stat
import time
from collections.abc import Iterable
from functools import cache
from pathlib import Path
from typing import Final

_LONGEST_UNUSED: Final = 30 * 86400.0
"""Time after which an unused folder is removed, s."""
_MOST_PER_CHECKOUT: Final = 2
"""The current version and the one before, so that changing between two branches compiles nothing."""
_MOST_FOLDERS: Final = 16
"""Of all checkouts together; about 13 MB each."""
# Earlier releases named a folder after the digest alone.
_NAME: Final = re.compile(r"(?:(?P<checkout>[0-9a-f]{8})-)?[0-9a-f]{16}")


def folder_name(*, checkout: Path, digest: str) -> str:
    """Eight digits for the checkout, a hyphen, and the digest of the sources."""
    place = hashlib.sha256(os.fsencode(checkout.resolve())).hexdigest()[:8]
    return f"{place}-{digest}"


def make_private(folder: Path) -> None:
    """Make a folder, and those above it that are missing, for this user alone; one of this user's own that
    others may write becomes private.

    Raises: OSError: it cannot be made.
    """
    if not folder.parent.exists():
        make_private(folder.parent)
    folder.mkdir(mode=0o700, exist_ok=True)
    if _may_be_changed_by_others(folder) and folder.stat().st_uid == os.geteuid():
        folder.chmod(0o700)


def foreign(paths: Iterable[Path]) -> Path | None:
    """The first of some files and folders whose content another user may have written; None: there is none.

    Kept code is executed, so it is taken from this user or the superuser alone, and from places that nobody
    else can write to. One that is missing is nobody's. Without owners of files (Windows) there is none.
    """
    return next((path for path in paths if _may_be_changed_by_others(path)), None)


def _may_be_changed_by_others(path: Path) -> bool:
    if not hasattr(os, "geteuid"):
        return False
    try:
        found = path.stat()
    except OSError:
        return False
    return found.st_uid not in {os.geteuid(), 0} or bool(found.st_mode & (stat.S_IWGRP | stat.S_IWOTH))


def code_folders(root: Path) -> list[Path]:
    """Folders of compiled code, the most recently used first; `root` may not exist."""
    try:
        named = [path for path in root.iterdir() if _NAME.fullmatch(path.name) and path.is_dir()]
    except OSError:
        return []
    return sorted(named, key=last_used, reverse=True)


def last_used(folder: Path) -> float:
    """Time of the last use, s since 1970; zero when the folder is gone."""
    try:
        return folder.stat().st_mtime
    except OSError:
        return 0.0


@cache
def mark_used(folder: Path) -> None:
    """Note once in a process that a folder's code is in use."""
    with contextlib.suppress(OSError):
        os.utime(folder)


@cache
def remove_old(current: Path) -> None:
    """Remove once in a process the folders that nobody is likely to need; `current` stays."""
    mark_used(current)
    for folder in _outdated(code_folders(current.parent), current=current, now=time.time()):
        shutil.rmtree(folder, ignore_errors=True)


def _outdated(folders: list[Path], *, current: Path, now: float) -> list[Path]:
    """Those unused for 30 days, beyond two of one checkout, or beyond 16 in all, but never `current`."""
    counts: dict[str, int] = {_checkout(current): 1}
    kept, old = 1, []
    for folder in folders:
        if folder == current:
            continue
        checkout = _checkout(folder)
        many = kept >= _MOST_FOLDERS or counts.get(checkout, 0) >= _MOST_PER_CHECKOUT
        if many or now - last_used(folder) > _LONGEST_UNUSED:
            old.append(folder)
            continue
        counts[checkout], kept = counts.get(checkout, 0) + 1, kept + 1
    return old


def _checkout(folder: Path) -> str:
    found = _NAME.fullmatch(folder.name)
    return (found and found["checkout"]) or folder.name
