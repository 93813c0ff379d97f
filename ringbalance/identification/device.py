"""Device of a scene for predictions: its flow law, and the fills after injections.

The law is the calibrated one without finite elements and uncertainties.  Injections are integrated by the
closed loop's equations of motion, always with the inertia of the liquid and its rise to the crest, and with
gas line and valve lag if the scene gives them.  The models are selected once for a scene, so that predictions
are smooth in the parameters.  Laws of scenes to be compared are computed together, since most of the
work is common to them.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any, Final, cast

import numpy as np
import numpy.typing as npt

from ringbalance.controller.terms import dynamics_of
from ringbalance.identification.kinds.kind import Observations
from ringbalance.physics.gas import applied_pressure, chamber_pressures
from ringbalance.reduced_model.injection.dynamics import WORKSPACE, empty_plants
from ringbalance.reduced_model.injection.limits import hold_liquid
from ringbalance.reduced_model.injection.march import inject_each
from ringbalance.reduced_model.injection.pair import at_rest
from ringbalance.reduced_model.law.calibrated_law import CalibratedLaw, cleared_laws
from ringbalance.reduced_model.law.flow_law import BalancerModel
from ringbalance.reduced_model.law.making import Rings, nominal_law, nominal_laws
from ringbalance.reduced_model.residual_liquid import Holding
from ringbalance.reduced_model.terms import FILLING, INERTIA, LAG
from ringbalance.scene.arrays import FloatArray
from ringbalance.scene.designs import Designs, alike
from ringbalance.scene.fitted import START_ERROR
from ringbalance.scene.models import Scene
from ringbalance.scene.uncertain import NORMAL_95

RELATIVE_ERROR: Final = 1e-5
"""Relative error allowed to one step of an injection.

Derivatives by differences then change by less than 1e-5 with a thousandth of it, which is less than
`identifiability.DEPENDENT`.
"""
_SETTLING_TIME_S: Final = 10.0
"""Time after the valve closes within which the gas has vented and the liquid rests or has run back."""
_KEPT_DEVICES: Final = 128
"""Number of devices whose laws and predictions are cached."""
_LEAST_LEFT: Final = 0.1
"""Smallest fraction of the valve-open time that remains after a delayed start of the flow."""


class _Kept(dict[Any, Any]):
    """Cache that is empty in copies and pickles."""

    def __reduce__(self) -> tuple[type[_Kept], tuple[()]]:
        return _Kept, ()


@dataclass(frozen=True, kw_only=True)
class Models:
    """Models for predictions of a scene and of scenes near it, selected by the scene's tolerance."""

    velocity: float
    """Velocity in a primed tube at equal fills, m/s."""
    gas_pressure: float
    """Gauge pressure of the fitted scene's gas, Pa; the difference to another scene's is the gauge error."""
    devices: dict[Scene, ModelledDevice] = field(default_factory=_Kept, init=False, repr=False, compare=False)
    """The last `_KEPT_DEVICES` devices in use."""
    rings: Rings = field(default_factory=_Kept, init=False, repr=False, compare=False)
    """Cached values of chambers under gravity, which few of the fitted quantities change."""

    @classmethod
    def of(cls, scene: Scene) -> Models:
        """Models that `calibrate` selects for the scene."""
        law = nominal_law(scene, gravity=scene.environment.gravity > 0)
        return cls(
            velocity=_primed_velocity(law, scene),
            gas_pressure=scene.gas.pressure - scene.gas.gauge_correction,
        )

    def expect(self, scenes: Sequence[Scene]) -> None:
        """Group devices of scenes, so that the first use of one law computes the laws of its group."""
        devices = {id(device): device for device in (ModelledDevice.of(scene, self) for scene in scenes)}
        lacking = [device for device in devices.values() if "law" not in vars(device)]
        for places in alike([device.scene for device in lacking]):
            together = [lacking[index] for index in places]
            for device in together:
                device.together[:] = together


def _primed_velocity(law: CalibratedLaw, scene: Scene) -> float:
    """Velocity in a primed tube at equal fills under the scene's gas, m/s; zero if it is blocked."""
    fill = scene.disc.initial_fill
    return abs(
        float(law.evaluate(fill_ratio=fill, gas_pressure=applied_pressure(scene.gas), primed=True).velocity)
    )


def runs_back(scene: Scene, _: Observations) -> str:
    """Reason why no injection has a lasting effect; empty if the tube holds the liquid at equal fills."""
    held = Holding.of(scene, fill_ratio=scene.disc.initial_fill)
    if held.finding is None or held.likely_speed is not None:
        return ""
    return f"by this scene no injection leaves a change behind: {held.finding.text}"


@dataclass(frozen=True, kw_only=True, eq=False)
class ModelledDevice:
    """Disc, tube and gas line of a scene."""

    scene: Scene
    models: Models
    together: list[ModelledDevice] = field(default_factory=list)
    """Devices with laws that are computed together with this one's."""

    @cached_property
    def law(self) -> CalibratedLaw:
        """Flow law and moments.

        The fitted scene alone decides which flows clear the gas from the crest.  Otherwise that limit would
        give information on k, although its Froude number is not known accurately enough.
        """
        devices = [each for each in self.together if "law" not in vars(each)] or [self]
        scenes = [each.scene for each in devices]
        gravity = self.scene.environment.gravity > 0
        laws = nominal_laws(scenes, gravity=gravity, rings=self.models.rings, clearing=False)
        velocities = [_primed_velocity(law, each.scene) for law, each in zip(laws, devices, strict=True)]
        fitted = self.models.velocity
        flows = [(each, fitted) if each > 0 and fitted > 0 else (1.0, 1.0) for each in velocities]
        froude = [law.path.froude_velocity * u / u0 for law, (u, u0) in zip(laws, flows, strict=True)]
        for device, law in zip(devices, cleared_laws(laws, froude), strict=True):
            vars(device)["law"] = law
        result: CalibratedLaw = vars(self)["law"]
        return result

    @cached_property
    def _plant(self) -> npt.NDArray[np.void]:
        devices = [each for each in self.together if "_plant" not in vars(each)] or [self]
        plants, gas = empty_plants(len(devices)), self.scene.gas
        line = gas.conductance is not None and gas.critical_ratio is not None
        terms = [INERTIA, *([FILLING] if line else []), *([LAG] if gas.valve_lag is not None else [])]
        for i, each in enumerate(devices):
            model, total = BalancerModel.of(each.law), 2 * each.scene.disc.initial_fill
            dynamics = dynamics_of(scene=each.scene, model=model, modelled=terms, checked=True)
            dynamics.fill(plants[i : i + 1], total=total, relative_error=RELATIVE_ERROR)
        hold_liquid(plants, Designs.stacked([each.scene for each in devices]))
        for i, each in enumerate(devices):
            vars(each)["_plant"] = plants[i : i + 1]
        plant: npt.NDArray[np.void] = vars(self)["_plant"]
        return plant

    @cached_property
    def _kept(self) -> dict[int, tuple[Observations, FloatArray]]:
        return {}

    def once(
        self, observations: Observations, find: Callable[[ModelledDevice, Observations], FloatArray]
    ) -> FloatArray:
        """Part of a prediction that depends on the device only, cached for all its rotors."""
        # The entry refers to its data set, so that no other object can get the same id.
        if id(observations) not in self._kept:
            self._kept[id(observations)] = observations, find(self, observations)
        return self._kept[id(observations)][1]

    def injected(
        self,
        *,
        fill: npt.ArrayLike,
        follows: Sequence[int] | None = None,
        chamber: npt.ArrayLike,
        pressure: npt.ArrayLike,
        gas_time: npt.ArrayLike,
    ) -> FloatArray:
        """Fill of chamber 0 of a pair at rest before and after each of n injections, shape (2, n).

        Args: `fill`: x of chamber 0 before. `follows`: for each injection, index of the one at whose end it
            begins; its own index: it begins at `fill`; None: all begin at `fill`. `chamber`: driven chamber,
            0 or 1. `pressure`: gauge reading of the supply, Pa. `gas_time`: from the command to open to the
            command to close, s.
        """
        scene, velocity, times = self.scene, self.models.velocity, np.atleast_1d(gas_time)
        supply = np.asarray(pressure, dtype=np.float64) + scene.gas.pressure - self.models.gas_pressure
        # Delayed start of the flow: the model error (95 %) is L/2u at equal fills.
        late = scene.tube.model_error(START_ERROR) / NORMAL_95 * scene.tube.length / 2
        delay = late / velocity if velocity else 0.0
        count, plant = times.size, self._plant
        gas = replace(scene.gas, pressure=cast(float, np.broadcast_to(supply, count)))
        pressures = applied_pressure(gas), supply + scene.gas.ambient_pressure, chamber_pressures(gas)[1]
        fills = np.zeros((2, count))
        fills[0] = fill
        motions = np.repeat(at_rest(plant, fill=scene.disc.initial_fill), 2)
        inject_each(
            plant[0],
            motions,
            np.arange(count) if follows is None else np.array(follows, dtype=np.int64),
            np.broadcast_to(np.asarray(chamber, dtype=np.int64), count).copy(),
            np.stack([np.broadcast_to(each, count) for each in pressures]),
            # In a shorter time no flow would start.
            np.maximum(times - delay, _LEAST_LEFT * times),
            _SETTLING_TIME_S,
            fills,
            np.zeros(WORKSPACE),
        )
        return fills

    @classmethod
    def of(cls, scene: Scene, models: Models) -> ModelledDevice:
        """Device of a scene, with the geometry's lambda.

        Scenes that differ only in rotor, sensor, controller or lambda factor share one device.
        """
        rotor = replace(
            scene.rotor, influence_coefficient=1.0, lag_angle=0.0, initial_amplitude=0.0, initial_phase=0.0
        )
        disc = replace(scene.disc, lambda_factor=None)
        built, devices = replace(scene, rotor=rotor, disc=disc), models.devices
        device = devices.pop(built, None) or ModelledDevice(scene=built, models=models)
        devices[built] = device
        if len(devices) > _KEPT_DEVICES:
            del devices[next(iter(devices))]
        return device
