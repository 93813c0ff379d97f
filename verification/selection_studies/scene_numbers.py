"""The dimensionless numbers of a scene, from which each term's contribution is judged before solving."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from ringbalance.mesh.geometry import surface_radius
from ringbalance.physics.tube.friction import reynolds_number, rotation_reynolds_number
from ringbalance.reduced_model.chamber.terms import amplification, surface_tension, wall_layers
from ringbalance.reduced_model.selection.estimates import (
    FILLING,
    INERTIA,
    LAG,
    injection_estimates,
    injection_time,
)
from ringbalance.reduced_model.selection.range_flow import equal_velocity
from ringbalance.reduced_model.tube.flow import column_pressure
from ringbalance.scene.models import Scene

_Row = tuple[str, float | None, str, str]


@dataclass(frozen=True)
class _Number:
    """One dimensionless number of a scene."""

    name: str
    value: float | None
    """None where the scene gives no basis for it."""
    formula: str
    tells: str
    """What it decides."""


def scene_numbers(scene: Scene) -> tuple[_Number, ...]:
    """All numbers that the choice of models rests on, at equal fills; times over the deciding injection's.

    Those of the tube are by a velocity from the correlations alone.
    """
    return tuple(_Number(*row) for row in (*_ring(scene), *_tube(scene), *_times(scene)))


def _ring(scene: Scene) -> tuple[_Row, ...]:
    disc, omega, gravity = scene.disc, abs(scene.rotor.speed), scene.environment.gravity
    fill = disc.max_fill_ratio / 2
    a = float(surface_radius(disc=disc, fill_ratio=fill))
    bond = scene.liquid.density * omega**2 * a * (disc.outer_radius - a) ** 2 / surface_tension(scene)
    across = scene.environment.shaft == "horizontal" and gravity > 0
    swing, formula = None, "|1/(1 - 1/s^2)|, s^2 = k tanh(k ln(R2/a)), k = pi/theta"
    if across:
        swing = float(amplification(scene, fill).largest)
    pull = omega**2 * a / gravity if gravity else None
    layers = "layers at the walls of a chamber, sqrt(Ek) R2 thick"
    return (
        ("omega^2 a/g", pull, "omega^2 a/g", "gravity against the ring"),
        ("sloshing ratio", swing, formula, "how much swinging may enlarge gravity's ripple at 1x"),
        ("Bond number", bond, "rho omega^2 a (R2 - a)^2/sigma", "surface tension against the ring"),
        ("Ekman number", wall_layers(scene, np.array(fill))[1], "nu/(omega R2^2)", layers),
    )


def _tube(scene: Scene) -> tuple[_Row, ...]:
    hump, bore, nu = scene.tube.hump_radius, scene.tube.bore, scene.liquid.kinematic_viscosity
    re = float(reynolds_number(velocity=equal_velocity(scene), bore=bore, kinematic_viscosity=nu))
    rotation = rotation_reynolds_number(angular_velocity=scene.rotor.speed, bore=bore, kinematic_viscosity=nu)
    ratio, formula = None, "rho omega^2 (R2^2 - r_m^2)/(2 p)"
    if hump is not None and scene.gas.pressure > 0:
        ratio = column_pressure(scene=scene, radius=hump) / scene.gas.pressure
    return (
        ("R_Omega", rotation, "omega d^2/nu", "friction by rotation"),
        ("Re", re, "u d/nu", "laminar or turbulent"),
        ("Kl", rotation * re, "R_Omega Re", "rotation in laminar flow"),
        ("priming ratio", ratio, formula, "whether the gas lifts the column"),
    )


def _times(scene: Scene) -> Iterator[_Row]:
    rows = (
        ("inertia time", INERTIA, "tau ln 2 over T", "start of the column"),
        ("filling time", FILLING, "time to fill, or to vent, over T", "gas filling"),
        ("valve lag", LAG, "lag over T", "valve lag"),
    )
    for name, term, formula, tells in rows:
        time = injection_estimates(scene)[term].time
        over = None if time is None else time / injection_time(scene)
        yield f"{name} over valve-open time", over, formula, tells
