"""Figures on one sheet: an SVG file that needs no page about it, for word processors and printers."""

from __future__ import annotations

import re
from collections.abc import Sequence
from typing import Final

from ringbalance.reports.figures.style import LIGHT, NARROW, WIDE, Drawing

_POINTS: Final = 72
_MARGIN: Final = 18.0
_FONT: Final = "DejaVu Sans, Arial, sans-serif"


def sheet(drawings: Sequence[Drawing]) -> str:
    """All drawings below each other, narrow ones in pairs, in the colours of a light page."""
    placed, x, y, row, edge = [], _MARGIN, _MARGIN, 0.0, _MARGIN + _POINTS * WIDE
    for drawing in drawings:
        width = _POINTS * (WIDE if drawing.wide else NARROW)
        if x > _MARGIN and x + width > edge:
            x, y, row = _MARGIN, y + row + _MARGIN, 0.0
        height = _height(drawing)
        place = f'<svg x="{x:g}" y="{y:g}" width="{width:g}" height="{height:g}" overflow="visible" '
        placed.append(drawing.svg.replace("<svg ", place, 1))
        x, row = x + width + _MARGIN, max(row, height)
    return _file("\n".join(placed), edge + _MARGIN, y + row + _MARGIN)


def _height(drawing: Drawing) -> float:
    box = re.search(r'viewBox="0 0 [\d.]+ ([\d.]+)"', drawing.svg)
    if box is None:
        raise ValueError(f"the figure {drawing.name} has no viewBox")
    return float(box[1])


def _file(body: str, width: float, height: float) -> str:
    """Word processors know neither variables nor schemes."""
    body = body.replace("var(--fig-font)", _FONT)
    for variable, colour in LIGHT.items():
        body = body.replace(f"var({variable})", colour)
    size = f'width="{width:g}pt" height="{height:g}pt" viewBox="0 0 {width:g} {height:g}"'
    return (
        f'<?xml version="1.0" encoding="UTF-8"?>\n<svg xmlns="http://www.w3.org/2000/svg" {size}>\n'
        f'<rect width="100%" height="100%" fill="{LIGHT["--fig-surface"]}"/>\n{body}\n</svg>\n'
    )
