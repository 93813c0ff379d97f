"""A law as a JSON file: records by their type and field names, floats by their shortest exact decimals."""

from __future__ import annotations

import json
from dataclasses import fields, is_dataclass
from pathlib import Path
from typing import Any, Final

import numpy as np

from ringbalance.scene.platform.files import write_whole

FORMAT: Final = "ringbalance law"
VERSION: Final = 2


def save_record(*, path: Path, record: object) -> Path:
    """Write a record of floats, arrays, texts and other such records.

    Raises: TypeError: a value that such a file cannot hold.
    Raises: ValueError: a value that is not finite.
    Raises: OSError: the file cannot be written; nothing is left behind.
    """
    content = {"format": FORMAT, "version": VERSION, "law": _plain(record)}
    return write_whole(path, json.dumps(content, allow_nan=False, indent=1) + "\n")


def _plain(value: object) -> Any:
    if is_dataclass(value) and not isinstance(value, type):
        named = {f.name: _plain(getattr(value, f.name)) for f in fields(value)}
        return {"type": type(value).__name__} | named
    if isinstance(value, np.ndarray):
        return [float(v) for v in value]
    # The order matters: bool is an int, and a NumPy float is a float.
    if value is None or isinstance(value, bool | str):
        return value
    if isinstance(value, float | int):
        return float(value)
    raise TypeError(f"a law's file cannot hold {type(value).__name__}")
