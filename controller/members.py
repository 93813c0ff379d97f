"""The members of an ensemble: what differs between them, with what was fitted together."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import partial
from typing import Any, Final

import numpy as np

from ringbalance.reduced_model.chamber.values import measured_closed_forms
from ringbalance.reduced_model.core import Answers
from ringbalance.reduced_model.law.calibrated_law import CalibratedLaw, CalibratedMoment
from ringbalance.reduced_model.law.flow_law import BalancerModel, Flow, FlowLaw
from ringbalance.reduced_model.law.paper_law import PaperLaw
from ringbalance.reduced_model.residual_liquid import FACTOR, residual_fill_ratios
from ringbalance.scene.arrays import FloatArray
from ringbalance.scene.designs import Designs, in_batches
from ringbalance.scene.models import Gas, Scene
from ringbalance.scene.uncertain import NORMAL_95, direction_sides, half_widths, nominal_value

BLOCK: Final = 8192
"""Members that are drawn and carried together."""
PAPER_DRAG_UNCERTAINTY: Final = 0.1
"""Relative half-width taken for "k is about 50"."""
PAPER_MOMENT_UNCERTAINTY: Final = 0.007
"""Relative half-width that the liquid-ring paper states for lambda."""
LARGEST_RATIO: Final = 0.99
"""A critical ratio is below one."""
ASSUMED_INFLUENCE: Final = 0.05
ASSUMED_LAG: Final = math.radians(3.0)
LINE_KEYS: Final = ("conductance", "critical_ratio", "dead_volume", "valve_lag")
"""Of a chamber's gas line, which drawn devices may have of their own."""
RATE, MOMENT, INFLUENCE, LAG = range(4)
"""Rows of `_fitted_effects` before those of `LINE_KEYS`."""


@dataclass(frozen=True, kw_only=True)
class MemberUncertainty:
    """Expanded uncertainties (95 %) of what differs between members, and where each comes from."""

    velocity: float
    """Relative, of the flow's velocity: k + 1 enters with half its relative half-width."""
    moment: float
    """Relative, of the balancing moment, so of lambda."""
    influence_coefficient: float
    """Relative."""
    lag_angle: float
    """rad."""
    sources: tuple[str, ...] = ()
    """One text for each of the four."""
    gas_line: Mapping[str, float] = field(default_factory=dict)
    """Relative, of those of `LINE_KEYS` whose uncertainty the scene states."""
    draw_down: float = 0.0
    """Relative, of the depth over a port at which gas enters it."""
    together: FloatArray | None = None
    """`_fitted_effects` of inputs that were fitted together, which are in none of the others; None: none."""

    @property
    def whole_lag_angle(self) -> float:
        """Of the lag angle, with what was fitted together, rad."""
        return math.hypot(self.lag_angle, *self._together(LAG))

    @property
    def together_on_vibration(self) -> float:
        """Relative, of the rate at which the vibration changes, by what was fitted together."""
        return math.hypot(*(self._together(RATE) + self._together(MOMENT) + self._together(INFLUENCE)))

    def document(self) -> dict[str, Any]:
        """As JSON takes it; of what was fitted together the root of the sum of squares of every row."""
        plain = {name: value for name, value in vars(self).items() if name != "together"}
        plain["gas_line"] = dict(self.gas_line)
        if self.together is not None:
            plain["together"] = np.hypot.reduce(self.together, axis=1).tolist()
        return plain

    def _together(self, row: int) -> FloatArray:
        return np.zeros(0) if self.together is None else self.together[row]

    @classmethod
    def of(cls, scene: Scene, model: BalancerModel) -> MemberUncertainty:
        """Half-widths for a scene under a law: the law's, the scene's, else assumed ones."""
        velocity, moment = _velocity(scene, model), _moment(scene, model)
        influence = _stated(scene, "influence_coefficient")
        lag = _stated(scene, "lag_angle")
        coefficient = scene.rotor.influence_coefficient
        together = None
        if scene.fitted.quantities:
            together = _fitted_effects(scene, of_flow=isinstance(model.flow, CalibratedLaw))
        return cls(
            velocity=velocity[0],
            moment=moment[0],
            influence_coefficient=ASSUMED_INFLUENCE if influence is None else influence / coefficient,
            lag_angle=ASSUMED_LAG if lag is None else lag,
            sources=(
                velocity[1],
                moment[1],
                _source(scene, "influence_coefficient", influence),
                _source(scene, "lag_angle", lag),
            ),
            gas_line=_line(scene),
            draw_down=half_widths(scene).get(FACTOR, 0.0) / scene.tube.draw_down_factor,
            together=together,
        )


def _source(scene: Scene, quantity: str, stated: float | None) -> str:
    if _fitted(scene, quantity):
        return "fitted together with other inputs"
    return "assumed: the scene states none" if stated is None else "the scene's uncertainty"


@dataclass(frozen=True, kw_only=True, eq=False)
class Members:
    """Arrays of one length."""

    velocity_factor: FloatArray
    """Of the flow's velocity, sqrt((k + 1)/(k' + 1)) where only k differs."""
    moment_factor: FloatArray
    """Of the balancing moment, lambda'/lambda."""
    influence_coefficient: FloatArray
    """m/(kg m)."""
    lag_angle: FloatArray
    """rad."""
    proportional: FloatArray
    """Kc, s/m."""
    gas_line: FloatArray | None = None
    """Factors of `LINE_KEYS`, a row each; None: all have the scene's line.

    They change the plant, and with it the dead time of its valves.  The controller does not know them: what
    it adds to a valve-open time, `gas_time_offset`, stays the scene's.
    """
    draw_down: FloatArray | None = None
    """Factor of the depth over a port at which gas enters it; None: all have the scene's."""

    def at(self, places: slice | list[int]) -> Members:
        """Some of them."""
        kept: dict[str, Any] = {
            name: values if values is None else values[..., places] for name, values in vars(self).items()
        }
        return Members(**kept)

    def gas_of(self, gas: Gas, number: int) -> Gas:
        """A scene's gas supply with one member's line."""
        if self.gas_line is None:
            return gas
        factors = {name: float(row[number]) for name, row in zip(LINE_KEYS, self.gas_line, strict=True)}
        own = {name: getattr(gas, name) * f for name, f in factors.items() if getattr(gas, name) is not None}
        if "critical_ratio" in own:
            own["critical_ratio"] = min(own["critical_ratio"], LARGEST_RATIO)
        return replace(gas, **own)

    def residual_fill(self, scene: Scene, *, law: FlowLaw) -> FloatArray:
        """Fill at which gas enters the port of each member's driven chamber."""
        deeper = 1.0 if self.draw_down is None else self.draw_down
        return residual_fill_ratios(scene, law=law, depth=deeper, velocity=self.velocity_factor)

    @classmethod
    def alike(cls, scene: Scene, *, size: int) -> Members:
        """Members that all have the scene's own values."""
        one = np.ones(size)
        return cls(
            velocity_factor=one,
            moment_factor=one,
            influence_coefficient=scene.rotor.influence_coefficient * one,
            lag_angle=scene.rotor.lag_angle * one,
            proportional=scene.controller.proportional * one,
        )

    @classmethod
    def drawn(cls, scene: Scene, *, uncertainty_95: MemberUncertainty, seed: int, block: int) -> Members:
        """Draw one block of members; relative quantities log-normal, the lag angle normal.

        A block has the same members in an ensemble of any size.
        """
        random = np.random.default_rng(np.random.SeedSequence(entropy=seed, spawn_key=(block, 0)))
        z = random.standard_normal((4, BLOCK)) / NORMAL_95
        other = np.random.default_rng(np.random.SeedSequence(entropy=seed, spawn_key=(block, 1)))
        deeper = math.log1p(uncertainty_95.draw_down) * other.standard_normal(BLOCK) / NORMAL_95
        line = uncertainty_95.gas_line
        wide = np.array([[math.log1p(line.get(name, 0.0))] for name in LINE_KEYS])
        alike = Members.alike(scene, size=BLOCK)
        lines = np.exp(wide * random.standard_normal((4, BLOCK)) / NORMAL_95) if line else None
        factors, lag = _drawn_together(uncertainty_95.together, seed=seed, block=block)
        if line or np.any(factors[LAG + 1 :] != 1.0):
            lines = factors[LAG + 1 :] * (1.0 if lines is None else lines)
        return cls(
            velocity_factor=np.exp(math.log1p(uncertainty_95.velocity) * z[0]) * factors[RATE],
            moment_factor=np.exp(math.log1p(uncertainty_95.moment) * z[1]) * factors[MOMENT],
            influence_coefficient=alike.influence_coefficient
            * np.exp(math.log1p(uncertainty_95.influence_coefficient) * z[2])
            * factors[INFLUENCE],
            lag_angle=alike.lag_angle + uncertainty_95.lag_angle * z[3] + lag,
            proportional=alike.proportional,
            gas_line=lines,
            draw_down=np.exp(deeper),
        )


def _drawn_together(effects: FloatArray | None, *, seed: int, block: int) -> tuple[FloatArray, FloatArray]:
    """Factors by what was fitted together, rows as in `_fitted_effects`, and changes of the lag angle."""
    if effects is None:
        return np.ones((LAG + 1 + len(LINE_KEYS), BLOCK)), np.zeros(BLOCK)
    random = np.random.default_rng(np.random.SeedSequence(entropy=seed, spawn_key=(block, 2)))
    changes = effects @ random.standard_normal((effects.shape[1], BLOCK)) / NORMAL_95
    return np.exp(changes), changes[LAG]


def _line(scene: Scene) -> dict[str, float]:
    """Relative half-widths that the scene states of its gas line."""
    names = (name for name in LINE_KEYS if getattr(scene.gas, name))
    stated = {name: _stated(scene, name) for name in names}
    return {name: width / getattr(scene.gas, name) for name, width in stated.items() if width}


def _stated(scene: Scene, quantity: str) -> float | None:
    """Absolute half-width that the scene states, zero for an input that was fitted together with others."""
    if _fitted(scene, quantity):
        return 0.0
    for entry in scene.uncertainty:
        if entry.quantity == quantity:
            value = nominal_value(scene=scene, quantity=quantity)
            return entry.half_width if value is None else entry.absolute(value)
    return None


def _fitted(scene: Scene, quantity: str) -> bool:
    return any(each.key == quantity for each in scene.fitted.quantities)


def starting_flow(scene: Scene, law: FlowLaw) -> Flow:
    """Flow at equal fills under the scene's gas, from what the tube holds while the gas is off."""
    x = scene.disc.initial_fill
    rest = law.evaluate(fill_ratio=x, opposite_fill_ratio=x, gas_pressure=0.0, primed=True)
    return law.evaluate(
        fill_ratio=x, opposite_fill_ratio=x, gas_pressure=scene.gas.pressure, primed=rest.primed
    )


def _velocity(scene: Scene, model: BalancerModel) -> tuple[float, str]:
    if isinstance(model.flow, PaperLaw):
        k = model.flow.drag_coefficient
        stated = _stated(scene, "drag_coefficient")
        width = PAPER_DRAG_UNCERTAINTY * k if stated is None else stated
        why = "assumed: k within 10 %" if stated is None else "the scene's uncertainty of k"
        return width / (k + 1) / 2, why
    law = model.flow
    if isinstance(law, CalibratedLaw):
        law = replace(law, variants=())
    flow = starting_flow(scene, law)
    u = abs(float(flow.velocity))
    return (float(flow.uncertainty) / u if u > 0 else 0.0), "the law's own, at equal fills"


def _moment(scene: Scene, model: BalancerModel) -> tuple[float, str]:
    stated = _stated(scene, "density")
    rho = scene.liquid.density
    density = scene.liquid.density_uncertainty if stated is None else stated / rho
    if not isinstance(model.moment, CalibratedMoment):
        return math.hypot(PAPER_MOMENT_UNCERTAINTY, density), "the paper's 0.7 %, and the density"
    top = model.flow.max_fill_ratio
    ends = model.moment.half_width(np.array([0.0, top]))
    pair = float(model.moment.pair_moment(fill_ratio=top, opposite_fill_ratio=0.0))
    own = math.hypot(float(np.hypot(*ends)) / pair, density)
    factor = _stated(scene, "lambda_factor")
    if factor is None:
        return own, "the law's own, and the density"
    return math.hypot(own, factor / scene.disc.moment_factor), "the law's own, density and lambda's factor"


def _fitted_effects(scene: Scene, *, of_flow: bool) -> FloatArray:
    """Changes along each direction of the fitted inputs by one expanded uncertainty (95 %).

    Args: `of_flow`: whether the flow is that of the scene's own tube, and not a law's that is given.
    Returns: Shape (8, directions): of ln S u/V, the rate at which a chamber empties at equal fills; of ln U,
        the moment; of ln kappa; of the lag angle, rad; and of the logarithms of `LINE_KEYS`.
    """
    sides = [side for both in direction_sides(scene).values() for side in both]
    if not sides:
        return np.zeros((LAG + 1 + len(LINE_KEYS), 0))
    values = in_batches(sides, partial(_effects_on, of_flow=of_flow))
    return np.asarray((values[:, 1::2] - values[:, ::2]) / 2)


def _effects_on(designs: Designs, *, of_flow: bool) -> FloatArray:
    scene, whole = designs.scene, np.ones(designs.size)
    moment = measured_closed_forms(scene=scene, fill_ratio=scene.disc.max_fill_ratio)[1]
    line = [getattr(scene.gas, key) for key in LINE_KEYS]
    rows = [
        _log_rate(designs) if of_flow else 0.0,
        np.log(moment),
        np.log(scene.rotor.influence_coefficient),
        scene.rotor.lag_angle,
        # A dead volume of zero has no logarithm, and no effect.
        *(0.0 if value is None else np.log(np.where(np.asarray(value) > 0, value, 1.0)) for value in line),
    ]
    return np.array([row * whole for row in rows])


def _log_rate(designs: Designs) -> FloatArray:
    """ln(S u/V) of a primed tube; zero where nothing flows."""
    answers = Answers.of(designs)
    u = answers.primed_velocity
    rate = designs.scene.tube.area * np.where(u > 0, u, 1.0) / answers.chamber_volume
    return np.where(u > 0, np.log(rate), 0.0)
