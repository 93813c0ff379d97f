"""Equations are set in the text's colour, and one copy of a letter serves them all."""

from __future__ import annotations

import json
import lzma
import re
from xml.etree import ElementTree

import doc_tables
import pytest
import typesetting

from ringbalance.reports.prose import GLYPHS, equation_svg, equations, share_glyphs


@pytest.mark.parametrize("name", sorted(equations()))
def test_every_equation_is_set_in_the_text_colour(name: str) -> None:
    item = equations()[name]
    svg = equation_svg(item.latex, item.words, f"eq-{name}")
    root = ElementTree.fromstring(svg)
    assert root.attrib["aria-label"] == item.words
    assert "currentColor" in svg
    assert not re.search(r"#[0-9a-fA-F]{6}\b|rgb\(", svg)
    assert all(identifier.startswith(f"eq-{name}-") for identifier in re.findall(r'id="([^"]+)"', svg))


def test_the_kept_equations_are_those_of_the_program_as_set_today() -> None:
    stored, now = doc_tables.EQUATIONS.read_bytes(), doc_tables.equations()
    same = json.loads(lzma.decompress(stored)) == json.loads(lzma.decompress(now))
    assert same, "run tools/generate.py --write docs"


def test_glyphs_are_shared_and_all_found() -> None:
    parts = [equation_svg(equations()[name].latex, "a", name) for name in ("eq7", "eq12")]
    page = share_glyphs(f"{GLYPHS}{parts[0]}{parts[1]}")
    ids = re.findall(r'<symbol id="([^"]+)"', page)
    used = re.findall(r'href="#([^"]+)"', page)
    assert len(ids) == len(set(ids))
    assert set(used) == set(ids)
    assert len(used) == sum(part.count("<use") for part in parts)
    assert len(page) < len(parts[0]) + len(parts[1])


def test_latex_that_is_not_kept_is_shown_as_it_is() -> None:
    assert equation_svg(r"a < \frac{b}{c}", "words", "x") == r"<code>a &lt; \frac{b}{c}</code>"


def test_latex_that_cannot_be_set_is_refused() -> None:
    with pytest.raises(ValueError, match="cannot be set"):
        typesetting.typeset(r"\frac{a}")
