"""Liquid that a machine moves beyond the fills at which simulated runs end."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import Final

from ringbalance.controller.simulation import Outcome
from ringbalance.physics.gas import applied_pressure
from ringbalance.reduced_model.law.calibrated_law import CalibratedLaw
from ringbalance.reduced_model.law.flow_law import BalancerModel
from ringbalance.reduced_model.residual_liquid import residual_fill_ratio, stalled_fill_ratio
from ringbalance.reduced_model.tube.path import crest_middle, crest_span
from ringbalance.results.rows import Finding, Value
from ringbalance.scene.models import Scene

_NOTICEABLE_FILL: Final = 1e-3
"""Fill ratio by which a running flow must pass the stalled fill to be reported."""


def beyond_capacity(
    scene: Scene, model: BalancerModel, ended: Sequence[str], *, settings: str = "these settings"
) -> Iterator[Finding]:
    """Findings where devices end for lack of capacity.

    Args: `ended`: codes of the ends of their runs. `settings`: name of the scene's settings in the findings.
    """
    which = {"settings": settings}
    total, law = 2 * scene.disc.initial_fill, model.flow
    influence = scene.rotor.influence_coefficient
    residual = residual_fill_ratio(scene, law=law)
    stalled = stalled_fill_ratio(law=law, total=total, gas_pressure=applied_pressure(scene.gas))

    def moment(least: float) -> float:
        """Moment of a pair with a chamber emptied to a fill, kg m."""
        high = min(total - min(least, total / 2), law.max_fill_ratio)
        return abs(complex(model.moment.pair_vector(fill_ratio=high, opposite_fill_ratio=total - high)))

    if count := ended.count(Outcome.CAPACITY_EXCEEDED.value):
        pulse = moment(max(residual - crest_fill(scene, model), 0.0)) - moment(residual)
        values: dict[str, Value] = {**which, "count": count, "moment": pulse, "vibration": influence * pulse}
        if pulse > 0:
            yield Finding(code="capacity_creeps", values=values)
        if len(ended) - count < scene.requirement.fraction * len(ended):
            yield Finding(code="capacity_decides", values={**which, "count": count})
    if count := ended.count(Outcome.STALLED.value):
        further = max(running_fill(scene, model), residual)
        if further < stalled - _NOTICEABLE_FILL:
            values = {**which, "count": count, "counted": moment(stalled), "reached": moment(further)}
            yield Finding(code="stall_passed", values=values)


def crest_fill(scene: Scene, model: BalancerModel) -> float:
    """Liquid that runs over after a pulse, as a fill of a chamber: all on the far half of the siphon crest's
    circle, with the tube full there.  Zero for a crest without a radius.
    """
    if scene.tube.hump_radius is None:
        return 0.0
    half = crest_span(scene.tube)[1] - crest_middle(scene.tube)
    return scene.tube.area * scene.tube.length * half / model.chamber_volume


def running_fill(scene: Scene, model: BalancerModel) -> float:
    """Least fill to which the gas drives a chamber whose flow never stops, with vapour alone in a cavity over
    the crest; the equal fill where that flow does not carry the gas off the crest.

    Other gas in the cavity stops the flow earlier; at its full pressure, where a new injection stalls.
    """
    total, law, gas = 2 * scene.disc.initial_fill, model.flow, applied_pressure(scene.gas)
    if isinstance(law, CalibratedLaw):
        law = replace(law, path=replace(law.path, released=0.0))
    rest = law.evaluate(fill_ratio=total / 2, gas_pressure=0.0, primed=True)
    start = law.evaluate(fill_ratio=total / 2, gas_pressure=gas, primed=bool(rest.primed))
    if not bool(start.primed):
        return total / 2
    return stalled_fill_ratio(law=law, total=total, gas_pressure=gas, runs=True)
