"""What a wrong k and lambda do to a machine: the same devices and settings under the paper's law and ours."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import Final

import numpy as np

from ringbalance.controller.balancer import balancer_of
from ringbalance.controller.judging.judge import judged
from ringbalance.reduced_model.law.flow_law import BalancerModel
from ringbalance.reduced_model.law.paper_law import paper_model
from ringbalance.reports.judged import judgement_record
from ringbalance.reports.section import Record, Section, Work
from ringbalance.scene.models import Scene

_SMALL_FILL: Final = 1e-3
"""Change of fill over which a loop counts as linear."""


@dataclass(frozen=True, kw_only=True)
class LoopGain:
    """The proportional loop about level chambers under one law.

    e_(n+1) = (1 - h) e_n with h = Kc dA/dt and dA/dt = kappa |dM/dx| u S/V: a residual turns round from h = 1
    and grows from h = 2.
    Source: sections 4.2 and 5 of the liquid-ring paper; a discrete first-order loop.
    """

    law: str
    velocity_m_s: float
    """u at equal fills."""
    drag_coefficient: float
    """k that Eq. 18 reads out of that velocity, 2p/(rho u^2) - 1."""
    moment_per_transferred_mass_m: float
    """lambda at equal fills."""
    slope_m_per_s: float
    """Vibration taken away per second of gas."""
    gain_per_operation: float
    """h: share of the residual that an operation takes away."""


def loop_gain(scene: Scene, model: BalancerModel) -> LoopGain | None:
    """Linearise the loop about level chambers; None when the gas does not drive a flow there."""
    x, pressure = scene.disc.initial_fill, scene.gas.pressure
    flow = model.flow.evaluate(fill_ratio=x, opposite_fill_ratio=x, gas_pressure=pressure)
    u = float(flow.velocity)
    if u <= 0 or pressure <= 0:
        return None
    ends = np.array([x - _SMALL_FILL, x + _SMALL_FILL])
    moments = model.moment.pair_vector(fill_ratio=ends, opposite_fill_ratio=2 * x - ends)
    per_fill = float(abs(moments[1] - moments[0])) / (2 * _SMALL_FILL)
    slope = scene.rotor.influence_coefficient * per_fill * u * model.tube_area / model.chamber_volume
    return LoopGain(
        law=model.name,
        velocity_m_s=u,
        drag_coefficient=2 * pressure / (model.density * u**2) - 1,
        moment_per_transferred_mass_m=per_fill / (model.density * model.chamber_volume),
        slope_m_per_s=slope,
        gain_per_operation=scene.controller.proportional * slope,
    )


def _collect(work: Work) -> Record:
    """The paper's law over the devices on which the summary judges the calibrated one."""
    gains = [loop_gain(work.ring, model) for model in (paper_model(work.ring), work.calibration.model)]
    paper = judged(balancer_of(work.ring, flow_law="paper"), {})
    return {
        "gain": [asdict(each) for each in gains if each is not None],
        "paper": judgement_record(paper),
    }


def _view(_own: Record, evidence: Record) -> Record | None:
    return {} if (evidence.get("summary") or {}).get("own") else None


SECTION: Final = Section(
    name="consequences", title="What a wrong k costs", collect=_collect, apart=True, show=_view
)
