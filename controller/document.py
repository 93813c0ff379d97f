"""A finished run as the JSON document that scripts rely on, and as a table of its histories."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict
from typing import Any

import numpy as np

from ringbalance.controller.simulation import Injection, Sample, Simulation
from ringbalance.reduced_model.gas_line import line_document
from ringbalance.reduced_model.selection.registry import neglected_in_injections


def simulation_document(simulation: Simulation) -> dict[str, Any]:
    """A run as a JSON document in SI.

    `time_s`, `amplitude_m`, `phase_rad` and each list of `fill_ratio` run together and hold the true state;
    what the sensor showed is under `samples`, null where a sample was dropped or not a number.
    """
    return {
        "balancer": simulation.balancer,
        "law": simulation.law,
        "integrator": simulation.integrator,
        "settled": simulation.settled,
        "settling_time_s": simulation.settling_time,
        "verdict": simulation.verdict.value,
        "outcome": simulation.outcome.value,
        "status": simulation.status,
        "limit_m": simulation.limit,
        "hold_time_s": simulation.hold_time,
        "loop_factor": simulation.loop.value,
        "loop_factor_limit": simulation.loop.limit,
        "largest_staying_loop_factor": simulation.loop.largest_staying,
        "vibration_rate_m_per_s": simulation.loop.rate,
        "stationary_deviation_m": _finite(simulation.loop.deviation),
        "time_s": simulation.time.tolist(),
        "amplitude_m": simulation.amplitude.tolist(),
        "phase_rad": simulation.phase.tolist(),
        "injections": [_injection(injection) for injection in simulation.injections],
        "fill_ratio": {letter: fill.tolist() for letter, fill in simulation.fill_ratio.items()},
        "overshoots": simulation.overshoots,
        "misadjustments": simulation.misadjustments,
        "injections_shortened": simulation.shortened,
        "energy_J": simulation.energy,
        "gas": {
            "fillings": simulation.gas.fillings,
            "normal_litres": simulation.gas.normal_volume * 1e3,
            "compression_energy_J": simulation.gas.energy,
            "injections_run_dry": simulation.gas.run_dry,
            "residual_fill_ratio": simulation.gas.residual_fill_ratio,
            "injections_below_residual_fill": simulation.gas.below_residual,
            "passed_through_normal_litres": simulation.gas.passed_through * 1e3,
            "warning": simulation.gas.warning,
        },
        "gas_line": line_document(simulation.gas_line),
        "noise_floor_m": simulation.noise_floor,
        "samples": _samples(simulation.samples),
        "terms_modelled": list(simulation.terms_modelled),
        "tolerance": simulation.tolerance,
        "models_used": [asdict(used) for used in simulation.models_used],
        "neglected": asdict(neglected_in_injections(simulation.models_used)),
        "model_status": {"code": str(simulation.model_status.code), "text": simulation.model_status.text},
    }


def simulation_history(simulation: Simulation) -> dict[str, Sequence[Any]]:
    """Every instant of a run, by name of its column; None at those at which the sensor shows nothing."""
    time = simulation.time
    shown = {sample.time: sample.measurement for sample in simulation.samples}
    seen = [shown.get(instant) for instant in time.tolist()]
    columns: dict[str, Sequence[Any]] = {
        "time_s": time.tolist(),
        "amplitude_m": simulation.amplitude.tolist(),
        "phase_rad": simulation.phase.tolist(),
        "measured_amplitude_m": [None if m is None else _finite(m.amplitude) for m in seen],
        "measured_phase_rad": [None if m is None else _finite(m.phase) for m in seen],
    }
    for letter, fill in simulation.fill_ratio.items():
        gas = np.zeros(time.size, dtype=np.int64)
        for injection in simulation.injections:
            if injection.chamber == letter:
                end = injection.time + injection.operation.duration
                gas[(time >= injection.time) & (time <= end)] = 1
        columns |= {f"fill_ratio_{letter}": fill.tolist(), f"valve_open_{letter}": gas.tolist()}
    return columns


def _injection(injection: Injection) -> dict[str, Any]:
    operation = injection.operation
    return {
        "time_s": injection.time,
        "chamber": injection.chamber,
        "duration_s": operation.duration,
        "regime": operation.regime_start.label,
        "regime_end": operation.regime_end.label,
        "event": operation.event.value,
        "fill_before": operation.fill_before,
        "fill_after": operation.fill_after,
        "energy_J": operation.energy,
        "run_dry_s": operation.run_dry,
    }


def _samples(samples: tuple[Sample, ...]) -> dict[str, Any]:
    seen = [sample.measurement for sample in samples]
    return {
        "time_s": [sample.time for sample in samples],
        "amplitude_m": [None if m is None else _finite(m.amplitude) for m in seen],
        "phase_rad": [None if m is None else _finite(m.phase) for m in seen],
        "resting": [sample.command.resting for sample in samples],
    }


def _finite(value: float | None) -> float | None:
    return value if value is not None and np.isfinite(value) else None
