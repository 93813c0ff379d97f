"""Whole runs at both ends of the default range of gas lines, where a scene does not give its own."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

from ringbalance.controller.document import simulation_document
from ringbalance.controller.simulation import Simulation
from ringbalance.reduced_model.gas_line import line_ends
from ringbalance.reduced_model.injection.dynamics import gives_forces
from ringbalance.reduced_model.law.paper_law import PaperLaw
from ringbalance.reduced_model.terms import FILLING, HELD, INERTIA, LAG
from ringbalance.results.numbers import given
from ringbalance.results.result import Table


@dataclass(frozen=True, kw_only=True)
class LineRun:
    """One run with one end of the range."""

    end: str
    """ "slow" or "fast"."""
    conductance: float
    """m^3/(s Pa)."""
    valve_lag: float
    """s."""
    run: Simulation


def line_runs(given: Simulation) -> tuple[LineRun, ...]:
    """Runs of the same scene and law with all terms of an injection modelled; none where the scene gives its
    gas line, the law no forces, or algorithm or sensor are the caller's own."""
    scene, flow = given.scene, given.model.flow
    ends = line_ends(scene)
    if len(ends) == 1 or not gives_forces(flow) or not given.as_scene:
        return ()
    found = []
    for end in ends:
        gas = replace(
            scene.gas,
            conductance=end.line.conductance,
            critical_ratio=end.line.critical_ratio,
            valve_lag=end.valve_lag,
        )
        # The paper's law has no mass in the tube and no crest.
        own = () if isinstance(flow, PaperLaw) else (INERTIA, HELD)
        terms = (*own, FILLING, LAG)
        run = given.again(replace(scene, gas=gas), terms)
        found.append(
            LineRun(end=end.name, conductance=end.line.conductance, valve_lag=end.valve_lag, run=run)
        )
    return tuple(found)


def command_document(run: Simulation) -> dict[str, Any]:
    """What `ringbalance simulate --json` prints of a run."""
    return simulation_document(run) | {"gas_line_runs": line_runs_document(line_runs(run))}


def line_runs_table(runs: Sequence[LineRun]) -> Table:
    """How the runs end."""
    return Table(
        caption="The scene gives no gas line; with both ends of its default range",
        heads=("line", "run", "settling time", "amplitude at the end"),
        rows=[
            (
                each.end,
                each.run.verdict.value,
                given(each.run.settling_time, "s", digits=3),
                given(float(each.run.amplitude[-1]), "m", digits=3),
            )
            for each in runs
        ],
    )


def line_runs_document(runs: Sequence[LineRun]) -> list[dict[str, Any]]:
    """For JSON, in SI."""
    return [
        {
            "end": found.end,
            "conductance_m3_per_s_Pa": found.conductance,
            "valve_lag_s": found.valve_lag,
            "settled": found.run.settled,
            "settling_time_s": found.run.settling_time,
            "verdict": found.run.verdict.value,
            "outcome": found.run.outcome.value,
            "final_amplitude_m": float(found.run.amplitude[-1]),
            "overshoots": found.run.overshoots,
            "injections": len(found.run.injections),
            "status": found.run.status,
        }
        for found in runs
    ]
