"""A finished run with two eccentric masses as the JSON document that scripts rely on."""

from __future__ import annotations

from typing import Any, Final

import numpy as np

from ringbalance.controller.eccentric_mass.run_record import EccentricRun
from ringbalance.scene.arrays import IntArray

MOST_ROWS: Final = 2500
"""Instants in the document; a run has a hundred times as many."""


def eccentric_document(run: EccentricRun, *, rows: int = MOST_ROWS) -> dict[str, Any]:
    """Turn a run into plain numbers, lists and text, all in SI.

    Lists run along `time_s`: instants at equal distances, with the beginning and the end of each stage and
    the largest vibration among them.
    Returns: Document that `json.dumps(..., allow_nan=False)` accepts.
    """
    kept = thinned(run, rows=rows)
    return {
        "balancer": run.balancer,
        "scene": run.scene,
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
            "friction_arm_m": run.estimates.friction_arm[kept].T.tolist(),
            "friction_variance": run.estimates.friction_variance[kept].T.tolist(),
        },
    }


def thinned(run: EccentricRun, *, rows: int = MOST_ROWS) -> IntArray:
    """Which samples of a run to show.

    Returns: Their numbers, ascending: equally spaced, with the stages' edges and the largest vibration.
    """
    last = run.time.size - 1
    even = np.linspace(0, last, min(rows, run.time.size)).round().astype(np.int64)
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
