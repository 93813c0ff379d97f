"""The disc to be turned in a browser: one file with the liquid's mesh and pressure, and the tube."""

from __future__ import annotations

import json
from importlib.resources import files
from typing import Any, Final

import jinja2
import numpy as np
from markupsafe import Markup

from ringbalance.reports.pictures.fields import ShownField, shown_field, shown_fill
from ringbalance.reports.pictures.tube_path import tube_path
from ringbalance.results.numbers import given, number
from ringbalance.scene import Scene
from ringbalance.scene.arrays import FloatArray

VIEW: Final = "view.html"
_MILLIMETRES: Final = 1e3
_STEPS: Final = 73


def view_page(scene: Scene) -> str:
    """A page that shows the liquid of the disc at its first fill, coloured by pressure, with the tube."""
    field = shown_field(scene, fill_ratio=shown_fill(scene))
    highest = float(np.max(field.outside().pressure))
    template = files("ringbalance.reports").joinpath("templates", VIEW).read_text(encoding="utf-8")
    fill = number(field.fill_ratio, digits=2)
    page: str = jinja2.Template(template, autoescape=True, undefined=jinja2.StrictUndefined).render(
        name=scene.name,
        alt=f"The disc's liquid at a fill ratio of {fill}, to be turned, and the tube of one pair.",
        caption=f"Liquid at a fill ratio of {fill}, coloured by its pressure, and the tube of one pair.",
        highest=given(highest, "Pa", digits=4),
        # No text within the data can end the element that holds it.
        data=Markup(json.dumps(_data(scene, field, highest)).replace("<", "\\u003c")),
    )
    return page


def _data(scene: Scene, field: ShownField, highest: float) -> dict[str, Any]:
    outside, disc = field.outside(), scene.disc
    quads = outside.faces
    used, places = np.unique(quads, return_inverse=True)
    points = _MILLIMETRES * outside.places[used]
    # Some meshes begin at zero along the shaft; the view turns about the middle.
    points[:, 2] -= points[:, 2].mean()
    pressure = np.mean(outside.pressure[quads], axis=1) / highest
    half = _MILLIMETRES * disc.axial_width / 2
    return {
        "chambers": disc.chambers,
        "reach": round(_MILLIMETRES * disc.outer_radius * 1.25, 2),
        "points": points.round(2).tolist(),
        "quads": places.reshape(quads.shape).tolist(),
        "shade": np.clip(pressure, 0, 1).round(2).tolist(),
        "lines": [
            *(
                {"kind": "edge", "points": _circle(_MILLIMETRES * radius, end * half)}
                for radius in (disc.inner_radius, disc.outer_radius)
                for end in (-1, 1)
            ),
            {"kind": "tube", "points": _tube(scene, half)},
        ],
    }


def _circle(radius: float, height: float) -> list[list[float]]:
    angle = np.linspace(0, 2 * np.pi, _STEPS)
    x, y, z = radius * np.cos(angle), radius * np.sin(angle), np.full(_STEPS, height)
    return _listed(np.stack([x, y, z], axis=1))


def _tube(scene: Scene, half: float) -> list[list[float]]:
    """On the disc's side, out of the first chamber and into the opposite one."""
    hump = scene.tube.hump_radius
    port, outer = _MILLIMETRES * scene.tube.port_radius, _MILLIMETRES * scene.disc.outer_radius
    path = tube_path(
        port=0.98 * port,
        hump=None if hump is None else _MILLIMETRES * hump,
        height=0.09 * outer,
        bend=0.06 * outer,
    )
    return _listed(path + np.array([0.0, 0.0, half]))


def _listed(points: FloatArray) -> list[list[float]]:
    listed: list[list[float]] = points.round(2).tolist()
    return listed
