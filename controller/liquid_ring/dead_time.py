"""Dead time of an injection: what of its valve-open time moves no liquid."""

from __future__ import annotations

from ringbalance.controller.terms import dynamics_of, run_models, terms_modelled
from ringbalance.reduced_model.injection.pair import Injections
from ringbalance.reduced_model.law.flow_law import BalancerModel
from ringbalance.scene.models import Scene


def dead_time(scene: Scene, model: BalancerModel, *, rate: float) -> float:
    """Of an injection of the size of the limit at equal fills, while gas fills the chamber and liquid rises.

    At least the valve's lag and its shortest opening, s.
    """
    modelled, total = terms_modelled(run_models(scene=scene, model=model)), 2 * scene.disc.initial_fill
    least = max(scene.gas.valve_lag or 0.0, scene.controller.minimum_gas_time)
    if not modelled or rate <= 0.0:
        return least
    dynamics = dynamics_of(scene=scene, model=model, modelled=modelled, checked=True)
    injections = Injections.of(dynamics, model, fill=scene.disc.initial_fill, total=total)
    lost = injections.dead_time(scene.controller.limit / rate * injections.steady)
    return max(lost or 0.0, least)
