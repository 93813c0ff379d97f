"""A finished run as a person reads it in a terminal."""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import Final

import numpy as np
from rich.console import Console, Group, RenderableType
from rich.table import Table
from rich.text import Text

from ringbalance.controller.liquid_ring.transfer import Event
from ringbalance.controller.simulation import Injection, Simulation
from ringbalance.reduced_model.gas_line import line_text, line_warning
from ringbalance.reduced_model.selection.registry import neglected_in_injections
from ringbalance.scene.arrays import FloatArray

BARS: Final = "▁▂▃▄▅▆▇█"
SPARK_WIDTH: Final = 60
MOST_INJECTIONS: Final = 40
DECADES: Final = 3.0
"""Depth of the sparkline below the largest amplitude."""


def show(simulation: Simulation, *, console: Console) -> None:
    """Print a run: summary, amplitude over time, injections."""
    console.print(Group(*_parts(simulation)))


def sparkline(values: FloatArray) -> str:
    """Draw values as a line of bars, logarithmic over three decades below the largest."""
    top = float(np.max(values, initial=0.0))
    if top == 0:
        return BARS[0] * values.size
    depth = np.log10(np.maximum(values / top, 10.0**-DECADES)) / DECADES + 1
    return "".join(BARS[round(share * (len(BARS) - 1))] for share in depth)


def _parts(simulation: Simulation) -> Iterable[RenderableType]:
    colour = "green" if simulation.settled else "yellow"
    yield Text(simulation.status, style=f"bold {colour}")
    for warning in (simulation.gas.warning, line_warning(simulation.gas_line)):
        if warning:
            yield Text(warning, style="yellow")
    yield _summary(simulation)
    yield _amplitude(simulation)
    if simulation.injections:
        yield _injections(simulation.injections)
    yield _terms(simulation)
    yield Text(neglected_in_injections(simulation.models_used).text, style="dim")
    if not simulation.model_status.ok:
        yield Text(simulation.model_status.text, style="yellow")


def _summary(simulation: Simulation) -> Table:
    table = Table(show_header=False, box=None, padding=(0, 2, 0, 0))
    table.add_column(style="dim")
    table.add_column()
    when = "-" if simulation.settling_time is None else f"{simulation.settling_time:.3f} s"
    last = {letter: fill[-1] for letter, fill in simulation.fill_ratio.items()}
    for name, value in (
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
    ):
        table.add_row(name, value)
    return table


def _loop(simulation: Simulation) -> str:
    loop = simulation.loop
    if loop.value is None or loop.deviation is None:
        return "none: this algorithm has no gain"
    left = f"noise leaves {_um(loop.deviation)}" if math.isfinite(loop.deviation) else "nothing holds it"
    return f"{loop.value:.3g} of at most {loop.limit:.3g}, {left}"


def _gas_time(simulation: Simulation) -> float:
    return math.fsum(injection.operation.duration for injection in simulation.injections)


def _amplitude(simulation: Simulation) -> Text:
    """Amplitude at equal steps of time, by straight lines, until shortly after the last valve has closed."""
    closed = [i.time + i.operation.duration for i in simulation.injections]
    end = min(float(simulation.time[-1]), 1.2 * max(closed, default=math.inf))
    at = np.linspace(0.0, end, SPARK_WIDTH)
    line = sparkline(np.interp(at, simulation.time, simulation.amplitude))
    return Text.assemble(("amplitude (log) ", "dim"), line, (f"  0 to {end:.3g} s", "dim"))


def _injections(injections: tuple[Injection, ...]) -> Table:
    table = Table(title="injections", title_justify="left")
    for name in ("time, s", "chamber", "gas, s", "fill before", "fill after"):
        table.add_column(name, justify="center" if name == "chamber" else "right")
    table.add_column("regime")
    for injection in injections[:MOST_INJECTIONS]:
        operation = injection.operation
        table.add_row(
            f"{injection.time:.3f}",
            injection.chamber,
            f"{operation.duration:.4f}",
            f"{operation.fill_before:.5f}",
            f"{operation.fill_after:.5f}",
            _regime(injection),
        )
    if len(injections) > MOST_INJECTIONS:
        table.caption = f"and {len(injections) - MOST_INJECTIONS} more: see --json"
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
