"""Scenes with faults: each is said on a line of its own as `data/refused.toml` has it, and no other is."""

from __future__ import annotations

import tomllib
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import pytest

from ringbalance.scene import SceneError

REFUSED = tomllib.loads((Path(__file__).parent / "data" / "refused.toml").read_text(encoding="utf-8"))
CASES = [(kind, name) for kind, cases in REFUSED.items() for name in cases]


@pytest.mark.parametrize(("kind", "name"), CASES)
def test_every_fault_is_named(
    kind: str,
    name: str,
    paper_document: dict[str, Any],
    driven_document: dict[str, Any],
    load: Callable[[Mapping[str, Any]], Any],
) -> None:
    case, document = REFUSED[kind][name], paper_document if kind == "liquid_ring" else driven_document
    for path in case.get("remove", ()):
        table, _, key = path.rpartition(".")
        del (document[table] if table else document)[key]
    for path, value in case.get("change", {}).items():
        table, _, key = path.rpartition(".")
        (document.setdefault(table, {}) if table else document)[key] = value
    with pytest.raises(SceneError) as caught:
        load(document)
    assert [str(fault).partition("my_disc.toml: ")[2] for fault in caught.value.faults] == case["says"]
    assert all(map(str.isprintable, str(caught.value).splitlines()))
