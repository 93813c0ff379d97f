"""Colours of every figure and picture on a light and a dark page; camera and lettering of 3-D pictures."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

import matplotlib
import numpy as np
from matplotlib.colors import Colormap
from matplotlib.ticker import MaxNLocator
from PIL import Image, ImageDraw, ImageFont

from ringbalance.scene.arrays import FloatArray

PICTURE: Final = (1200, 800)
"""Pixels of a finished picture."""


@dataclass(frozen=True, kw_only=True)
class Palette:
    """Colours of one kind of page. The lines tell apart for deuteranopes and protanopes, and as text."""

    background: str
    ink: str
    muted: str
    grid: str
    paper: str
    """The paper's formulas."""
    found: str
    """What this program found."""
    third: str
    fourth: str
    fifth: str


LIGHT: Final = Palette(
    background="#ffffff",
    ink="#1d2530",
    muted="#5b6675",
    grid="#dfe3e8",
    paper="#9d6600",
    found="#1757ee",
    third="#0a4420",
    fourth="#cf1fb0",
    fifth="#565400",
)
DARK: Final = Palette(
    background="#12171e",
    ink="#e4e8ee",
    muted="#9aa6b5",
    grid="#2c3540",
    paper="#ff9d3c",
    found="#5f86ff",
    third="#8cf07a",
    fourth="#a084c4",
    fifth="#b58a1a",
)


@dataclass(frozen=True, kw_only=True)
class Theme:
    """Colours of a picture, so that it sits on the page without a frame."""

    name: str
    palette: Palette
    metal: str
    mark: str
    edge: str

    @property
    def background(self) -> str:
        """Of the page."""
        return self.palette.background

    @property
    def ink(self) -> str:
        """Of the page's text."""
        return self.palette.ink

    @property
    def tube(self) -> str:
        """As in figures."""
        return self.palette.paper


THEMES: Final = (
    Theme(name="light", palette=LIGHT, metal="#c3cad2", mark=LIGHT.ink, edge=LIGHT.muted),
    Theme(name="dark", palette=DARK, metal="#66717e", mark="#ffffff", edge=DARK.muted),
)


_FONT_SIZE: Final = 34
"""px of the finished picture."""


@dataclass(frozen=True, kw_only=True)
class Label:
    """One label at a place of the picture."""

    text: str
    place: tuple[float, float]
    """Pixels from the upper left corner; of the thing that is named."""
    shift: tuple[float, float] = (0.0, 0.0)
    """Of the text's middle from the place, pixels; a leader is drawn when it is not zero."""
    size: int = _FONT_SIZE


@dataclass(frozen=True, kw_only=True)
class Bar:
    """A vertical colour bar with its title and unit."""

    title: str
    colours: Colormap
    low: float
    high: float
    ticks: tuple[float, ...]
    labels: tuple[str, ...]

    @classmethod
    def of(cls, title: str, colours: Colormap, limits: tuple[float, float]) -> Bar:
        """A colour bar with about five round ticks within its limits."""
        low, high = limits
        ticks = [
            float(t) for t in MaxNLocator(5, steps=[1, 2, 5, 10]).tick_values(low, high) if low <= t <= high
        ]
        labels = tuple(f"{tick:g}".replace("-", "\N{MINUS SIGN}") for tick in ticks)
        return cls(title=title, colours=colours, low=low, high=high, ticks=tuple(ticks), labels=labels)


def _font(size: int, *, bold: bool = False) -> ImageFont.FreeTypeFont:
    """The sans-serif font that comes with matplotlib, so that every machine draws the same letters.

    Args: `size`: px.
    """
    name = "DejaVuSans-Bold.ttf" if bold else "DejaVuSans.ttf"
    return ImageFont.truetype(str(Path(matplotlib.get_data_path()) / "fonts" / "ttf" / name), size)


def letter(
    image: Image.Image, *, labels: Sequence[Label], bar: Bar, ink: str, ground: str, scale: int
) -> Image.Image:
    """Draws labels and a colour bar onto a picture."""
    result = image.copy()
    pen = ImageDraw.Draw(result)
    for label in labels:
        _draw_label(pen, label, ink, ground, scale)
    _draw_bar(pen, bar, result.height, ink, scale)
    return result


def _draw_label(pen: ImageDraw.ImageDraw, label: Label, ink: str, ground: str, scale: int) -> None:
    (x, y), (dx, dy) = label.place, label.shift
    anchor = "mm"
    if dx or dy:
        for colour, width in ((ground, 6 * scale), (ink, 2 * scale)):
            pen.line([(x, y), (x + dx, y + dy)], fill=colour, width=width)
        dot = 4 * scale
        pen.ellipse([x - dot, y - dot, x + dot, y + dot], fill=ink)
        # The leader ends at the text, above or below it.
        anchor = "md" if dy < 0 else "ma"
    face = _font(label.size * scale, bold=label.size > _FONT_SIZE)
    # No label is cut by the edge of the picture.
    half = pen.textlength(label.text, font=face) / 2 + 5 * scale
    pen.text(
        (min(max(x + dx, half), pen.im.size[0] - half), y + dy),
        label.text,
        font=face,
        fill=ink,
        anchor=anchor,
        stroke_width=5 * scale,
        stroke_fill=ground,
    )


def _draw_bar(pen: ImageDraw.ImageDraw, bar: Bar, height: int, ink: str, scale: int) -> None:
    left, right, top, bottom = 32 * scale, 67 * scale, round(0.24 * height), round(0.82 * height)
    shades = np.rint(255 * np.asarray(bar.colours(np.linspace(1, 0, bottom - top)))).astype(int)
    for row, (red, green, blue, _) in enumerate(shades.tolist(), start=top):
        pen.line([(left, row), (right, row)], fill=(red, green, blue))
    pen.rectangle([left, top, right, bottom], outline=ink, width=2 * scale)
    pen.text((left, top - 22 * scale), bar.title, font=_font(_FONT_SIZE * scale), fill=ink, anchor="ls")
    for tick, text in zip(bar.ticks, bar.labels, strict=True):
        y = bottom - (tick - bar.low) / (bar.high - bar.low) * (bottom - top)
        pen.line([(right, y), (right + 8 * scale, y)], fill=ink, width=2 * scale)
        pen.text((right + 14 * scale, y), text, font=_font((_FONT_SIZE - 3) * scale), fill=ink, anchor="lm")


def look(
    plotter: Any,
    *,
    direction: tuple[float, float, float],
    up: tuple[float, float, float],
    zoom: float,
    bounds: tuple[float, ...],
    lift: float,
) -> None:
    """Points the camera at a box from a direction; the box stands a little right, the bar has the left.

    Args: `direction`: from the box to the camera, mm.
    """
    middle = np.array(bounds).reshape(3, 2).mean(axis=1)
    plotter.camera_position = [tuple(middle + np.array(direction)), tuple(middle), up]
    plotter.camera.view_angle = 18
    plotter.reset_camera(bounds=bounds, render=False)
    plotter.camera.zoom(zoom)
    plotter.camera.SetWindowCenter(-0.12, -lift)


def label_at(
    text: str, place: FloatArray, *, shift: tuple[float, float] = (0, 0), size: int = _FONT_SIZE
) -> tuple[FloatArray, Label]:
    """A label at a place of the scene; its place in the picture is found once the camera stands.

    Args: `place`: mm, shape (3,). `size`: px.
    """
    return place, Label(text=text, place=(0, 0), shift=shift, size=size)
