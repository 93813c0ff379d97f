"""Devices that a scene with eccentric masses may be: every uncertain input drawn by the device's number.

What [uncertainty] does not name is taken as the scene says, but for two inputs that differ from one rotor to
the next: the direction of the imbalance and, where nothing is stated of its size, that too.  Positive inputs
are log-normal, so that no draw has to be clipped.
"""

from __future__ import annotations

import cmath
import math
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, replace
from functools import partial
from typing import Final

from ringbalance.controller.eccentric_mass.plant import PlantParameters
from ringbalance.controller.eccentric_mass.scene_records import EccentricRotor, EccentricScene, SpeedPoint
from ringbalance.controller.rotor import CommonRotor, Rotors
from ringbalance.scene.draws import deviates, quantiles
from ringbalance.scene.origins import InputUncertainty, moved_at
from ringbalance.scene.uncertain import NORMAL_95

ASSUMED_AMPLITUDE: Final = 0.05
"""Relative expanded uncertainty (95 %) of an imbalance of which the scene states none, as of a liquid
ring's."""
PHASE: Final = "imbalance.phase"
FITTED: Final = "fitted together, direction"
_SIZE: Final = ("imbalance.mass", "imbalance.radius")
_ANGLES: Final = frozenset({"rad", "mrad", "deg"})
_Move = Callable[[float], float]


@dataclass(frozen=True, kw_only=True, eq=False)
class Device:
    """One of them."""

    scene: EccentricScene
    """Its plant; a strategy assumes what the scene says that it was drawn from."""
    inputs: Mapping[str, float]
    """Place of everything that was drawn in its distribution, in (0, 1)."""


def device(scene: EccentricScene, number: int, rotors: Rotors | None = None) -> Device:
    """A device by its number. Args: `rotors`: that it runs on; default its own, drawn."""
    seed, plant, inputs = scene.run.seed, scene, {}
    for name, moves in _inputs(scene):
        (normal,), (place,) = (draw(name, (number,), seed=seed) for draw in (deviates, quantiles))
        inputs[name] = float(place)
        for path, move in moves(float(normal) / NORMAL_95, float(place)):
            plant = moved_at(plant, path, move)
    return Device(scene=plant if rotors is None else on_rotor(plant, rotors(number)), inputs=inputs)


def on_rotor(scene: EccentricScene, rotor: CommonRotor) -> EccentricScene:
    """With a rotor's speed, influence coefficient and unbalance, and the scene's own mass, which these leave
    open.

    K_B = M W^2 + Re(W^2/alpha), C_B = Im(W^2/alpha)/W, with the mass M of rotor and both masses.
    """
    whole, dynamic = PlantParameters.of(scene).mass, rotor.speed**2 / rotor.influence
    return replace(
        scene,
        rotor=EccentricRotor(
            mass=scene.rotor.mass,
            stiffness=whole * rotor.speed**2 + dynamic.real,
            damping=dynamic.imag / rotor.speed,
            speed_profile=(SpeedPoint(time=0.0, speed=rotor.speed),),
        ),
        imbalance=replace(
            scene.imbalance,
            mass=abs(rotor.unbalance) / scene.imbalance.radius,
            phase=cmath.phase(rotor.unbalance),
        ),
    )


_Moves = Callable[[float, float], Iterator[tuple[str, _Move]]]
"""How a quantity's paths move, by its deviate over `NORMAL_95` and its place in (0, 1)."""


def _inputs(scene: EccentricScene) -> Iterator[tuple[str, _Moves]]:
    """Everything that is drawn, by name."""
    fitted = {each.quantity for each in scene.fitted.quantities}
    half = scene.requirement.phase_range
    stated = {each.quantity for each in scene.uncertainty} | fitted
    for uncertain in scene.uncertainty:
        if uncertain.quantity not in fitted and not (half and uncertain.quantity == PHASE):
            yield uncertain.quantity, _stated(uncertain, fitted)
    if stated.isdisjoint(_SIZE):
        yield _SIZE[0], _stated(_ASSUMED, fitted)
    for place, column in enumerate(scene.fitted.directions().T):
        yield f"{FITTED} {place + 1}", _together(scene, column.tolist())
    if half:
        yield PHASE, lambda _, place: iter([(PHASE, lambda angle: angle + half * (2.0 * place - 1.0))])


_ASSUMED: Final = InputUncertainty(quantity=_SIZE[0], half_width=ASSUMED_AMPLITUDE, relative=True)


def _stated(uncertain: InputUncertainty, fitted: set[str]) -> _Moves:
    """Both entries of a list alike, but for those that were fitted."""
    name, width = uncertain.quantity, uncertain.half_width
    both = [f"{name}[{place}]" for place in (0, 1)]
    alone = [path for path in both if path not in fitted]

    def moves(normal: float, _: float) -> Iterator[tuple[str, _Move]]:
        def move(value: float) -> float:
            if uncertain.relative:
                return value * math.exp(math.log1p(width) * normal)
            return _by(value, width * normal, linear=name == PHASE)

        for path in [name] if len(alone) == len(both) else alone:
            yield path, move

    return moves


def _together(scene: EccentricScene, column: list[float]) -> _Moves:
    """Along one direction of the joint distribution."""

    def moves(normal: float, _: float) -> Iterator[tuple[str, _Move]]:
        for each, change in zip(scene.fitted.quantities, column, strict=True):
            by = NORMAL_95 * normal * change
            yield each.quantity, partial(_by, change=by, linear=each.unit in _ANGLES)

    return moves


def _by(value: float, change: float, *, linear: bool) -> float:
    """Args: `linear`: whether the quantity may have any sign."""
    return value + change if linear or value <= 0 else value * math.exp(change / value)
