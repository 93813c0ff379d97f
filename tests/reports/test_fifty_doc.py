"""The page for designers on k = 50 holds the program's numbers."""

from __future__ import annotations

from doc_tables import PARTS, fresh, text_of

PAGE = "docs/is-k-50-right.md"


def test_the_page_says_what_the_program_finds() -> None:
    page = text_of(PAGE)
    assert fresh(page, PARTS[PAGE]()) == page, "run tools/generate.py --write docs"
