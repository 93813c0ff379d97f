"""Draws the connecting tube on its disc, coloured by pressure."""

from __future__ import annotations

from typing import Any, Final

import numpy as np
import pyvista as pv
from matplotlib import colormaps

from ringbalance.reports.pictures.disc_shapes import ring
from ringbalance.reports.pictures.style import Bar, Label, Theme, label_at, look
from ringbalance.scene.arrays import BoolArray, FloatArray, stretches

Record = dict[str, Any]

_VIRIDIS: Final = colormaps["viridis"]
_THICK: Final = 0.05
"""Radius of the drawn tube over the disc's: its own would be a hair."""
_SIDES: Final = 40


def draw_tube(
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
    return _labels(points, full, job, told), Bar.of("pressure in MPa", _VIRIDIS, (low, high))


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


def _labels(points: FloatArray, full: BoolArray, job: Record, told: Record) -> list[tuple[FloatArray, Label]]:
    letters = job["letters"]
    opposite = letters[len(letters) // 2]
    found = [
        label_at(f"from chamber {letters[0]}", points[0], shift=(-96, 112)),
        label_at(f"to chamber {opposite}", points[-1], shift=(72, 112)),
        label_at("hump", points[told["hump"]], shift=(0, -96)),
    ]
    empty = np.flatnonzero(~full)
    if empty.size:
        found.append(label_at("no liquid here", points[empty[empty.size // 2]], shift=(-152, -64)))
    return found
