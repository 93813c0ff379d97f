"""The scene of the cases on the eccentric-mass paper, at one speed too, and curves thin enough to draw."""

from __future__ import annotations

import math
from dataclasses import replace
from functools import lru_cache
from typing import Any, Final

import numpy as np
import numpy.typing as npt

from ringbalance.controller.eccentric_mass.scene_records import EccentricScene, SpeedPoint, eccentric_scene
from ringbalance.scene import bundled_scene, load_scene
from ringbalance.scene.arrays import FloatArray, IntArray
from ringbalance.scene.keys.declaration import keys_of

RPM: Final = 2 * math.pi / 60
DRIVEN_SCENE: Final = "eccentric_mass_paper"
_DRAWN: Final = 240
"""Points of a curve."""


@lru_cache(maxsize=1)
def driven_scene() -> EccentricScene:
    """The eccentric-mass paper's own rotor."""
    return eccentric_scene(load_scene(bundled_scene(DRIVEN_SCENE)))


def thinned(values: npt.ArrayLike) -> FloatArray:
    """Evenly chosen values along the last axis, at most 240, the first and last among them."""
    array = np.asarray(values, dtype=np.float64)
    return np.asarray(array[..., _places(array.shape[-1])], dtype=np.float64)


def envelope(values: npt.ArrayLike) -> FloatArray:
    """Largest value in each of so many stretches, so that a thinned curve keeps its peaks."""
    array = np.asarray(values, dtype=np.float64)
    return np.asarray(np.maximum.reduceat(array, _places(array.size)), dtype=np.float64)


def convergence_time(time: FloatArray, error: FloatArray, *, limit: float) -> float:
    """Instant from which on an error stays within a limit, s; infinite when the last is beyond it."""
    beyond = np.flatnonzero(error > limit)
    if beyond.size == 0:
        return float(time[0])
    last = int(beyond[-1])
    return math.inf if last == time.size - 1 else float(time[last + 1])


def _places(size: int) -> IntArray:
    return np.unique(np.linspace(0, size - 1, _DRAWN).round().astype(np.int64))


def changed(scene: EccentricScene, table: str, **values: Any) -> EccentricScene:
    """The scene with some values of one table replaced, and with the defaults that follow from them.

    Unlike `SceneFile.with_values` it checks nothing: at the ends of an assumed noise, say, the limit may lie
    below the noise. Args: `**values`: by key, SI.
    """
    scene = replace(scene, **{table: replace(getattr(scene, table), **values)})
    changes = {f"{table}.{name}" for name in values}
    for path in scene.defaulted:
        part, _, name = path.partition(".")
        if not hasattr(scene, part) or path in changes:
            continue
        record: Any = type(getattr(scene, part))
        presence = keys_of(record)[name].presence
        if not changes.isdisjoint(presence.needs):
            needed = [getattr(getattr(scene, p), key) for p, key in (n.split(".") for n in presence.needs)]
            scene = replace(scene, **{part: replace(getattr(scene, part), **{name: presence.value(*needed)})})
            changes.add(path)
    return scene


def at_constant_speed(
    scene: EccentricScene, *, time_limit: float, speed: float | None = None
) -> EccentricScene:
    """The scene at one speed. Args: `speed`: rad/s; default the first of the scene's profile."""
    kept = scene.rotor.speed_profile[0].speed if speed is None else speed
    level = changed(scene, "rotor", speed_profile=(SpeedPoint(time=0.0, speed=kept),))
    return changed(level, "run", time_limit=time_limit)
