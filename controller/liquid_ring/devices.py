"""Devices that a liquid ring's scene may be: every uncertain input drawn, and the law made for each."""

from __future__ import annotations

import cmath
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Final

import numpy as np

from ringbalance.controller.loop_records import MomentTable
from ringbalance.controller.rotor import CommonRotor, Rotors
from ringbalance.reduced_model.chamber.contributions import gravity_shares
from ringbalance.reduced_model.law.calibrated_law import CalibratedLaw, CalibratedMoment
from ringbalance.reduced_model.law.flow_law import BalancerModel
from ringbalance.reduced_model.law.making import nominal_laws
from ringbalance.reduced_model.law.paper_law import PaperLaw, paper_model
from ringbalance.scene.arrays import FloatArray
from ringbalance.scene.draws import deviates, quantiles
from ringbalance.scene.loop_models import Rotor
from ringbalance.scene.models import Scene
from ringbalance.scene.uncertain import (
    NORMAL_95,
    independent_half_widths,
    moved,
    shifted_in_turn,
)

ASSUMED_INFLUENCE: Final = 0.05
"""Relative expanded uncertainty (95 %) of an influence coefficient for which the scene states none."""
ASSUMED_LAG: Final = math.radians(3.0)
"""Expanded uncertainty (95 %) of a lag angle for which the scene states none."""
ASSUMED_AMPLITUDE: Final = 0.05
"""Relative expanded uncertainty (95 %) of the initial amplitude from one machine to the next."""
PAPER_DRAG_UNCERTAINTY: Final = 0.1
"""Relative half-width taken for "k is about 50"."""
PAPER_MOMENT_UNCERTAINTY: Final = 0.007
"""Relative half-width that the liquid-ring paper states for lambda."""
LOSS: Final = "model: loss of the tube"
CAVITY: Final = "model: pressure of the cavity"
MOMENT: Final = "model: moment"
AMPLITUDE: Final = "rotor.initial_amplitude"
PHASE: Final = "rotor.initial_phase"
FITTED: Final = "fitted together, direction"
"""Names of what is drawn beside the inputs of the scene."""


@dataclass(frozen=True, kw_only=True)
class Spread:
    """What differs between the devices of a scene under a law; expanded uncertainties (95 %)."""

    inputs: Mapping[str, float]
    """Of each input by itself, SI."""
    directions: FloatArray
    """Of inputs that were fitted together, SI, shape (quantities, directions)."""
    loss: float
    """Of the tube's head by models alone, relative; of a law that is not remade that of its velocity."""
    cavity: bool
    """Whether the pressure of a cavity lies anywhere between the vapour's and the gas's."""
    remade: bool
    """Whether a device has a law of its own, and not the scene's with another velocity."""
    moment: float
    """Of the moment by models alone, relative."""

    @property
    def names(self) -> tuple[str, ...]:
        """Of all that is drawn, inputs of the scene by their keys."""
        fitted = [f"{FITTED} {place + 1}" for place in range(self.directions.shape[1])]
        cavity = [CAVITY] if self.cavity else []
        return (*self.inputs, *fitted, LOSS, *cavity, MOMENT, AMPLITUDE, PHASE)

    @classmethod
    def of(cls, scene: Scene, model: BalancerModel, *, remade: bool = True) -> Spread:
        """Stated uncertainties, else assumed ones, and the errors of the law's models.

        Args: `remade`: whether a calibrated law is the scene's own.
        """
        rotor, fitted = scene.rotor, {each.key for each in scene.fitted.quantities}
        assumed = {
            "influence_coefficient": ASSUMED_INFLUENCE * rotor.influence_coefficient,
            "lag_angle": ASSUMED_LAG,
        }
        inputs = dict(independent_half_widths(scene))
        inputs |= {
            name: width
            for name, width in assumed.items()
            if name not in inputs and name not in fitted and not _states(scene, name)
        }
        return cls(
            inputs=inputs,
            directions=NORMAL_95 * scene.fitted.directions(),
            loss=_loss(scene, model, remade=remade),
            cavity=remade and isinstance(model.flow, CalibratedLaw) and model.flow.path.released > 0.0,
            remade=remade and isinstance(model.flow, CalibratedLaw),
            moment=_moment(model),
        )


@dataclass(frozen=True, kw_only=True, eq=False)
class Device:
    """One of them: its scene, with the vibration that it starts with, and its law."""

    number: int
    scene: Scene
    model: BalancerModel
    speed: float
    """Factor on the law's velocity."""
    moment: float
    """Factor on the law's moments."""
    inputs: Mapping[str, float]
    """Place of everything that was drawn in its distribution, in (0, 1)."""
    clipped: tuple[str, ...]
    """Inputs that lie nearer to the scene's value than drawn, since no device has the drawn one."""

    @cached_property
    def moments(self) -> MomentTable:
        """Of a pair, as runs have them."""
        return MomentTable.of(model=self.model, total=2 * self.scene.disc.initial_fill)

    def under(self, settings: Scene, *, of: Scene) -> Scene:
        """The device with a scene's controller and gas pressure; its gauge is as wrong as it was.

        The factor on its moments is put into the influence coefficient, through which they act.
        Args: `of`: the scene that the device was drawn from.
        """
        rotor, gas = self.scene.rotor, self.scene.gas
        pressure = max(gas.pressure + settings.gas.pressure - of.gas.pressure, 0.0)
        coefficient = rotor.influence_coefficient * self.moment
        return replace(
            self.scene,
            controller=settings.controller,
            gas=replace(gas, pressure=pressure),
            rotor=replace(rotor, influence_coefficient=coefficient),
        )


def devices(
    scene: Scene,
    model: BalancerModel,
    spread: Spread,
    numbers: Sequence[int],
    *,
    seed: int,
    rotors: Rotors | None = None,
) -> tuple[Device, ...]:
    """The devices of some numbers, with their laws made at once.

    Args: `rotors`: that the devices run on; default their own, drawn.
    """
    normal = _rows({name: deviates(name, numbers, seed=seed) / NORMAL_95 for name in spread.names})
    places = _rows({name: quantiles(name, numbers, seed=seed) for name in spread.names})
    found = [_drawn(scene, spread, z, q) for z, q in zip(normal, places, strict=True)]
    scenes = [drawn for drawn, _ in found]
    if rotors is not None:
        pairs = zip(scenes, numbers, strict=True)
        scenes = [replace(drawn, rotor=rotor_like(drawn.rotor, rotors(number))) for drawn, number in pairs]
    laws = _laws(scenes, scene, model, spread, normal, places)
    return tuple(
        Device(
            number=number,
            scene=drawn,
            model=law,
            speed=speed,
            moment=math.exp(math.log1p(spread.moment) * z[MOMENT]),
            inputs=q,
            clipped=clipped,
        )
        for number, drawn, (law, speed), z, q, (_, clipped) in zip(
            numbers, scenes, laws, normal, places, found, strict=True
        )
    )


def _rows(columns: Mapping[str, FloatArray]) -> list[dict[str, float]]:
    """What each device has of every column."""
    return [dict(zip(columns, row, strict=True)) for row in np.stack(list(columns.values()), axis=1).tolist()]


def rotor_like(own: Rotor, rotor: CommonRotor) -> Rotor:
    """A scene's rotor with another's speed, influence coefficient and vibration before balancing."""
    vibration = rotor.influence * rotor.unbalance
    return replace(
        own,
        speed=rotor.speed,
        influence_coefficient=abs(rotor.influence),
        lag_angle=-cmath.phase(rotor.influence),
        initial_amplitude=abs(vibration),
        initial_phase=cmath.phase(vibration),
    )


def _drawn(
    scene: Scene, spread: Spread, z: Mapping[str, float], q: Mapping[str, float]
) -> tuple[Scene, tuple[str, ...]]:
    """The scene of a device, and the inputs that no device can have as drawn."""
    changes = {name: width * z[name] for name, width in spread.inputs.items()}
    device, clipped = shifted_in_turn(scene, changes)
    keys = [each.key for each in scene.fitted.quantities]
    for place, column in enumerate(spread.directions.T):
        together = zip(keys, (column * z[f"{FITTED} {place + 1}"]).tolist(), strict=True)
        device = moved(device, dict(together))
    rotor, half = device.rotor, scene.requirement.phase_range
    started = replace(
        rotor,
        initial_amplitude=rotor.initial_amplitude * math.exp(math.log1p(ASSUMED_AMPLITUDE) * z[AMPLITUDE]),
        initial_phase=rotor.initial_phase + half * (2.0 * q[PHASE] - 1.0),
    )
    return replace(device, rotor=started), clipped


def _laws(
    scenes: Sequence[Scene],
    scene: Scene,
    model: BalancerModel,
    spread: Spread,
    normal: Sequence[Mapping[str, float]],
    places: Sequence[Mapping[str, float]],
) -> list[tuple[BalancerModel, float]]:
    """Law of each device, and the factor on its velocity where only that is known to be uncertain.

    Whether they hold gravity is the scene's own question.
    """
    if isinstance(model.flow, PaperLaw):
        drags = [_drag(model.flow.drag_coefficient, spread, z) for z in normal]
        tubes = zip(scenes, drags, strict=True)
        drawn = [replace(each, tube=replace(each.tube, drag_coefficient=drag)) for each, drag in tubes]
        return [(paper_model(each), 1.0) for each in drawn]
    if not spread.remade:
        return [(model, math.exp(math.log1p(spread.loss) * z[LOSS])) for z in normal]
    laws = nominal_laws(scenes, gravity=gravity_shares(scene).mean > scene.tolerance)
    return [(_as_drawn(law, spread, z, q), 1.0) for law, z, q in zip(laws, normal, places, strict=True)]


def _drag(k: float, spread: Spread, z: Mapping[str, float]) -> float:
    return k * math.exp(math.log1p(2.0 * spread.loss * (k + 1.0) / k) * z[LOSS])


def _as_drawn(
    law: CalibratedLaw, spread: Spread, z: Mapping[str, float], q: Mapping[str, float]
) -> BalancerModel:
    """With its loss and its cavity."""
    more = math.log1p(spread.loss) * z[LOSS]
    path = replace(law.path, released=q[CAVITY]) if spread.cavity else law.path
    return BalancerModel.of(replace(law, heads=law.heads.raised(more), path=path))


def _states(scene: Scene, name: str) -> bool:
    """Whether the scene states an uncertainty, be it zero."""
    return any(each.quantity == name for each in scene.uncertainty)


def _loss(scene: Scene, model: BalancerModel, *, remade: bool) -> float:
    """Relative uncertainty of the head by models alone; of a law that is not remade of its velocity."""
    law, fill = model.flow, scene.disc.initial_fill
    if isinstance(law, PaperLaw):
        stated = any(each.quantity == "drag_coefficient" for each in scene.uncertainty)
        k = law.drag_coefficient
        return 0.0 if stated else PAPER_DRAG_UNCERTAINTY * k / (k + 1.0) / 2.0
    rest = law.evaluate(fill_ratio=fill, opposite_fill_ratio=fill, gas_pressure=0.0, primed=True)
    flow = law.evaluate(
        fill_ratio=fill, opposite_fill_ratio=fill, gas_pressure=scene.gas.pressure, primed=rest.primed
    )
    u = abs(float(flow.velocity)) or 1.0
    if remade and isinstance(law, CalibratedLaw):
        return law.heads.uncertainty_of_models(u, scene=scene)
    return float(flow.uncertainty) / u


def _moment(model: BalancerModel) -> float:
    """Relative uncertainty of a pair's largest moment by numerics and models."""
    if not isinstance(model.moment, CalibratedMoment):
        return PAPER_MOMENT_UNCERTAINTY
    top = model.flow.max_fill_ratio
    ends = model.moment.half_width(np.array([0.0, top]))
    return float(np.hypot(*ends)) / float(model.moment.pair_moment(fill_ratio=top, opposite_fill_ratio=0.0))
