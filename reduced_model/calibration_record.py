"""What `calibrate` finds out about a balancer, and one uncertainty budget for every main quantity of it."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Final

import numpy as np
import numpy.typing as npt

from ringbalance.physics.tube.loss import TubeLoss, tube_loss
from ringbalance.reduced_model import paper
from ringbalance.reduced_model.chamber.calibration import ChamberCalibration, Curve
from ringbalance.reduced_model.chamber.contributions import AsynchronousInstability, unmodelled_fractions
from ringbalance.reduced_model.chamber.values import drawing_shares
from ringbalance.reduced_model.core import Answers
from ringbalance.reduced_model.gas_line import LineAnswer
from ringbalance.reduced_model.law.calibrated_law import CalibratedLaw
from ringbalance.reduced_model.law.flow_law import BalancerModel, Regime
from ringbalance.reduced_model.law.paper_law import PaperLaw
from ringbalance.reduced_model.pressure_profile import HumpProfile, TubeLiquid
from ringbalance.reduced_model.residual_liquid import Holding, ResidualLiquid
from ringbalance.reduced_model.terms import ModelUsed
from ringbalance.reduced_model.tube import regime
from ringbalance.reduced_model.tube.flow import Waves
from ringbalance.reduced_model.tube.regime import stall_pressure
from ringbalance.results.result import PresentedResult
from ringbalance.scene.arrays import FloatArray
from ringbalance.scene.designs import Designs, alike, changes_of
from ringbalance.scene.errors import (
    MOMENT,
    VOLUME,
    WAVES,
    Uncertainty,
    both_sides,
    by_group,
    of_chamber,
    uncertainties,
    with_places,
)
from ringbalance.scene.fitted import MODEL
from ringbalance.scene.models import HumpGas, Scene
from ringbalance.scene.registry import registered
from ringbalance.scene.uncertain import NORMAL_95, UNCERTAIN_QUANTITIES

UNITS: Final = {
    "chamber_volume": "m^3",
    "wall_pressure": "Pa",
    "moment": "kg m",
    "least_fill_ratio": "1",
    "usable_moment": "kg m",
    "lambda": "m",
    "velocity": "m/s",
    "drag_coefficient": "1",
    "crest_pressure": "Pa",
    "cavitation_margin": "Pa",
    "priming_pressure_vented": "Pa",
    "priming_pressure_trapped": "Pa",
    "stall_pressure": "Pa",
}
_ANSWERS: Final = {"lambda": "moment_per_mass"}
"""Names in `Answers` that differ."""
UNSTATED: Final = (
    "The scene states no uncertainty of its inputs, so no ± here holds what they would add; a value without "
    "± is known no better than the inputs."
)
_NEGLIGIBLE: Final = 1e-12
"""Relative change of a quantity that counts as rounding, not as an effect of an input."""


@dataclass(frozen=True, kw_only=True)
class OperatingPoint:
    """Equal fills, the scene's gas pressure, an empty tube beforehand."""

    fill_ratio: float
    """x of both chambers."""
    gas_pressure: float
    """Gauge, Pa."""
    regime: Regime
    """Of the flow."""
    velocity: float
    """u, m/s; zero when blocked."""
    velocity_uncertainty: float
    """Expanded uncertainty (95 %), m/s."""
    loss_velocity: float
    """|u|, at which k is given, m/s; zero where it is blocked."""
    k: float | None
    """Loss coefficient there; None where it is blocked."""
    k_uncertainty: float | None
    """Expanded uncertainty (95 %)."""
    priming_vented: float | None
    """Gauge pressure that starts a flow, crest gas vented, driven chamber empty, Pa; None: no crest."""
    priming_trapped: float | None
    """The same with that gas trapped, at equal fills."""
    stall: float
    """Gauge pressure at which a full siphon stalls with the driven chamber empty, Pa."""
    stall_paper: float
    """The same by Eq. 19."""
    hump_pressure: float | None
    """Pressure over the crest, gauge, Pa; None: no crest."""
    cavity_pressure: float | None
    """At which the column separates there, gauge, Pa."""
    cavitation_margin: float | None
    """Pressure over the crest of a full siphon, of a primed tube when blocked, less `cavity_pressure`, Pa."""
    cavitation_margin_uncertainty: float | None
    """Expanded uncertainty (95 %), Pa."""

    @classmethod
    def of(cls, *, scene: Scene, law: CalibratedLaw) -> OperatingPoint:
        """Evaluate the law at equal fills under the scene's gas pressure.

        Source: the law itself; thresholds by hydrostatics.
        """
        x, pressure = law.max_fill_ratio / 2, scene.gas.pressure
        flow = law.evaluate(fill_ratio=x, opposite_fill_ratio=x, gas_pressure=pressure)
        u = abs(float(flow.velocity))
        loss = tube_loss(scene, u) if u > 0 else None
        hump = HumpProfile.of(scene=scene, law=law, fill_ratio=x, opposite_fill_ratio=x, points=2)
        vented = priming_pressure(law=law, fill_ratio=0.0, hump_gas="vented")
        trapped = priming_pressure(law=law, fill_ratio=x, opposite_fill_ratio=x, hump_gas="trapped")
        return cls(
            fill_ratio=x,
            gas_pressure=pressure,
            regime=Regime(int(flow.regime)),
            velocity=float(flow.velocity),
            velocity_uncertainty=float(flow.uncertainty),
            loss_velocity=u,
            k=None if loss is None else float(loss.k.value),
            k_uncertainty=None if loss is None else float(loss.k.uncertainty),
            priming_vented=None if vented is None else float(vented),
            priming_trapped=None if trapped is None else float(trapped),
            stall=max(float(stall_pressure(law.path, law.ends(fill_ratio=0.0))) / law.gas_factor, 0.0),
            stall_paper=paper.stall_pressure(
                disc=scene.disc, density=scene.liquid.density, angular_velocity=scene.rotor.speed
            ),
            hump_pressure=hump.hump_pressure,
            cavity_pressure=hump.cavity_pressure,
            cavitation_margin=hump.cavitation_margin,
            cavitation_margin_uncertainty=hump.cavitation_margin_uncertainty,
        )


def priming_pressure(
    *,
    law: CalibratedLaw,
    fill_ratio: npt.ArrayLike,
    opposite_fill_ratio: npt.ArrayLike | None = None,
    hump_gas: HumpGas,
) -> FloatArray | None:
    """Gas pressure that primes the tube: it lifts the liquid over the siphon crest.

    vented: rho omega^2 (a_A^2 - r_m^2)/2; trapped: that and rho omega^2 (r_p^2 - a_C^2)/2.
    Args: `law`: the flow law. `fill_ratio`: x of the driven chamber, any shape. `opposite_fill_ratio`: of the
        opposite chamber; default max_fill_ratio - fill_ratio. `hump_gas`: which of the two bounds, whatever
        the law itself uses.
    Returns: Gauge pressure, Pa, of the broadcast shape; None without a crest.
    Source: hydrostatics of the two legs in the rotating frame. For the liquid-ring paper's disc a crest at
        31.5 mm gives its 0.54 MPa, vented with the driven chamber nearly empty or trapped at equal fills: an
        inference, because the paper does not say what its figure means.
    """
    if not law.path.crest:
        return None
    path = replace(law.path, trapped=hump_gas == "trapped")
    ends = law.ends(fill_ratio=fill_ratio, opposite_fill_ratio=opposite_fill_ratio)
    return np.asarray(regime.priming_pressure(path, ends)) / law.gas_factor


@dataclass(frozen=True, kw_only=True)
class Budget:
    """A quantity with its expanded uncertainties (95 %) by cause, all in the quantity's SI unit."""

    quantity: str
    unit: str
    value: float
    numerical: float
    """Rounding, quadrature, interpolation, and what finite elements contradict."""
    models: Mapping[str, float]
    """By error of a model, such as "model: ends"; those without any effect are not listed."""
    inputs: Mapping[str, float]
    """By path in the scene file, such as "tube.bore", "fitted" for all that were fitted together; those
    without any effect are not listed."""
    lowered: float
    """By how much inputs and models together may lower the value (95 %)."""
    raised: float
    """By how much they may raise it."""

    @property
    def lower(self) -> float:
        """End of the interval (95 %)."""
        return self.value - math.hypot(self.numerical, self.lowered)

    @property
    def upper(self) -> float:
        """Other end of the interval (95 %)."""
        return self.value + math.hypot(self.numerical, self.raised)

    @property
    def model(self) -> float:
        """Of all errors of models, which are independent."""
        return math.hypot(*self.models.values())

    @property
    def input(self) -> float:
        """Of all inputs, which are independent."""
        return math.hypot(*self.inputs.values())

    @property
    def total(self) -> float:
        """Root of the sum of the squares of the three parts (ASME V&V 20-2009)."""
        return math.hypot(self.numerical, self.input, self.model)


def _budgets(calibration: Calibration) -> Mapping[str, Budget]:
    """Budget of each of `UNITS`; wall pressure and moment at the largest fill, flow at the operating point.

    Every uncertainty of the scene counts by `changes_of`, with what the velocity does when it moves. An
    operating point without any velocity has no drag coefficient, and one without a flow over a crest neither
    crest pressure nor margin.
    """
    errors = (*uncertainties(calibration.scene), of_chamber(VOLUME))
    changes = _Changes.of(calibration, errors)
    effects, values = by_group(errors, changes.alone), _values(calibration)
    lowered, raised = changes.together([list(UNITS).index(name) for name in values])
    found = {}
    for (name, (value, numerical)), down, up in zip(values.items(), lowered, raised, strict=True):
        place = list(UNITS).index(name)
        each = {
            group: float(effect[place])
            for group, effect in effects.items()
            if effect[place] > _NEGLIGIBLE * abs(value)
        }
        found[name] = Budget(
            quantity=name,
            unit=UNITS[name],
            value=value,
            numerical=numerical,
            models={group: size for group, size in each.items() if group.startswith(MODEL)},
            inputs={
                f"{UNCERTAIN_QUANTITIES[group]}.{group}" if group in UNCERTAIN_QUANTITIES else group: size
                for group, size in each.items()
                if not group.startswith(MODEL)
            },
            lowered=down,
            raised=up,
        )
    return found


@dataclass(frozen=True, kw_only=True, eq=False)
class _Changes:
    """Changes of `UNITS`, the last axis, by the errors of a scene."""

    scene: Scene
    errors: Sequence[Uncertainty]
    values: FloatArray
    alone: FloatArray
    """At both sides of each error, shape (m, 2, quantities)."""
    linear: FloatArray
    """Half-widths (95 %) by what is no change of the scene, which act in proportion, (m, quantities)."""
    waves: Waves

    @classmethod
    def of(cls, calibration: Calibration, errors: Sequence[Uncertainty]) -> _Changes:
        """By every error alone; the chambers' by what no model of them holds."""
        scene, chamber, rest = calibration.scene, calibration.chamber, calibration.residual
        values, changes = changes_of(scene, _quantities, errors)
        place = {error.name: place for place, error in enumerate(errors)}
        at, fills = chamber.reported[-1], np.unique(chamber.fill_ratio)
        share = unmodelled_fractions(scene, fills)["heads"]
        waves = Waves(fill_ratio=fills, share=share, deviation=NORMAL_95 * np.array([-1.0, 1.0]))
        moved = _quantities(Designs.stacked([scene] * 2), waves=waves)
        changes[place[WAVES]] = (moved - values[:, None]).T
        central = float(chamber.moment_per_mass.uncertainty)
        moments = chamber.moment.unmodelled[np.argsort(chamber.fill_ratio)]
        ends = np.interp([rest.least_fill_ratio, rest.largest_fill_ratio], fills, moments)
        linear = np.zeros((len(errors), len(UNITS)))
        for error, quantity, width in (
            (WAVES, "wall_pressure", float(chamber.wall_pressure.unmodelled[at])),
            (MOMENT, "moment", float(chamber.moment.unmodelled[at])),
            (MOMENT, "lambda", math.sqrt(max(central**2 - chamber.moment_per_mass_numerical**2, 0.0))),
            (MOMENT, "usable_moment", math.hypot(*ends)),
            (VOLUME, "chamber_volume", drawing_shares(scene.disc, np.empty(0)).volume * chamber.volume),
        ):
            linear[place[error], list(UNITS).index(quantity)] = width
        alone = changes + np.stack([-linear, linear], axis=1)
        return cls(scene=scene, errors=errors, values=values, alone=alone, linear=linear, waves=waves)

    def together(self, places: Sequence[int]) -> tuple[list[float], list[float]]:
        """By how much all errors together may lower and raise quantities (95 %), by their places.

        All move at once, in proportion to what each alone changes: on the sphere of 1.96 standard deviations
        to the point from which on, to the first order, a value lies further away.
        Source: Hasofer and Lind, "Exact and Invariant Second-Moment Code Format", J. Eng. Mech. Div. 100
            (1974) 111 (first-order reliability).
        """
        asked = [(place, side) for place in places for side in (-1, 1)]
        z = np.array([self._most_probable(place, side) for place, side in asked])
        base, scenes = with_places(self.scene, self.errors), []
        for row in z:
            scene = base
            for error, each in zip(self.errors, row.tolist(), strict=True):
                scene = error.moved(scene, error.deviation_of_normal(each))
            scenes.append(scene)
        waves = z[:, [each.name for each in self.errors].index(WAVES)]
        values = np.empty((len(UNITS), len(scenes)))
        # Chambers of a mesh move with the scene, so that each scene has its own.
        for rows in alike(scenes):
            designs = Designs.stacked([scenes[row] for row in rows])
            values[:, rows] = _quantities(designs, waves=replace(self.waves, deviation=waves[rows]))
        found, alone = [], both_sides(self.alone)
        for row, (place, side) in enumerate(asked):
            moved = side * (values[place, row] - self.values[place])
            moved += side * float(z[row] @ self.linear[:, place]) / NORMAL_95
            # Where nothing flows at that point, what flows at the sides counts.
            found.append(float(max(moved, 0.0) if np.isfinite(moved) else alone[(side + 1) // 2][place]))
        return found[::2], found[1::2]

    def _most_probable(self, place: int, side: int) -> FloatArray:
        """Standard normal deviates of the errors that move a quantity most to one side, shape (m,)."""
        low, high = (side * np.nan_to_num(self.alone[:, end, place]) for end in (0, 1))
        size = np.maximum(np.maximum(low, high), 0.0)
        return NORMAL_95 * np.where(high >= low, 1.0, -1.0) * size / (np.linalg.norm(size) or 1.0)


def _values(calibration: Calibration) -> dict[str, tuple[float, float]]:
    """Values with their numerical parts."""
    point, rest, chamber = calibration.operating_point, calibration.residual, calibration.chamber
    at, error = chamber.reported[-1], calibration.flow_law.heads.interpolation_error
    level, moment = chamber.hydrostatic_pressure, float(np.max(chamber.moment.interpolation))
    # Two chambers count.
    width = math.sqrt(2) * math.hypot(float(level.numerical[at]), float(level.interpolation[-1]))
    found: dict[str, tuple[float | None, float]] = {
        "chamber_volume": (chamber.volume, _NEGLIGIBLE * chamber.volume),
        "wall_pressure": _at(chamber.wall_pressure, at),
        "moment": _at(chamber.moment, at),
        "lambda": (float(chamber.moment_per_mass.value), chamber.moment_per_mass_numerical),
        "stall_pressure": (point.stall, width),
        "priming_pressure_vented": (point.priming_vented, width),
        "priming_pressure_trapped": (point.priming_trapped, width),
        "least_fill_ratio": (rest.least_fill_ratio, 0.0),
        "usable_moment": (rest.usable_pair_moment, moment),
        "velocity": (point.velocity, error * abs(point.velocity)),
        "drag_coefficient": (point.k, error * ((point.k or 0.0) + 1)),
    }
    if point.velocity != 0:
        rounding = error * abs(point.gas_pressure)
        found["crest_pressure"] = (point.hump_pressure, rounding)
        found["cavitation_margin"] = (point.cavitation_margin, rounding)
    return {name: (value, part) for name, (value, part) in found.items() if value is not None}


def _at(curve: Curve, at: int) -> tuple[float, float]:
    return float(curve.value[at]), float(curve.numerical[at])


def _quantities(designs: Designs, *, waves: Waves | None = None) -> FloatArray:
    answers = Answers.of(designs, waves=waves)
    return np.array([getattr(answers, _ANSWERS.get(name, name)) for name in UNITS])


@dataclass(frozen=True, kw_only=True, eq=False, repr=False)
class Calibration(PresentedResult):
    """Everything that `calibrate` finds out about a scene's balancer.

    Example:
        >>> scene = rb.load_scene(rb.bundled_scene("liquid_ring_paper"))
        >>> calibration = rb.calibrate(scene)
        >>> f"{calibration.operating_point.velocity:.1f} m/s"
        '14.9 m/s'
        >>> f"{calibration.to_dict()['lambda']['per_transferred_mass_m']:.4f} m"
        '0.0734 m'
    """

    scene: Scene
    chamber: ChamberCalibration
    """Wall pressure, moment and lambda."""
    tube: TubeLoss
    """k over `VELOCITIES`."""
    flow_law: CalibratedLaw
    """The law distilled from both."""
    paper_law: PaperLaw
    """Eq. 19 of the liquid-ring paper, for comparison."""
    operating_point: OperatingPoint
    """At equal fills under the scene's gas pressure."""
    residual: ResidualLiquid
    """Of a chamber emptied under the scene's gas pressure, and what a pair can use."""
    tube_liquid: TubeLiquid
    """In the tube of a pair around its first injection, and what it does to the vibration."""
    instability: AsynchronousInstability | None
    """Whirl that surface waves lock to; None where there is no such wave."""
    models_used: tuple[ModelUsed, ...]
    """Every physical term, with its model and its estimated contribution."""
    statistics: Mapping[str, float]
    """Counted work and measured interpolation errors; no wall times, so they reproduce."""

    @cached_property
    def budgets(self) -> Mapping[str, Budget]:
        """Uncertainty budget of every main quantity, made when it is first asked for."""
        return _budgets(self)

    @cached_property
    def gas_line(self) -> tuple[LineAnswer, ...]:
        """What the gas line can deliver, or both ends of a default range of lines; found when asked for."""
        # The march is compiled: what needs no answer of it loads no compiler.
        answers: tuple[LineAnswer, ...] = registered("function", "line_answers")(self.scene, self.model)
        return answers

    @property
    def holding(self) -> Holding:
        """Whether the fullest chamber that runs reach keeps its liquid with the gas off."""
        return Holding.of(self.scene, fill_ratio=self.residual.largest_fill_ratio)

    @property
    def model(self) -> BalancerModel:
        """The balancer as the closed loop takes it."""
        return BalancerModel.of(self.flow_law)

    def lambda_over_fill(self, *, fill_ratio: FloatArray) -> FloatArray:
        """lambda(x) per transferred mass, [U(x) - U(x_max - x)]/(rho V (x - x_max/2)).

        Returns: lambda, m, shape (n,); its limit at the centre.
        Source: definition; per difference of the two chambers' masses it is half of that.
        """
        law, chamber = self.flow_law, self.chamber
        largest = law.max_fill_ratio
        away = fill_ratio - largest / 2
        # Nearer than this the difference of two moments would be mostly interpolation error.
        centre = np.abs(away) < 0.02 * largest
        pair = law.moment.pair_moment(
            fill_ratio=fill_ratio, opposite_fill_ratio=np.clip(largest - fill_ratio, 0.0, largest)
        )
        mass = law.density * law.chamber_volume * np.where(centre, 1.0, away)
        return np.where(centre, float(chamber.moment_per_mass.value), pair / mass)

    @property
    def lambda_variation(self) -> float:
        """Variation of lambda over the fill range, (largest - smallest)/value at the centre.

        Source: definition; the liquid-ring paper states 0.7 %.
        """
        x = np.linspace(0.0, self.flow_law.max_fill_ratio, 101)
        values = self.lambda_over_fill(fill_ratio=x)
        return float(np.ptp(values) / self.chamber.moment_per_mass.value)
