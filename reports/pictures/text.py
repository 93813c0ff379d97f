"""Lettering of the 3-D pictures: labels with leaders and a colour bar, set with a proper font."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Final

import matplotlib
import numpy as np
from matplotlib.colors import Colormap
from PIL import Image, ImageDraw, ImageFont

FONT_SIZE: Final = 34
"""px of the finished picture."""
BAR_SHADES: Final = 64


@dataclass(frozen=True, kw_only=True)
class Label:
    """One label at a place of the picture."""

    text: str
    place: tuple[float, float]
    """Pixels from the upper left corner; of the thing that is named."""
    shift: tuple[float, float] = (0.0, 0.0)
    """Of the text's middle from the place, pixels; a leader is drawn when it is not zero."""
    size: int = FONT_SIZE


@dataclass(frozen=True, kw_only=True)
class Bar:
    """A vertical colour bar with its title and unit."""

    title: str
    colours: Colormap
    low: float
    high: float
    ticks: tuple[float, ...]
    labels: tuple[str, ...]


def font(size: int, *, bold: bool = False) -> ImageFont.FreeTypeFont:
    """The sans-serif font that comes with matplotlib, so that every machine draws the same letters.

    Args: `size`: px.
    """
    name = "DejaVuSans-Bold.ttf" if bold else "DejaVuSans.ttf"
    return ImageFont.truetype(str(Path(matplotlib.get_data_path()) / "fonts" / "ttf" / name), size)


def letter(
    image: Image.Image, *, labels: Sequence[Label], bar: Bar | None, ink: str, ground: str, scale: int
) -> Image.Image:
    """Draws labels and a colour bar onto a picture."""
    result = image.copy()
    pen = ImageDraw.Draw(result)
    for label in labels:
        _draw_label(pen, label, ink, ground, scale)
    if bar is not None:
        _draw_bar(pen, bar, result.height, ink, scale)
    return result


def _draw_label(pen: ImageDraw.ImageDraw, label: Label, ink: str, ground: str, scale: int) -> None:
    (x, y), (dx, dy) = label.place, label.shift
    anchor = "mm"
    if dx or dy:
        for colour, width in ((ground, 7 * scale), (ink, 2 * scale)):
            pen.line([(x, y), (x + dx, y + dy)], fill=colour, width=width)
        dot = 5 * scale
        pen.ellipse([x - dot, y - dot, x + dot, y + dot], fill=ink)
        # The leader ends at the text, above or below it.
        anchor = "md" if dy < 0 else "ma"
    face = font(label.size * scale, bold=label.size > FONT_SIZE)
    pen.text(
        (x + dx, y + dy),
        label.text,
        font=face,
        fill=ink,
        anchor=anchor,
        stroke_width=6 * scale,
        stroke_fill=ground,
    )


def _bar_box(height: int, scale: int) -> tuple[int, int, int, int]:
    """Left, right, top and bottom of the bar in a picture of a height."""
    return 40 * scale, 84 * scale, round(0.24 * height), round(0.82 * height)


def shade_bar(image: Image.Image, bar: Bar) -> Image.Image:
    """Fills the frame of the colour bar, in few shades, once the rest has been brought to a palette.

    Args: `image`: finished picture with the bar's frame.
    """
    result = image.copy()
    pen = ImageDraw.Draw(result)
    left, right, top, bottom = _bar_box(image.height, 1)
    shades = np.rint(255 * np.asarray(bar.colours(np.linspace(1, 0, BAR_SHADES)))).astype(int)
    for row in range(top + 3, bottom - 2):
        red, green, blue, _ = (int(part) for part in shades[(row - top) * BAR_SHADES // (bottom - top)])
        pen.line([(left + 3, row), (right - 3, row)], fill=(red, green, blue))
    return result


def with_palette(image: Image.Image) -> Image.Image:
    """The same picture with a palette, which takes a third of the bytes.

    Raises: ValueError: more than 256 colours.
    """
    pixels = np.asarray(image.convert("RGB"), dtype=np.uint32)
    codes = pixels @ np.array([65536, 256, 1], dtype=np.uint32)
    colours, places = np.unique(codes, return_inverse=True)
    if colours.size > 256:
        raise ValueError(f"a palette holds 256 colours, not {colours.size}")
    result = Image.fromarray(places.reshape(codes.shape).astype(np.uint8), mode="P")
    result.putpalette(
        np.stack([colours >> 16, colours >> 8 & 255, colours & 255], axis=1).astype(np.uint8).tobytes()
    )
    return result


def _draw_bar(pen: ImageDraw.ImageDraw, bar: Bar, height: int, ink: str, scale: int) -> None:
    left, right, top, bottom = _bar_box(height, scale)
    pen.rectangle([left, top, right, bottom], outline=ink, width=2 * scale)
    pen.text((left, top - 28 * scale), bar.title, font=font(FONT_SIZE * scale), fill=ink, anchor="ls")
    for tick, text in zip(bar.ticks, bar.labels, strict=True):
        y = bottom - (tick - bar.low) / (bar.high - bar.low) * (bottom - top)
        pen.line([(right, y), (right + 10 * scale, y)], fill=ink, width=2 * scale)
        pen.text((right + 18 * scale, y), text, font=font((FONT_SIZE - 4) * scale), fill=ink, anchor="lm")
