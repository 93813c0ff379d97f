"""The paper's disc as records, and small flow laws whose transfers are known in closed form."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest

from ringbalance.controller.transfer import Drive
from ringbalance.reduced_model.flow_law import Flow, Regime
from ringbalance.reduced_model.model import BalancerModel
from ringbalance.reduced_model.paper_law import paper_model
from ringbalance.scene import models

FloatArray = npt.NDArray[np.float64]
Velocity = Callable[[FloatArray, FloatArray, FloatArray, npt.NDArray[np.bool_]], tuple[Any, Any]]


@dataclass(frozen=True, kw_only=True)
class FunctionLaw:
    """A flow law from a function of (x_A, x_C, p, primed) to (velocity, regime)."""

    function: Velocity
    holds: bool = False
    """Whether a column holds with the gas off."""
    name: str = "function"
    max_fill_ratio: float = 0.5

    def evaluate(
        self,
        *,
        fill_ratio: npt.ArrayLike,
        opposite_fill_ratio: npt.ArrayLike | None = None,
        gas_pressure: npt.ArrayLike,
        primed: npt.ArrayLike = False,
    ) -> Flow:
        x = np.asarray(fill_ratio, dtype=np.float64)
        if not np.all((x >= 0) & (x <= self.max_fill_ratio)):
            raise ValueError("fill ratio outside the law's range")
        y = self.max_fill_ratio - x if opposite_fill_ratio is None else opposite_fill_ratio
        x, y, p, wet = np.broadcast_arrays(x, np.asarray(y, dtype=np.float64), gas_pressure, primed)
        on = (p > 0) | (wet & self.holds)
        velocity, regime = self.function(x, y, p, wet)
        velocity = np.where(on, velocity, 0.0)
        return Flow(
            velocity=velocity,
            regime=np.where(velocity == 0, Regime.BLOCKED, regime).astype(np.int64),
            uncertainty=np.zeros_like(velocity),
            primed=on & ((velocity != 0) | (wet & self.holds)),
        )

    def table(self) -> Mapping[str, FloatArray]:
        return {}


def constant(x: FloatArray, *_: Any) -> tuple[Any, Any]:
    """u = 5 m/s."""
    return np.full(x.shape, 5.0), np.full(x.shape, Regime.SIPHON)


def square_root(x: FloatArray, *_: Any) -> tuple[Any, Any]:
    """u = sqrt(400 (x - 0.1)) m/s, zero below 0.1."""
    return np.sqrt(400 * np.maximum(x - 0.1, 0.0)), np.full(x.shape, Regime.SIPHON)


def proportional(x: FloatArray, *_: Any) -> tuple[Any, Any]:
    """u = 40 (x - 0.1) m/s, turning round below 0.1."""
    return 40 * (x - 0.1), np.where(x > 0.1, Regime.SIPHON, Regime.REVERSE)


def two_regimes(x: FloatArray, *_: Any) -> tuple[Any, Any]:
    """u = 5 m/s above x = 0.2, 25 x below."""
    return np.minimum(5.0, 25 * x), np.where(x >= 0.2, Regime.SEPARATED, Regime.SIPHON)


def levelling(x: FloatArray, y: FloatArray, p: FloatArray, _: Any) -> tuple[Any, Any]:
    """u = 20 (x - y) m/s plus 8 m/s with the gas on."""
    velocity = 20 * (x - y) + np.where(p > 0, 8.0, 0.0)
    return velocity, np.where(velocity >= 0, Regime.SIPHON, Regime.REVERSE)


LAWS: Mapping[str, FunctionLaw] = {
    "constant": FunctionLaw(function=constant),
    "square_root": FunctionLaw(function=square_root),
    "proportional": FunctionLaw(function=proportional),
    "two_regimes": FunctionLaw(function=two_regimes),
    "levelling": FunctionLaw(function=levelling, holds=True),
}


@pytest.fixture(scope="session")
def laws() -> Mapping[str, FunctionLaw]:
    """Laws with known transfers, by name."""
    return LAWS


@pytest.fixture(scope="session")
def scene() -> models.Scene:
    """Table 1 of the liquid-ring paper, with the assumed tube and rotor of the bundled scene."""
    return models.Scene(
        name="the paper's disc",
        disc=models.Disc(
            outer_radius=44.5e-3,
            inner_radius=20.5e-3,
            axial_width=62e-3,
            central_angle=math.pi / 2,
            chambers=4,
            plate_thickness=2.777e-3,
            max_fill_ratio=0.5,
            initial_fill=0.25,
        ),
        liquid=models.Liquid(
            name="custom",
            temperature=None,
            density=1000.0,
            kinematic_viscosity=1e-6,
            vapour_pressure=2339.0,
            density_uncertainty=0.001,
            viscosity_uncertainty=0.01,
            source="test",
        ),
        tube=models.Tube(
            bore=1.5e-3,
            port_radius=44.5e-3,
            hump_radius=31.5e-3,
            hump_position=0.5,
            hump_gas="vented",
            length=120e-3,
            roughness=1.5e-6,
            entrance="sharp",
            entrance_radius=0.0,
            bends=(),
            extra_loss=0.0,
            drag_coefficient=None,
        ),
        gas=models.Gas(
            pressure=0.7e6,
            ambient_pressure=101325.0,
            temperature=293.15,
            conductance=None,
            critical_ratio=None,
            dead_volume=None,
            valve_lag=None,
        ),
        environment=models.Environment(shaft="horizontal", gravity=9.80665),
        rotor=models.Rotor(
            speed=10000 * 2 * math.pi / 60,
            influence_coefficient=0.0108,
            lag_angle=math.radians(17),
            initial_amplitude=10e-6,
            initial_phase=math.pi / 2,
        ),
        sensor=models.Sensor(amplitude_noise=0.0, phase_noise=0.0),
        controller=models.ControllerSettings(
            kind="target_vector",
            limit=0.05e-6,
            period=0.5,
            proportional=0.08e6,
            integral_time=48.0,
            derivative_time=0.06,
            minimum_gas_time=1e-3,
            maximum_gas_time=5.0,
            assumed_influence_coefficient=0.0108,
            assumed_lag_angle=math.radians(17),
            sequence=("A", "C", "B", "D"),
            first_trial=0.05,
            long_step=0.1,
            short_step=0.004,
            fine_below=0.8e-6,
        ),
        uncertainty=(),
        run=models.RunSettings(seed=0, time_limit=120.0),
        tolerance=0.01,
        source="test.toml",
        sha256="0" * 64,
    )


@pytest.fixture(scope="session")
def model(scene: models.Scene) -> BalancerModel:
    """The paper's balancer."""
    return paper_model(scene)


@pytest.fixture(scope="session")
def drive(model: BalancerModel) -> Drive:
    """Gas of 0.7 MPa on a level pair under the paper's law."""
    return Drive(
        law=model.flow,
        fill=0.25,
        total=0.5,
        exchange_rate=model.tube_area / model.chamber_volume,
        gas_pressure=0.7e6,
        primed=False,
    )


@pytest.fixture(scope="session")
def drive_by(laws: Mapping[str, FunctionLaw]) -> Callable[..., Drive]:
    """Gas on a level pair under one of the small laws, with S/V = 0.02 per metre."""

    def make(name: str, **changes: Any) -> Drive:
        base = Drive(law=laws[name], fill=0.25, total=0.5, exchange_rate=0.02, gas_pressure=1e5, primed=False)
        return replace(base, **changes)

    return make
