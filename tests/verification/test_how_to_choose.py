"""The page on choosing says what is measured now."""

from __future__ import annotations

import importlib.util
import re
from pathlib import Path
from types import ModuleType

import pytest

ROOT = Path(__file__).resolve().parents[2]


@pytest.fixture(scope="module")
def tool() -> ModuleType:
    spec = importlib.util.spec_from_file_location("choose_table", ROOT / "tools" / "choose_table.py")
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def rows(tool: ModuleType, name: str) -> list[str]:
    """Rows of one table as they stand on the page."""
    found = {match[1]: match[0] for match in tool.BLOCK.finditer(tool.PAGE.read_text(encoding="utf-8"))}
    return [line for line in found[name].splitlines() if line.startswith("| ")][1:]


def cells(row: str) -> list[tuple[str, float]]:
    """Model and error of each cell between a row's title and its last column; the top has no error."""
    told = [re.fullmatch(r"(.*) \((.*)\)", cell.strip()) for cell in row.split("|")[2:-2]]
    return [(m[1], 0.0 if m[2] == "as the finest" else float(m[2])) for m in told if m is not None]


def test_quick_rows_are_what_is_measured(tool: ModuleType) -> None:
    for told, now in zip(rows(tool, "paper"), tool.table("paper", only=tool.QUICK), strict=False):
        assert told.split("|")[1] == now.split("|")[1]
        assert [name for name, _ in cells(told)] == [name for name, _ in cells(now)]
        for (_, page), (_, measured) in zip(cells(told), cells(now), strict=True):
            assert measured / 5 <= page <= 5 * measured


def test_every_table_is_there(tool: ModuleType) -> None:
    for name, (_, quantities) in tool.scenes().items():
        assert len(rows(tool, name)) == len(quantities)


@pytest.mark.heavy
def test_the_whole_page_is_what_is_measured(tool: ModuleType) -> None:
    text = tool.PAGE.read_text(encoding="utf-8")
    assert tool.page(text) == text
