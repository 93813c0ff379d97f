"""Page of figures that answer a pointer and the arrow keys with their values, in one file."""

from __future__ import annotations

import base64
import hashlib
import json
from collections.abc import Sequence
from dataclasses import dataclass
from importlib.resources import files
from typing import Any, Final

import jinja2
import numpy as np
from numpy.typing import ArrayLike

from ringbalance.panels.document import joined, module_text
from ringbalance.reports.figure import DARK, LIGHT, Drawing
from ringbalance.results.numbers import display_unit, short

READING_FILE: Final = "figures.html"
"""Name of the file, beside a report or in the folder of a sweep."""
_DIGITS: Final = 4
_START: Final = 'figures.start(document, JSON.parse(document.getElementById("content").textContent));\n'


@dataclass(frozen=True, kw_only=True)
class ReadingColumn:
    """Column of the values that are read out."""

    name: str
    values: Sequence[Any]
    """By row, SI or text; None where not known."""
    unit: str = ""
    """SI unit of numbers; empty for texts and counts."""

    def texts(self) -> tuple[str, list[str]]:
        """Unit that suits all values, and their texts."""
        if not self.unit:
            return "", ["" if value is None else str(value) for value in self.values]
        display = display_unit(self.unit, *self.values)
        texts = [
            "" if value is None else short(value * display.factor, digits=_DIGITS) for value in self.values
        ]
        return "" if display.symbol == "1" else display.symbol, texts


@dataclass(frozen=True, kw_only=True)
class ReadableFigure:
    """A figure with the positions of the rows in it."""

    drawing: Drawing
    label: str
    """Short name."""
    caption: str
    curves: Sequence[tuple[ArrayLike, ArrayLike]]
    """Values by row along and up each of the drawing's frames, in its axes' numbers; NaN: not drawn."""

    def document(self) -> dict[str, Any]:
        """Boxes of the frames and positions of the rows, pt."""
        frames = []
        for frame, (x, y) in zip(self.drawing.frames, self.curves, strict=False):
            at = np.round(frame.places(x, y), 1).tolist()
            box = [round(each, 1) for each in (frame.left, frame.top, frame.width, frame.height)]
            frames.append({"box": box, "at": [[v if np.isfinite(v) else None for v in p] for p in at]})
        return {"name": f"figure-{self.drawing.name}", "frames": frames}


def figures_page(
    title: str,
    source: str,
    columns: Sequence[ReadingColumn],
    figures: Sequence[ReadableFigure],
    *,
    start: int,
    along_x: bool,
    back: tuple[str, str] = ("", ""),
    has_dark: bool,
) -> str:
    """HTML page of figures over the same rows.

    Args: `source`: sentence on what is shown. `start`: row read out at first. `along_x`: True if rows lie
        along the x axis. `back`: file that refers to this page, and words for it. `has_dark`:
        True if the figures have colours of a dark page.
    """
    texts = [column.texts() for column in columns]
    content = {
        "heads": [[column.name, unit] for column, (unit, _) in zip(columns, texts, strict=True)],
        "rows": [list(row) for row in zip(*(values for _, values in texts), strict=True)],
        "start": start,
        "along": along_x,
        "figures": [figure.document() for figure in figures],
    }
    script = joined({"figures": module_text("figures")}) + _START
    template = files("ringbalance.reports").joinpath("templates", READING_FILE).read_text(encoding="utf-8")
    page: str = jinja2.Template(template, autoescape=True, undefined=jinja2.StrictUndefined).render(
        title=title,
        source=source,
        figures=[
            {
                "name": f"figure-{figure.drawing.name}",
                "label": figure.label,
                "caption": figure.caption,
                "svg": figure.drawing.svg,
            }
            for figure in figures
        ],
        back=back[0],
        back_words=back[1],
        light=_rules(LIGHT),
        dark=_rules(DARK) if has_dark else "",
        digest=base64.b64encode(hashlib.sha256(script.encode()).digest()).decode(),
        # Nothing in the data can end its element.
        content=json.dumps(content, ensure_ascii=False, separators=(",", ":")).replace("<", "\\u003c"),
        script=script,
    )
    return page


def _rules(scheme: Any) -> str:
    return "".join(f"{name}:{colour};" for name, colour in scheme.items())
