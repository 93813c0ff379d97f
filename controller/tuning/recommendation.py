"""The gain to use: the largest one with which no residual turns round, at the edge of the uncertainty.

The loop factor is uncertain by the law's models and numerics, by each input through what it does to
lambda rho S u, and by the influence coefficient.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from ringbalance.controller.ensemble.samples import MemberUncertainty, starting_flow
from ringbalance.controller.tuning.loop_factor import LoopFactor, vibration_rates
from ringbalance.reduced_model.device import HEAD_INPUTS, device_of
from ringbalance.reduced_model.law.calibrated_law import CalibratedLaw
from ringbalance.reduced_model.law.model import BalancerModel
from ringbalance.reduced_model.law.paper_law import PaperLaw, paper_model
from ringbalance.reduced_model.tube.directed_flow import DriveUncertainty
from ringbalance.scene.joint import FITTED, independent_half_widths
from ringbalance.scene.models import Scene
from ringbalance.scene.uncertain import shifted

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
    rate_of = _rate_by_inputs(scene, model)
    nominal = rate_of(scene, "") if rate_of else 0.0
    if rate_of is None or nominal == 0.0:
        return {}
    found = {}
    for quantity, width in independent_half_widths(scene).items():
        if quantity in _ELSEWHERE:
            continue
        moved = (shifted(scene=scene, quantity=quantity, change=side * width) for side in (-1, 1))
        found[quantity] = max(abs(rate_of(other, quantity) / nominal - 1.0) for other in moved)
    return {quantity: effect for quantity, effect in found.items() if effect > _NO_EFFECT}


def _rate_by_inputs(scene: Scene, model: BalancerModel) -> Callable[[Scene, str], float] | None:
    """Something in proportion to the rate of a scene, one input of which has been moved."""
    if isinstance(model.flow, PaperLaw):
        return lambda asked, _: float(np.max(np.mean(vibration_rates(asked, paper_model(asked)), axis=1)))
    if not isinstance(model.flow, CalibratedLaw):
        return None
    here = device_of(scene, near=_velocity(scene, model) or 1.0)

    def rate(asked: Scene, quantity: str) -> float:
        heads = None if quantity in HEAD_INPUTS else here.heads
        values = device_of(asked, near=here.near, heads=heads).values()
        return values["lambda"] * asked.liquid.density * asked.tube.bore**2 * values["velocity"]

    return rate
