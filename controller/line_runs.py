"""Whole runs at both ends of the default range of gas lines, where a scene does not give its own."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

from ringbalance.controller.document import simulation_document
from ringbalance.controller.loop import simulate
from ringbalance.controller.simulation import Simulation
from ringbalance.reduced_model.gas_line import line_ends
from ringbalance.reduced_model.injection.dynamics import gives_forces
from ringbalance.reduced_model.law.model import BalancerModel
from ringbalance.reduced_model.law.paper_law import PaperLaw
from ringbalance.reduced_model.terms import FILLING, HELD, INERTIA, LAG
from ringbalance.results.numbers import given
from ringbalance.results.table import Table
from ringbalance.scene.models import Scene


@dataclass(frozen=True, kw_only=True)
class _LineRun:
    """One run with one end of the range."""

    end: str
    """ "slow" or "fast"."""
    conductance: float
    """m^3/(s Pa)."""
    valve_lag: float
    """s."""
    run: Simulation


def line_runs(scene: Scene, model: BalancerModel) -> tuple[_LineRun, ...]:
    """Runs with all terms of an injection modelled; none where the scene gives its gas line, or the law no
    forces."""
    ends = line_ends(scene)
    if len(ends) == 1 or not gives_forces(model.flow):
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
        own = () if isinstance(model.flow, PaperLaw) else (INERTIA, HELD)
        terms = (*own, FILLING, LAG)
        run = simulate(replace(scene, gas=gas), model, modelled=terms)
        found.append(
            _LineRun(end=end.name, conductance=end.line.conductance, valve_lag=end.valve_lag, run=run)
        )
    return tuple(found)


def command_document(simulation: Simulation, at_ends: Sequence[_LineRun] | None = None) -> dict[str, Any]:
    """What `ringbalance simulate --json` prints of a run.

    Args: `at_ends`: of the same scene and law; None: they are run, unless algorithm or sensor are the
        caller's own.
    """
    if at_ends is None:
        at_ends = line_runs(simulation.scene, simulation.model) if simulation.as_scene else ()
    return simulation_document(simulation) | {"gas_line_runs": line_runs_document(at_ends)}


def line_runs_table(runs: Sequence[_LineRun]) -> Table:
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


def line_runs_document(runs: Sequence[_LineRun]) -> list[dict[str, Any]]:
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
