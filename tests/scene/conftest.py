"""Scenes as documents, to be changed and written."""

from __future__ import annotations

import json
import math
import tomllib
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import pytest

from ringbalance.scene import AnyScene, bundled_scene, load_scene

Document = dict[str, Any]


def _toml(value: Any) -> str:
    if isinstance(value, Mapping):
        return "{" + ", ".join(f"{json.dumps(key)} = {_toml(item)}" for key, item in value.items()) + "}"
    if isinstance(value, list):
        return "[" + ", ".join(map(_toml, value)) + "]"
    if isinstance(value, float) and not math.isfinite(value):
        return str(value)
    # TOML has no \u007f-free rule for JSON's escapes to break: a JSON string is a TOML basic string.
    return json.dumps(value).replace("\x7f", "\\u007f")


@pytest.fixture(scope="session")
def as_toml() -> Callable[[Mapping[str, Any]], str]:
    """Write a document as TOML, one inline value for each top-level key."""
    return lambda document: "\n".join(
        f"{json.dumps(key)} = {_toml(value)}" for key, value in document.items()
    )


@pytest.fixture
def paper_document() -> Document:
    """The paper's scene, to be changed at will: nothing in it refers to a key that a test takes away."""
    document = tomllib.loads(bundled_scene("liquid_ring_paper").read_text(encoding="utf-8"))
    del document["uncertainty"]
    for table in document.values():
        if isinstance(table, dict):
            table.pop("origin", None)
    return document


@pytest.fixture
def driven_document() -> Document:
    """The scene of the paper on eccentric masses, to be changed at will."""
    return tomllib.loads(bundled_scene("eccentric_mass_paper").read_text(encoding="utf-8"))


@pytest.fixture
def newcomer_document() -> Document:
    """The least that a scene needs."""
    return {
        "disc": {
            "outer_radius": "60 mm",
            "inner_radius": "30 mm",
            "axial_width": "40 mm",
            "central_angle": "60 deg",
        },
        "liquid": {"name": "water", "temperature": "25 degC"},
        "tube": {"bore": "2 mm", "length": "200 mm"},
        "gas": {"pressure": "5 bar"},
        "rotor": {"speed": "6000 rpm"},
    }


@pytest.fixture
def load(tmp_path: Path, as_toml: Callable[[Mapping[str, Any]], str]) -> Callable[[Mapping[str, Any]], Any]:
    """Write a document to my_disc.toml and load it."""

    def load_document(document: Mapping[str, Any]) -> AnyScene:
        path = tmp_path / "my_disc.toml"
        path.write_text(as_toml(document), encoding="utf-8")
        return load_scene(path)

    return load_document
