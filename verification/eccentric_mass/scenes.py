"""Scenes that differ from a given one in what a figure of the paper varies."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

from ringbalance.scene.eccentric_models import EccentricScene, SpeedPoint

RPM = 2 * math.pi / 60


def changed(scene: EccentricScene, table: str, **values: Any) -> EccentricScene:
    """The scene with some values of one table replaced.

    Args: `table`: name of the table, such as "lqr". `**values`: by key, SI.
    """
    return replace(scene, **{table: replace(getattr(scene, table), **values)})


def at_constant_speed(
    scene: EccentricScene, *, time_limit: float, speed: float | None = None
) -> EccentricScene:
    """The scene at one speed.

    Args: `time_limit`: of the run, s. `speed`: rad/s; default the first of the scene's profile.
    """
    kept = scene.rotor.speed_profile[0].speed if speed is None else speed
    level = changed(scene, "rotor", speed_profile=(SpeedPoint(time=0.0, speed=kept),))
    return changed(level, "run", time_limit=time_limit)
