"""A finished run with two eccentric masses as the JSON document that scripts rely on, and for a person."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from typing import Any, Final

import numpy as np
from rich.console import Console, Group, RenderableType
from rich.table import Table
from rich.text import Text

from ringbalance.controller.document import amplitude_line
from ringbalance.controller.eccentric_mass.run_record import EccentricRun
from ringbalance.controller.eccentric_mass.run_status import length_text
from ringbalance.results.render import two_columns
from ringbalance.scene.arrays import FloatArray, IntArray
from ringbalance.scene.uncertain import NORMAL_95

_MOST_ROWS: Final = 2500
"""Instants in the document; a run has a hundred times as many."""


def eccentric_document(run: EccentricRun) -> dict[str, Any]:
    """Turn a run into plain numbers, lists and text, all in SI.

    Lists run along `time_s`: instants at equal distances, with the beginning and the end of each stage and
    the largest vibration among them.
    Returns: Document that `json.dumps(..., allow_nan=False)` accepts.
    """
    kept = _thinned(run)
    return {
        "balancer": run.balancer,
        "scene": {"name": run.scene, "source": run.source, "sha256": run.sha256},
        "settled": run.settled,
        "settling_time_s": run.settling_time,
        "outcome": run.outcome.value,
        "status": run.status,
        "warnings": list(run.warnings),
        "remedies": [dict(remedy.changes) for remedy in run.remedies],
        "innovation": run.innovation,
        "limit_m": run.limit,
        "residual_ratio": run.residual_ratio,
        "final_amplitude_m": run.final_amplitude,
        "worst_amplitude_m": run.worst_amplitude,
        "energy_J": run.electrical_energy,
        "peak_voltage_V": float(np.abs(run.voltage).max()),
        "stages": [{"name": s.name, "start_s": s.start, "end_s": s.end} for s in run.stages],
        "targets": None if run.targets is None else _targets(run),
        "time_s": run.time[kept].tolist(),
        "speed_rad_s": run.speed[kept].tolist(),
        "amplitude_m": run.amplitude[kept].tolist(),
        "phase_rad": run.phase[kept].tolist(),
        "mass_angle_rad": run.mass_angle[:, kept].tolist(),
        "goal_rad": run.goal[:, kept].tolist(),
        "voltage_V": run.voltage[:, kept].tolist(),
        "drive_off": run.drive_off[kept].tolist(),
        "estimates": {
            "imbalance_kg_m": run.estimates.imbalance[kept].T.tolist(),
            "imbalance_covariance": run.estimates.imbalance_covariance[kept].tolist(),
            "imbalance_rotor_covariance": run.rotor_covariance.tolist(),
            "imbalance_half_width_kg_m": (NORMAL_95 * np.sqrt(np.diag(run.imbalance_covariance))).tolist(),
            "friction_arm_m": run.estimates.friction_arm[kept].T.tolist(),
            "friction_variance": run.estimates.friction_variance[kept].T.tolist(),
        },
    }


def eccentric_history(run: EccentricRun) -> dict[str, Sequence[Any]]:
    """Every sample of a run by name of its column: rotor-fixed vectors, angles not wrapped."""
    told = run.estimates
    stages = np.searchsorted([stage.start for stage in run.stages], run.time, side="right") - 1
    columns: dict[str, FloatArray] = {
        "time_s": run.time,
        "speed_rad_s": run.speed,
        "whirl_x_m": run.whirl.real,
        "whirl_y_m": run.whirl.imag,
        "amplitude_m": run.amplitude,
        "phase_rad": run.phase,
        **_each("mass_angle_{}_rad", run.mass_angle),
        **_each("mass_rate_{}_rad_s", run.mass_rate),
        **_each("goal_{}_rad", run.goal),
        **_each("voltage_{}_V", run.voltage),
        "energy_J": run.energy,
        "imbalance_x_kg_m": told.imbalance[:, 0],
        "imbalance_y_kg_m": told.imbalance[:, 1],
        "imbalance_variance_xx_kg2_m2": told.imbalance_covariance[:, 0, 0],
        "imbalance_variance_xy_kg2_m2": told.imbalance_covariance[:, 0, 1],
        "imbalance_variance_yy_kg2_m2": told.imbalance_covariance[:, 1, 1],
        **_each("friction_arm_{}_m", told.friction_arm.T),
        **_each("friction_variance_{}_m2", told.friction_variance.T),
    }
    return {
        **{name: values.tolist() for name, values in columns.items()},
        "drive_off": run.drive_off.astype(int).tolist(),
        "stage": [run.stages[place].name for place in stages],
    }


def _each(name: str, values: FloatArray) -> dict[str, FloatArray]:
    return {name.format(mass): row for mass, row in enumerate(values, start=1)}


def _thinned(run: EccentricRun) -> IntArray:
    """Numbers of samples to show: equally spaced, with the stages' edges and the largest vibration."""
    last = run.time.size - 1
    even = np.linspace(0, last, min(_MOST_ROWS, run.time.size)).round().astype(np.int64)
    edges = np.searchsorted(run.time, [time for stage in run.stages for time in (stage.start, stage.end)])
    extra = np.array([int(np.argmax(run.amplitude)), last], dtype=np.int64)
    return np.unique(np.concatenate([even, np.minimum(edges, last), extra]))


def _targets(run: EccentricRun) -> dict[str, Any]:
    found = {} if run.targets is None else run.targets._asdict()
    return {
        "angle_rad": [found["first"], found["second"]],
        "half_angle_rad": found["half_angle"],
        "residual_kg_m": found["residual"],
        "saturated": bool(found["saturated"]),
    }


def show_eccentric(run: EccentricRun, *, console: Console) -> None:
    """Print a run: summary, amplitude over time, stages."""
    console.print(Group(*_parts(run)))


def _parts(run: EccentricRun) -> Iterable[RenderableType]:
    yield Text(run.status, style="bold green" if run.settled else "bold yellow")
    for warning in run.warnings:
        yield Text(f"warning: {warning}", style="yellow")
    yield _summary(run)
    yield amplitude_line(run.time, run.amplitude, end=float(run.time[-1]))
    yield _stages(run)


def _summary(run: EccentricRun) -> Table:
    when = "-" if run.settling_time is None else f"{run.settling_time:.3f} s"
    ratio = "-" if run.residual_ratio is None else f"{100 * run.residual_ratio:.3g} %"
    rows = (
        ("settling time", when),
        ("amplitude at the end", length_text(run.final_amplitude)),
        ("amplitude at worst", length_text(run.worst_amplitude)),
        ("limit", length_text(run.limit)),
        ("of the vibration without balancing", ratio),
        ("imbalance", _imbalance(run)),
        ("friction arms, +- standard deviation", _friction(run)),
        ("masses at", "  ".join(f"{_degrees(angle)} deg" for angle in run.mass_angle[:, -1])),
        ("electrical energy", f"{run.electrical_energy:.4g} J"),
    )
    return two_columns(rows)


def _imbalance(run: EccentricRun) -> str:
    x, y = run.estimates.imbalance[-1]
    deviation = math.sqrt(float(np.max(np.linalg.eigvalsh(run.imbalance_covariance))))
    phase = _degrees(math.atan2(y, x))
    return f"{math.hypot(x, y):.4g} kg m at {phase} deg, standard deviation {deviation:.2g} kg m"


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
