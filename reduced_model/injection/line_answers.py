"""What a pair at equal fills can do with a gas line.

What an opening moves is that of one run of the march, with the lift to the crest and, by the calibrated law,
the liquid's mass.
"""

from __future__ import annotations

from ringbalance.physics.gas import GasLine
from ringbalance.reduced_model.gas_line import LineAnswer, LineEnd, line_ends
from ringbalance.reduced_model.injection.dynamics import Dynamics, gives_forces
from ringbalance.reduced_model.injection.pair import Injections
from ringbalance.reduced_model.law.calibrated_law import CalibratedLaw
from ringbalance.reduced_model.law.flow_law import BalancerModel
from ringbalance.reduced_model.law.paper_law import PaperLaw
from ringbalance.scene.models import Scene


def line_answers(scene: Scene, model: BalancerModel) -> tuple[LineAnswer, ...]:
    """What the balancer's gas line can deliver, for each of `line_ends`, at equal fills of a pair."""
    return tuple(_answer(scene, end, model) for end in line_ends(scene))


def _injections(scene: Scene, line: GasLine, model: BalancerModel) -> Injections:
    """At equal fills; a law that gives no forces fills gas at once."""
    dynamics = Dynamics.of(
        scene,
        model,
        inertia=isinstance(model.flow, CalibratedLaw),
        line=line if gives_forces(model.flow) else None,
        lifts=True,
    )
    total = model.flow.max_fill_ratio
    return Injections.of(dynamics, model, fill=total / 2, total=total)


def _holds(model: BalancerModel) -> bool | None:
    """Whether what an injection moves at equal fills stays moved with the gas off; as `TubePath.holds`."""
    law = model.flow
    return not isinstance(law, CalibratedLaw | PaperLaw) or law.holds(law.max_fill_ratio / 2)


def _answer(scene: Scene, end: LineEnd, model: BalancerModel) -> LineAnswer:
    line, limit, holds = end.line, scene.controller.limit, _holds(model)
    volume = (1 - model.flow.max_fill_ratio / 2) * model.chamber_volume + (scene.gas.dead_volume or 0.0)
    injections = _injections(scene, line, model) if holds is not False else None
    opening = correction = dead = None
    if injections is not None and injections.shortest is not None:
        opening = max(injections.shortest, end.valve_lag)
        moved = injections.moved(opening)
        fill = model.flow.max_fill_ratio / 2
        moment = model.moment.pair_moment(fill_ratio=fill - moved, opposite_fill_ratio=fill + moved)
        correction = abs(float(moment)) * scene.rotor.influence_coefficient
        # Under extreme laws the shortest injection may move nothing: then no vibration belongs to a way.
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
