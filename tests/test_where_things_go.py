"""The page for newcomers names folders and files that exist, and the glossary defines each term once."""

from __future__ import annotations

import re
from collections import Counter
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
CODE = re.compile(r"`([\w./-]*/[\w./-]*)`")


def missing_paths(text: str) -> list[str]:
    """Paths in code type, those with a slash, that the tree does not have."""
    return [path for path in CODE.findall(text) if not (ROOT / path).exists()]


def glossary_terms() -> list[str]:
    lines = (ROOT / "docs/glossary.md").read_text(encoding="utf-8").splitlines()
    rows = [line.strip("|").split("|") for line in lines if line.startswith("|") and "---" not in line]
    assert all(len(row) == 4 for row in rows)
    assert all(row[3].strip() for row in rows)
    return [row[0].strip() for row in rows if row[0].strip() != "term"]


def test_every_path_of_the_page_exists() -> None:
    page = (ROOT / "docs/where-things-go.md").read_text(encoding="utf-8")
    assert len(CODE.findall(page)) > 30
    assert missing_paths(page) == []


def test_each_term_is_defined_once() -> None:
    terms = Counter(glossary_terms())
    assert len(terms) > 50
    assert [term for term, count in terms.items() if count > 1] == []


def test_the_short_selection_names_tests_that_exist() -> None:
    makefile = (ROOT / "Makefile").read_text(encoding="utf-8")
    paths = re.findall(r"\btests/[\w./]+", makefile)
    assert len(paths) > 5
    assert [path for path in paths if not (ROOT / path).exists()] == []
