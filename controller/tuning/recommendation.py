"""The gain to use: the largest one with which no residual turns round, at the edge of the uncertainty.

The loop factor is uncertain by the law's models and numerics, by each input through what it does to
lambda rho S u, and by the influence coefficient.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from ringbalance.controller.liquid_ring.loop_factor import LoopFactor, vibration_rates
from ringbalance.controller.members import MemberUncertainty, starting_flow
from ringbalance.reduced_model.core import Answers
from ringbalance.reduced_model.law.calibrated_law import CalibratedLaw
from ringbalance.reduced_model.law.flow_law import BalancerModel
from ringbalance.reduced_model.law.paper_law import PaperLaw, paper_model
from ringbalance.reduced_model.tube.directed_flow import DriveUncertainty
from ringbalance.scene.arrays import FloatArray
from ringbalance.scene.designs import Designs, input_effects
from ringbalance.scene.models import Scene
from ringbalance.scene.uncertain import FITTED, independent_half_widths, input_sides

_ELSEWHERE: Final = frozenset({"influence_coefficient", "lag_angle", "density"})
"""Inputs with a part of their own; the density is in that of the moment, and the velocity makes up for some
of it."""

_NO_EFFECT: Final = 1e-6


@dataclass(frozen=True, kw_only=True)
class Contribution:
    """One part of the loop factor's uncertainty."""

    name: str
    uncertainty: float
    """Expanded (95 %), relative to the loop factor."""
    source: str


@dataclass(frozen=True, kw_only=True)
class FactorUncertainty:
    """Of the loop factor, by all that is uncertain."""

    widths: MemberUncertainty
    """Of a random sample; every input is in its velocity."""
    parts: tuple[Contribution, ...]

    @property
    def total(self) -> float:
        """Expanded uncertainty (95 %), relative: root of the sum of the squares."""
        return math.hypot(*(part.uncertainty for part in self.parts))


def recommended_gain(
    scene: Scene, model: BalancerModel, *, loop: LoopFactor, uncertainty: FactorUncertainty | None = None
) -> float:
    """Kc, s/m, of the target-vector algorithm; zero where nothing flows or the limit is below the noise.

    With the expanded uncertainty U of the loop factor, and the fastest chamber r times as fast as the mean
    of its pair, Kc b = min(1/r, h_s)/(1 + U): one injection then removes at most the whole residual, and the
    loop factor is at most h_s, with which noise leaves the amplitude within its limit.
    """
    if loop.rate == 0.0:
        return 0.0
    known = factor_uncertainty(scene, model) if uncertainty is None else uncertainty
    fastest = float(np.max(vibration_rates(scene, model))) / loop.rate
    return min(1.0 / fastest, loop.largest_staying) / (1.0 + known.total) / loop.rate


def factor_uncertainty(scene: Scene, model: BalancerModel) -> FactorUncertainty:
    """All that makes the loop factor uncertain, under a law; inputs move a law that the program can make."""
    own = MemberUncertainty.of(scene, _without_inputs(scene, model))
    effects = _input_effects(scene, model)
    parts = [
        Contribution(name="velocity", uncertainty=own.velocity, source=own.sources[0]),
        Contribution(name="moment", uncertainty=own.moment, source=own.sources[1]),
        Contribution(
            name="influence_coefficient", uncertainty=own.influence_coefficient, source=own.sources[2]
        ),
        *(
            Contribution(name=quantity, uncertainty=effect, source="uncertainty of the input")
            for quantity, effect in effects.items()
        ),
    ]
    if own.together is not None:
        parts.append(
            Contribution(
                name=FITTED,
                uncertainty=own.together_on_vibration,
                source="inputs that were fitted together, and the influence coefficient where it is one",
            )
        )
    velocity = math.hypot(own.velocity, *effects.values())
    return FactorUncertainty(widths=replace(own, velocity=velocity), parts=tuple(parts))


def _without_inputs(scene: Scene, model: BalancerModel) -> BalancerModel:
    """The same law with the uncertainty of its models and numerics alone."""
    law = model.flow
    if not isinstance(law, CalibratedLaw):
        return model
    heads = law.heads.without_inputs(scene=scene, velocity=_velocity(scene, model) or 1.0)
    return replace(model, flow=replace(law, heads=heads, inputs=DriveUncertainty(), variants=()))


def _velocity(scene: Scene, model: BalancerModel) -> float:
    """At equal fills, m/s."""
    return abs(float(starting_flow(scene, model.flow).velocity))


def _input_effects(scene: Scene, model: BalancerModel) -> dict[str, float]:
    """Larger relative change of lambda rho S u to either side, by input; none under another's law."""
    widths = independent_half_widths(scene)
    among = [name for name in widths if name not in _ELSEWHERE]
    if isinstance(model.flow, CalibratedLaw):
        here, changes = input_effects(scene, _rates, among=among, errors=False)
        changes.pop(FITTED, None)
    elif isinstance(model.flow, PaperLaw):
        here = _paper_rate(scene)
        sides = input_sides(scene, among=among, errors=False)
        changes = {name: np.max([abs(_paper_rate(side) - here) for side in sides[name]]) for name in among}
    else:
        return {}
    effects = {name: float(change / here) for name, change in changes.items()} if here > 0 else {}
    return {name: effect for name, effect in effects.items() if effect > _NO_EFFECT}


def _rates(designs: Designs) -> FloatArray:
    """Of the vibration at equal fills where the tube is dry beforehand, in proportion."""
    answers, scene = Answers.of(designs), designs.scene
    return np.asarray(answers.moment_per_mass * scene.liquid.density * scene.tube.area * answers.velocity)


def _paper_rate(scene: Scene) -> FloatArray:
    return np.asarray(np.max(np.mean(vibration_rates(scene, paper_model(scene)), axis=1)))
