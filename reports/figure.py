"""Style of every figure, and its frame: axes, units, bands and legend, from values in SI.

Figures are drawn in sentinel colours, which the SVG text then exchanges for CSS variables.  Nothing random,
no date and no fixed colour remains, so the same data gives the same bytes.
"""

from __future__ import annotations

import io
import math
import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from textwrap import fill
from typing import Any, Final, Literal, cast

import matplotlib
import numpy as np
from matplotlib.axes import Axes
from matplotlib.axis import XAxis, YAxis
from matplotlib.colors import LinearSegmentedColormap, to_hex
from matplotlib.figure import Figure
from matplotlib.ticker import AutoLocator, FuncFormatter, NullLocator
from numpy.typing import ArrayLike

from ringbalance.results.numbers import MINUS, display_unit, number, power_of_ten
from ringbalance.scene.arrays import FloatArray

INK: Final = "#010101"
MUTED: Final = "#020202"
GRID: Final = "#030303"
PAPER: Final = "#040404"
"""Colour of the paper's formulas in every figure."""
FOUND: Final = "#050505"
"""Colour of this program's results in every figure."""
THIRD: Final = "#060606"
FOURTH: Final = "#070707"
FIFTH: Final = "#080808"
SURFACE: Final = "#090909"
"""Colour of the page behind the figure."""

AS_PAPER: Final[dict[str, Any]] = {"color": PAPER, "linestyle": (0, (5, 2))}
"""Properties of a line of the paper's formulas."""
REGIME_COLOURS: Final = {
    "siphon": FOUND,
    "separated": THIRD,
    "blocked": FIFTH,
    "reverse": FOURTH,
    "undecided": MUTED,
}
_DASHES: Final = ("-", (0, (5, 1.6)), (0, (1.2, 1.2)), (0, (6, 1.6, 1.2, 1.6)), (0, (3, 1)), (0, (9, 3)))
_LINE_COLOURS: Final = (FOUND, THIRD, FOURTH, FIFTH, PAPER, MUTED)
_MARKERS: Final = ("o", "s", "^", "D", "v", "P")
MAP: Final = tuple(f"#0a0a{step:02x}" for step in range(1, 13))
"""Twelve shades from low to high, for a field in colour."""


def _ramp(low: str, middle: str, high: str) -> LinearSegmentedColormap:
    """Colours from one through another to a third; lines in the text's colour stand out on each."""
    return LinearSegmentedColormap.from_list("ramp", [low, middle, high])


def _shades(ramp: LinearSegmentedColormap) -> tuple[str, ...]:
    return tuple(to_hex(ramp(step / (len(MAP) - 1))) for step in range(len(MAP)))


LIGHT_RAMP: Final = _ramp("#f1f5fa", "#a9c9ec", "#5597d6")
"""Colours of a field on a light page without steps, for pictures that are embedded."""
POINT_RAMP: Final = _ramp("#a9c9ec", "#5597d6", "#0b3a6e")
"""Colours of points on a light page, which stand out from it."""


_PALETTE: Final = {
    INK: ("--fig-ink", "#1d2530", "#e4e8ee"),
    MUTED: ("--fig-muted", "#5b6675", "#9aa6b5"),
    GRID: ("--fig-grid", "#dfe3e8", "#2c3540"),
    PAPER: ("--fig-paper", "#9d6600", "#ff9d3c"),
    FOUND: ("--fig-found", "#1757ee", "#5f86ff"),
    THIRD: ("--fig-third", "#0a4420", "#8cf07a"),
    FOURTH: ("--fig-fourth", "#cf1fb0", "#a084c4"),
    FIFTH: ("--fig-fifth", "#565400", "#b58a1a"),
    SURFACE: ("--fig-surface", "#ffffff", "#12171e"),
    **{
        shade: (f"--fig-map-{step}", light, dark)
        for step, (shade, light, dark) in enumerate(
            zip(
                MAP,
                _shades(LIGHT_RAMP),
                _shades(_ramp("#18202a", "#1d4a7c", "#3f83c9")),
                strict=True,
            )
        )
    },
}
"""By sentinel: CSS variable, and colours on a light and a dark page.

Deuteranopes and protanopes can tell the lines apart; in every line colour text is legible.
"""
LIGHT: Final = {name: light for name, light, _ in _PALETTE.values()}
DARK: Final = {name: dark for name, _, dark in _PALETTE.values()}

_FILE_FONT: Final = "DejaVu Sans, Arial, sans-serif"
_TEXT_PT: Final = 8.8
"""Size of all text: 8 pt where two narrow figures share the width of an A4 page, 13 px on a screen."""
_RC: Final = {
    "svg.fonttype": "none",
    "svg.hashsalt": "ringbalance",
    "font.family": ["DejaVu Sans"],
    "font.size": _TEXT_PT,
    "axes.edgecolor": MUTED,
    "axes.facecolor": "none",
    "axes.labelcolor": INK,
    "axes.labelsize": _TEXT_PT,
    "axes.linewidth": 0.7,
    "axes.spines.right": False,
    "axes.spines.top": False,
    "axes.axisbelow": True,
    "axes.grid": True,
    "axes.unicode_minus": True,
    "grid.color": GRID,
    "grid.linewidth": 0.6,
    "hatch.linewidth": 0.6,
    "figure.facecolor": "none",
    "savefig.facecolor": "none",
    "legend.frameon": False,
    "legend.fontsize": _TEXT_PT,
    "legend.labelcolor": INK,
    "legend.handlelength": 1.8,
    "lines.linewidth": 1.6,
    "lines.solid_capstyle": "round",
    "text.color": INK,
    "xtick.color": MUTED,
    "ytick.color": MUTED,
    "xtick.labelcolor": INK,
    "ytick.labelcolor": INK,
    "xtick.labelsize": _TEXT_PT,
    "ytick.labelsize": _TEXT_PT,
    "xtick.major.width": 0.7,
    "ytick.major.width": 0.7,
    "xtick.minor.visible": False,
    "text.parse_math": False,
}

Paint = Callable[[Axes], object]
"""Function that draws a part of a figure on its axes, SI."""
AxisLabel = tuple[str, str]
"""Name and SI unit of an axis's quantity."""


def line(index: int, *, size: float | None = None) -> dict[str, Any]:
    """Properties of one of several curves: its own colour, with its own dashes or with markers of `size`."""
    index %= len(_LINE_COLOURS)
    if size is None:
        return {"color": _LINE_COLOURS[index], "linestyle": _DASHES[index]}
    return {"color": _LINE_COLOURS[index], "marker": _MARKERS[index], "markersize": size}


@dataclass(frozen=True, kw_only=True)
class Frame:
    """Linear axes of a finished figure: where values lie in its picture."""

    left: float
    top: float
    width: float
    height: float
    """Box of the axes in the picture, pt from its upper left corner."""
    x: tuple[float, float]
    y: tuple[float, float]
    """Values at the ends of the axes."""

    def places(self, x: ArrayLike, y: ArrayLike) -> FloatArray:
        """Positions (n, 2) of points in the picture, pt; NaN where a value is."""
        (left, right), (low, high) = self.x, self.y
        across = self.left + self.width * (np.asarray(x, dtype=np.float64) - left) / (right - left)
        down = self.top + self.height * (high - np.asarray(y, dtype=np.float64)) / (high - low)
        return np.stack(np.broadcast_arrays(across, down), axis=-1)


@dataclass(frozen=True, kw_only=True)
class Drawing:
    """A finished figure."""

    name: str
    """Stem of the file, and prefix of every id in it."""
    svg: str
    """Element for an HTML page that defines the colour variables."""
    wide: bool = False
    """True if it takes the page's whole width."""
    frames: tuple[Frame, ...] = ()
    """Axes with values, in the order in which they were made."""

    @property
    def size(self) -> tuple[float, float]:
        """Width and height, pt."""
        box = re.search(r'viewBox="0 0 ([\d.]+) ([\d.]+)"', self.svg)
        if box is None:
            raise ValueError(f"the figure {self.name} has no viewBox")
        return float(box[1]), float(box[2])

    def standalone(self) -> str:
        """The figure as an SVG file, in the colours of a light page."""
        return _as_file(self.svg, *self.size)


def _as_file(body: str, width: float, height: float) -> str:
    """An SVG file of svg elements; word processors, LaTeX and printers support neither variables nor schemes.

    Args: `width`, `height`: pt.
    """
    body = body.replace("var(--fig-font)", _FILE_FONT)
    for variable, colour in LIGHT.items():
        body = body.replace(f"var({variable})", colour)
    size = f'width="{width:g}pt" height="{height:g}pt" viewBox="0 0 {width:g} {height:g}"'
    links = 'xmlns="http://www.w3.org/2000/svg" xmlns:xlink="http://www.w3.org/1999/xlink"'
    return (
        f'<?xml version="1.0" encoding="UTF-8"?>\n<svg {links} {size}>\n'
        f'<rect width="100%" height="100%" fill="{LIGHT["--fig-surface"]}"/>\n{body}\n</svg>\n'
    )


WIDE_IN: Final = 7.5
"""Width of a figure that takes the page's whole width: its text then has the size of a narrow one's."""
NARROW_IN: Final = 3.6
COLUMN_IN: Final = 85 / 25.4
"""Width of a column of a journal, 85 mm."""
_EMBEDDED_DPI: Final = 300
"""Resolution of parts that are embedded as pictures: that of print."""
_LEFT_IN, _RIGHT_IN, _BOTTOM_IN, _TOP_IN = 0.66, 0.14, 0.42, 0.1
_LEGEND_ROW_IN, _TOP_AXIS_IN = 0.175, 0.42
_PT_PER_IN, _SHEET_MARGIN_PT = 72, 18.0
_FINE_TICKS_RANGE: Final = 8.0
"""Ratio of a logarithmic axis's ends up to which ticks at 1, 2 and 5 would be too few."""
_DECADES_RANGE: Final = 1e4
"""Ratio of a logarithmic axis's ends from which on decades alone are labelled."""


def plain_number(value: float, _position: object = None) -> str:
    """Tick label in plain text, because matplotlib's own would be mathtext."""
    if value == 0:
        return "0"
    text = f"{value:.6g}"
    return text.replace("-", MINUS) if "e" not in text else number(value, digits=1)


def decade(value: float, _position: object = None) -> str:
    """Tick label of a logarithmic axis that spans many decades.

    Args: `value`: the tick, positive.
    """
    exponent = f"{value:.0e}".split("e")
    return power_of_ten(int(exponent[1])) if exponent[0] == "1" else ""


def logarithmic(
    axis: Literal["x", "y"], *, ticks: list[float] | None = None, within: tuple[float, float] | None = None
) -> Paint:
    """Make one axis logarithmic, labels in plain text: at ticks, at 1, 2, 5 within limits, or decades."""
    if within is not None:
        fine = (1, 2, 5) if within[1] > _FINE_TICKS_RANGE * within[0] else (1, 1.5, 2, 2.5, 3, 4, 5, 6, 7, 8)
        steps = (step * 10.0**exponent for exponent in range(-12, 10) for step in fine)
        ticks = [step for step in steps if within[0] <= step <= within[1]]

    def paint(axes: Axes) -> None:
        axes.set(**{f"{axis}scale": "log"})
        target = axes.xaxis if axis == "x" else axes.yaxis
        if ticks is not None:
            target.set_ticks(ticks)
        target.set_major_formatter(FuncFormatter(decade if ticks is None else plain_number))
        target.set_minor_locator(NullLocator())

    return paint


def curve(
    x: ArrayLike,
    y: ArrayLike,
    label: str | None = None,
    *,
    band: ArrayLike | None = None,
    **look: Any,
) -> Paint:
    """A line or markers, with their half-width as a shaded band if there is one."""

    def paint(axes: Axes) -> None:
        if band is not None:
            values, width = np.asarray(y), np.asarray(band)
            axes.fill_between(
                np.asarray(x), values - width, values + width, color=look["color"], alpha=0.2, linewidth=0
            )
        axes.plot(np.asarray(x), np.asarray(y), label=label, **look)

    return paint


def level(value: float, label: str | None = None, **look: Any) -> Paint:
    """A horizontal line across the figure."""
    return lambda axes: axes.axhline(value, label=label, **look)


def upright(value: float, label: str | None = None, **look: Any) -> Paint:
    """A vertical line across the figure."""
    return lambda axes: axes.axvline(value, label=label, **look)


def note(text: str, point: tuple[float, float], shift_pt: tuple[float, float], **look: Any) -> Paint:
    """A text beside a point."""
    shifted = {"xytext": shift_pt, "textcoords": "offset points", "color": MUTED}
    return lambda axes: axes.annotate(text, point, **{**shifted, **look})


AMPLITUDE: Final[AxisLabel] = ("amplitude, zero to peak,", "m")
TIME: Final[AxisLabel] = ("time", "s")


def amplitudes(curves: Sequence[tuple[ArrayLike, ArrayLike, dict[str, Any]]], limit: float) -> Paint:
    """Vibration amplitudes and the limit, m, on a logarithmic axis.

    Args: `curves`: time, s, or speed; amplitude, m; and the line's properties.
    """
    every = np.append(np.concatenate([np.asarray(values) for _, values, _ in curves]), limit)
    low, high = 0.7 * every[every > 0].min(), 1.4 * every.max()

    def paint(axes: Axes) -> None:
        for time, values, look in curves:
            curve(time, values, **look)(axes)
        level(limit, "limit", color=MUTED, linewidth=1, linestyle=":")(axes)
        logarithmic("y", within=(low, high) if high < _DECADES_RANGE * low else None)(axes)
        axes.set(xlim=(0, None), ylim=(low, high))

    return paint


def _to_page(text: str, name: str) -> str:
    """Bare svg element with variables for colours and font, unique ids and no fixed size."""
    body = text[text.index("<svg") :]
    # The page's style sheet has this rule once.
    body = re.sub(r"<(metadata|style).*?</\1>\s*", "", body, flags=re.DOTALL)
    body = re.sub(r'(<svg[^>]*?) width="[^"]*"', r"\1", body, count=1)
    body = re.sub(r'(<svg[^>]*?) height="[^"]*"', r"\1", body, count=1)
    body = re.sub(r'\bid="', f'id="{name}-', body)
    body = re.sub(r'(href="|url\()#', rf"\1#{name}-", body)
    # Matplotlib before 3.11 writes the font in one property.
    body = re.sub(r"font: ((?:\w+ )?[\d.]+px) [^;\"]*", r"font: \1 var(--fig-font)", body)
    body = re.sub(r"font-family: [^;\"]*", "font-family: var(--fig-font)", body)
    for sentinel, (variable, *_) in _PALETTE.items():
        body = body.replace(sentinel, f"var({variable})")
    # Screen readers read the frame around it on the page, by the figure's caption.
    body = body.replace("<svg ", '<svg aria-hidden="true" ', 1)
    # A tenth of a point is below what the eye sees; small parts, such as markers, keep another digit.
    # The matrix of an embedded picture is multiplied by its pixels.
    parts = re.split(r'( (?:d|x|y|transform)="(?!matrix)[^"]*")', body)
    short = re.sub(r"(\d\d\.\d)\d+", r"\1", re.sub(r"(\.\d\d)\d+", r"\1", "\0".join(parts[1::2])))
    parts[1::2] = re.sub(r"\.(?!\d)", "", re.sub(r"(\.\d*?)0+(?!\d)", r"\1", short)).split("\0")
    body = "".join(parts)
    body = "\n".join(text.rstrip() for text in body.splitlines())
    return re.sub(r"\bM ([\d.]+ [\d.]+)\nL \1\n", r"M\1h0", body)


def draw(
    name: str,
    *paints: Paint,
    x: AxisLabel = ("", "1"),
    y: AxisLabel = ("", "1"),
    xlim: tuple[float | None, float | None] | None = None,
    ylim: tuple[float | None, float | None] | None = None,
    columns: int = 2,
    wide: bool = False,
    width: float | None = None,
    height: float = 2.7,
) -> Drawing:
    """Draw one figure: its paints in their order, its axes in suitable units, and above it the
    legend of what is labelled.

    Args: `name`: stem of the file. `columns`: of the legend; 0: no legend. `width`: inches of 72 units, by
    default the page's whole width or half of it, see `wide`. `height`: inches.
    """
    settings: Any = dict(_RC)
    with matplotlib.rc_context(settings):
        fits, width = width is not None, width or (WIDE_IN if wide else NARROW_IN)
        figure = Figure(figsize=(width, height))
        # Margins in inches, equal in all figures, so that neighbours align.
        sizes = 1 - (_LEFT_IN + _RIGHT_IN) / width, 1 - (_BOTTOM_IN + _TOP_IN) / height
        axes = figure.add_axes((_LEFT_IN / width, _BOTTOM_IN / height, *sizes))
        for axis in (axes.xaxis, axes.yaxis):
            axis.set_major_formatter(FuncFormatter(plain_number))
        for paint in paints:
            paint(axes)
        axes.set(xlim=xlim, ylim=ylim)
        _in_unit(axes.xaxis, axes.get_xlim(), x)
        _in_unit(axes.yaxis, axes.get_ylim(), y)
        if columns:
            _legend_above(axes, columns=columns)
        if fits:
            _fit(axes)
        buffer = io.StringIO()
        figure.savefig(buffer, format="svg", dpi=_EMBEDDED_DPI, metadata={"Date": None, "Creator": None})
        frames = tuple(_frame(each) for each in figure.axes if each.axison and each.get_xscale() == "linear")
    return Drawing(name=name, svg=_to_page(buffer.getvalue(), name), wide=wide, frames=frames)


def _frame(axes: Axes) -> Frame:
    box, (width, height) = axes.get_position(), figure_of(axes).get_size_inches() * _PT_PER_IN
    return Frame(
        left=float(box.x0 * width),
        top=float((1 - box.y1) * height),
        width=float(box.width * width),
        height=float(box.height * height),
        x=axes.get_xlim(),
        y=axes.get_ylim(),
    )


def _in_unit(axis: XAxis | YAxis, limits: tuple[float, float], label: AxisLabel) -> None:
    """Label an axis, with ticks in the unit that suits its ends."""
    name, unit = label
    display = display_unit(unit, *limits)
    axis.set_label_text(f"{name} in {display.symbol}" if name and display.symbol else name or display.symbol)
    if display.factor == 1:
        return
    if not math.log10(display.factor).is_integer() and axis.get_scale() == "linear":
        # Ticks that are round in SI are not round in the unit shown.
        low, high = sorted(end * display.factor for end in limits)
        ticks = AutoLocator().tick_values(low, high)
        axis.set_ticks([tick / display.factor for tick in ticks if low <= tick <= high])
    text = axis.get_major_formatter()
    axis.set_major_formatter(FuncFormatter(lambda value, position: text(value * display.factor, position)))


def panels(axes: Axes, *boxes: tuple[float, float, float, float], **kind: Any) -> list[Axes]:
    """Axes that replace those of a figure, each by left, bottom, width and height over the figure's.

    Args: `kind`: properties of the axes, such as their `projection`.
    """
    axes.set_axis_off()
    return [figure_of(axes).add_axes(box, **kind) for box in boxes]


def nice_span(span: float) -> list[float]:
    """Two to five round ticks on either side of zero, and zero, within plus and minus a span."""
    step = next(
        step * 10.0**exponent
        for exponent in range(math.floor(math.log10(span)) - 1, 99)
        for step in (1, 2, 5)
        if span / (step * 10.0**exponent) < 3
    )
    count = int(span / step)
    return [step * multiple for multiple in range(-count, count + 1)]


def figure_of(axes: Axes) -> Figure:
    """The figure that axes belong to."""
    return cast(Figure, axes.get_figure())


def _legend_above(axes: Axes, *, columns: int) -> None:
    """Put the legend above the axes, in columns that fit; the axes take the height left. Call it last."""
    figure = figure_of(axes)
    handles, labels = axes.get_legend_handles_labels()
    for fitting in range(max(columns, 1), 0, -1):
        legend = figure.legend(
            handles,
            labels,
            loc="upper left",
            bbox_to_anchor=(0, 1),
            ncols=fitting,
            columnspacing=1.4,
            borderaxespad=0.0,
            borderpad=0.1,
            labelspacing=0.35,
        )
        if fitting == 1 or not labels or legend.get_window_extent().width <= figure.bbox.width:
            break
        legend.remove()
    rows = -(-len(labels) // fitting) + sum(label.count("\n") for label in labels)
    top = _TOP_IN + _LEGEND_ROW_IN * rows + (_TOP_AXIS_IN if axes.child_axes else 0.0)
    box, height = axes.get_position(), figure.get_figheight()
    axes.set_position((box.x0, box.y0, box.width, 1 - (_BOTTOM_IN + top) / height))


def _fit(axes: Axes) -> None:
    """Break a label of the y-axis that is longer than the axis, and narrow the axes until all labels fit."""
    figure, label = figure_of(axes), axes.yaxis.label
    tall, text = label.get_window_extent().height / axes.bbox.height, label.get_text()
    if tall > 1:
        label.set_text(fill(text, int(len(text) / tall)))
    extent, box, across = figure.get_tightbbox(), axes.get_position(), figure.get_figwidth()
    left, right = max(-extent.x0 / across, 0.0), max(extent.x1 / across - 1.0, 0.0)
    axes.set_position((box.x0 + left, box.y0, box.width - left - right, box.height))


def sheet(drawings: Sequence[Drawing]) -> str:
    """All drawings below each other, narrow ones in pairs, in the colours of a light page."""
    elements, x, y, row, edge = (
        [],
        _SHEET_MARGIN_PT,
        _SHEET_MARGIN_PT,
        0.0,
        _SHEET_MARGIN_PT + _PT_PER_IN * WIDE_IN,
    )
    for drawing in drawings:
        width = _PT_PER_IN * (WIDE_IN if drawing.wide else NARROW_IN)
        if x > _SHEET_MARGIN_PT and x + width > edge:
            x, y, row = _SHEET_MARGIN_PT, y + row + _SHEET_MARGIN_PT, 0.0
        height = drawing.size[1]
        tag = f'<svg x="{x:g}" y="{y:g}" width="{width:g}" height="{height:g}" overflow="visible" '
        aria = f'role="img" aria-label="{drawing.name.replace("-", " ")}"'
        elements.append(drawing.svg.replace("<svg ", tag, 1).replace('aria-hidden="true"', aria, 1))
        x, row = x + width + _SHEET_MARGIN_PT, max(row, height)
    return _as_file("\n".join(elements), edge + _SHEET_MARGIN_PT, y + row + _SHEET_MARGIN_PT)
