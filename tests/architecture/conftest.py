"""The repository as the architecture tests see it: its root, its rooms and the files that git knows."""

from __future__ import annotations

import ast
from collections.abc import Mapping
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
ROOM_ORDER = (
    "scene",
    "results",
    "mesh",
    "physics",
    "reduced_model",
    "controller",
    "identification",
    "export",
    "design",
    "panels",
    "verification",
    "reports",
)
LINKED = ("mesh", "reduced_model", "verification", "reports", "scenes")
"""Folders at the root, each a package of `ringbalance/` by a link there."""


@pytest.fixture(scope="session")
def root() -> Path:
    """Top folder of the repository."""
    return ROOT


@pytest.fixture(scope="session")
def room_order() -> tuple[str, ...]:
    """The rooms, first to last; a room imports only from those before it."""
    return ROOM_ORDER


@pytest.fixture(scope="session")
def linked() -> tuple[str, ...]:
    """Folders at the root that are linked into the package."""
    return LINKED


@pytest.fixture(scope="session")
def modules() -> Mapping[str, Path]:
    """Dotted name to file, for every module of every room."""
    found: dict[str, Path] = {}
    for room in ROOM_ORDER:
        place = ROOT if room in LINKED else ROOT / "ringbalance"
        for path in sorted((place / room).rglob("*.py")):
            parts = path.relative_to(place).with_suffix("").parts
            name = ".".join(("ringbalance", *(part for part in parts if part != "__init__")))
            found[name] = path
    return found


@pytest.fixture(scope="session")
def trees(modules: Mapping[str, Path]) -> Mapping[str, ast.Module]:
    """Dotted name to syntax tree, for every module of the rooms and of the package's face."""
    face = {f"ringbalance.{path.stem}": path for path in sorted((ROOT / "ringbalance").glob("*.py"))}
    return {name: ast.parse(path.read_text()) for name, path in (face | dict(modules)).items()}
