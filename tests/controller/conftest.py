"""The paper's disc as records, and small flow laws whose transfers are known in closed form."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest
from pairs import Motion, PairState, Passage, Switch, pass_time
from transfers import Drive

from ringbalance.controller.liquid_ring.plant import LiquidRing
from ringbalance.controller.terms import dynamics_of
from ringbalance.reduced_model.calibration import calibrate
from ringbalance.reduced_model.injection import column
from ringbalance.reduced_model.injection.dynamics import Dynamics
from ringbalance.reduced_model.law.flow_law import BalancerModel, Flow, Regime
from ringbalance.reduced_model.law.paper_law import paper_model
from ringbalance.scene import loop_models, models
from ringbalance.scene.arrays import BoolArray, FloatArray
from scenes import with_tables

Velocity = Callable[[FloatArray, FloatArray, FloatArray, BoolArray], tuple[Any, Any]]


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


def restless(x: FloatArray, *_: Any) -> tuple[Any, Any]:
    """u = 5 m/s in a regime that changes all the time."""
    return np.full(x.shape, 5.0), np.where(np.sin(900 * x) > 0, Regime.SIPHON, Regime.SEPARATED)


LAWS: Mapping[str, FunctionLaw] = {
    "restless": FunctionLaw(function=restless),
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
def scene(paper_scene: models.Scene) -> models.Scene:
    """The paper's disc with an exact sensor, and every number that these tests count on by hand."""
    return with_tables(
        paper_scene,
        source="test.toml",
        rotor=loop_models.Rotor(
            speed=10000 * 2 * math.pi / 60,
            influence_coefficient=0.0108,
            lag_angle=math.radians(17),
            initial_amplitude=10e-6,
            initial_phase=math.pi / 2,
        ),
        sensor=loop_models.Sensor(amplitude_noise=0.0, phase_noise=0.0),
        controller={
            "period": 0.5,
            "integral_time": 48.0,
            "derivative_time": 0.06,
            "assumed_lag_angle": math.radians(17),
            "first_trial": 0.05,
            "long_step": 0.1,
            "short_step": 0.004,
        },
        run=loop_models.RunSettings(seed=0, time_limit=120.0),
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


@pytest.fixture(scope="session")
def ring_of(scene: models.Scene) -> Callable[..., LiquidRing]:
    """A disc whose liquid moves by its flow law alone, under a gas pressure."""

    def make(model: BalancerModel, *, gas_pressure: float = 0.7e6, chambers: int = 4) -> LiquidRing:
        under = with_tables(scene, gas={"pressure": gas_pressure})
        dynamics = dynamics_of(scene=under, model=model, modelled=())
        return LiquidRing(model=model, chambers=chambers, dynamics=dynamics, total=0.5)

    return make


@pytest.fixture(scope="session")
def calibrated(scene: models.Scene) -> BalancerModel:
    """The same disc by its calibrated law, with the crest at 31.5 mm."""
    return calibrate(scene).model


@pytest.fixture(scope="session")
def plant_of() -> Callable[..., Dynamics]:
    """Terms of a plant for a scene and a balancer."""

    def make(scene: models.Scene, model: BalancerModel, *terms: str) -> Dynamics:
        return dynamics_of(scene=scene, model=model, modelled=terms)

    return make


@pytest.fixture(scope="session")
def plant(scene: models.Scene) -> Callable[..., Dynamics]:
    """Terms of a plant for a balancer, with changes to the scene's gas and tube."""

    def make(model: BalancerModel, *terms: str, length: float | None = None, **gas: Any) -> Dynamics:
        tube = replace(scene.tube, length=length or scene.tube.length)
        own = with_tables(scene, tube=tube, gas=gas)
        return dynamics_of(scene=own, model=model, modelled=terms)

    return make


@dataclass(frozen=True)
class Forces:
    """The compiled forces of a plant's column, with total fill 0.5."""

    dynamics: Dynamics

    def steady(
        self, fills: tuple[float, float], gases: tuple[float, float], *, primed: bool
    ) -> tuple[float, bool, bool]:
        """Velocity out of chamber 0, whether separated, whether the tube holds a column."""
        known = self.dynamics.kept_plant(total=0.5)[0]
        given = (known, *fills, *gases, primed, 0.0)
        return *column.steady(*given), column.holds(*given)

    def accelerations(
        self, fills: tuple[float, float], gases: tuple[float, float], *, speed: float, primed: bool = True
    ) -> tuple[float, float]:
        """Of a full and of a separated column that flows out of chamber 0."""
        known = self.dynamics.kept_plant(total=0.5)[0]
        at = column.ends(known, *fills, *gases, 1)
        return column.accelerations(known, at, speed, 1, primed, 0.0)[:2]


@pytest.fixture(scope="session")
def forces() -> Callable[[Dynamics], Forces]:
    """Forces of a plant's column."""
    return Forces


@pytest.fixture(scope="session")
def pulse() -> Callable[..., Passage]:
    """One opening of the valve of chamber 0 on a pair with half of a chamber's liquid."""

    def make(
        dynamics: Dynamics, duration: float, instants: FloatArray, *, fill: float = 0.25, **state: Any
    ) -> Passage:
        lag = dynamics.valve_lag
        opens = Switch(after=lag, chamber=0, opens=True)
        closes = Switch(after=lag + duration, chamber=0, opens=False)
        given: dict[str, Any] = {"motion": Motion(pending=(opens, closes)), "primed": False} | state
        return pass_time(dynamics, PairState(fill=fill, total=0.5, **given), instants=instants)

    return make


@pytest.fixture(scope="session")
def resumed() -> Callable[..., Passage]:
    """The interval after another one, from the state in which that ended."""

    def make(dynamics: Dynamics, before: Passage, duration: float) -> Passage:
        pair = PairState(fill=before.fill, total=0.5, primed=before.primed, motion=before.motion)
        return pass_time(dynamics, pair, instants=np.array([duration]))

    return make
