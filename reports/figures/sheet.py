"""Figures on one sheet: an SVG file that needs no page about it, for word processors and printers."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

from ringbalance.reports.figures.style import NARROW, WIDE, Drawing, as_file

_POINTS: Final = 72
_MARGIN: Final = 18.0


def sheet(drawings: Sequence[Drawing]) -> str:
    """All drawings below each other, narrow ones in pairs, in the colours of a light page."""
    placed, x, y, row, edge = [], _MARGIN, _MARGIN, 0.0, _MARGIN + _POINTS * WIDE
    for drawing in drawings:
        width = _POINTS * (WIDE if drawing.wide else NARROW)
        if x > _MARGIN and x + width > edge:
            x, y, row = _MARGIN, y + row + _MARGIN, 0.0
        height = drawing.size[1]
        place = f'<svg x="{x:g}" y="{y:g}" width="{width:g}" height="{height:g}" overflow="visible" '
        placed.append(drawing.svg.replace("<svg ", place, 1))
        x, row = x + width + _MARGIN, max(row, height)
    return as_file("\n".join(placed), edge + _MARGIN, y + row + _MARGIN)
