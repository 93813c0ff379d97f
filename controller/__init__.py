"""The closed loop: rotor, liquid-ring disc, control algorithms and the ways to carry an operation through.

What runs as compiled code is loaded when it is first asked for, because its compiler takes half a second.
"""

from importlib import import_module
from typing import TYPE_CHECKING

from ringbalance.controller.algorithm import Command, Controller, Measurement, ValveCommand
from ringbalance.controller.algorithms import controller_of
from ringbalance.controller.document import simulation_document
from ringbalance.controller.law_based import LawBased
from ringbalance.controller.loop import simulate
from ringbalance.controller.simulation import Injection, Outcome, Simulation
from ringbalance.controller.target_vector import TargetVector
from ringbalance.controller.trial import Trial

if TYPE_CHECKING:
    from ringbalance.controller.consequences import Consequences, consequences_document, find_consequences
    from ringbalance.controller.consequences_gain import LoopGain, loop_gain
    from ringbalance.controller.ensemble import Ensemble, ensemble_document, simulate_ensemble
    from ringbalance.controller.prepared_run import PreparedRun, Trace, prepare_run

__all__ = [
    "Command",
    "Consequences",
    "Controller",
    "Ensemble",
    "Injection",
    "LawBased",
    "LoopGain",
    "Measurement",
    "Outcome",
    "PreparedRun",
    "Simulation",
    "TargetVector",
    "Trace",
    "Trial",
    "ValveCommand",
    "consequences_document",
    "controller_of",
    "ensemble_document",
    "find_consequences",
    "loop_gain",
    "prepare_run",
    "simulate",
    "simulate_ensemble",
    "simulation_document",
]

_HOME = {
    "Consequences": "ringbalance.controller.consequences",
    "consequences_document": "ringbalance.controller.consequences",
    "find_consequences": "ringbalance.controller.consequences",
    "LoopGain": "ringbalance.controller.consequences_gain",
    "loop_gain": "ringbalance.controller.consequences_gain",
    "Ensemble": "ringbalance.controller.ensemble",
    "ensemble_document": "ringbalance.controller.ensemble",
    "simulate_ensemble": "ringbalance.controller.ensemble",
    "PreparedRun": "ringbalance.controller.prepared_run",
    "Trace": "ringbalance.controller.prepared_run",
    "prepare_run": "ringbalance.controller.prepared_run",
}


def __getattr__(name: str) -> object:
    if name not in _HOME:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(import_module(_HOME[name]), name)
