"""Camera and labels of the 3-D pictures."""

from __future__ import annotations

from typing import Any

import numpy as np

from ringbalance.reports.pictures.text import FONT_SIZE, Label
from ringbalance.scene.arrays import FloatArray


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
    text: str, place: FloatArray, *, shift: tuple[float, float] = (0, 0), size: int = FONT_SIZE
) -> tuple[FloatArray, Label]:
    """A label at a place of the scene; its place in the picture is found once the camera stands.

    Args: `place`: mm, shape (3,). `size`: px.
    """
    return place, Label(text=text, place=(0, 0), shift=shift, size=size)
