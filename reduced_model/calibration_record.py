"""What `calibrate` finds out about a balancer, and one uncertainty budget for every main quantity of it."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Final

import numpy as np
import numpy.typing as npt

from ringbalance.physics.tube.loss import INPUT_PART, TubeLoss, tube_loss
from ringbalance.reduced_model import paper
from ringbalance.reduced_model.chamber.calibration import ChamberCalibration, Curve
from ringbalance.reduced_model.chamber.contributions import AsynchronousInstability
from ringbalance.reduced_model.chamber.values import drawing_shares
from ringbalance.reduced_model.core import Answers
from ringbalance.reduced_model.gas_line import LineAnswer
from ringbalance.reduced_model.law.calibrated_law import WIDTH, CalibratedLaw, DriveUncertainty
from ringbalance.reduced_model.law.flow_law import BalancerModel, Regime
from ringbalance.reduced_model.law.paper_law import PaperLaw
from ringbalance.reduced_model.pressure_profile import HumpProfile, TubeLiquid
from ringbalance.reduced_model.residual_liquid import Holding, ResidualLiquid
from ringbalance.reduced_model.terms import ModelUsed
from ringbalance.reduced_model.tube import regime
from ringbalance.reduced_model.tube.regime import TubeEnds, gas_over_crest, possible_cavity, stall_pressure
from ringbalance.results.result import PresentedResult
from ringbalance.scene.arrays import FloatArray
from ringbalance.scene.designs import Designs, input_effects
from ringbalance.scene.models import HumpGas, Scene
from ringbalance.scene.registry import registered
from ringbalance.scene.uncertain import UNCERTAIN_QUANTITIES

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
    k_model_uncertainty: float | None
    """Its part by correlations, without the inputs."""
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
            k_model_uncertainty=None if loss is None else _model_part(loss.uncertainty_parts),
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


def _model_part(parts: Mapping[str, FloatArray]) -> float:
    return math.hypot(*(float(part) for name, part in parts.items() if not name.startswith(INPUT_PART)))


@dataclass(frozen=True, kw_only=True)
class Budget:
    """A quantity with its expanded uncertainties (95 %) by cause, all in the quantity's SI unit."""

    quantity: str
    unit: str
    value: float
    numerical: float
    """Rounding, quadrature, interpolation, and what finite elements contradict."""
    model: float
    """Correlations, terms that are left out or have no model, and what is undecided over the crest."""
    inputs: Mapping[str, float]
    """By path in the scene file, such as "tube.bore", "fitted" for all that were fitted together; those
    without any effect are not listed."""

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

    Inputs count by `input_effects`, k's with what its velocity does when an input moves it. An operating
    point without any velocity has no drag coefficient, and one without a flow over a crest neither crest
    pressure nor margin.
    """
    scene = calibration.scene
    parts = _chamber_parts(scene, calibration.chamber) | _flow_parts(scene, calibration)
    effects = _input_effects(scene)
    return {
        name: Budget(
            quantity=name,
            unit=UNITS[name],
            value=value,
            numerical=numerical,
            model=model,
            inputs={
                path: change
                for path, each in effects.items()
                if (change := each[name]) > _NEGLIGIBLE * abs(value)
            },
        )
        for name, (value, numerical, model) in parts.items()
    }


_Parts = tuple[float, float, float]


def _chamber_parts(scene: Scene, chamber: ChamberCalibration) -> dict[str, _Parts]:
    """Value, numerical and model part of the quantities of the chamber."""
    at = chamber.reported[-1]
    central, numerical = chamber.moment_per_mass, chamber.moment_per_mass_numerical
    drawn = drawing_shares(scene.disc, np.empty(0)).volume
    model = math.sqrt(max(float(central.uncertainty) ** 2 - numerical**2, 0.0))
    return {
        "chamber_volume": (chamber.volume, _NEGLIGIBLE * chamber.volume, drawn * chamber.volume),
        "wall_pressure": _curve_parts(chamber.wall_pressure, at),
        "moment": _curve_parts(chamber.moment, at),
        "lambda": (float(central.value), numerical, model),
    }


def _curve_parts(curve: Curve, at: int) -> _Parts:
    model = float(curve.unmodelled[at])
    return float(curve.value[at]), float(curve.numerical[at]), model


def _flow_parts(scene: Scene, calibration: Calibration) -> dict[str, _Parts]:
    """Value, numerical and model part of the quantities of the flow at the operating point."""
    point, rest = calibration.operating_point, calibration.residual
    law = _law_without_inputs(scene, calibration)
    fills = (point.fill_ratio, point.fill_ratio)
    flow = law.evaluate(fill_ratio=fills[0], opposite_fill_ratio=fills[1], gas_pressure=point.gas_pressure)
    error = calibration.flow_law.heads.interpolation_error
    levels = _level_parts(calibration)
    _, numerical, model = levels["stall_pressure"]
    fill_width, moment_width = rest.model_uncertainty(scene, law=law, head=math.hypot(numerical, model))
    found = levels | {
        "least_fill_ratio": (rest.least_fill_ratio, 0.0, fill_width),
        "usable_moment": (
            rest.usable_pair_moment,
            float(np.max(calibration.chamber.moment.interpolation)),
            moment_width,
        ),
        "velocity": (point.velocity, error * abs(point.velocity), float(flow.uncertainty)),
    }
    if point.k is not None and point.k_model_uncertainty is not None:
        found["drag_coefficient"] = (point.k, error * (point.k + 1), point.k_model_uncertainty)
    if point.cavitation_margin is None or point.hump_pressure is None or point.velocity == 0:
        return found
    reverse = point.velocity < 0
    margin = law.cavity_margin(fills=fills, gas_pressure=point.gas_pressure, reverse=reverse)[1] or 0.0
    ends = law.ends(fill_ratio=fills[0], opposite_fill_ratio=fills[1], gas_pressure=point.gas_pressure)
    part = _crest_part(law, point, ends.reversed() if reverse else ends, margin)
    rounding = error * abs(point.gas_pressure)
    return found | {
        "crest_pressure": (point.hump_pressure, rounding, part),
        "cavitation_margin": (point.cavitation_margin, rounding, margin),
    }


def _level_parts(calibration: Calibration) -> dict[str, _Parts]:
    """The same of the gas pressures that hydrostatics alone give, for which two chambers count."""
    point, chamber = calibration.operating_point, calibration.chamber
    level = chamber.hydrostatic_pressure
    _, numerical, model = _curve_parts(level, chamber.reported[-1])
    values = {
        "stall_pressure": point.stall,
        "priming_pressure_vented": point.priming_vented,
        "priming_pressure_trapped": point.priming_trapped,
    }
    width = math.sqrt(2) * math.hypot(numerical, float(level.interpolation[-1]))
    return {name: (value, width, math.sqrt(2) * model) for name, value in values.items() if value is not None}


def _crest_part(law: CalibratedLaw, point: OperatingPoint, ends: TubeEnds, margin: float) -> float:
    """Model part of the crest's pressure, the larger of a cavity's, which has bounds, and a full siphon's."""
    if point.cavitation_margin is None or point.cavity_pressure is None:
        return 0.0
    low, high = (float(bound) for bound in possible_cavity(law.path, ends))
    gas = max(float(gas_over_crest(law.path, ends)), high)
    pressure = point.hump_pressure or 0.0
    full = point.cavity_pressure + point.cavitation_margin
    highest = max(gas if pressure > high else high, full + margin)
    return max(highest - pressure, pressure - max(low, full - margin), 0.0)


def _law_without_inputs(scene: Scene, calibration: Calibration) -> CalibratedLaw:
    """The law with the uncertainties of numerics and models alone."""
    chamber, law = calibration.chamber, calibration.flow_law
    width = chamber.hydrostatic_pressure.half_widths(inputs=np.zeros_like(chamber.fill_ratio))
    return replace(
        law,
        heads=law.heads.without_inputs(scene=scene),
        inputs=DriveUncertainty(),
        variants=(),
        levels=law.levels.with_column(WIDTH, width),
    )


def _input_effects(scene: Scene) -> dict[str, dict[str, float]]:
    """Effects on all of `UNITS`, by the input's path in the scene, or "fitted"."""
    found = {}
    for name, effects in input_effects(scene, _quantities)[1].items():
        table = UNCERTAIN_QUANTITIES.get(name)
        path = name if table is None else f"{table}.{name}"
        found[path] = dict(zip(UNITS, effects.tolist(), strict=True))
    return found


def _quantities(designs: Designs) -> FloatArray:
    answers = Answers.of(designs)
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
