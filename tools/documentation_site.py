"""Additions to Sphinx for the site: order of pages, equations, first page. An extension of docs/conf.py."""

from __future__ import annotations

import re
import shutil
from pathlib import Path
from typing import Any, Final

from docutils import nodes
from sphinx.application import Sphinx
from typesetting import typeset, typeset_inline

import ringbalance as rb

LIST_OF_PAGES: Final = "docs/README"
_SECTION: Final = re.compile(r"^## (.+?)\n(.*?)(?=^## |\Z)", re.DOTALL | re.MULTILINE)
_ENTRY: Final = re.compile(r"^\* \[[^\]]+\]\(([^)]+)\.md\)", re.MULTILINE)


def toctrees(page: str) -> str:
    """The lists of a page of links as hidden tables of contents, one a section."""
    return "".join(
        f"\n```{{toctree}}\n:hidden:\n:caption: {title}\n\n{chr(10).join(_ENTRY.findall(body))}\n```\n"
        for title, body in _SECTION.findall(page)
        if _ENTRY.search(body)
    )


def add_order(app: Sphinx, docname: str, source: list[str]) -> None:
    """Give Sphinx the order of the pages in docs/README.md."""
    if docname == app.config.root_doc:
        app.env.note_dependency(f"{LIST_OF_PAGES}.md")
        pages = Path(app.srcdir, f"{LIST_OF_PAGES}.md").read_text(encoding="utf-8")
        source[0] += f"\n```{{toctree}}\n:hidden:\n\n{LIST_OF_PAGES}\n```\n"
        source[0] += toctrees(pages.replace("](", "](docs/").replace("docs/../", ""))


def inline_math(self: Any, node: nodes.math) -> None:
    """Write an equation within a line."""
    self.body.append(f'<span class="math">{typeset_inline(node.astext())}</span>')
    raise nodes.SkipNode


def display_math(self: Any, node: nodes.math_block) -> None:
    """Write an equation on a line of its own."""
    self.body.append(f'<div class="math">{typeset(node.astext())}</div>')
    raise nodes.SkipNode


def add_index(app: Sphinx, error: Exception | None) -> None:
    """Copy README.html to index.html, the page that a browser opens first."""
    if error is None:
        shutil.copyfile(Path(app.outdir, "README.html"), Path(app.outdir, "index.html"))


def add_panel(app: Sphinx, error: Exception | None) -> None:
    """Write the panel of the paper's disc beside the tutorial that speaks of it."""
    if error is None:
        scene = rb.load_scene(rb.bundled_scene("liquid_ring_paper"))
        rb.panel(scene).save(Path(app.outdir, "docs/tutorials/panel.html"))


def setup(app: Sphinx) -> dict[str, Any]:
    """Register the additions with Sphinx."""
    app.add_html_math_renderer("typeset", (inline_math, None), (display_math, None))
    app.connect("source-read", add_order)
    app.connect("build-finished", add_index)
    app.connect("build-finished", add_panel)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
