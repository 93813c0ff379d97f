"""The dimensionless numbers of a scene, from which each term's contribution is judged before solving."""

from __future__ import annotations

from dataclasses import dataclass

from ringbalance.mesh.geometry import surface_radius
from ringbalance.physics.tube.numbers import reynolds_number, rotation_reynolds_number
from ringbalance.reduced_model.chamber.terms import amplification, surface_tension
from ringbalance.reduced_model.law.building import column_pressure
from ringbalance.reduced_model.selection.estimates import (
    FILLING,
    INERTIA,
    LAG,
    injection_estimates,
    injection_time,
)
from ringbalance.reduced_model.selection.range_flow import equal_velocity
from ringbalance.scene.models import Scene


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
    return (*_ring(scene), *_tube(scene), *_times(scene))


def _ring(scene: Scene) -> tuple[_Number, ...]:
    disc, omega = scene.disc, abs(scene.rotor.speed)
    a = float(surface_radius(disc=disc, fill_ratio=disc.max_fill_ratio / 2))
    depth, gravity = disc.outer_radius - a, scene.environment.gravity
    ekman = scene.liquid.kinematic_viscosity / (omega * disc.outer_radius**2)
    bond = scene.liquid.density * omega**2 * a * depth**2 / surface_tension(scene)
    swing = float(amplification(scene, disc.max_fill_ratio / 2))
    across = scene.environment.shaft == "horizontal" and gravity > 0
    return (
        _Number(
            "omega^2 a/g",
            omega**2 * a / gravity if gravity else None,
            "omega^2 a/g",
            "gravity against the ring",
        ),
        _Number(
            "sloshing ratio",
            swing if across else None,
            "|1/(1 - 1/s^2)|, s^2 = k tanh(k ln(R2/a)), k = pi/theta",
            "how much swinging enlarges gravity's ripple at 1x",
        ),
        _Number("Bond number", bond, "rho omega^2 a (R2 - a)^2/sigma", "surface tension against the ring"),
        _Number(
            "Ekman number", ekman, "nu/(omega R2^2)", "layers at the walls of a chamber, sqrt(Ek) R2 thick"
        ),
    )


def _tube(scene: Scene) -> tuple[_Number, ...]:
    hump, bore, nu = scene.tube.hump_radius, scene.tube.bore, scene.liquid.kinematic_viscosity
    re = float(reynolds_number(velocity=equal_velocity(scene), bore=bore, kinematic_viscosity=nu))
    rotation = rotation_reynolds_number(angular_velocity=scene.rotor.speed, bore=bore, kinematic_viscosity=nu)
    column = None if hump is None else column_pressure(scene=scene, radius=hump)
    ratio = column / scene.gas.pressure if column is not None and scene.gas.pressure > 0 else None
    return (
        _Number("R_Omega", rotation, "omega d^2/nu", "friction by rotation"),
        _Number("Re", re, "u d/nu", "laminar or turbulent"),
        _Number("Kl", rotation * re, "R_Omega Re", "rotation in laminar flow"),
        _Number(
            "priming ratio", ratio, "rho omega^2 (R2^2 - r_m^2)/(2 p)", "whether the gas lifts the column"
        ),
    )


def _times(scene: Scene) -> tuple[_Number, ...]:
    deciding, found = injection_time(scene), injection_estimates(scene)

    def over(term: str) -> float | None:
        time = found[term].time
        return None if time is None else time / deciding

    return (
        _Number("inertia time over valve-open time", over(INERTIA), "tau ln 2 over T", "start of the column"),
        _Number(
            "filling time over valve-open time",
            over(FILLING),
            "time to fill, or to vent, over T",
            "gas filling",
        ),
        _Number("valve lag over valve-open time", over(LAG), "lag over T", "valve lag"),
    )
