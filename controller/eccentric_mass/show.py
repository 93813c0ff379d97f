"""A finished run with two eccentric masses as a person reads it in a terminal."""

from __future__ import annotations

import math
from collections.abc import Iterable

import numpy as np
from rich.console import Console, Group, RenderableType
from rich.table import Table
from rich.text import Text

from ringbalance.controller.eccentric_mass.run_record import EccentricRun
from ringbalance.controller.eccentric_mass.run_status import length_text
from ringbalance.controller.show import SPARK_WIDTH, sparkline


def show_eccentric(run: EccentricRun, *, console: Console) -> None:
    """Print a run: summary, amplitude over time, stages."""
    console.print(Group(*_parts(run)))


def _parts(run: EccentricRun) -> Iterable[RenderableType]:
    yield Text(run.status, style="bold green" if run.settled else "bold yellow")
    for warning in run.warnings:
        yield Text(f"warning: {warning}", style="yellow")
    yield _summary(run)
    at = np.linspace(0.0, float(run.time[-1]), SPARK_WIDTH)
    line = sparkline(np.interp(at, run.time, run.amplitude))
    yield Text.assemble(("amplitude (log) ", "dim"), line, (f"  0 to {run.time[-1]:.3g} s", "dim"))
    yield _stages(run)


def _summary(run: EccentricRun) -> Table:
    table = Table(show_header=False, box=None, padding=(0, 2, 0, 0))
    table.add_column(style="dim")
    table.add_column()
    when = "-" if run.settling_time is None else f"{run.settling_time:.3f} s"
    ratio = "-" if run.residual_ratio is None else f"{100 * run.residual_ratio:.3g} %"
    for name, value in (
        ("settling time", when),
        ("amplitude at the end", length_text(run.final_amplitude)),
        ("amplitude at worst", length_text(run.worst_amplitude)),
        ("limit", length_text(run.limit)),
        ("of the vibration without balancing", ratio),
        ("imbalance", _imbalance(run)),
        ("friction arms, +- standard deviation", _friction(run)),
        ("masses at", "  ".join(f"{_degrees(angle)} deg" for angle in run.mass_angle[:, -1])),
        ("electrical energy", f"{run.electrical_energy:.4g} J"),
    ):
        table.add_row(name, value)
    return table


def _imbalance(run: EccentricRun) -> str:
    x, y = run.estimates.imbalance[-1]
    standard_deviation = math.sqrt(float(np.max(np.linalg.eigvalsh(run.estimates.imbalance_covariance[-1]))))
    phase = _degrees(math.atan2(y, x))
    return f"{math.hypot(x, y):.4g} kg m at {phase} deg, standard deviation {standard_deviation:.2g} kg m"


def _friction(run: EccentricRun) -> str:
    arms, variances = run.estimates.friction_arm[-1], run.estimates.friction_variance[-1]
    return "  ".join(
        f"{length_text(arm)} +- {length_text(math.sqrt(variance))}"
        for arm, variance in zip(arms, variances, strict=True)
    )


def _stages(run: EccentricRun) -> Table:
    table = Table(title="stages", title_justify="left")
    for name, side in (("stage", "left"), ("from, s", "right"), ("to, s", "right"), ("amplitude", "right")):
        table.add_column(name, justify="right" if side == "right" else "left")
    for stage in run.stages:
        end = run.amplitude[np.searchsorted(run.time, stage.end)]
        table.add_row(stage.name, f"{stage.start:.3f}", f"{stage.end:.3f}", length_text(float(end)))
    return table


def _degrees(angle: float) -> str:
    return f"{math.degrees(angle) % 360:.2f}"
