"""Devices drawn from a liquid ring's scene: every uncertain input drawn, and the law made for each."""

from __future__ import annotations

import cmath
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, Final

import numpy as np

from ringbalance.controller.rotor import CommonRotor, Rotors
from ringbalance.physics.gas import applied_pressure
from ringbalance.reduced_model.chamber.contributions import gravity_shares
from ringbalance.reduced_model.law.calibrated_law import CalibratedLaw, CalibratedMoment
from ringbalance.reduced_model.law.flow_law import BalancerModel
from ringbalance.reduced_model.law.making import nominal_laws
from ringbalance.reduced_model.law.paper_law import PaperLaw, paper_model
from ringbalance.scene.arrays import FloatArray
from ringbalance.scene.draws import quantiles
from ringbalance.scene.errors import (
    AMPLITUDE,
    LOSS,
    MOMENT,
    PHASE,
    RUNOUT_PHASE,
    WAVES,
    Uncertainty,
    of_chamber,
    of_runs,
    uncertainties,
)
from ringbalance.scene.loop_models import Rotor
from ringbalance.scene.models import Scene
from ringbalance.scene.uncertain import NORMAL_95, UNCERTAIN_QUANTITIES, moved, shifted_in_turn

PAPER_DRAG_UNCERTAINTY: Final = 0.1
"""Relative half-width taken for "k is about 50"."""
PAPER_MOMENT_UNCERTAINTY: Final = 0.007
"""Relative half-width that the liquid-ring paper states for lambda."""


@dataclass(frozen=True, kw_only=True)
class Spread:
    """Differences between the devices of a scene under a law."""

    errors: tuple[Uncertainty, ...]
    remade: bool
    """True if each device has its own law; False: the scene's with a factor on the velocity."""

    @property
    def names(self) -> tuple[str, ...]:
        """Names of all that is drawn, inputs of the scene by their keys."""
        return tuple(each.name for each in self.errors)

    def half_width(self, name: str) -> float:
        """Relative expanded uncertainty (95 %) of an error that acts by a factor."""
        return next(each.half_width or 0.0 for each in self.errors if each.name == name)

    def factor(self, name: str, z: Mapping[str, float]) -> float:
        """Factor by which a drawn error acts at its deviation."""
        return math.exp(math.log1p(self.half_width(name)) * z[name] / NORMAL_95)

    def document(self) -> list[dict[str, Any]]:
        """Drawn errors, for JSON."""
        return [each.document() for each in self.errors]

    @classmethod
    def of(cls, scene: Scene, model: BalancerModel, *, remade: bool = True) -> Spread:
        """Stated uncertainties, else assumed ones, and the errors of the law's models.

        Args: `remade`: true if a calibrated law is the scene's own.
        """
        law, fill, top = model.flow, scene.disc.initial_fill, model.flow.max_fill_ratio
        # A pair's largest moment, by numerics and models.
        width = PAPER_MOMENT_UNCERTAINTY
        if isinstance(model.moment, CalibratedMoment):
            largest = float(model.moment.pair_moment(fill_ratio=top, opposite_fill_ratio=0.0))
            width = float(np.hypot(*model.moment.half_width(np.array([0.0, top])))) / largest
        moment = of_chamber(MOMENT, width)
        if remade and isinstance(law, CalibratedLaw):
            errors = [each for each in uncertainties(scene) if each.name != MOMENT]
            return cls(errors=(*errors, moment, *of_runs(scene)), remade=True)

        # Velocity of a law that is not remade; of the paper's law by models alone.
        if isinstance(law, PaperLaw):
            stated = any(each.quantity == "drag_coefficient" for each in scene.uncertainty)
            k = law.drag_coefficient
            velocity_width = 0.0 if stated else PAPER_DRAG_UNCERTAINTY * k / (k + 1.0) / 2.0
        else:
            rest = law.evaluate(fill_ratio=fill, opposite_fill_ratio=fill, gas_pressure=0.0, primed=True)
            flow = law.evaluate(
                fill_ratio=fill,
                opposite_fill_ratio=fill,
                gas_pressure=applied_pressure(scene.gas),
                primed=rest.primed,
            )
            velocity_width = float(flow.uncertainty) / (abs(float(flow.velocity)) or 1.0)
        loss = Uncertainty(
            name=LOSS,
            group=LOSS,
            acts_on="velocity in the tube",
            varies="not known",
            distribution="lognormal",
            half_width=velocity_width,
        )
        inputs = uncertainties(scene, models=False)
        return cls(errors=(*inputs, loss, moment, *of_runs(scene)), remade=False)


@dataclass(frozen=True, kw_only=True, eq=False)
class RingDevice:
    """A drawn device: its scene, with the vibration that it starts with, and its law."""

    number: int
    scene: Scene
    model: BalancerModel
    speed: float
    """Factor on the law's velocity."""
    moment: float
    """Factor on the law's moments."""
    inputs: Mapping[str, float]
    """Quantile of every drawn input, in (0, 1)."""
    clipped: tuple[str, ...]
    """Inputs nearer to the scene's value than drawn, since no device can have the drawn value."""

    def under(self, settings: Scene, *, of: Scene) -> Scene:
        """The device with a scene's controller and gas pressure; the error of its gauge is kept.

        The factor on its moments is included in the influence coefficient, through which they act.
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
) -> tuple[RingDevice, ...]:
    """The devices of some numbers, with their laws made at once.

    Args: `rotors`: rotors of the devices; default their own, drawn.
    """
    places = {each.name: quantiles(each.name, numbers, seed=seed) for each in spread.errors}
    quantile = _rows(places)
    deviation = _rows({each.name: each.deviation(places[each.name]) for each in spread.errors})
    shifted = [_shifted(scene, spread, z) for z in deviation]
    scenes = [each for each, _ in shifted]
    if rotors is not None:
        pairs = zip(scenes, numbers, strict=True)
        scenes = [replace(each, rotor=rotor_like(each.rotor, rotors(number))) for each, number in pairs]

    if isinstance(model.flow, PaperLaw):
        k, width = model.flow.drag_coefficient, 2.0 * spread.half_width(LOSS)
        drags = [k * math.exp(math.log1p(width * (k + 1.0) / k) * z[LOSS] / NORMAL_95) for z in deviation]
        tubes = [replace(each.tube, drag_coefficient=k) for each, k in zip(scenes, drags, strict=True)]
        of_tubes = zip(scenes, tubes, strict=True)
        laws = [(paper_model(replace(each, tube=tube)), 1.0) for each, tube in of_tubes]
    elif not spread.remade:
        laws = [(model, spread.factor(LOSS, z)) for z in deviation]
    else:
        # The nominal scene decides if the laws of its devices include gravity.
        gravity, waves = gravity_shares(scene).mean > scene.tolerance, [z[WAVES] for z in deviation]
        laws = [(BalancerModel.of(law), 1.0) for law in nominal_laws(scenes, gravity=gravity, waves=waves)]
    return tuple(
        RingDevice(
            number=number,
            scene=device,
            model=law,
            speed=speed,
            moment=spread.factor(MOMENT, z),
            inputs=q,
            clipped=clipped,
        )
        for number, device, (law, speed), z, q, (_, clipped) in zip(
            numbers, scenes, laws, deviation, quantile, shifted, strict=True
        )
    )


def _rows(columns: Mapping[str, FloatArray]) -> list[dict[str, float]]:
    """Values of each device by the names of the columns."""
    return [dict(zip(columns, row, strict=True)) for row in np.stack(list(columns.values()), axis=1).tolist()]


def rotor_like(scene_rotor: Rotor, rotor: CommonRotor) -> Rotor:
    """A scene's rotor with another's speed, influence coefficient and vibration before balancing."""
    vibration = rotor.influence * rotor.unbalance
    return replace(
        scene_rotor,
        speed=rotor.speed,
        influence_coefficient=abs(rotor.influence),
        lag_angle=-cmath.phase(rotor.influence),
        initial_amplitude=abs(vibration),
        initial_phase=cmath.phase(vibration),
    )


def _shifted(scene: Scene, spread: Spread, z: Mapping[str, float]) -> tuple[Scene, tuple[str, ...]]:
    """The scene of a device, and the inputs that no device can have as drawn."""
    alone = {
        name: z[each.name] * change
        for each in spread.errors
        if each.name in UNCERTAIN_QUANTITIES
        for name, change in each.change.items()
    }
    device, clipped = shifted_in_turn(scene, alone)
    others: dict[str, float] = {}
    for each in spread.errors:
        if each.name not in alone:
            for name, change in each.change.items():
                others[name] = others.get(name, 0.0) + z[each.name] * change
    device = moved(device, others)
    rotor, half = device.rotor, scene.requirement.phase_range
    started = replace(
        rotor,
        initial_amplitude=rotor.initial_amplitude * spread.factor(AMPLITUDE, z),
        initial_phase=rotor.initial_phase + half * z[PHASE] / NORMAL_95,
    )
    sensor = device.sensor
    if RUNOUT_PHASE in z:
        sensor = replace(sensor, runout_phase=math.pi * z[RUNOUT_PHASE] / NORMAL_95)
    return replace(device, rotor=started, sensor=sensor), clipped
