"""Equations of the report, set as SVG in the text's colour."""

from __future__ import annotations

import json
import lzma
import re
import tomllib
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from importlib.resources import files
from typing import Final, cast

from markupsafe import escape

GLYPHS: Final = "<!-- glyphs -->"
_SYMBOL: Final = re.compile(r'<symbol id="([^"]+)"([^>]*/>|[^>]*>.*?</symbol>)', re.DOTALL)
_USE: Final = re.compile(r'href="#([^"]+)"')


@dataclass(frozen=True, kw_only=True)
class _Equation:
    """One displayed equation."""

    latex: str
    words: str
    """Read aloud, or by those who cannot see it."""
    source: str
    """Where it stands in the paper, or what it is."""


@cache
def equations() -> Mapping[str, _Equation]:
    """The displayed equations of the report's sections, by name."""
    text = files("ringbalance.reports").joinpath("templates", "equations.toml").read_text(encoding="utf-8")
    return {name: _Equation(**entry) for name, entry in tomllib.loads(text).items()}


@cache
def equation_svg(latex: str, words: str, name: str) -> str:
    """One equation as an SVG element in the current text colour, sized in the text's em.

    One that is not kept, as of a case of the user's own, is shown as its LaTeX.

    Args: `name`: prefix of every id within, so that two equations on one page do not share glyphs.
    """
    text = _kept().get(latex)
    if text is None:
        return f"<code>{escape(latex)}</code>"
    text = re.sub(r'\bid="', f'id="{name}-', text)
    text = re.sub(r'href="#', f'href="#{name}-', text)
    text = re.sub(r' width="([\d.]+)" height="([\d.]+)"', _in_em, text, count=1)
    label = words.replace("&", "&amp;").replace('"', "&quot;").replace("<", "&lt;")
    return text.replace("<svg ", f'<svg role="img" aria-label="{label}" class="math" ', 1)


@cache
def _kept() -> Mapping[str, str]:
    """SVG of the program's own equations by their LaTeX, as `tools/generated_docs.py` has set them."""
    packed = files("ringbalance.reports").joinpath("data", "equations.json.xz").read_bytes()
    return cast(Mapping[str, str], json.loads(lzma.decompress(packed)))


def share_glyphs(page: str) -> str:
    """Keeps one copy of each glyph for all equations of a page: equations are mostly the same letters."""
    names: dict[str, str] = {}
    renamed: dict[str, str] = {}
    for match in _SYMBOL.finditer(page):
        content = match[2]
        renamed[match[1]] = names.setdefault(content, f"glyph-{len(names)}")
    bare = _SYMBOL.sub("", page)
    used = _USE.sub(lambda match: f'href="#{renamed.get(match[1], match[1])}"', bare)
    sheet = "".join(f'<symbol id="{name}"{content}' for content, name in names.items())
    hidden = 'width="0" height="0" style="position:absolute" aria-hidden="true"'
    return used.replace(GLYPHS, f'<svg xmlns="http://www.w3.org/2000/svg" {hidden}>{sheet}</svg>', 1)


def _in_em(size: re.Match[str]) -> str:
    width, height = (float(group) / 16 for group in size.groups())
    return f' style="width:{width:.3f}em;height:{height:.3f}em"'
