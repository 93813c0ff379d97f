"""A finished run as the JSON document that scripts rely on, as a table of its histories, and for a person."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import asdict
from typing import Any, Final

import numpy as np
from rich.console import Console, Group, RenderableType
from rich.table import Table
from rich.text import Text

from ringbalance.controller.liquid_ring.transfer import Event
from ringbalance.controller.simulation import Injection, Sample, Simulation
from ringbalance.reduced_model.gas_line import line_document, line_text, line_warning
from ringbalance.reduced_model.terms import neglected_in_injections
from ringbalance.scene.arrays import FloatArray, finite
from ringbalance.scene.platform.terminal import two_columns


def simulation_document(simulation: Simulation) -> dict[str, Any]:
    """A run as a JSON document in SI.

    `time_s`, `amplitude_m`, `phase_rad` and each list of `fill_ratio` run together and hold the true state;
    what the sensor showed is under `samples`, null where a sample was dropped or not a number.
    """
    scene = simulation.scene
    return {
        "scene": {"name": scene.name, "source": scene.source, "sha256": scene.sha256},
        "balancer": simulation.balancer,
        "controller": simulation.controller,
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
_SPARK_WIDTH: Final = 60
_MOST_INJECTIONS: Final = 40
_DECADES: Final = 3.0
"""Depth of the sparkline below the largest amplitude."""


def show(simulation: Simulation, *, console: Console) -> None:
    """Print a run: summary, amplitude over time, injections."""
    console.print(Group(*_parts(simulation)))


def amplitude_line(time: FloatArray, amplitude: FloatArray, *, end: float) -> Text:
    """An amplitude at equal steps of time up to `end`, s, by straight lines."""
    line = _sparkline(np.interp(np.linspace(0.0, end, _SPARK_WIDTH), time, amplitude))
    return Text.assemble(("amplitude (log) ", "dim"), line, (f"  0 to {end:.3g} s", "dim"))


def _sparkline(values: FloatArray) -> str:
    """Draw values as a line of bars, logarithmic over three decades below the largest."""
    top = float(np.max(values, initial=0.0))
    if top == 0:
        return _BARS[0] * values.size
    depth = np.log10(np.maximum(values / top, 10.0**-_DECADES)) / _DECADES + 1
    return "".join(_BARS[round(share * (len(_BARS) - 1))] for share in depth)


def _parts(simulation: Simulation) -> Iterable[RenderableType]:
    colour = "green" if simulation.settled else "yellow"
    yield Text(simulation.status, style=f"bold {colour}")
    for warning in (simulation.gas.warning, line_warning(simulation.gas_line)):
        if warning:
            yield Text(warning, style="yellow")
    yield _summary(simulation)
    closed = [i.time + i.operation.duration for i in simulation.injections]
    # Until shortly after the last valve has closed.
    end = min(float(simulation.time[-1]), 1.2 * max(closed, default=math.inf))
    yield amplitude_line(simulation.time, simulation.amplitude, end=end)
    if simulation.injections:
        yield _injections(simulation.injections)
    yield _terms(simulation)
    yield Text(neglected_in_injections(simulation.models_used).text, style="dim")
    if not simulation.model_status.ok:
        yield Text(simulation.model_status.text, style="yellow")


def _summary(simulation: Simulation) -> Table:
    when = "-" if simulation.settling_time is None else f"{simulation.settling_time:.3f} s"
    last = {letter: fill[-1] for letter, fill in simulation.fill_ratio.items()}
    rows = (
        ("flow law", f"{simulation.law} ({simulation.integrator.replace('_', ' ')})"),
        ("settling time", when),
        ("amplitude", f"{_um(simulation.amplitude[0])} -> {_um(simulation.amplitude[-1])}"),
        ("limit", f"{_um(simulation.limit)} for {simulation.hold_time:.4g} s"),
        ("loop factor", _loop(simulation)),
        ("valve-open time", f"{_gas_time(simulation):.3f} s in {len(simulation.injections)} injections"),
        ("gas energy", f"{simulation.energy:.4g} J of work on the liquid"),
        ("gas consumption", simulation.gas.text),
        ("gas line", line_text(simulation.gas_line)),
        ("overshoots", str(simulation.overshoots)),
        ("misadjustments", str(simulation.misadjustments)),
        *([("shortened injections", str(simulation.shortened))] if simulation.shortened else []),
        ("fill ratios", "  ".join(f"{letter} {fill:.4f}" for letter, fill in last.items())),
    )
    return two_columns(rows)


def _loop(simulation: Simulation) -> str:
    loop = simulation.loop
    if loop.value is None or loop.deviation is None:
        return "none: this algorithm has no gain"
    left = f"noise leaves {_um(loop.deviation)}" if math.isfinite(loop.deviation) else "nothing holds it"
    return f"{loop.value:.3g} of at most {loop.limit:.3g}, {left}"


def _gas_time(simulation: Simulation) -> float:
    return math.fsum(injection.operation.duration for injection in simulation.injections)


def _injections(injections: tuple[Injection, ...]) -> Table:
    table = Table(title="injections", title_justify="left")
    for name in ("time, s", "chamber", "gas, s", "fill before", "fill after"):
        table.add_column(name, justify="center" if name == "chamber" else "right")
    table.add_column("regime")
    for injection in injections[:_MOST_INJECTIONS]:
        operation = injection.operation
        table.add_row(
            f"{injection.time:.3f}",
            injection.chamber,
            f"{operation.duration:.4f}",
            f"{operation.fill_before:.5f}",
            f"{operation.fill_after:.5f}",
            _regime(injection),
        )
    if len(injections) > _MOST_INJECTIONS:
        table.caption = f"and {len(injections) - _MOST_INJECTIONS} more: see --json"
    return table


def _terms(simulation: Simulation) -> Table:
    table = Table(title="terms", title_justify="left")
    for name in ("term", "model", "why"):
        table.add_column(name)
    for used in simulation.models_used:
        table.add_row(used.term, used.model, used.why)
    return table


def _regime(injection: Injection) -> str:
    operation = injection.operation
    names = dict.fromkeys((operation.regime_start.label, operation.regime_end.label))
    event = "" if operation.event in {Event.NONE, Event.BLOCKED} else f" ({operation.event.value})"
    return " to ".join(names) + event


def _um(length: float) -> str:
    return f"{length * 1e6:.4g} um"
