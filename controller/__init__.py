"""The closed loop: rotor, liquid-ring disc, control algorithms and the ways to carry an operation through."""

from ringbalance.controller.algorithm import Command, Controller, Measurement, ValveCommand
from ringbalance.controller.algorithms import controller_of
from ringbalance.controller.consequences import Consequences, consequences_document, find_consequences
from ringbalance.controller.document import simulation_document
from ringbalance.controller.ensemble import Ensemble, ensemble_document, simulate_ensemble
from ringbalance.controller.law_based import LawBased
from ringbalance.controller.loop import simulate
from ringbalance.controller.simulation import Injection, Outcome, Simulation
from ringbalance.controller.target_vector import TargetVector
from ringbalance.controller.trial import Trial

__all__ = [
    "Command",
    "Consequences",
    "Controller",
    "Ensemble",
    "Injection",
    "LawBased",
    "Measurement",
    "Outcome",
    "Simulation",
    "TargetVector",
    "Trial",
    "ValveCommand",
    "consequences_document",
    "controller_of",
    "ensemble_document",
    "find_consequences",
    "simulate",
    "simulate_ensemble",
    "simulation_document",
]
