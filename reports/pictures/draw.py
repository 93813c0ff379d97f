"""Draws the 3-D pictures off-screen; run in a process of its own, because a driver may take it down.

    python -m ringbalance.reports.pictures.draw JOB.json

The job names the VTU files of the fields, the disc's dimensions in metres and the folder for the PNG files.
VTK must find VTK_DEFAULT_OPENGL_WINDOW in the environment.  Standard input is a pipe that
stays open: when it closes, whoever wanted the pictures is gone, and the drawing ends.
"""

from __future__ import annotations

import json
import math
import os
import sys
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any, Final

import numpy as np
import pyvista as pv
from matplotlib import colormaps
from matplotlib.colors import ListedColormap
from PIL import Image

from ringbalance.reports.pictures.disc_shapes import chamber_outline, ring, split_cells, web
from ringbalance.reports.pictures.style import PICTURE, THEMES, Bar, Label, Theme, label_at, letter, look
from ringbalance.scene.arrays import BoolArray, FloatArray, stretches
from ringbalance.scene.platform.processes import end_with

Record = dict[str, Any]

SCALE: Final = 2
"""Drawn this much larger and then reduced, so that lines and letters are smooth."""
_MILLIMETRES: Final = 1e3
_COLOURS: Final = 256
_OUTSIDE: Final = 1.002
_SHARP: Final = 40.0
"""Angle between faces of an imported chamber from which their edge is drawn, deg."""
_VIRIDIS: Final = colormaps["viridis"]
_WATER: Final = ListedColormap(colormaps["Blues"](np.linspace(0.28, 1.0, 256)))


def main(arguments: list[str]) -> int:
    """Draw every picture of a job in every theme."""
    # Not through sys.stdin, whose lock would be held when the interpreter ends.
    end_with(partial(os.read, 0, 1))
    job = json.loads(Path(arguments[0]).read_text(encoding="utf-8"))
    lengths = {key: None if value is None else value * _MILLIMETRES for key, value in job["lengths"].items()}
    walls = _walls(job["fields"].get("chamber"))
    paints = {"pressure": _draw_pressure, "disc": _draw_disc} | ({"tube": _draw_tube} if job["tube"] else {})
    # One window for all: the driver then compiles its shaders once.
    plotter: Any = pv.Plotter(
        off_screen=True, window_size=[SCALE * side for side in PICTURE], lighting="light kit"
    )
    # The reduction smooths already.
    plotter.render_window.SetMultiSamples(0)
    for name, paint in paints.items():
        field = job["fields"].get(name)
        liquid = None if field is None else _in_millimetres(pv.read(field))
        for theme in THEMES:
            plotter.suppress_rendering = True
            plotter.clear_actors()
            plotter.set_background(theme.background)
            labels, scale = paint(plotter, job | {"lengths": lengths, "walls": walls}, liquid, theme)
            _save(plotter, labels, scale, theme, Path(job["folder"]) / f"{name}-{theme.name}.png")
    plotter.close()
    return 0


def _walls(path: str | None) -> Any:
    """Surface of an imported chamber in millimetres; None for a sector between plates."""
    if path is None:
        return None
    grid = split_cells(pv.read(path))
    grid.points = np.asarray(grid.points) * _MILLIMETRES
    return grid.extract_surface(algorithm="dataset_surface")


def _in_millimetres(grid: Any) -> Any:
    """Linear cells in millimetres and MPa, eight for each quadratic one of the file, on its very nodes."""
    fine = split_cells(grid)
    fine.points = np.asarray(fine.points) * _MILLIMETRES
    fine.point_data["pressure"] = np.asarray(fine.point_data["pressure_Pa"]) * 1e-6
    fine.point_data["depth"] = np.asarray(fine.point_data["depth_m"]) * _MILLIMETRES
    return fine


def _pixel(plotter: Any, place: FloatArray) -> tuple[float, float]:
    """Where a place of the scene stands in the picture."""
    camera, (width, height) = plotter.camera, (SCALE * side for side in PICTURE)
    matrix = camera.GetCompositeProjectionTransformMatrix(width / height, -1, 1)
    rows = np.array([[matrix.GetElement(i, j) for j in range(4)] for i in range(4)])
    x, y, _, w = rows @ np.array([*place, 1.0])
    return (x / w + 1) / 2 * width, (1 - y / w) / 2 * height


def _save(plotter: Any, labels: list[tuple[FloatArray, Label]], scale: Bar, theme: Theme, path: Path) -> None:
    """Letters, reduces and writes the picture."""
    plotter.suppress_rendering = False
    plotter.render()
    image = Image.fromarray(plotter.screenshot(return_img=True))
    placed = [
        replace(label, place=_pixel(plotter, place), shift=(SCALE * label.shift[0], SCALE * label.shift[1]))
        for place, label in labels
    ]
    lettered = letter(image, labels=placed, bar=scale, ink=theme.ink, ground=theme.background, scale=SCALE)
    # All colours: a palette of 256 shows as steps in a colour bar.
    lettered.reduce(SCALE).save(path)


def _draw_pressure(
    plotter: Any, job: Record, liquid: Any, theme: Theme
) -> tuple[list[tuple[FloatArray, Label]], Bar]:
    """The liquid of one chamber, a corner cut away, coloured by pressure, in the outline of its chamber."""
    disc, half = job["lengths"], job["central_angle"] / 2
    outer, inner, width = disc["outer_radius"], disc["inner_radius"], disc["axial_width"]
    high = float(liquid.point_data["pressure"].max())
    for part in _without_corner(liquid):
        _add_field(plotter, part, high)
    for edge in _outline(job, half):
        plotter.add_mesh(edge, color=theme.edge, line_width=2.4)
    reach = outer * math.sin(min(half, math.pi / 2))
    low = min(inner * math.cos(half), outer * math.cos(half))
    bounds = (low, outer, -reach, reach, -width / 2, width / 2)
    look(plotter, direction=(75, -80, 150), up=(1, 0, 0), zoom=1.35, bounds=bounds, lift=0.11)
    shallow = float(np.hypot(liquid.points[:, 0], liquid.points[:, 1]).min())
    return [
        label_at("outer wall", _polar(outer, 0.45 * half, 0.1 * width), shift=(48, -88)),
        label_at("free surface", _polar(shallow, 0.55 * half, width / 2), shift=(-100, 120)),
        label_at("gas", _polar(0.75 * inner + 0.25 * outer, 0.0, width / 2)),
    ], Bar.of("pressure in MPa", _VIRIDIS, (0.0, high))


def _outline(job: Record, half: float) -> list[Any]:
    """Edges of the whole chamber."""
    disc, walls = job["lengths"], job["walls"]
    if walls is not None:
        return [walls.extract_feature_edges(_SHARP, boundary_edges=False, manifold_edges=False)]
    return chamber_outline(
        inner=disc["inner_radius"],
        outer=disc["outer_radius"],
        half_thickness=disc["plate_thickness"],
        half_angle=half,
        width=disc["axial_width"],
    )


def _without_corner(liquid: Any) -> tuple[Any, Any]:
    """The back half, and the left half of the front."""
    front = liquid.clip(normal="z", origin=(0, 0, 0), invert=False)
    return (
        liquid.clip(normal="z", origin=(0, 0, 0), invert=True),
        front.clip(normal="y", origin=(0, 0, 0), invert=False),
    )


def _add_field(plotter: Any, part: Any, high: float) -> None:
    surface = part.extract_surface(algorithm="dataset_surface")
    plotter.add_mesh(
        surface,
        scalars="pressure",
        cmap=_VIRIDIS,
        clim=[0, high],
        n_colors=256,
        ambient=0.65,
        diffuse=0.4,
        show_scalar_bar=False,
    )
    lines = surface.contour(np.linspace(0, high, 9)[1:-1], scalars="pressure")
    plotter.add_mesh(lines, color="white", line_width=2.4, opacity=0.6)


def _polar(radius: float, angle: float, height: float) -> FloatArray:
    return np.array([radius * math.cos(angle), radius * math.sin(angle), height])


def _draw_disc(
    plotter: Any, job: Record, liquid: Any, theme: Theme
) -> tuple[list[tuple[FloatArray, Label]], Bar]:
    """All chambers with their liquid, the front half of the width cut off, and one tube over its crest."""
    disc, count = job["lengths"], job["chambers"]
    _add_metal(plotter, job, theme)
    high = float(liquid.point_data["depth"].max())
    body = liquid.clip(normal="z", origin=(0, 0, -0.004 * disc["axial_width"]))
    surface = body.extract_surface(algorithm="dataset_surface")
    for index in range(count):
        plotter.add_mesh(
            surface.rotate_z(360.0 * index / count),
            scalars="depth",
            cmap=_WATER,
            clim=[0, high],
            ambient=0.65,
            diffuse=0.4,
            specular=0.05,
            show_scalar_bar=False,
        )
    labels = _add_tube(plotter, disc, theme)
    outer, inner = disc["outer_radius"], disc["inner_radius"]
    labels.append(_add_arrow(plotter, 1.17 * outer, theme))
    rim = 1.2 * outer
    look(
        plotter,
        direction=(35, -95, 150),
        up=(0, 1, 0),
        zoom=1.3,
        bounds=(-rim, rim, -rim, rim, -disc["axial_width"] / 2, 0.0),
        lift=0.02,
    )
    for index, name in enumerate(job["letters"]):
        angle = 2 * math.pi * (index / count) - 0.22 * job["central_angle"]
        # Beside the middle of the chamber, where the tube does not run.
        labels.append(label_at(name, _polar(0.62 * inner + 0.38 * outer, angle, 0.0), size=43))
    return labels, Bar.of("depth in mm", _WATER, (0.0, high))


def _add_metal(plotter: Any, job: Record, theme: Theme) -> None:
    """Hub, wall, back plate and the webs between the chambers."""
    disc, count = job["lengths"], job["chambers"]
    outer, inner, back = disc["outer_radius"], disc["inner_radius"], -disc["axial_width"] / 2
    wall = 0.07 * outer
    hub = max(inner - wall, 0.5 * inner)
    shapes = [
        ring(inner=outer, outer=outer + wall, bottom=back, top=0.0),
        ring(inner=hub, outer=inner, bottom=back, top=0.0),
        ring(inner=hub, outer=outer + wall, bottom=back - wall, top=back),
    ]
    if job["walls"] is None:
        shapes += _webs(job, start=(hub + inner) / 2, end=outer + wall / 2, bottom=back)
    else:
        # A little larger than the liquid, whose sides would else lie in its own.
        body = job["walls"].scale(_OUTSIDE).clip(normal="z", origin=(0, 0, 0))
        shapes += [body.rotate_z(360.0 * index / count) for index in range(count)]
    for shape in shapes:
        plotter.add_mesh(
            shape, color=theme.metal, smooth_shading=True, split_sharp_edges=True, ambient=0.2, diffuse=0.8
        )


def _webs(job: Record, *, start: float, end: float, bottom: float) -> list[Any]:
    """The solids between the chambers of a disc with plates."""
    disc, count = job["lengths"], job["chambers"]
    radius = np.linspace(disc["inner_radius"], disc["outer_radius"], 41)
    strip = np.arcsin(disc["plate_thickness"] / radius)
    between = math.pi / count - (job["central_angle"] / 2 - strip)
    solid = web(start=start, end=end, half_angle=between, radius=radius, bottom=bottom, top=0.0)
    return [solid.rotate_z(360.0 * (index + 0.5) / count) for index in range(count)]


def _add_arrow(plotter: Any, radius: float, theme: Theme) -> tuple[FloatArray, Label]:
    """An arrow along the rim that shows which way the disc turns."""
    angle = np.radians(np.linspace(287, 325, 40))
    points = np.c_[radius * np.cos(angle), radius * np.sin(angle), np.zeros(angle.size)]
    way = points[-1] - points[-2]
    thick = 0.014 * radius
    plotter.add_mesh(
        pv.lines_from_points(points).strip().tube(radius=thick, n_sides=24), color=theme.mark, ambient=0.4
    )
    tip = pv.Cone(
        center=points[-1] + 2.6 * thick * way / np.linalg.norm(way),
        direction=way,
        height=7 * thick,
        radius=2.6 * thick,
        resolution=36,
    )
    plotter.add_mesh(tip, color=theme.mark, ambient=0.4)
    return label_at("rotation", _polar(1.16 * radius, math.radians(300), -0.1 * radius))


def _add_tube(plotter: Any, disc: Record, theme: Theme) -> list[tuple[FloatArray, Label]]:
    outer, hump = disc["outer_radius"], disc["hump_radius"]
    height = 0.09 * outer
    reach = disc["port_radius"] - 0.04 * outer
    path = tube_path(port=reach, hump=hump, height=height, bend=0.06 * outer)
    radius = max(disc["bore"], 0.045 * outer) / 2
    tube = pv.lines_from_points(path).strip().tube(radius=radius, n_sides=32, capping=True)
    plotter.add_mesh(tube, color=theme.tube, smooth_shading=True, ambient=0.25, specular=0.3)
    if hump is None:
        return [label_at("connecting tube", np.array([0.0, 0.0, height]), shift=(120, 96))]
    top = np.array([0.0, hump, height])
    plotter.add_mesh(
        pv.Sphere(radius=1.7 * radius, center=top), color=theme.mark, smooth_shading=True, ambient=0.3
    )
    side = path[len(path) // 4]
    return [
        label_at(f"siphon crest at {hump:.4g} mm", top, shift=(-8, -88)),
        label_at("connecting tube", side, shift=(200, -80)),
    ]


def tube_path(*, port: float, hump: float | None, height: float, bend: float) -> FloatArray:
    """Schematic centre line from the first chamber's port over the crest to the opposite one's.

    Out of the chamber, inward to the crest's radius, along that radius half-way round, outward and in again;
    without a crest straight across.
    Args: `port`: radius of both ports, mm. `hump`: smallest radius on the path, mm; None: a straight tube.
    `bend`: radius of its corners, mm.
    Returns: Points, mm, shape (n, 3).
    """
    low = -height
    if hump is None:
        return np.array(
            [[port, 0, low], [port, 0, height], [-port, 0, height], [-port, 0, low]], dtype=np.float64
        )
    angle = np.linspace(0, np.pi, 121)
    arc = np.c_[hump * np.cos(angle), hump * np.sin(angle), np.full(angle.size, height)]
    return np.vstack(
        [
            [[port, 0, low]],
            _corner(np.array([port, 0, low]), np.array([port, 0, height]), arc[0], bend),
            _corner(np.array([port, 0, height]), arc[0], arc[5], bend),
            arc[6:-6],
            _corner(arc[-6], arc[-1], np.array([-port, 0, height]), bend),
            _corner(arc[-1], np.array([-port, 0, height]), np.array([-port, 0, low]), bend),
            [[-port, 0, low]],
        ]
    )


def _corner(before: FloatArray, corner: FloatArray, after: FloatArray, bend: float) -> FloatArray:
    """A corner rounded by a parabola, at most half-way into its legs."""
    legs = [point - corner for point in (before, after)]
    start, end = (corner + leg * min(bend / float(np.linalg.norm(leg)), 0.5) for leg in legs)
    share = np.linspace(0, 1, 13)[:, None]
    return np.asarray((1 - share) ** 2 * start + 2 * share * (1 - share) * corner + share**2 * end)


_THICK: Final = 0.05
"""Radius of the drawn tube over the disc's: its own would be a hair."""
_SIDES: Final = 40


def _draw_tube(
    plotter: Any, job: Record, _liquid: Any, theme: Theme
) -> tuple[list[tuple[FloatArray, Label]], Bar]:
    """The tube's half turn over the crest, liquid in colour, gas or cavity as bare wall."""
    told, disc = job["tube"], job["lengths"]
    outer = disc["outer_radius"]
    points = 1e3 * np.array(told["points"]) + np.array([0.0, 0.0, 1.5 * _THICK * outer])
    pressure, full = np.array(told["pressure"]) * 1e-6, np.array(told["full"], dtype=bool)
    low, high = float(pressure.min()), float(pressure.max())
    _add_disc(plotter, disc, theme)
    for filled, part in stretches(full.tolist()):
        _add_part(plotter, points[part], pressure[part], filled, (low, high), _THICK * outer, theme)
    edge = 1.08 * outer
    look(
        plotter,
        direction=(0, -70, 140),
        up=(0, 1, 0),
        zoom=1.42,
        bounds=(-edge, edge, -0.35 * outer, edge, 0.0, 2 * _THICK * outer),
        lift=0.17,
    )
    return _tube_labels(points, full, job, told), Bar.of("pressure in MPa", _VIRIDIS, (low, high))


def _add_disc(plotter: Any, disc: Record, theme: Theme) -> None:
    """Back plate, outer wall and hub."""
    outer, inner = disc["outer_radius"], disc["inner_radius"]
    plate = 0.05 * outer
    shapes = [
        ring(inner=0.55 * inner, outer=1.07 * outer, bottom=-2 * plate, top=-plate),
        ring(inner=outer, outer=1.07 * outer, bottom=-plate, top=0.5 * plate),
        ring(inner=0.55 * inner, outer=inner, bottom=-plate, top=0.5 * plate),
    ]
    for shape in shapes:
        plotter.add_mesh(
            shape, color=theme.metal, smooth_shading=True, split_sharp_edges=True, ambient=0.3, diffuse=0.7
        )


def _add_part(
    plotter: Any,
    points: FloatArray,
    pressure: FloatArray,
    filled: bool,
    limits: tuple[float, float],
    radius: float,
    theme: Theme,
) -> None:
    if len(points) < 2:
        return
    line = pv.lines_from_points(points)
    line.point_data["pressure"] = pressure
    tube = line.strip().tube(radius=radius, n_sides=_SIDES, capping=True)
    if not filled:
        plotter.add_mesh(tube, color=theme.edge, opacity=0.35, smooth_shading=True, ambient=0.4)
        return
    plotter.add_mesh(
        tube,
        scalars="pressure",
        cmap=_VIRIDIS,
        clim=limits,
        n_colors=256,
        ambient=0.55,
        diffuse=0.5,
        specular=0.1,
        smooth_shading=True,
        show_scalar_bar=False,
    )


def _tube_labels(
    points: FloatArray, full: BoolArray, job: Record, told: Record
) -> list[tuple[FloatArray, Label]]:
    letters = job["letters"]
    opposite = letters[len(letters) // 2]
    found = [
        label_at(f"from chamber {letters[0]}", points[0], shift=(-96, 112)),
        label_at(f"to chamber {opposite}", points[-1], shift=(72, 112)),
        label_at("siphon crest", points[told["hump"]], shift=(0, -96)),
    ]
    empty = np.flatnonzero(~full)
    if empty.size:
        found.append(label_at("no liquid here", points[empty[empty.size // 2]], shift=(-152, -64)))
    return found


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
