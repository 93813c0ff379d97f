"""Outputs are written whole or not at all: to a temporary file beside the target, then renamed.

What can be made again, and is only kept to save time, stands in the user's own cache folder.
"""

from __future__ import annotations

import os
import tempfile
from pathlib import Path


def write_whole(path: Path, data: str | bytes) -> Path:
    """Write a file so that a reader never sees half of it, making its folder when there is none.

    Args:
        path: where the file shall stand.
        data: its content; text is written as UTF-8.

    Returns:
        The path.

    Raises:
        OSError: the folder cannot be made or written; nothing is left behind.
    """
    content = data.encode() if isinstance(data, str) else data
    path.parent.mkdir(parents=True, exist_ok=True)
    handle, temporary = tempfile.mkstemp(dir=path.parent, prefix=f".{path.name}.")
    try:
        with os.fdopen(handle, "wb") as stream:
            stream.write(content)
        os.chmod(temporary, 0o644)
        os.replace(temporary, path)
    except BaseException:
        Path(temporary).unlink(missing_ok=True)
        raise
    return path


def cache_folder() -> Path:
    """The user's folder for what ringbalance can make again.

    Returns:
        Path; it may not exist yet.

    Source: the XDG base directory specification, XDG_CACHE_HOME.
    """
    return Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "ringbalance"
