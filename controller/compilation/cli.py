"""The command `ringbalance cache`."""

from __future__ import annotations

import json as json_format
import os
import shutil
import time
from pathlib import Path
from typing import Any

from rich.console import Console
from rich.table import Table

from ringbalance.controller.compilation.cache import is_damaged, kept_files
from ringbalance.controller.compilation.compiled import code_folder, code_root
from ringbalance.controller.compilation.folders import code_folders, foreign, last_used

DONE = 0
DAY = 86400.0
MEGABYTE = 1e6


def cache(*, clear: bool = False, json: bool = False) -> int:
    """Show the folder of compiled code and results of cases, or remove what is in it.

    Args:
        clear: remove all of it; the next runs compile again, and the next report runs all its cases.
        json: print one JSON document instead of a table.

    Returns:
        Exit code 0.

    Raises:
        OSError: a folder that cannot be removed.
    """
    removed = 0
    for folder in code_folders(code_root()) if clear else []:
        shutil.rmtree(folder)
        removed += 1
    told = _document(removed)
    if json:
        print(json_format.dumps(told, allow_nan=False))
    else:
        _show(told, Console())
    return DONE


def _document(removed: int) -> dict[str, Any]:
    root, now = code_root(), time.time()
    versions = [_version(folder, now) for folder in code_folders(root)]
    return {
        "folder": str(root),
        "size_bytes": sum(version["size_bytes"] for version in versions),
        "writable": _writable(root),
        "trusted": foreign([root, code_folder()]) is None,
        "usable": _writable(root) or any(v["current"] and v["files"] > v["damaged"] for v in versions),
        "versions": versions,
        "removed": removed,
    }


def _version(folder: Path, now: float) -> dict[str, Any]:
    files = list(kept_files(folder))
    return {
        "name": folder.name,
        "current": folder == code_folder(),
        "files": len(files),
        "damaged": sum(is_damaged(path) for path in files),
        "size_bytes": sum(_size(path) for path in files),
        "unused_s": max(now - last_used(folder), 0.0),
    }


def _size(path: Path) -> int:
    try:
        return path.stat().st_size
    except OSError:
        return 0


def _writable(root: Path) -> bool:
    """Whether the folder can be written to, or made."""
    place = next(path for path in (root, *root.parents) if path.exists())
    return place.is_dir() and os.access(place, os.W_OK | os.X_OK)


def _show(told: dict[str, Any], console: Console) -> None:
    size = told["size_bytes"] / MEGABYTE
    console.print(
        f"{told['folder']}: {size:.1f} MB of compiled code and results of cases",
        highlight=False,
        markup=False,
    )
    if told["removed"]:
        console.print(f"removed: {told['removed']} versions", highlight=False)
    if not told["writable"]:
        console.print(
            "it cannot be written: what is not kept yet is compiled in every run; set XDG_CACHE_HOME or "
            "NUMBA_CACHE_DIR to a folder that can, and that nobody else can write to",
            highlight=False,
        )
    if not told["trusted"]:
        console.print(
            "it belongs to another user, or others may write to it: nothing in it is used, because kept code "
            "is executed; remove it, or set XDG_CACHE_HOME or NUMBA_CACHE_DIR to a folder of your own",
            highlight=False,
        )
    if not told["versions"]:
        return
    table = Table("version", "files", "damaged", "MB", "last used")
    for version in told["versions"]:
        name = f"{version['name']} (this)" if version["current"] else version["name"]
        shown = f"{version['size_bytes'] / MEGABYTE:.1f}"
        days = version["unused_s"] / DAY
        table.add_row(name, str(version["files"]), str(version["damaged"]), shown, f"{days:.1f} days ago")
    console.print(table)
    if any(version["damaged"] for version in told["versions"]):
        console.print("damaged files are discarded and made again when they are needed", highlight=False)
