"""Performance of a gas line on a pair at equal fills.

The liquid that an opening moves is that of one run of the march, with the lift to the crest and, by the
calibrated law, the liquid's mass.
"""

from __future__ import annotations

from ringbalance.reduced_model.gas_line import LineAnswer, LineEnd, line_ends
from ringbalance.reduced_model.injection.dynamics import Dynamics, gives_forces
from ringbalance.reduced_model.injection.pair import Injections
from ringbalance.reduced_model.law.calibrated_law import CalibratedLaw
from ringbalance.reduced_model.law.flow_law import BalancerModel
from ringbalance.reduced_model.law.paper_law import PaperLaw
from ringbalance.scene.models import Scene


def line_answers(scene: Scene, model: BalancerModel) -> tuple[LineAnswer, ...]:
    """Performance of the balancer's gas line for each of `line_ends`, at equal fills of a pair."""
    law, fill = model.flow, model.flow.max_fill_ratio / 2
    # Under a law without levels moved liquid is assumed to stay.
    holds = law.holds(fill) if isinstance(law, CalibratedLaw | PaperLaw) else True
    return tuple(_answer(scene, end, model, fill, holds) for end in line_ends(scene))


def _answer(scene: Scene, end: LineEnd, model: BalancerModel, fill: float, holds: bool | None) -> LineAnswer:
    line, limit = end.line, scene.controller.limit
    volume = (1 - fill) * model.chamber_volume + (scene.gas.dead_volume or 0.0)
    dynamics = Dynamics.of(
        scene,
        model,
        inertia=isinstance(model.flow, CalibratedLaw),
        # Under a law that gives no forces gas fills at once.
        line=line if gives_forces(model.flow) else None,
        lifts=True,
    )
    injections = Injections.of(dynamics, model, fill=fill, total=model.flow.max_fill_ratio)
    opening = correction = dead = None
    if holds is not False and injections.shortest is not None:
        opening = max(injections.shortest, end.valve_lag)
        moved = injections.moved(opening)
        moment = model.moment.pair_moment(fill_ratio=fill - moved, opposite_fill_ratio=fill + moved)
        correction = abs(float(moment)) * scene.rotor.influence_coefficient
        # With extreme laws the shortest injection may move nothing: then no amount corresponds to the limit.
        if correction > 0:
            dead = injections.dead_time(limit * moved / correction)
    return LineAnswer(
        end=end.name,
        conductance=line.conductance,
        critical_ratio=line.critical_ratio,
        valve_lag=end.valve_lag,
        filling_time=float(line.filling_time(line.supply_pressure, volume=volume)),
        choked_filling_time=line.choked_filling_time(volume=volume),
        venting_time=float(line.venting_time(line.supply_pressure, volume=volume)),
        shortest_opening=opening,
        smallest_correction=correction,
        dead_time=dead,
        holds=holds,
    )
