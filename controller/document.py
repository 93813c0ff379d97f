"""A finished run as the JSON document that scripts rely on, as a table of its histories, and for a person."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import asdict
from typing import Any, Final

import numpy as np

from ringbalance.controller.simulation import Injection, Sample, Simulation
from ringbalance.reduced_model.gas_line import line_document, line_text, line_warning
from ringbalance.reduced_model.injection.dynamics import Event
from ringbalance.reduced_model.terms import neglected_in_injections
from ringbalance.results.result import Rows, Table, models_table
from ringbalance.results.rows import Finding, Quantity
from ringbalance.scene.arrays import FloatArray, finite


def simulation_document(simulation: Simulation) -> dict[str, Any]:
    """A run as a JSON document in SI.

    `time_s`, `amplitude_m`, `phase_rad` and each list of `fill_ratio` run together and hold the true state;
    what the sensor showed is under `samples`, null where a sample was dropped or not a number.
    """
    scene, gas = simulation.scene, simulation.gas
    return {
        "scene": {"name": scene.name, "source": scene.source, "sha256": scene.sha256},
        "balancer": simulation.balancer,
        "controller": simulation.controller,
        "law": simulation.law,
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
        "stationary_deviation_m": finite(simulation.loop.deviation),
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
            "fillings": gas.fillings,
            "normal_litres": gas.normal_volume * 1e3,
            "compression_energy_J": gas.energy,
            "injections_run_dry": gas.run_dry,
            "residual_fill_ratio": gas.residual_fill_ratio,
            "injections_below_residual_fill": gas.below_residual,
            "passed_through_normal_litres": gas.passed_through * 1e3,
            "warning": "" if gas.finding is None else gas.finding.text,
        },
        "gas_line": line_document(simulation.gas_line),
        "noise_floor_m": simulation.noise_floor,
        "samples": _samples(simulation.samples),
        "terms_modelled": list(simulation.terms_modelled),
        "tolerance": simulation.tolerance,
        "models_used": [asdict(used) for used in simulation.models_used],
        "neglected": asdict(neglected_in_injections(simulation.models_used)),
        "model_status": {"code": str(simulation.model_status.code), "text": simulation.model_status.text},
        **simulation.rows().document(),
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
        "measured_amplitude_m": [None if m is None else finite(m.amplitude) for m in seen],
        "measured_phase_rad": [None if m is None else finite(m.phase) for m in seen],
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
        "amplitude_m": [None if m is None else finite(m.amplitude) for m in seen],
        "phase_rad": [None if m is None else finite(m.phase) for m in seen],
        "resting": [sample.command.resting for sample in samples],
    }


_BARS: Final = "▁▂▃▄▅▆▇█"
_SPARK_WIDTH: Final = 32
_MOST_INJECTIONS: Final = 40
_DECADES: Final = 3.0
"""Depth of the sparkline below the largest amplitude."""


def simulation_rows(simulation: Simulation) -> Rows:
    """Quantities, findings, injections and terms of a run."""
    gas = simulation.gas.finding
    scene, line = simulation.scene, line_warning(simulation.gas_line)
    model = simulation.model_status
    closed = [i.time + i.operation.duration for i in simulation.injections]
    # Until shortly after the last valve has closed.
    end = min(float(simulation.time[-1]), 1.2 * max(closed, default=math.inf))
    return Rows(
        title=f"Run of {scene.name} ({scene.source}), {simulation.law} law, {simulation.controller}",
        quantities=_quantities(simulation),
        findings=(
            *simulation.findings,
            *(() if gas is None else (gas,)),
            *(Finding(code="gas_line", values={"text": line}) for _ in (line,) if line),
            *(Finding(code="out_of_range", values={"text": model.text}) for _ in (model,) if not model.ok),
        ),
        facts=(
            ("flow law", simulation.law),
            ("gas line", line_text(simulation.gas_line)),
            ("neglected", neglected_in_injections(simulation.models_used).text),
            ("amplitude (log)", amplitude_line(simulation.time, simulation.amplitude, end=end)),
        ),
        tables=(_injection_table(simulation.injections), models_table(simulation.models_used)),
    )


def _quantities(simulation: Simulation) -> tuple[Quantity, ...]:
    loop, gas, injections = simulation.loop, simulation.gas, simulation.injections
    fills = simulation.fill_ratio.items()
    rows: list[tuple[str, str, str, float | None]] = [
        ("settling_time", "settling time", "s", simulation.settling_time),
        ("initial_amplitude", "amplitude before", "m", float(simulation.amplitude[0])),
        ("final_amplitude", "amplitude at the end", "m", float(simulation.amplitude[-1])),
        ("limit", "limit", "m", simulation.limit),
        ("hold_time", "hold time", "s", simulation.hold_time),
        ("loop_factor", "loop factor", "1", loop.value),
        ("loop_factor_limit", "loop factor, at most", "1", loop.limit),
        ("stationary_deviation", "standard deviation that noise leaves", "m", finite(loop.deviation)),
        ("valve_open_time", "valve-open time", "s", math.fsum(i.operation.duration for i in injections)),
        ("injections", "injections", "1", len(injections)),
        ("energy", "work on the liquid", "J", simulation.energy),
        ("gas_volume", "gas, normal volume", "m^3", gas.normal_volume),
        ("compression_energy", "compression of the gas", "J", gas.energy),
        ("overshoots", "overshoots", "1", simulation.overshoots),
        ("misadjustments", "misadjustments", "1", simulation.misadjustments),
        *(
            (f"fill_ratio_{letter}", f"fill ratio of {letter}", "1", float(fill[-1]))
            for letter, fill in fills
        ),
    ]
    origins = {"limit": "given", "hold_time": "given"}
    return tuple(
        Quantity(key=key, name=name, unit=unit, value=value, origin=origins.get(key, "simulated"))
        for key, name, unit, value in rows
    )


def _injection_table(injections: tuple[Injection, ...]) -> Table:
    """The first injections."""
    more = len(injections) - _MOST_INJECTIONS
    return Table(
        caption="Injections",
        heads=("time, s", "chamber", "gas, s", "fill before", "fill after", "regime"),
        rows=[
            (
                f"{each.time:.3f}",
                each.chamber,
                f"{each.operation.duration:.4f}",
                f"{each.operation.fill_before:.5f}",
                f"{each.operation.fill_after:.5f}",
                _regime(each),
            )
            for each in injections[:_MOST_INJECTIONS]
        ],
        note=f"and {more} more: see --json" if more > 0 else "",
    )


def _regime(injection: Injection) -> str:
    operation = injection.operation
    names = dict.fromkeys((operation.regime_start.label, operation.regime_end.label))
    event = "" if operation.event in {Event.NONE, Event.BLOCKED} else f" ({operation.event.value})"
    return " to ".join(names) + event


def amplitude_line(time: FloatArray, amplitude: FloatArray, *, end: float) -> str:
    """An amplitude at equal steps of time up to `end`, s, by straight lines; logarithmic."""
    return f"{_sparkline(np.interp(np.linspace(0.0, end, _SPARK_WIDTH), time, amplitude))} to {end:.3g} s"


def _sparkline(values: FloatArray) -> str:
    """Draw values as a line of bars, logarithmic over three decades below the largest."""
    top = float(np.max(values, initial=0.0))
    if top == 0:
        return _BARS[0] * values.size
    depth = np.log10(np.maximum(values / top, 10.0**-_DECADES)) / _DECADES + 1
    return "".join(_BARS[round(share * (len(_BARS) - 1))] for share in depth)
