"""Random scenes for judging the choice of models, drawn from wide ranges and the same for the same number."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Final

import numpy as np

from ringbalance.mesh.geometry import surface_radius
from ringbalance.scene.models import Bend, Disc, Scene

SEED: Final = 20_260
LOWEST_RATIO: Final = 1.3
"""Smallest omega^2 a/g at the largest fill."""
ANGLES: Final = (45.0, 60.0, 90.0)
"""Central angles, degrees."""


def random_scene(base: Scene, number: int) -> Scene:
    """A scene with disc, liquid, tube, gas, shaft and speed drawn at random, the rest as in `base`.

    A ring exists: the speed lies between 1.3 times what gravity allows and 15 000 rpm.
    """
    rng = np.random.default_rng([SEED, number])
    disc = _disc(base.disc, rng)
    gravity = base.environment.gravity
    a = float(surface_radius(disc=disc, fill_ratio=disc.max_fill_ratio))
    slowest = math.sqrt(LOWEST_RATIO * gravity / a)
    speed = _between(rng, slowest, 15_000 * math.pi / 30, even_in_log=True)
    density = _between(rng, 700.0, 2500.0)
    liquid = replace(
        base.liquid,
        name="custom",
        density=density,
        kinematic_viscosity=_between(rng, 3e-7, 2e-4, even_in_log=True),
        density_uncertainty=0.0,
        viscosity_uncertainty=0.0,
    )
    level = density * speed**2 * (disc.outer_radius**2 - a**2) / 2
    pressure = max(_between(rng, 0.5, 4.0) * level, 2e3)
    scene = replace(
        base,
        name=f"random scene {number}",
        disc=disc,
        liquid=liquid,
        rotor=replace(base.rotor, speed=speed),
        environment=replace(base.environment, shaft="vertical" if rng.random() < 0.05 else "horizontal"),
        gas=replace(base.gas, pressure=pressure),
        uncertainty=(),
        source=f"random {number}",
    )
    return _with_tube(scene, rng)


def _between(rng: np.random.Generator, low: float, high: float, *, even_in_log: bool = False) -> float:
    if even_in_log:
        return float(np.exp(rng.uniform(math.log(low), math.log(high))))
    return float(rng.uniform(low, high))


def _disc(base: Disc, rng: np.random.Generator) -> Disc:
    outer = _between(rng, 0.03, 0.12, even_in_log=True)
    angle = float(rng.choice(ANGLES))
    inner = outer * _between(rng, 0.3, 0.6)
    largest = _between(rng, 0.25, 0.6)
    return replace(
        base,
        outer_radius=outer,
        inner_radius=inner,
        axial_width=outer * _between(rng, 0.4, 2.0),
        central_angle=math.radians(angle),
        chambers=round(360 / angle),
        plate_thickness=inner * math.sin(math.radians(angle) / 2) * _between(rng, 0.0, 0.25),
        max_fill_ratio=largest,
        initial_fill=largest / 2,
    )


def _with_tube(scene: Scene, rng: np.random.Generator) -> Scene:
    disc, bore = scene.disc, _between(rng, 0.8e-3, 4e-3, even_in_log=True)
    hump = None
    if rng.random() < 0.6:
        hump = disc.inner_radius + (disc.outer_radius - disc.inner_radius) * _between(rng, 0.3, 0.9)
    tube = replace(
        scene.tube,
        bore=bore,
        port_radius=disc.outer_radius,
        hump_radius=hump,
        length=_between(rng, 2.5, 5.0) * disc.outer_radius + 4 * bore,
        roughness=bore * _between(rng, 1e-4, 1e-2, even_in_log=True),
        bends=(Bend(angle=math.pi / 2, radius=2 * bore),) * int(rng.integers(0, 3)),
        drag_coefficient=None,
    )
    return replace(scene, tube=tube)
