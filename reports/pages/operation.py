"""The operating map and the dimensioned section of the disc."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any, Final

import numpy as np
from matplotlib.axes import Axes
from matplotlib.patches import Circle, PathPatch
from matplotlib.path import Path
from scipy.ndimage import distance_transform_edt, gaussian_filter

from ringbalance.mesh.geometry import surface_radius
from ringbalance.mesh.section import outlines
from ringbalance.reduced_model.law.calibrated_law import CalibratedLaw
from ringbalance.reduced_model.law.flow_law import Regime
from ringbalance.reports.figure import (
    FIFTH,
    FOUND,
    FOURTH,
    INK,
    MAP,
    MUTED,
    PAPER,
    SURFACE,
    THIRD,
    WIDE_IN,
    Drawing,
    curve,
    draw,
    panels,
)
from ringbalance.reports.section import Record, Section, Work
from ringbalance.results.numbers import number
from ringbalance.scene.arrays import FloatArray, IntArray
from ringbalance.verification.assumptions import assumptions_of
from ringbalance.verification.case import RestsOn

_FILLS: Final = 101
_PRESSURES: Final = 121
_TOP_FACTOR: Final = 1.5
"""Highest pressure of the map over the higher of the scene's gas pressure and the priming pressure."""
_ARC_STEP_RAD: Final = math.radians(3)
_OUTLINE_DECIMALS_M: Final = 7
_SPILLING: Final = "spilling"
_NAMES: Final = (*(regime.label for regime in Regime), _SPILLING)
_SHADES: Final = {
    "siphon": (FOUND, 0.30),
    "separated": (THIRD, 0.24),
    "spilling": (FIFTH, 0.30),
    "blocked": (MUTED, 0.10),
    "reverse": (FOURTH, 0.26),
    "undecided": (PAPER, 0.22),
}
_HATCHED: Final[dict[str, Any]] = {
    "facecolor": "none",
    "edgecolor": PAPER,
    "hatch": "////",
    "linewidth": 0.8,
}
_CREST: Final = "tube.hump_radius"
_SMOOTHING_SIGMA_POINTS: Final = 1.0
"""Standard deviation over which the map's borders are smoothed."""
_NAME_CLEARANCE_POINTS: Final = 2.2
"""Least distance of a regime's name from the edge of its area."""
_WORKING_RANGE_CLEARANCE: Final = 0.035
"""Least distance of regimes' names from the working range, over the map's height."""
_MM_PER_M: Final = 1e3
_HEIGHT_IN: Final = 3.3
_PICTURE_HALF: Final = 1.42
"""Half the height of the picture over the outer radius: room for the dimensions."""
_CENTRE_LINE_DASHES: Final = (0, (6, 2, 1, 2))
_TUBE: Final[dict[str, Any]] = {"color": PAPER, "linewidth": 2.0}


def _regimes(law: CalibratedLaw, fill: np.typing.ArrayLike, pressure: np.typing.ArrayLike) -> IntArray:
    """Regimes of an unprimed tube, as numbers of `_NAMES`.

    Spilling: a separated column that leaves gas over the crest and so does not prime the tube.
    """
    flow = law.evaluate(fill_ratio=fill, gas_pressure=pressure)
    ends = law.ends(fill_ratio=fill, gas_pressure=pressure)
    covered = ends.downstream_hydrostatic >= law.path.port_pressure
    spills = (flow.regime == Regime.SEPARATED) & ~flow.primed & covered
    return np.asarray(np.where(spills, _NAMES.index(_SPILLING), flow.regime), dtype=np.int64)


def _collect(work: Work) -> Record:
    scene, calibration = work.ring, work.calibration
    disc, tube, law, answers = scene.disc, scene.tube, calibration.flow_law, calibration.answers
    half = disc.max_fill_ratio / 2
    top = _TOP_FACTOR * np.nanmax([scene.gas.pressure, float(answers.priming_pressure_vented)])
    fill, pressure = np.linspace(0, law.max_fill_ratio, _FILLS), np.linspace(0, top, _PRESSURES)
    at_point = int(_regimes(law, half, scene.gas.pressure))
    # Range of the siphon crest's radius, assumed or stated, and the gas pressures that lift the liquid over
    # both of its ends.
    crest, ends, radius = None, None, tube.hump_radius
    (assumed,) = assumptions_of((RestsOn(path=_CREST, documented=True, why="see there"),), scene) or (None,)
    width = next((each for each in scene.uncertainty if _CREST.endswith(each.quantity)), None)
    if assumed is not None:
        ends = [assumed.low, assumed.high]
    elif width is not None and radius is not None:
        ends = [radius - width.absolute(radius), radius + width.absolute(radius)]
    if ends is not None:
        surface = surface_radius(disc=disc, fill_ratio=fill)
        head = 0.5 * scene.liquid.density * scene.rotor.speed**2 / law.gas_factor
        lifting = [np.maximum(head * (surface**2 - end**2), 0.0).tolist() for end in ends]
        crest = {"radius_m": ends, "lifting_pressure_Pa": lifting}
    # Sections through the middle of an imported chamber, across the shaft, (x, y), and along it, (x, z).
    sections = (
        {}
        if disc.geometry is None
        else {
            name: [
                np.round(loop, _OUTLINE_DECIMALS_M).tolist() for loop in outlines(disc.geometry, axis=axis)
            ]
            for name, axis in (("across_m", 2), ("along_m", 1))
        }
    )
    return {
        "fill_ratio": fill.tolist(),
        "gas_pressure_Pa": pressure.tolist(),
        "regimes": list(_NAMES),
        "regime": ["".join(map(str, row)) for row in _regimes(law, fill[None, :], pressure[:, None])],
        "point": {"fill_ratio": half, "gas_pressure_Pa": scene.gas.pressure, "regime": _NAMES[at_point]},
        "crest": crest,
        "working_fill_ratio": [float(answers.residual_fill_ratio), float(answers.largest_fill_ratio)],
        "disc": {
            **({"outlines": sections} if sections else {}),
            "chambers": disc.chambers,
            "central_angle_rad": disc.central_angle,
            "outer_radius_m": disc.outer_radius,
            "inner_radius_m": disc.inner_radius,
            "axial_width_m": disc.axial_width,
            "plate_thickness_m": disc.plate_thickness,
            "fill_ratio": disc.initial_fill,
            "port_radius_m": tube.port_radius,
            "crest_radius_m": tube.hump_radius,
            "bore_m": tube.bore,
            "length_m": tube.length,
            "origins": {key: scene.origin_of(f"tube.{key}") for key in ("bore", "length", "hump_radius")},
        },
    }


def _view(record: Record, evidence: Record) -> Record:
    chamber, disc = evidence["calibration"]["chamber"], record["disc"]
    surface = np.interp(disc["fill_ratio"], chamber["fill_ratio"], chamber["free_surface_radius_m"])
    disc = {**disc, "free_surface_radius_m": float(surface)}
    return {"map": _operating_map(record), "disc": _disc_section(disc)}


def _operating_map(record: Record) -> Drawing:
    """Regime of the unprimed tube over the driven chamber's fill and the gas pressure.

    Args: `record`: axes, names and numbers of the regimes, the operating point and the working fills.
    """
    fill, pressure = np.asarray(record["fill_ratio"]), np.asarray(record["gas_pressure_Pa"])
    regime = np.array([[int(sign) for sign in row] for row in record["regime"]])
    point, gas = record["point"], record["point"]["gas_pressure_Pa"]

    def areas(axes: Axes) -> None:
        for index, name in enumerate(record["regimes"]):
            colour, strength = _SHADES[name]
            area = regime == index
            if not area.all() and area.any():
                smooth = gaussian_filter(area.astype(float), _SMOOTHING_SIGMA_POINTS)
                axes.contourf(fill, pressure, smooth, levels=[0.5, 1.5], colors=[colour], alpha=strength)
                axes.contour(fill, pressure, smooth, levels=[0.5], colors=[MUTED], linewidths=0.7)
        near = np.abs(pressure - gas)[:, None] < _WORKING_RANGE_CLEARANCE * (pressure[-1] - pressure[0])
        for index, name in enumerate(record["regimes"]):
            # Each name stands at the point of its area farthest from the edges.
            room = distance_transform_edt(np.pad((regime == index) & ~near, 1))[1:-1, 1:-1]
            row, column = np.unravel_index(np.argmax(room), room.shape)
            if room[row, column] >= _NAME_CLEARANCE_POINTS:
                look: dict[str, Any] = {"ha": "center", "va": "center", "color": INK, "weight": "bold"}
                look["bbox"] = {"facecolor": SURFACE, "alpha": 0.75, "linewidth": 0, "pad": 1.5}
                axes.text(fill[column], pressure[row], name, **look)
        axes.grid(visible=False)

    def crest(axes: Axes) -> None:
        if record.get("crest"):
            low, high = record["crest"]["lifting_pressure_Pa"]
            axes.fill_between(fill, high, low, label="start of the flow, crest in its range", **_HATCHED)

    working: dict[str, Any] = {"color": INK, "marker": "|", "linewidth": 2, "markersize": 9}
    return draw(
        "operating-map",
        areas,
        crest,
        curve(record["working_fill_ratio"], [gas, gas], "working range", **working),
        curve(
            [point["fill_ratio"]], [gas], "operating point", color=INK, linestyle="", marker="o", markersize=6
        ),
        x=("fill ratio of the driven chamber", "1"),
        y=("gas pressure, gauge,", "Pa"),
        xlim=(fill[0], fill[-1]),
        ylim=(pressure[0], pressure[-1]),
        columns=3,
        wide=True,
        height=2.6,
    )


def _across(panel: Axes, disc: Record, size: dict[str, float]) -> None:
    inner, outer, surface = size["inner_radius"], size["outer_radius"], size["free_surface_radius"]
    angle, count, (loops, _) = disc["central_angle_rad"] / 2, disc["chambers"], _closed_lines(disc, size)
    panel.add_patch(Circle((0, 0), outer, facecolor=MAP[3], edgecolor=INK, linewidth=1))
    ring = _area([_arc(1.1 * outer, 0, 2 * math.pi), _arc(surface, 0, 2 * math.pi)])
    for index, middle in enumerate(2 * math.pi * np.arange(count) / count):
        turn = np.array([[math.cos(middle), math.sin(middle)], [-math.sin(middle), math.cos(middle)]])
        _filled(panel, _area([loop @ turn for loop in loops]), ring)
        x, y = _polar(_letter_radius(size), middle + 0.62 * angle)
        panel.text(x, y, chr(ord("A") + index), ha="center", va="center", weight="bold")
    panel.plot(0, 0, "+", color=INK, markersize=9)
    _tube(panel, size)
    for name, radius, turned in (("R₂", outer, -0.5), ("R₁", inner, -2.1), ("R₁′", surface, -2.62)):
        _line(panel, (0, 0), _polar(radius, turned), "-|>")
        text = f"{name} {number(radius, digits=4)}"
        _note(panel, text, _polar(radius, turned), _polar(1.3 * outer, turned))
    low, high = (_polar(1.1 * outer, side) for side in (-angle, angle))
    _line(panel, low, high, "<->", connectionstyle=f"arc3,rad={math.tan(angle / 2):.3f}")
    for x, y in (_polar(1.14 * outer, side) for side in (-angle, angle)):
        panel.plot([0, x], [0, y], color=MUTED, linewidth=0.7, linestyle=_CENTRE_LINE_DASHES)
    panel.text(1.13 * outer, 0.12 * outer, f"θ {number(math.degrees(2 * angle), digits=3)}°")
    if "outlines" not in disc:
        strip = size["plate_thickness"]
        wall = _polar(0.9 * outer, angle - strip / outer / 2)
        text = f"t {number(strip, digits=3)} each side"
        _note(panel, text, wall, (0.72 * outer, 1.25 * outer), ha="left")


def _along(panel: Axes, disc: Record, size: dict[str, float]) -> None:
    inner, outer, surface = size["inner_radius"], size["outer_radius"], size["free_surface_radius"]
    _, loops = _closed_lines(disc, size)
    half, port, crest = (
        size["axial_width"] / 2,
        0.985 * size["port_radius"],
        size.get("crest_radius", 0.0),
    )
    wall = half + 0.06 * outer
    for sign in (-1, 1):
        corners = 1.1 * half * np.array([[-1, 0], [1, 0], [1, 0], [-1, 0]])
        heights = sign * np.array([surface, surface, 1.1 * outer, 1.1 * outer])
        liquid = Path(np.vstack([corners + np.outer(heights, (0, 1)), corners[:1]]), closed=True)
        _filled(panel, _area([loop * (1, sign) for loop in loops]), liquid)
    panel.plot([half, wall, wall, wall, half], [port, port, crest, -port, -port], **_TUBE)
    shaft: Record = {"color": MUTED, "linewidth": 0.8, "linestyle": _CENTRE_LINE_DASHES}
    panel.plot([-1.35 * half, 1.5 * half], [0, 0], **shaft)
    level = -1.14 * outer
    _line(panel, (-half, level), (half, level), "<->")
    panel.plot([[-half, half]] * 2, [[0.9 * level] * 2, [1.04 * level] * 2], color=MUTED, linewidth=0.7)
    panel.text(0, 1.03 * level, f"B {number(2 * half, digits=4)}", ha="center", va="top")
    gas, text = 0.5 * (inner + surface), "valve side:\ngas line"
    _line(panel, (-half - 0.35 * outer, gas), (-half, gas), "-|>", color=THIRD, linewidth=1.4)
    panel.text(-half - 0.1 * outer, 0.62 * (inner + outer), text, ha="right", va="center")
    panel.text(wall + 0.06 * outer, 0.72 * outer, "tube", color=PAPER, va="center")
    panel.text(0, (surface + outer) / 2, "liquid", ha="center", va="center")
    # Beside the middle, where a gas tube may stand.
    panel.text(-half / 2, gas, "gas", ha="center", va="center")
    panel.text(1.5 * half, 0.04 * outer, "shaft", ha="right", va="bottom", color=MUTED)


def _disc_section(disc: Record) -> Drawing:
    """Section of the disc with its dimensions.

    Args: `disc`: lengths in m, angles in rad, the fill that is drawn and, for an imported chamber, its
        sections under "outlines".
    """
    size = {
        key.removesuffix("_m"): value * _MM_PER_M
        for key, value in disc.items()
        if key.endswith("_m") and value is not None
    }

    def paint(axes: Axes) -> None:
        left, right = panels(axes, (0.0, 0.0, 0.56, 1), (0.57, 0.0, 0.43, 1))
        reach = _PICTURE_HALF * size["outer_radius"]
        for panel, width in ((left, 0.56), (right, 0.43)):
            half = reach * width * WIDE_IN / _HEIGHT_IN
            panel.set(xlim=(-half, half), ylim=(-reach, reach), aspect="equal")
            panel.set_axis_off()
        _across(left, disc, size)
        _along(right, disc, size)

    return draw("disc-section", paint, columns=0, wide=True, height=_HEIGHT_IN)


def _arc(radius: float, start: float, end: float) -> FloatArray:
    angle = np.linspace(start, end, 2 + round(abs(end - start) / _ARC_STEP_RAD))
    return radius * np.stack([np.cos(angle), np.sin(angle)], axis=1)


def _closed_lines(disc: Record, size: dict[str, float]) -> tuple[list[FloatArray], list[FloatArray]]:
    """Closed lines around the first chamber's space across the shaft, (x, y), and along it, (z, x), mm."""
    if sections := disc.get("outlines"):
        across = [np.array(loop) * _MM_PER_M for loop in sections["across_m"]]
        return across, [np.array(loop)[:, ::-1] * _MM_PER_M for loop in sections["along_m"]]
    inner, outer, half = size["inner_radius"], size["outer_radius"], size["axial_width"] / 2
    strip = size["plate_thickness"]
    low, high = (disc["central_angle_rad"] / 2 - math.asin(min(strip / r, 1.0)) for r in (inner, outer))
    sector = np.vstack([_arc(outer, -high, high), _arc(inner, low, -low)])
    return [sector], [np.array([[-half, inner], [half, inner], [half, outer], [-half, outer]])]


def _area(loops: Sequence[FloatArray]) -> Path:
    """Area within the outermost lines and outside those within them."""
    parts = []
    for loop in loops:
        within = sum(Path(other).contains_point(loop[0]) for other in loops if other is not loop)
        x, y = loop.T
        rising = np.sum(x * np.roll(y, -1) - np.roll(x, -1) * y) > 0
        turned = loop if rising == (within % 2 == 0) else loop[::-1]
        parts.append(Path(np.vstack([turned, turned[:1]]), closed=True))
    return Path.make_compound_path(*parts)


def _filled(panel: Axes, area: Path, liquid: Path) -> None:
    """A chamber's gas, and its liquid with the surface: the part of the chamber within `liquid`."""
    edge: dict[str, Any] = {"edgecolor": INK, "linewidth": 0.6}
    panel.add_patch(PathPatch(area, facecolor=SURFACE, **edge))
    panel.add_patch(PathPatch(area, facecolor=MAP[7], **edge)).set_clip_path(liquid, panel.transData)
    panel.add_patch(PathPatch(liquid, facecolor="none", **edge)).set_clip_path(area, panel.transData)
    panel.add_patch(PathPatch(area, facecolor="none", **edge))


def _polar(radius: float, angle: float) -> tuple[float, float]:
    return radius * math.cos(angle), radius * math.sin(angle)


def _letter_radius(size: dict[str, float]) -> float:
    """Radius of a chamber's letter, mm: in the gas, on the wider side of the tube."""
    inner, surface = size["inner_radius"], size["free_surface_radius"]
    crest = min(max(size.get("crest_radius", inner), inner), surface)
    return (inner + crest) / 2 if crest - inner > surface - crest else (crest + surface) / 2


def _tube(panel: Axes, size: dict[str, float]) -> None:
    """Draw the tube: out of chamber A, inward to the crest, half-way round at its radius, and outward."""
    port, crest = size["port_radius"], size.get("crest_radius")
    if crest is None:
        panel.plot([port, -port], [0, 0], **_TUBE)
        return
    panel.plot(*np.vstack([[[port, 0]], _arc(crest, 0, math.pi), [[-port, 0]]]).T, **_TUBE)
    panel.plot([port, -port], [0, 0], "o", color=PAPER, markersize=5)
    text = f"tube, bore {number(size['bore'], digits=3)}, length {number(size['length'], digits=4)}"
    _note(panel, text, _polar(crest, 1.76), (-1.4 * port, 1.3 * port), ha="left")
    _note(panel, f"port {number(port, digits=3)}", (-port, 0), (-1.43 * port, -0.28 * port), ha="left")
    top = _polar(crest, math.pi / 2 + 0.12)
    _line(panel, (0, 0), top, "-|>")
    panel.text(0.75 * top[0] + 0.05 * port, 0.75 * top[1], f"rₘ {number(crest, digits=3)}", va="center")


def _line(panel: Axes, start: Sequence[float], end: Sequence[float], kind: str, **line: Any) -> None:
    """Draw a line between two points, with the arrow heads of its kind."""
    shape = {"arrowstyle": kind, "color": INK, "linewidth": 0.9, "shrinkA": 0, "shrinkB": 0, **line}
    panel.annotate("", (end[0], end[1]), (start[0], start[1]), arrowprops=shape)


def _note(
    panel: Axes, text: str, point: tuple[float, float], text_at: tuple[float, float], ha: str = "center"
) -> None:
    """Write a text, and draw a thin line from it to a point."""
    thin = {"arrowstyle": "-", "color": MUTED, "linewidth": 0.7}
    panel.annotate(text, point, text_at, color=INK, ha=ha, va="center", arrowprops=thin)


SECTION: Final = Section(
    name="operation", title="Where it works", document="report", collect=_collect, show=_view
)
