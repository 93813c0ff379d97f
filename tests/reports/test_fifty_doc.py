"""The page for designers on k = 50 holds the program's numbers."""

from __future__ import annotations

import re
from pathlib import Path

import pytest
from drag_coefficient_doc import document_tables

PAGE = Path(__file__).parents[2] / "docs" / "is-k-50-right.md"
NAMES = ("liquids", "bores", "rule", "hidden")


@pytest.fixture(scope="module")
def tables() -> dict[str, str]:
    return document_tables()


def test_nothing_else_is_generated(tables: dict[str, str]) -> None:
    assert tuple(tables) == NAMES
    assert tuple(re.findall(r"^<!-- (\w+) -->$", PAGE.read_text(encoding="utf-8"), re.MULTILINE)) == NAMES


@pytest.mark.parametrize("name", NAMES)
def test_the_page_says_what_the_program_finds(name: str, tables: dict[str, str]) -> None:
    found = re.search(
        rf"<!-- {name} -->\n(.*?)\n<!-- /{name} -->", PAGE.read_text(encoding="utf-8"), re.DOTALL
    )
    assert found, name
    told = "run: python tools/drag_coefficient_doc.py docs/is-k-50-right.md"
    assert found[1].strip() == tables[name].strip(), told
