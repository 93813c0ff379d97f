"""Record of a calibration: the answers of a scene, each with its uncertainty budget."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from types import MappingProxyType
from typing import Final

import numpy as np

from ringbalance.mesh.faceting import drawing_shares
from ringbalance.physics.evaporation import carried_off
from ringbalance.physics.gas import applied_pressure, leaks
from ringbalance.physics.tube.loss import TubeLoss
from ringbalance.reduced_model import paper
from ringbalance.reduced_model.chamber.calibration import ChamberCalibration
from ringbalance.reduced_model.chamber.contributions import AsynchronousInstability, unmodelled_fractions
from ringbalance.reduced_model.core import Answers
from ringbalance.reduced_model.gas_line import LineAnswer
from ringbalance.reduced_model.law.calibrated_law import CalibratedLaw
from ringbalance.reduced_model.law.flow_law import BalancerModel, Regime
from ringbalance.reduced_model.law.paper_law import PaperLaw
from ringbalance.reduced_model.residual_liquid import Holding
from ringbalance.reduced_model.terms import ModelUsed
from ringbalance.reduced_model.tube.flow import Waves
from ringbalance.results.result import PresentedResult
from ringbalance.results.rows import Parts, Quantity, around
from ringbalance.scene.arrays import FloatArray, plain
from ringbalance.scene.designs import Designs, changes_of
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
from ringbalance.scene.models import Scene
from ringbalance.scene.registry import registered
from ringbalance.scene.uncertain import NORMAL_95, UNCERTAIN_QUANTITIES

ANSWERED: Final[Mapping[str, tuple[str, str, str]]] = MappingProxyType(
    {
        "lambda": ("lambda per transferred mass", "λ", "m"),
        "usable_moment": ("usable moment of a pair", "U", "kg m"),
        "velocity": ("velocity at the operating point", "u", "m/s"),
        "reach": ("usable moment in any direction", "", "kg m"),
        "drag_coefficient": ("k there", "k", "1"),
        "chamber_volume": ("volume of a chamber", "V", "m^3"),
        "wall_pressure": ("wall pressure, largest fill", "p", "Pa"),
        "moment": ("moment of a chamber, largest fill", "U", "kg m"),
        "least_fill_ratio": ("smallest usable fill ratio", "x", "1"),
        "stall_pressure": ("full siphon stalls, chamber empty", "p", "Pa"),
        "priming_pressure_vented": ("priming, vented, chamber empty", "p", "Pa"),
        "priming_pressure_trapped": ("priming, trapped, equal fills", "p", "Pa"),
        "crest_pressure": ("gauge pressure over the crest", "p", "Pa"),
        "cavitation_margin": ("cavitation margin over the crest", "Δp", "Pa"),
        "usable_volume": ("usable volume of a pair", "", "m^3"),
        "residual_depth": ("liquid over the port as gas enters", "", "m"),
        "largest_fill_ratio": ("largest usable fill ratio", "", "1"),
        "crater_depth": ("crater of the gas jet, equal fills", "", "m"),
        "crater_ratio": ("crater over the ring, smallest fill", "", "1"),
        "blowing_number": ("blowing number, equal fills", "", "1"),
    }
)
"""Name, symbol and unit of the answers that have an uncertainty budget, in the order in which they are shown,
the main ones first."""
OF_THE_JET: Final = ("crater_depth", "crater_ratio", "blowing_number")
"""Answers that only a scene with a gas hole has."""
MAIN: Final = 4
"""Number of answers that a short text shows."""
FIELDS: Final = {"lambda": "moment_per_mass"}
"""Field of `Answers` by the name of an answer, where the two differ."""
_INDEX: Final = {name: index for index, name in enumerate(ANSWERED)}
_NEGLIGIBLE_CHANGE: Final = 1e-12
"""Relative change of a quantity that counts as rounding, not as an effect of an input."""


def _budgets(calibration: Calibration) -> Iterator[Quantity]:
    """Quantities of `ANSWERED` with intervals; wall pressure and moment at the largest fill.

    The effect of every error comes from `changes_of`, the change of the velocity included. A blocked tube has
    no drag coefficient and no crest pressure, a tube without a crest no cavitation margin.
    """
    scene, stated = calibration.scene, bool(calibration.scene.uncertainty)
    errors = (*uncertainties(scene), of_chamber(VOLUME))
    changes = _ErrorEffects.of(calibration, errors)
    effects, values = by_group(errors, changes.alone), _values(calibration)
    lowered, raised = changes.together([_INDEX[name] for name in values])
    for (key, (value, numerical)), down, up in zip(values.items(), lowered, raised, strict=True):
        causes = {
            f"{UNCERTAIN_QUANTITIES[group]}.{group}" if group in UNCERTAIN_QUANTITIES else group: size
            for group, effect in effects.items()
            if (size := float(effect[_INDEX[key]])) > _NEGLIGIBLE_CHANGE * abs(value)
        }
        parts = Parts(
            numerical=numerical,
            input=math.hypot(*(size for name, size in causes.items() if not name.startswith(MODEL))),
            model=math.hypot(*(size for name, size in causes.items() if name.startswith(MODEL))),
        )
        low, high = around(value, parts.total, stated=stated)
        if low is not None:
            low, high = value - math.hypot(numerical, down), value + math.hypot(numerical, up)
        name, symbol, unit = ANSWERED[key]
        yield Quantity(
            key=key,
            name=name,
            symbol=symbol,
            unit=unit,
            value=value,
            lower=low,
            upper=high,
            parts=parts,
            causes=causes,
            status=_status(calibration, key),
        )


def _status(calibration: Calibration, key: str) -> str:
    """ "ok" or the code of the finding that limits an answer."""
    if key in OF_THE_JET:
        return "ok" if calibration.scene.disc.gas_hole_direction == "outward" else "gas_jet_bound"
    return str(calibration.chamber.moment_per_mass.status.code) if key == "lambda" else "ok"


@dataclass(frozen=True, kw_only=True, eq=False)
class _ErrorEffects:
    """Changes of the quantities of `ANSWERED` (last axis) by the errors of a scene."""

    scene: Scene
    errors: Sequence[Uncertainty]
    values: FloatArray
    alone: FloatArray
    """Changes at the 2.5 and 97.5 % quantiles of each error alone, shape (m, 2, quantities)."""
    linear: FloatArray
    """Half-widths (95 %) by errors that change no number of the scene, linear in them, (m, quantities)."""
    waves: Waves

    @classmethod
    def of(cls, calibration: Calibration, errors: Sequence[Uncertainty]) -> _ErrorEffects:
        """Effects of each error alone, the unmodelled terms of the chambers included."""
        scene, chamber, answers = calibration.scene, calibration.chamber, calibration.answers
        values, changes = changes_of(scene, _quantities, errors)
        row = {error.name: index for index, error in enumerate(errors)}
        at, fills = chamber.reported[-1], np.unique(chamber.fill_ratio)
        share = unmodelled_fractions(scene, fills)["heads"]
        waves = Waves(fill_ratio=fills, share=share, deviation=NORMAL_95 * np.array([-1.0, 1.0]))
        moved = _quantities(Designs.stacked([scene] * 2), waves=waves)
        changes[row[WAVES]] = (moved - values[:, None]).T
        central = float(chamber.moment_per_mass.uncertainty)
        moments = chamber.moment.unmodelled[np.argsort(chamber.fill_ratio)]
        pair = math.hypot(*np.interp([answers.least_fill_ratio, answers.largest_fill_ratio], fills, moments))
        facets = drawing_shares(scene.disc, np.empty(0)).volume
        linear = np.zeros((len(errors), len(ANSWERED)))
        for error, quantity, width in (
            (WAVES, "wall_pressure", float(chamber.wall_pressure.unmodelled[at])),
            (MOMENT, "moment", float(chamber.moment.unmodelled[at])),
            (MOMENT, "lambda", math.sqrt(max(central**2 - chamber.moment_per_mass_numerical**2, 0.0))),
            (MOMENT, "usable_moment", pair),
            (MOMENT, "reach", pair / math.tan(math.pi / scene.disc.chambers)),
            (VOLUME, "chamber_volume", facets * chamber.volume),
            (VOLUME, "usable_volume", facets * float(answers.usable_volume)),
        ):
            linear[row[error], _INDEX[quantity]] = width
        alone = changes + np.stack([-linear, linear], axis=1)
        return cls(scene=scene, errors=errors, values=values, alone=alone, linear=linear, waves=waves)

    def together(self, quantities: Sequence[int]) -> tuple[list[float], list[float]]:
        """Largest decrease and increase (95 %) of quantities, by index, by all errors together.

        All errors deviate at once, in proportion to the effect of each alone: to the point on the sphere of
        1.96 standard deviations that changes the quantity most, to first order.
        Source: Hasofer and Lind, "Exact and Invariant Second-Moment Code Format", J. Eng. Mech. Div. 100
            (1974) 111 (first-order reliability).
        """
        targets = [(quantity, side) for quantity in quantities for side in (-1, 1)]
        z = np.empty((len(targets), len(self.errors)))
        for row, (quantity, side) in enumerate(targets):
            # Standard normal deviates of the errors that move the quantity most to this side.
            low, high = (side * np.nan_to_num(self.alone[:, end, quantity]) for end in (0, 1))
            size = np.maximum(np.maximum(low, high), 0.0)
            z[row] = NORMAL_95 * np.where(high >= low, 1.0, -1.0) * size / (np.linalg.norm(size) or 1.0)
        waves = [each.name for each in self.errors].index(WAVES)
        values, base = np.empty((len(ANSWERED), len(z))), with_places(self.scene, self.errors)
        # An imported chamber differs from scene to scene, so these are evaluated one by one.
        at_once = np.arange(len(z)) if base.disc.geometry is None else None
        for rows in [at_once] if at_once is not None else range(len(z)):
            scene = base
            for error, deviates in zip(self.errors, z[rows].T, strict=True):
                scene = error.moved(scene, error.deviation_of_normal(plain(deviates)))
            designs = Designs(scene=scene, size=np.size(rows))
            moved = replace(self.waves, deviation=np.atleast_1d(z[rows, waves]))
            values[:, rows] = np.reshape(_quantities(designs, waves=moved), values[:, rows].shape)
        changes, alone = [], both_sides(self.alone)
        for row, (quantity, side) in enumerate(targets):
            change = side * (values[quantity, row] - self.values[quantity])
            change += side * float(z[row] @ self.linear[:, quantity]) / NORMAL_95
            # Without flow at that point, the combined effects of single errors count.
            sides = alone[(side + 1) // 2][quantity]
            changes.append(float(max(change, 0.0) if np.isfinite(change) else sides))
        return changes[::2], changes[1::2]


def _values(calibration: Calibration) -> dict[str, tuple[float, float]]:
    """Values of the answers that exist, with their numerical half-widths."""
    chamber, answers, disc = calibration.chamber, calibration.answers, calibration.scene.disc
    at, error = chamber.reported[-1], calibration.flow_law.heads.interpolation_error
    level, moment = chamber.hydrostatic_pressure, float(np.max(chamber.moment.interpolation))
    # Two chambers count.
    width = math.sqrt(2) * math.hypot(float(level.numerical[at]), float(level.interpolation[-1]))
    rounding = error * abs(applied_pressure(calibration.scene.gas))
    k = float(answers.drag_coefficient)
    numerical = {
        "lambda": chamber.moment_per_mass_numerical,
        "usable_moment": moment,
        "velocity": error * abs(float(answers.velocity)),
        "reach": moment / math.tan(math.pi / disc.chambers),
        "drag_coefficient": error * (k + 1),
        "chamber_volume": _NEGLIGIBLE_CHANGE * chamber.volume,
        "wall_pressure": float(chamber.wall_pressure.numerical[at]),
        "moment": float(chamber.moment.numerical[at]),
        "stall_pressure": width,
        "priming_pressure_vented": width,
        "priming_pressure_trapped": width,
        "crest_pressure": rounding,
        "cavitation_margin": rounding,
    }
    values = {name: float(getattr(answers, FIELDS.get(name, name))) for name in ANSWERED}
    return {
        name: (value, numerical.get(name, 0.0)) for name, value in values.items() if not math.isnan(value)
    }


def _quantities(designs: Designs, *, waves: Waves | None = None) -> FloatArray:
    answers = Answers.of(designs, waves=waves)
    return np.array([getattr(answers, FIELDS.get(name, name)) for name in ANSWERED])


@dataclass(frozen=True, kw_only=True, eq=False, repr=False)
class Calibration(PresentedResult):
    """Results of `calibrate` for a scene's balancer.

    Example:
        >>> scene = rb.load_scene(rb.bundled_scene("liquid_ring_paper"))
        >>> calibration = rb.calibrate(scene)
        >>> f"{calibration.answers.velocity:.1f} m/s"
        '14.9 m/s'
        >>> f"{calibration.quantities['lambda'].value:.4f} m"
        '0.0734 m'
    """

    scene: Scene
    chamber: ChamberCalibration
    """Wall pressure, moment and lambda."""
    tube: TubeLoss
    """k over `VELOCITIES`."""
    flow_law: CalibratedLaw
    """Flow law from chamber and tube."""
    paper_law: PaperLaw
    """Eq. 19 of the liquid-ring paper, for comparison."""
    answers: Answers
    """Flow at equal fills under the scene's gas pressure, usable range of a pair, and thresholds."""
    instability: AsynchronousInstability | None
    """Asynchronous whirl with surface waves; None where every wave is faster than the rotor."""
    models_used: tuple[ModelUsed, ...]
    """Every physical term, with its model and its estimated contribution."""
    statistics: Mapping[str, float]
    """Operation counts and interpolation errors; no wall times, so that they are reproducible."""

    @cached_property
    def quantities(self) -> Mapping[str, Quantity]:
        """Main numbers by key, with intervals, computed on first use."""
        by_paper = paper.stall_pressure(
            disc=self.scene.disc, density=self.scene.liquid.density, angular_velocity=self.scene.rotor.speed
        )
        rest = [
            ("lambda_variation", "variation of lambda over fills", "1", self.lambda_variation),
            ("stall_pressure_paper", "stall pressure by Eq. 19", "Pa", by_paper),
        ]
        if (per_gas := carried_off(self.scene)) is not None:
            name = "liquid that gas takes, at most"
            rest.append(("liquid_per_gas", name, "kg/m^3", per_gas))
        if leaks(self.scene.gas):
            name = "gas pressure over a vented chamber"
            rest.append(("applied_pressure", name, "Pa", applied_pressure(self.scene.gas)))
        without_budget = (
            Quantity(key=key, name=name, unit=unit, value=value, digits=3) for key, name, unit, value in rest
        )
        return {each.key: each for each in (*_budgets(self), *without_budget)}

    @cached_property
    def regime(self) -> Regime:
        """Regime of an unprimed tube at equal fills under the scene's gas pressure."""
        law = self.flow_law
        half = law.max_fill_ratio / 2
        flow = law.evaluate(
            fill_ratio=half, opposite_fill_ratio=half, gas_pressure=applied_pressure(self.scene.gas)
        )
        return Regime(int(flow.regime))

    @cached_property
    def gas_line(self) -> tuple[LineAnswer, ...]:
        """Effect of the gas line, or of both ends of a default range of lines; computed on first use."""
        # The time integration is compiled; only its use loads the compiler.
        answers: tuple[LineAnswer, ...] = registered("function", "line_answers")(self.scene, self.model)
        return answers

    @property
    def holding(self) -> Holding:
        """Stability of the liquid in the fullest chamber that runs reach, with the gas off."""
        return Holding.of(self.scene, fill_ratio=float(self.answers.largest_fill_ratio))

    @property
    def model(self) -> BalancerModel:
        """Balancer model for the closed loop."""
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
