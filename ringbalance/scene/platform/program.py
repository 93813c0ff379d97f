"""Identity of the program: results of another version of it, or of a package, are not reused."""

from __future__ import annotations

import hashlib
import platform
from functools import cache
from importlib.metadata import PackageNotFoundError, version
from importlib.resources import files
from pathlib import Path
from typing import Final

_PACKAGES: Final = ("numpy", "scipy", "numba", "fluids", "scikit-fem", "pyamg", "meshio")
"""Packages whose versions may change a number."""
_ROOMS: Final = (
    *("scene", "results", "mesh", "physics", "reduced_model", "controller", "identification"),
    *("design", "verification", "scenes"),
)
_SUFFIXES: Final = frozenset({".py", ".toml", ".csv", ".json", ".xz"})


@cache
def program_digest() -> str:
    """Digest of the files that determine results, the packages that they use and the kind of processor."""
    versions = [
        platform.python_version(),
        platform.machine(),
        *(f"{name} {version_of(name)}" for name in _PACKAGES),
    ]
    digest = hashlib.sha256("\n".join(versions).encode())
    for room in _ROOMS:
        folder = Path(str(files(f"ringbalance.{room}")))
        for path in sorted(path for path in folder.rglob("*") if path.suffix in _SUFFIXES):
            digest.update(f"\n{room} {path.relative_to(folder)}\n".encode() + path.read_bytes())
    return digest.hexdigest()


def version_of(name: str) -> str:
    """Version of an installed package; empty where there is none."""
    try:
        return version(name)
    except PackageNotFoundError:
        return ""
