"""How many substeps a run takes, counted before it begins."""

from __future__ import annotations

import math
from typing import Final

import numpy as np

from ringbalance.controller.eccentric_mass.plant.integrate import LONGEST, fastest_rate
from ringbalance.controller.eccentric_mass.plant.parameters import PlantParameters
from ringbalance.scene.eccentric_models import EccentricScene
from ringbalance.scene.faults import Fault, SceneError
from ringbalance.scene.units import format_quantity

MOST_SUBSTEPS: Final = 30_000_000
"""About one minute, at 2 us each."""
MOST_SAMPLES: Final = 2_000_000
"""About 500 MB of histories."""


def check_substeps(scene: EccentricScene) -> None:
    """Refuse a scene whose run would take many minutes or much memory.

    A substep lasts at most 0.1 / (|W| + sqrt(K_B / M) + C_B / M + C_add / J_least).
    Raises: SceneError: more than `MOST_SAMPLES`, or more than `MOST_SUBSTEPS`; it names the key of the
    fastest rate and what is allowed.
    """
    samples = scene.run.time_limit / scene.sensor.step + 1
    if samples > MOST_SAMPLES:
        longest = scene.sensor.step * (MOST_SAMPLES - 1)
        problem = f"the run would take {samples:.3g} samples, and {MOST_SAMPLES:.3g} are the most"
        value = format_quantity(scene.run.time_limit, "time", "s")
        allowed = f"at most {longest:.4g} s, or a longer sensor.step"
        raise SceneError([_fault(scene, ("run", "time_limit"), value, problem, allowed)])
    count = _substeps(scene)
    if count > MOST_SUBSTEPS:
        key, value, allowed = _fastest(scene)
        problem = (
            f"the run would take {count:.3g} steps of the integration, and {MOST_SUBSTEPS:.3g} are the most"
        )
        raise SceneError([_fault(scene, key, value, problem, f"{allowed}, or a shorter run.time_limit")])


def longest_run(scene: EccentricScene) -> float:
    """Longest run.time_limit that `check_substeps` allows, s, if the speed stays what it is on average."""
    by_samples = scene.sensor.step * (MOST_SAMPLES - 1)
    return min(by_samples, scene.run.time_limit * MOST_SUBSTEPS / _substeps(scene))


def _substeps(scene: EccentricScene) -> float:
    parameters, step = PlantParameters.of(scene), scene.sensor.step
    times, speeds = scene.rotor.profile
    samples = scene.samples
    # Not at every sample: close enough for a limit, and cheap.
    at = np.linspace(0.0, scene.run.time_limit, min(samples, 10_000))
    rates = np.abs(np.interp(at, times, speeds)) + fastest_rate(parameters, 0.0)
    return samples * float(np.mean(np.maximum(np.ceil(rates * step / LONGEST), 1.0)))


def _fastest(scene: EccentricScene) -> tuple[tuple[str, str], str, str]:
    """Key, present value and limit of the largest of the rates that the steps follow from."""
    plant, resistance = PlantParameters.of(scene), scene.motor.resistance
    least = plant.inertia + plant.drive_inertia - 2 * plant.moment**2 / plant.mass
    speed = max(abs(point.speed) for point in scene.rotor.speed_profile)
    whirl, damped = math.sqrt(plant.stiffness / plant.mass), plant.damping / plant.mass
    drive = plant.drive_damping / least
    # Half of what the whole run may have: the other rates take their part.
    rate = 0.5 * MOST_SUBSTEPS * LONGEST / scene.run.time_limit
    most, lowest = "at most", "at least"
    keys = [
        (whirl, ("rotor", "stiffness"), plant.stiffness, most, plant.mass * rate**2, "stiffness", "N/m"),
        (damped, ("rotor", "damping"), plant.damping, most, plant.mass * rate, "damping", "N*s/m"),
        (speed, ("rotor", "speed_profile"), speed, most, rate, "speed", "rpm"),
        (drive, ("motor", "resistance"), resistance, lowest, resistance * drive / rate, "resistance", "ohm"),
    ]
    _, key, value, bound, limit, dimension, unit = max(keys)
    shown = format_quantity(limit, dimension, unit, digits=3)
    return key, format_quantity(value, dimension, unit), f"{bound} {shown}"


def _fault(scene: EccentricScene, key: tuple[str, str], value: str, problem: str, allowed: str) -> Fault:
    return Fault(file=scene.file, table=key[0], key=key[1], value=value, problem=problem, allowed=allowed)
