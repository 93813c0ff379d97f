"""Draw the 3-D pictures off-screen, in a separate process, because a driver may crash it.

    python -m ringbalance.reports.pictures.draw JOB.json

The job names the VTU files of the fields, the disc's dimensions in metres and the folder for the PNG files.
VTK must find VTK_DEFAULT_OPENGL_WINDOW in the environment.  Standard input is a pipe that
stays open: when it closes, the process that waits for the pictures has ended, and the drawing ends.
"""

from __future__ import annotations

import json
import math
import os
import sys
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any, Final

import numpy as np
import pyvista as pv
from matplotlib import colormaps
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.cm import ScalarMappable
from matplotlib.colors import Colormap, ListedColormap, Normalize
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patheffects import withStroke
from matplotlib.ticker import FuncFormatter, MaxNLocator
from PIL import Image

from ringbalance.reports.figure import DARK, LIGHT, plain_number
from ringbalance.scene.arrays import FloatArray
from ringbalance.scene.platform.processes import end_with

Record = dict[str, Any]

PICTURE: Final = (1200, 800)
"""Pixels of a finished picture; drawn twice as large, so that lines are smooth."""
_SCALE: Final = 2
_DPI: Final = 100
_PT_PER_PIXEL: Final = 72 / _DPI
_FONT_PT: Final = 46 * _PT_PER_PIXEL
_MM_PER_M: Final = 1e3
_WALL_SCALE: Final = 1.002
"""Scale of walls, so that the liquid's sides do not lie in them."""
_SHARP_EDGE_DEG: Final = 40.0
"""Angle between faces of a chamber from which their edge is drawn."""
_CIRCLE_STEPS: Final = 480
_SURFACE: Final = "dataset_surface"
_WATER: Final = ListedColormap(colormaps["Blues"](np.linspace(0.28, 1.0, 256)))


@dataclass(frozen=True, kw_only=True)
class _Theme:
    """Colours of a picture, which match the page so that it needs no frame."""

    name: str
    colours: dict[str, str]
    """Colours of the page's figures by CSS variable."""
    metal: str
    mark: str

    @property
    def ground(self) -> str:
        """Background of the page."""
        return self.colours["--fig-surface"]

    @property
    def ink(self) -> str:
        """Colour of the page's text."""
        return self.colours["--fig-ink"]


THEMES: Final = (
    _Theme(name="light", colours=LIGHT, metal="#c3cad2", mark=LIGHT["--fig-ink"]),
    _Theme(name="dark", colours=DARK, metal="#66717e", mark="#ffffff"),
)


@dataclass(frozen=True, kw_only=True)
class _Label:
    """A text beside a point of the picture."""

    text: str
    point: FloatArray
    """mm, shape (3,)."""
    shift: tuple[float, float] = (0, 0)
    """Distance of the text from the point, pixels right and up; a leader joins them where it is not zero."""
    strong: bool = False


@dataclass(frozen=True, kw_only=True)
class _Lettering:
    """Lettering of a picture: labels, and a colour bar from zero with its title."""

    labels: list[_Label]
    title: str
    colours: Colormap
    high: float


def main(arguments: list[str]) -> int:
    """Draw every picture of a job in every theme."""
    # Not through sys.stdin, whose lock would be held when the interpreter ends.
    end_with(partial(os.read, 0, 1))
    job = json.loads(Path(arguments[0]).read_text(encoding="utf-8"))
    disc: Record = {
        key: None if value is None else value * _MM_PER_M for key, value in job["lengths"].items()
    }
    if (chamber := job["fields"].get("chamber")) is not None:
        walls = _read(chamber).extract_surface(algorithm=_SURFACE)
    else:
        # The space of one chamber between its plates.
        inner, outer, strip = disc["inner_radius"], disc["outer_radius"], disc["plate_thickness"]
        half = [job["central_angle"] / 2 - math.asin(strip / radius) for radius in (inner, outer)]
        angle = np.linspace(-1, 1, _CIRCLE_STEPS // 4)
        line = np.concatenate([inner * np.exp(1j * half[0] * angle), outer * np.exp(-1j * half[1] * angle)])
        walls = _prism(line, -disc["axial_width"] / 2, disc["axial_width"] / 2)
    # One window for all: the driver then compiles its shaders once.
    plotter: Any = pv.Plotter(
        off_screen=True, window_size=[_SCALE * side for side in PICTURE], lighting="light kit"
    )
    # Reducing the picture smooths it.
    plotter.render_window.SetMultiSamples(0)
    for name, paint in (("pressure", _draw_pressure), ("disc", _draw_disc)):
        liquid = _read(job["fields"][name])
        for theme in THEMES:
            plotter.suppress_rendering = True
            plotter.clear_actors()
            plotter.set_background(theme.ground)
            lettering = paint(plotter, {**job, "lengths": disc, "walls": walls}, liquid, theme)
            _save(plotter, lettering, theme, Path(job["folder"]) / f"{name}-{theme.name}.png")
    plotter.close()
    return 0


def _read(path: str) -> Any:
    """Linear cells in millimetres, several for a quadratic one, since VTK cuts only linear cells well."""
    grid: Any = pv.read(path)
    cells = grid.cells_dict.get(pv.CellType.TRIQUADRATIC_HEXAHEDRON)
    if cells is not None:
        # The filter handles the nodes on corners and edges, which come first.
        fields = dict(grid.point_data)
        grid = pv.UnstructuredGrid({pv.CellType.QUADRATIC_HEXAHEDRON: cells[:, :20]}, np.asarray(grid.points))
        grid.point_data.update(fields)
    grid = grid.tessellate()
    grid.points = np.asarray(grid.points) * _MM_PER_M
    return grid


def _prism(line: Any, bottom: float, top: float) -> Any:
    """The solid between two planes across the shaft within a closed line of complex points, mm."""
    points = np.c_[line.real, line.imag, np.full(line.size, bottom)]
    face = pv.PolyData(points, faces=[line.size, *range(line.size)]).triangulate()
    return face.extrude((0, 0, top - bottom), capping=True)


def _ring(inner: float, outer: float, bottom: float, top: float) -> Any:
    """A closed ring of rectangular section about the shaft, mm."""
    flat = pv.Disc(center=(0, 0, bottom), inner=inner, outer=outer, r_res=1, c_res=_CIRCLE_STEPS)
    return flat.extrude((0, 0, top - bottom), capping=True)


def _polar(radius: float, angle: float, height: float) -> FloatArray:
    return np.array([radius * math.cos(angle), radius * math.sin(angle), height])


def _look(
    plotter: Any, bounds: tuple[float, ...], *, direction: Any, up: Any, zoom: float, lift: float
) -> None:
    """Point the camera at a box, a little to the right, since the colour bar is on the left."""
    middle = np.array(bounds).reshape(3, 2).mean(axis=1)
    plotter.camera_position = [tuple(middle + direction), tuple(middle), up]
    plotter.camera.view_angle = 18
    plotter.reset_camera(bounds=bounds, render=False)
    plotter.camera.zoom(zoom)
    plotter.camera.SetWindowCenter(-0.12, -lift)


def _draw_pressure(plotter: Any, job: Record, liquid: Any, theme: _Theme) -> _Lettering:
    """The liquid of one chamber, a corner cut away, coloured by pressure, in the outline of its chamber."""
    disc, half = job["lengths"], job["central_angle"] / 2
    outer, inner, width = disc["outer_radius"], disc["inner_radius"], disc["axial_width"]
    pressure = np.asarray(liquid.point_data["pressure_Pa"]) * 1e-6
    liquid.point_data["pressure"], high = pressure, float(pressure.max())
    back, front = (liquid.clip(normal="z", origin=(0, 0, 0), invert=side) for side in (True, False))
    for part in (back, front.clip(normal="y", origin=(0, 0, 0), invert=False)):
        surface = part.extract_surface(algorithm=_SURFACE)
        _add_field(plotter, surface, "pressure", _WATER, high)
        lines = surface.contour(np.linspace(0, high, 9)[1:-1], scalars="pressure")
        plotter.add_mesh(lines, color="white", line_width=2.4, opacity=0.6)
    edges = job["walls"].extract_feature_edges(_SHARP_EDGE_DEG, boundary_edges=False, manifold_edges=False)
    plotter.add_mesh(edges, color=theme.colours["--fig-muted"], line_width=2.4)
    reach = outer * math.sin(min(half, math.pi / 2))
    low = min(inner * math.cos(half), outer * math.cos(half))
    bounds = (low, outer, -reach, reach, -width / 2, width / 2)
    _look(plotter, bounds, direction=(75, -80, 150), up=(1, 0, 0), zoom=1.35, lift=0.11)
    shallow = float(np.hypot(liquid.points[:, 0], liquid.points[:, 1]).min())
    labels = [
        _Label(text="outer wall", point=_polar(outer, 0.45 * half, 0.1 * width), shift=(48, 88)),
        _Label(text="free surface", point=_polar(shallow, 0.55 * half, width / 2), shift=(-40, -140)),
        _Label(text="gas", point=_polar(0.75 * inner + 0.25 * outer, 0.0, width / 2)),
    ]
    return _Lettering(labels=labels, title="pressure in MPa", colours=_WATER, high=high)


def _add_field(plotter: Any, surface: Any, name: str, colours: Colormap, high: float) -> None:
    look = {"ambient": 0.65, "diffuse": 0.4, "specular": 0.05, "show_scalar_bar": False}
    plotter.add_mesh(surface, scalars=name, cmap=colours, clim=[0, high], n_colors=256, **look)


def _draw_disc(plotter: Any, job: Record, liquid: Any, theme: _Theme) -> _Lettering:
    """All chambers with their liquid, the front half of the width cut off, and one tube over its crest."""
    disc, count = job["lengths"], job["chambers"]
    outer, inner, back = disc["outer_radius"], disc["inner_radius"], -disc["axial_width"] / 2
    metal = {"smooth_shading": True, "split_sharp_edges": True, "ambient": 0.2, "diffuse": 0.8}
    for shape in _metal(job):
        plotter.add_mesh(shape, color=theme.metal, **metal)
    depth = np.asarray(liquid.point_data["depth_m"]) * _MM_PER_M
    liquid.point_data["depth"], high = depth, float(depth.max())
    surface = liquid.clip(normal="z", origin=(0, 0, 0.008 * back)).extract_surface(algorithm=_SURFACE)
    for index in range(count):
        _add_field(plotter, surface.rotate_z(360.0 * index / count), "depth", _WATER, high)
    rim = 1.2 * outer
    # Beside the middle of each chamber, where the tube does not run.
    letters = [
        _Label(text=letter, point=_polar(0.62 * inner + 0.38 * outer, angle, 0.0), strong=True)
        for index, letter in enumerate(job["letters"])
        for angle in (2 * math.pi * index / count - 0.22 * job["central_angle"],)
    ]
    labels = [*_add_tube(plotter, disc, theme), _add_arrow(plotter, 1.17 * outer, theme), *letters]
    bounds = (-rim, rim, -rim, rim, back, 0.0)
    _look(plotter, bounds, direction=(35, -95, 150), up=(0, 1, 0), zoom=1.3, lift=0.02)
    return _Lettering(labels=labels, title="depth in mm", colours=_WATER, high=high)


def _metal(job: Record) -> list[Any]:
    """Hub, wall, back plate, and the webs between the chambers; of imported chambers their walls."""
    disc, count = job["lengths"], job["chambers"]
    outer, inner, back = disc["outer_radius"], disc["inner_radius"], -disc["axial_width"] / 2
    wall = 0.07 * outer
    hub = max(inner - wall, 0.5 * inner)
    rings = [
        _ring(outer, outer + wall, back, 0.0),
        _ring(hub, inner, back, 0.0),
        _ring(hub, outer + wall, back - wall, back),
    ]
    if "chamber" in job["fields"]:
        # A little larger than the liquid, whose sides would otherwise coincide with the walls.
        body = job["walls"].scale(_WALL_SCALE).clip(normal="z", origin=(0, 0, 0))
        return rings + [body.rotate_z(360.0 * index / count) for index in range(count)]
    radius = np.linspace((hub + inner) / 2, outer + wall / 2, 41)
    strip = np.arcsin(disc["plate_thickness"] / np.clip(radius, inner, outer))
    side = radius * np.exp(1j * (math.pi / count - job["central_angle"] / 2 + strip))
    web = _prism(np.concatenate([side.conj(), side[::-1]]), back, 0.0)
    return rings + [web.rotate_z(360.0 * (index + 0.5) / count) for index in range(count)]


def _add_arrow(plotter: Any, radius: float, theme: _Theme) -> _Label:
    """An arrow along the rim that shows which way the disc turns."""
    angle = np.radians(np.linspace(287, 325, 40))
    points = np.c_[radius * np.cos(angle), radius * np.sin(angle), np.zeros(angle.size)]
    way, thick = points[-1] - points[-2], 0.014 * radius
    tip = {"center": points[-1] + 2.6 * thick * way / np.linalg.norm(way), "direction": way}
    cone = pv.Cone(**tip, height=7 * thick, radius=2.6 * thick, resolution=36)
    for shape in (pv.MultipleLines(points).tube(radius=thick, n_sides=24), cone):
        plotter.add_mesh(shape, color=theme.mark, ambient=0.4)
    return _Label(text="rotation", point=_polar(1.16 * radius, math.radians(300), -0.1 * radius))


def _add_tube(plotter: Any, disc: Record, theme: _Theme) -> list[_Label]:
    outer, crest = disc["outer_radius"], disc["hump_radius"]
    height, reach = 0.09 * outer, disc["port_radius"] - 0.04 * outer
    path = _tube_path(port=reach, crest=crest, height=height, bend=0.06 * outer)
    radius = max(disc["bore"], 0.045 * outer) / 2
    tube = pv.MultipleLines(path).tube(radius=radius, n_sides=32, capping=True)
    shine = {"smooth_shading": True, "ambient": 0.25, "specular": 0.3}
    plotter.add_mesh(tube, color=theme.colours["--fig-paper"], **shine)
    if crest is None:
        return [_Label(text="connecting tube", point=np.array([0.0, 0.0, height]), shift=(120, -96))]
    top = np.array([0.0, crest, height])
    plotter.add_mesh(pv.Sphere(radius=1.7 * radius, center=top), color=theme.mark, smooth_shading=True)
    return [
        _Label(text=f"siphon crest at {crest:.4g} mm", point=top, shift=(-8, 88)),
        _Label(text="connecting tube", point=path[len(path) // 4], shift=(200, 80)),
    ]


def _tube_path(*, port: float, crest: float | None, height: float, bend: float) -> FloatArray:
    """Schematic centre line from the first chamber's port over the crest to the opposite one's, mm, (n, 3).

    Out of the chamber, inward to the crest's radius, half a turn along it, outward and into the other one;
    without a crest straight across.
    Args: `port`: radius of both ports. `crest`: smallest radius on the path; None: a straight tube.
    `bend`: length of each leg over which a corner is rounded.
    """
    ends = np.array([[port, 0, -height], [port, 0, height], [-port, 0, height], [-port, 0, -height]])
    if crest is None:
        return ends.astype(np.float64)
    angle = np.linspace(0, np.pi, 121)
    arc = np.c_[crest * np.cos(angle), crest * np.sin(angle), np.full(angle.size, height)]
    return np.vstack(
        [
            ends[:1],
            _corner(ends[0], ends[1], arc[0], bend),
            _corner(ends[1], arc[0], arc[5], bend),
            arc[6:-6],
            _corner(arc[-6], arc[-1], ends[2], bend),
            _corner(arc[-1], ends[2], ends[3], bend),
            ends[3:],
        ]
    )


def _corner(before: FloatArray, corner: FloatArray, after: FloatArray, bend: float) -> FloatArray:
    """A corner rounded by a parabola, at most half-way into its legs."""
    legs = [point - corner for point in (before, after)]
    start, end = (corner + leg * min(bend / float(np.linalg.norm(leg)), 0.5) for leg in legs)
    share = np.linspace(0, 1, 13)[:, None]
    return np.asarray((1 - share) ** 2 * start + 2 * share * (1 - share) * corner + share**2 * end)


def _save(plotter: Any, lettering: _Lettering, theme: _Theme, path: Path) -> None:
    """Reduce the picture, letter it and write it."""
    plotter.suppress_rendering = False
    plotter.render()
    pixels = np.asarray(plotter.screenshot(return_img=True), dtype=np.float64)
    width, height = PICTURE
    reduced = pixels.reshape(height, _SCALE, width, _SCALE, 3).mean(axis=(1, 3)) / 255
    figure = Figure(figsize=(width / _DPI, height / _DPI), dpi=_DPI)
    figure.figimage(reduced, zorder=-1)
    projection = plotter.camera.GetCompositeProjectionTransformMatrix(width / height, -1, 1)
    matrix = pv.array_from_vtkmatrix(projection)
    halo = [withStroke(linewidth=10 * _PT_PER_PIXEL, foreground=theme.ground)]
    for label in lettering.labels:
        x, y, _, w = matrix @ np.array([*label.point, 1.0])
        x, y = (x / w + 1) / 2 * width, (y / w + 1) / 2 * height
        right, up = label.shift
        side = "center" if not up else "bottom" if up > 0 else "top"
        look: Record = {"ha": "center", "va": side, "color": theme.ink, "zorder": 3, "path_effects": halo}
        look |= {"fontsize": _FONT_PT, "weight": "bold"} if label.strong else {"fontsize": _FONT_PT}
        text = figure.text(0, (y + up) / height, label.text, **look)
        # The text stays whole within the picture; its leader begins at its upper or lower edge.
        half = text.get_window_extent().width / 2 + 5
        text.set_x(min(max(x + right, half), width - half) / width)
        if up:
            leader: Record = {"color": theme.ink, "linewidth": 2 * _PT_PER_PIXEL, "path_effects": halo}
            leader |= {"transform": None, "marker": "o", "markersize": 8 * _PT_PER_PIXEL, "markevery": [0]}
            figure.add_artist(Line2D([x, x + right], [y, y + up], **leader))
    bar = figure.add_axes((32 / width, 0.18, 35 / width, 0.58))
    bar.set_title(lettering.title, loc="left", color=theme.ink, fontsize=_FONT_PT, pad=14)
    scale = ScalarMappable(Normalize(0, lettering.high), lettering.colours)
    ticks = MaxNLocator(5, steps=[1, 2, 5, 10])
    drawn_bar = figure.colorbar(scale, cax=bar, ticks=ticks, format=FuncFormatter(plain_number))
    drawn_bar.outline.set_edgecolor(theme.ink)
    bar.tick_params(color=theme.ink, labelcolor=theme.ink, labelsize=_FONT_PT - 2)
    canvas: Any = FigureCanvasAgg(figure)
    canvas.draw()
    # Without the alpha channel a file is a tenth smaller.
    Image.fromarray(np.asarray(canvas.buffer_rgba())[..., :3]).save(path, optimize=True)


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
