"""Report and annex from their template and the evidence alone: nothing is calculated, nothing is fetched."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Iterable, Mapping
from functools import cache
from importlib.resources import files
from typing import Final

import jinja2
from markupsafe import Markup, escape

from ringbalance.reports import summary
from ringbalance.reports.equations import GLYPHS, share_glyphs
from ringbalance.reports.figure import DARK, LIGHT
from ringbalance.reports.page import ANNEX, DOCUMENTS, PageContent, page_content
from ringbalance.reports.prose import input_name, key_words, series
from ringbalance.reports.section import Record
from ringbalance.reports.sections import PREFIXES
from ringbalance.reports.traced import FILTERS, finished, listing_of, table_of
from ringbalance.scene.describe import usual_name

_STYLED: Final = re.compile(r'(<(?:path|g|text|tspan|use|rect|line|polyline|image)\b[^>]*?) style="([^"]*)"')
_PART_ID: Final = re.compile(r'(<(?:path|g|defs|text)\b[^>]*?)( id="([^"]*)")')
_CLASSES: Final = "/* classes */"


def render(evidence: Record, *, pictures: Mapping[str, bytes] | None = None) -> dict[str, str]:
    """The self-contained HTML documents by file name, the report last.

    Args: `pictures`: PNG bytes by the file names that the evidence lists; a picture that is missing is left
    out.
    Raises: KeyError: an evidence document that lacks a part.
    """
    return render_pages(page_content(evidence, pictures=pictures))


def render_pages(content: PageContent, *, documents: Iterable[str] = tuple(DOCUMENTS)) -> dict[str, str]:
    """Fills the template, once for each document."""
    return {file: _page(content, file) for file in documents}


@cache
def _environment() -> jinja2.Environment:
    """Keeps the templates, each compiled once."""
    environment = jinja2.Environment(
        loader=jinja2.FunctionLoader(_template),
        autoescape=True,
        undefined=jinja2.StrictUndefined,
        finalize=finished,
    )
    environment.filters |= {
        "tone": summary.tone,
        "verbatim": escape,
        "series": series,
        "opening": lambda text: f"{text[0].upper()}{text[1:]}",
        "as_in": lambda name, names: names.get(name, name),
        "sentence": lambda text: f"{text[0].upper()}{text[1:].rstrip('.')}.",
        "input_name": input_name,
        "key_words": key_words,
        "usual_name": usual_name,
        **FILTERS,
    }
    environment.globals |= {"table_of": table_of, "listing_of": listing_of}
    environment.tests |= {"verdict": summary.is_verdict}
    return environment


def _page(content: PageContent, file: str) -> str:
    document = DOCUMENTS[file]
    page = (
        _environment()
        .get_template("report.html")
        .render(
            content.context,
            document=document,
            numbered=_Numbers(PREFIXES[document["place"]]),
            annex_file=ANNEX,
            sections=[s for s in content.context["sections"] if s["place"] == document["place"]],
            style=Markup(_style(content.context["running_head"])),
            glyphs=Markup(GLYPHS),
        )
    )
    return _share_styles(share_glyphs(page)) + "\n"


class _Numbers:
    """Numbers of a document's figures, tables and equations, in the order in which they are set."""

    def __init__(self, prefix: str) -> None:
        self._prefix = prefix
        self._counts: Counter[str] = Counter()

    def __call__(self, kind: str, form: str = "") -> str:
        self._counts[kind] += 1
        number = f"{self._prefix}{self._counts[kind]}"
        return form % number if form else f"{kind} {number}"


def _share_styles(page: str) -> str:
    """Each style that drawings repeat, once, as a class, and no id that nothing refers to."""
    used = {*re.findall(r"[#(]#?([\w.-]+)[\")]", page)}
    page = _PART_ID.sub(lambda match: match[1] + (match[2] if match[3] in used else ""), page)
    names: dict[str, str] = {}

    def named(match: re.Match[str]) -> str:
        tag, style = match.groups()
        if " class=" in tag:
            return match[0]
        return f'{tag} class="{names.setdefault(style, f"s{len(names)}")}"'

    bare = _STYLED.sub(named, page)
    rules = "".join(f".{name}{{{style}}}" for style, name in names.items())
    return bare.replace(_CLASSES, rules, 1)


def _template(name: str) -> str:
    return files("ringbalance.reports").joinpath("templates", name).read_text(encoding="utf-8")


def _style(running_head: str) -> str:
    blocks = ["".join(f"{key}:{value};" for key, value in colours.items()) for colours in (LIGHT, DARK)]
    text = _template("style.css").replace("{{ running_head }}", _css_string(running_head))
    return text.replace("{{ figure_light }}", blocks[0]).replace("{{ figure_dark }}", blocks[1])


def _css_string(text: str) -> str:
    """Every sign outside the plainest is escaped, so that a scene's name cannot leave its string."""
    return "".join(c if c.isalnum() or c in " .,-()" else f"\\{ord(c):x} " for c in text)
