"""Random devices of a scene with eccentric masses: every uncertain input drawn by the device's number.

An input that [uncertainty] does not name has the scene's value, with two exceptions that differ from rotor to
rotor: the direction of the imbalance, and its size if no uncertainty of it is stated.  Positive inputs are
log-normal, so that no draw has to be clipped.
"""

from __future__ import annotations

import cmath
import math
from collections.abc import Mapping
from dataclasses import dataclass
from functools import partial
from operator import mul
from typing import Final

from ringbalance.controller.eccentric_mass.plant import PlantParameters
from ringbalance.controller.eccentric_mass.scene_records import EccentricScene, SpeedPoint
from ringbalance.controller.eccentric_mass.targets import reach_of
from ringbalance.controller.rotor import CommonRotor, Rotors
from ringbalance.scene.draws import deviates, quantiles
from ringbalance.scene.origins import InputUncertainty, moved_at, with_values_at
from ringbalance.scene.uncertain import NORMAL_95

ASSUMED_AMPLITUDE: Final = 0.05
"""Relative expanded uncertainty (95 %) of an imbalance without a stated one; liquid rings have the same."""
_SIZING_DEVICES: Final = 256
PHASE: Final = "imbalance.phase"
FITTED: Final = "fitted together, direction"
_SIZE: Final = ("imbalance.mass", "imbalance.radius")
_ANGLE_UNITS: Final = frozenset({"rad", "mrad", "deg"})


@dataclass(frozen=True, kw_only=True, eq=False)
class EccentricDevice:
    """Device drawn from a scene."""

    scene: EccentricScene
    """Scene of the drawn plant; the strategy is configured by the scene before the draw."""
    inputs: Mapping[str, float]
    """Quantile of each drawn input in its distribution, in (0, 1)."""


def device(scene: EccentricScene, number: int, rotors: Rotors | None = None) -> EccentricDevice:
    """Draw a device by its number. Args: `rotors`: rotors of the devices; default drawn from the scene."""
    fitted, half_range = scene.fitted.quantities, scene.requirement.phase_range
    plant, inputs = scene, {}

    def draw(name: str) -> float:
        """Standard normal deviate of an input, divided by `NORMAL_95`; its quantile goes into `inputs`."""
        (normal,) = deviates(name, (number,), seed=scene.run.seed)
        (quantile,) = quantiles(name, (number,), seed=scene.run.seed)
        inputs[name] = float(quantile)
        return float(normal) / NORMAL_95

    fitted_paths = {each.quantity for each in fitted}
    stated = [each for each in scene.uncertainty if each.quantity not in fitted_paths]
    if half_range:
        stated = [each for each in stated if each.quantity != PHASE]
    if fitted_paths.union(each.quantity for each in scene.uncertainty).isdisjoint(_SIZE):
        stated.append(InputUncertainty(quantity=_SIZE[0], half_width=ASSUMED_AMPLITUDE, relative=True))
    for uncertain in stated:
        name, normal, width = uncertain.quantity, draw(uncertain.quantity), uncertain.half_width
        if uncertain.relative:
            move = partial(mul, math.exp(math.log1p(width) * normal))
        else:
            move = partial(_moved, change=width * normal, linear=name == PHASE)
        # Both entries of a list are one quantity and get the same change, except those that were fitted.
        entries = [f"{name}[{i}]" for i in (0, 1)]
        alone = [path for path in entries if path not in fitted_paths]
        for path in [name] if len(alone) == 2 else alone:
            plant = moved_at(plant, path, move)
    for number_of_direction, column in enumerate(scene.fitted.directions().T, start=1):
        normal = draw(f"{FITTED} {number_of_direction}")
        for each, per_deviate in zip(fitted, column.tolist(), strict=True):
            change = NORMAL_95 * normal * per_deviate
            move = partial(_moved, change=change, linear=each.unit in _ANGLE_UNITS)
            plant = moved_at(plant, each.quantity, move)
    if half_range:
        draw(PHASE)
        turn = half_range * (2.0 * inputs[PHASE] - 1.0)
        plant = moved_at(plant, PHASE, lambda angle: angle + turn)
    return EccentricDevice(scene=plant if rotors is None else on_rotor(plant, rotors(number)), inputs=inputs)


def imbalance_ratios(scene: EccentricScene, rotors: Rotors | None = None) -> list[float]:
    """Imbalance over the largest that the masses cancel, of many devices without a run."""
    scenes = (device(scene, number, rotors).scene for number in range(_SIZING_DEVICES))
    return [each.imbalance.mass * each.imbalance.radius / reach_of(each) for each in scenes]


def _moved(value: float, change: float, *, linear: bool) -> float:
    """Add a change, or multiply by exp(change/value). Args: `linear`: True if any sign is possible."""
    return value + change if linear or value <= 0 else value * math.exp(change / value)


def on_rotor(scene: EccentricScene, rotor: CommonRotor) -> EccentricScene:
    """Give a scene a rotor's speed, influence coefficient and unbalance; these leave its mass open.

    K_B = M W^2 + Re(W^2/alpha), C_B = Im(W^2/alpha)/W, with the mass M of rotor and both masses.
    """
    mass, dynamic = PlantParameters.of(scene).mass, rotor.speed**2 / rotor.influence
    values = {
        "rotor.stiffness": mass * rotor.speed**2 + dynamic.real,
        "rotor.damping": dynamic.imag / rotor.speed,
        "rotor.speed_profile": (SpeedPoint(time=0.0, speed=rotor.speed),),
        "imbalance.mass": abs(rotor.unbalance) / scene.imbalance.radius,
        "imbalance.phase": cmath.phase(rotor.unbalance),
    }
    return with_values_at(scene, values)
