"""The device of a scene as predictions take it: its law, and the fills that injections leave behind.

The law is the calibrated one without finite elements and uncertainties; injections run through the closed
loop's own equations of motion, with the liquid's mass always and the gas line and the lag of the valve where
the scene gives them.  Which models serve the scene is decided once, so that a prediction is smooth in values.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property, lru_cache
from typing import Final

import numpy as np
import numpy.typing as npt

from ringbalance.controller.liquid_ring.compiled_march import advance, command
from ringbalance.controller.liquid_ring.motion import Motion, packed
from ringbalance.controller.liquid_ring.records import WORKSPACE, X
from ringbalance.controller.terms import known_dynamics
from ringbalance.identification.data.observations import Observations
from ringbalance.reduced_model.chamber.range import mean_gravity
from ringbalance.reduced_model.law.building import nominal_law
from ringbalance.reduced_model.law.calibrated_law import CalibratedLaw
from ringbalance.reduced_model.law.model import balancer_model
from ringbalance.reduced_model.selection.estimates import FILLING, INERTIA, LAG
from ringbalance.reduced_model.selection.tube_terms import tube_models
from ringbalance.reduced_model.tube.path import with_bends_kept
from ringbalance.scene.arrays import FloatArray
from ringbalance.scene.models import Scene
from ringbalance.scene.tube_models import TubeModels

RELATIVE_ERROR: Final = 1e-6
"""Allowed to one step of an injection: fills within 1e-9, so that differences of predictions are smooth."""
_SETTLED: Final = 10.0
"""s after a valve has closed: the gas has vented and the liquid rests, or has run back."""
_KEPT: Final = 32


@dataclass(frozen=True, kw_only=True)
class Models:
    """Models that predictions of a scene and its neighbours take, by the scene's own tolerance."""

    tube: TubeModels
    gravity: bool
    """Whether the chamber's values hold gravity."""
    other: Callable[[CalibratedLaw], CalibratedLaw] | None = None
    """Makes another law of the scene's, to be compared with it."""


def models_of(scene: Scene) -> Models:
    """The models that `calibrate` takes."""
    return Models(
        tube=with_bends_kept(tube_models(scene), scene.tube), gravity=mean_gravity(scene) > scene.tolerance
    )


@dataclass(frozen=True, kw_only=True, eq=False)
class Device:
    """Disc, tube and gas line of a scene."""

    scene: Scene
    gravity: bool
    other: Callable[[CalibratedLaw], CalibratedLaw] | None = None

    @cached_property
    def law(self) -> CalibratedLaw:
        """Flow law and moments."""
        law = nominal_law(self.scene, gravity=self.gravity)
        return law if self.other is None else self.other(law)

    @cached_property
    def _plant(self) -> npt.NDArray[np.void]:
        gas = self.scene.gas
        line = gas.conductance is not None and gas.critical_ratio is not None
        terms = [INERTIA, *([FILLING] if line else []), *([LAG] if gas.valve_lag is not None else [])]
        dynamics = known_dynamics(scene=self.scene, model=balancer_model(self.law), modelled=terms)
        if dynamics is None:
            raise ValueError("the calibrated law has a column in the tube")
        return dynamics.plant(total=2 * self.scene.disc.initial_fill, relative_error=RELATIVE_ERROR)

    @cached_property
    def _kept(self) -> dict[int, tuple[Observations, FloatArray]]:
        return {}

    def once(
        self, observations: Observations, find: Callable[[Device, Observations], FloatArray]
    ) -> FloatArray:
        """What the device alone decides of a data set: predictions with another rotor take it again."""
        # The entry keeps its data set alive, so that no other one can have the same identity.
        if id(observations) not in self._kept:
            self._kept[id(observations)] = observations, find(self, observations)
        return self._kept[id(observations)][1]

    def injected(self, *, fill: float, chamber: int, pressure: float, gas_time: float) -> float:
        """Fill of chamber 0 of a pair at rest after gas into one of its chambers, and all that follows.

        Args: `fill`: x of chamber 0 before. `chamber`: 0 or 1. `pressure`: of the supply, gauge, Pa.
            `gas_time`: from the command to open to the command to close, s.
        """
        plant, work = self._plant, np.zeros(WORKSPACE)
        plant["gas_pressure"] = pressure
        motion = packed(plant, fill=fill, primed=False, motion=Motion())
        command(plant[0], motion[0], chamber, gas_time)
        lag = float(plant["valve_lag"][0])
        advance(plant[0], motion[0], lag + gas_time + _SETTLED, work, 0, 0, work)
        return float(motion["state"][0, X])


def device_of(scene: Scene, models: Models) -> Device:
    """The device of a scene, with the geometry's lambda; scenes that differ in rotor, sensor, controller or
    the factor on lambda alone share theirs."""
    rotor = replace(
        scene.rotor, influence_coefficient=1.0, lag_angle=0.0, initial_amplitude=0.0, initial_phase=0.0
    )
    disc = replace(scene.disc, lambda_factor=None)
    tube = replace(scene.tube, models=models.tube)
    return _device(replace(scene, rotor=rotor, disc=disc, tube=tube), models.gravity, models.other)


@lru_cache(maxsize=_KEPT)
def _device(scene: Scene, gravity: bool, other: Callable[[CalibratedLaw], CalibratedLaw] | None) -> Device:
    return Device(scene=scene, gravity=gravity, other=other)
