"""Times and volumes that a quasi-steady flow law does not know, for the ladder of models."""

from __future__ import annotations

from typing import Final

from ringbalance.reduced_model.calibrated_law import CalibratedLaw
from ringbalance.reduced_model.operating_point import OperatingPoint
from ringbalance.scene.models import Scene

REFERENCE_PRESSURE: Final = 1e5
"""Of the reference atmosphere of ISO 6358, Pa."""
REFERENCE_TEMPERATURE: Final = 293.15
"""Of the same, K."""


def pulse_time(scene: Scene) -> float:
    """A first operation's gas time: Kc times the initial amplitude, within the controller's limits.

    Where that is zero, because nothing vibrates, it is the longest gas time.

    Args:
        scene: the scene.

    Returns:
        s; the first trial's time for the trial algorithm.

    Source: section 4 of the liquid-ring paper.
    """
    control = scene.controller
    wanted = control.proportional * scene.rotor.initial_amplitude
    if control.kind == "trial":
        wanted = control.first_trial
    limited = min(max(wanted, control.minimum_gas_time), control.maximum_gas_time)
    return limited if limited > 0 else control.maximum_gas_time


def inertia_time(*, scene: Scene, point: OperatingPoint) -> float | None:
    """Time scale on which the liquid column starts, 2 L/((k + 1) u).

    Args:
        scene: the scene.
        point: the operating point.

    Returns:
        s; None when nothing flows.

    Source: L du/dt = (H_A - H_C) - (k + 1) u^2/2.
    """
    if point.k is None or point.loss_velocity == 0:
        return None
    return 2 * scene.tube.length / ((point.k + 1) * point.loss_velocity)


def filling_time(*, scene: Scene, law: CalibratedLaw) -> float | None:
    """Time in which choked flow fills a chamber at equal fills, t = V_gas p/(C p_1 p_0) sqrt(T/T_0).

    Args:
        scene: the scene.
        law: its flow law, for the chamber's volume.

    Returns:
        s; None when the scene gives no conductance.

    Source: ISO 6358-1, volume flow at reference conditions C p_1 sqrt(T_0/T), with the upstream pressure p_1
        taken as the chamber's final one and p_0 = 100 kPa.
    """
    gas = scene.gas
    if gas.conductance is None:
        return None
    volume = (1 - law.max_fill_ratio / 2) * law.chamber_volume + (gas.dead_volume or 0.0)
    upstream = gas.pressure + gas.ambient_pressure
    flow = gas.conductance * upstream * (REFERENCE_TEMPERATURE / gas.temperature) ** 0.5
    free_gas = volume * gas.pressure / REFERENCE_PRESSURE * REFERENCE_TEMPERATURE / gas.temperature
    return float(free_gas / flow)


def tube_liquid_share(*, scene: Scene, law: CalibratedLaw) -> float:
    """Liquid that fills the tube, S L, over that of one chamber at equal fills.

    Args:
        scene: the scene.
        law: its flow law.

    Returns:
        Share.

    Source: geometry.
    """
    return law.tube_area * scene.tube.length / (law.chamber_volume * law.max_fill_ratio / 2)
