"""The report page from its templates and the evidence alone: nothing is calculated, nothing is fetched."""

from __future__ import annotations

from collections.abc import Mapping
from importlib.resources import files

import jinja2
from markupsafe import Markup, escape

from ringbalance.reports import summary
from ringbalance.reports.equations import GLYPHS, share_glyphs
from ringbalance.reports.figures.style import DARK, LIGHT
from ringbalance.reports.page import PageContent, page_content
from ringbalance.reports.prose import typeset
from ringbalance.reports.section import Record


def render(evidence: Record, *, pictures: Mapping[str, bytes] | None = None) -> str:
    """One self-contained HTML page.

    Args: `pictures`: PNG bytes by the file names that the evidence lists; a picture that is missing is left
    out.
    Raises: KeyError: an evidence document that lacks a part.
    """
    return render_page(page_content(evidence, pictures=pictures))


def render_page(content: PageContent) -> str:
    """Fills the templates."""
    environment = jinja2.Environment(
        loader=jinja2.FunctionLoader(_template),
        autoescape=True,
        trim_blocks=True,
        undefined=jinja2.StrictUndefined,
        finalize=_finished,
    )
    environment.filters |= {"tone": summary.tone, "verbatim": escape}
    page = environment.get_template("report.html").render(
        content.context, style=Markup(_style()), glyphs=Markup(GLYPHS)
    )
    return share_glyphs(page) + "\n"


def _finished(value: object) -> object:
    """Text is typeset as it goes onto the page, but for markup and what is marked `verbatim`."""
    return typeset(value) if isinstance(value, str) and not isinstance(value, Markup) else value


def _template(name: str) -> str:
    return files("ringbalance.reports").joinpath("templates", name).read_text(encoding="utf-8")


def _style() -> str:
    blocks = ["".join(f"{key}:{value};" for key, value in colours.items()) for colours in (LIGHT, DARK)]
    text = _template("style.css")
    return text.replace("{{ figure_light }}", blocks[0]).replace("{{ figure_dark }}", blocks[1])
