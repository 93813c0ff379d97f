"""Presentation of a run with two eccentric masses: JSON document, table of its history, printed rows."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any, Final

import numpy as np

from ringbalance.controller.balancer import RunResult
from ringbalance.controller.document import amplitude_line
from ringbalance.controller.eccentric_mass.run_record import EccentricRun
from ringbalance.results.numbers import format_given
from ringbalance.results.result import Rows, Table
from ringbalance.results.rows import Quantity, around
from ringbalance.scene.arrays import FloatArray
from ringbalance.scene.uncertain import NORMAL_95

_DOCUMENT_INSTANTS: Final = 2500
"""Number of instants in the document; a run has about a hundred times as many samples."""
_BAND_INSTANTS: Final = 600


def eccentric_document(run: EccentricRun) -> dict[str, Any]:
    """Turn a run into plain numbers, lists and text, all in SI.

    Lists run along `time_s`: equally spaced instants, begin and end of each stage, and the instant of the
    largest vibration.
    Returns: Document that `json.dumps(..., allow_nan=False)` accepts.
    """
    # Equally spaced samples, with the stages' edges and the largest vibration.
    last = run.time.size - 1
    even = np.linspace(0, last, min(_DOCUMENT_INSTANTS, run.time.size)).round().astype(np.int64)
    edges = np.searchsorted(run.time, [time for stage in run.stages for time in (stage.start, stage.end)])
    extra = np.array([int(np.argmax(run.amplitude)), last], dtype=np.int64)
    samples = np.unique(np.concatenate([even, np.minimum(edges, last), extra]))
    targets = run.targets
    return {
        "balancer": run.balancer,
        "scene": {"name": run.scene.name, "source": run.scene.source, "sha256": run.scene.sha256},
        "settled": run.settled,
        "settling_time_s": run.settling_time,
        "outcome": run.outcome.value,
        "status": run.status,
        "warnings": list(run.warnings),
        "innovation": run.innovation,
        "limit_m": run.limit,
        "residual_ratio": run.residual_ratio,
        "final_amplitude_m": run.final_amplitude,
        "worst_amplitude_m": run.worst_amplitude,
        "energy_J": run.electrical_energy,
        "peak_voltage_V": float(np.abs(run.voltage).max()),
        "stages": [{"name": s.name, "start_s": s.start, "end_s": s.end} for s in run.stages],
        "targets": targets
        and {
            "angle_rad": [targets.first, targets.second],
            "half_angle_rad": targets.half_angle,
            "residual_kg_m": targets.residual,
            "saturated": bool(targets.saturated),
        },
        "time_s": run.time[samples].tolist(),
        "speed_rad_s": run.speed[samples].tolist(),
        "amplitude_m": run.amplitude[samples].tolist(),
        "phase_rad": run.phase[samples].tolist(),
        "mass_angle_rad": run.mass_angle[:, samples].tolist(),
        "goal_rad": run.goal[:, samples].tolist(),
        "voltage_V": run.voltage[:, samples].tolist(),
        "drive_off": run.drive_off[samples].tolist(),
        "estimates": {
            "imbalance_kg_m": run.history["imbalance"][samples].T.tolist(),
            "imbalance_covariance": run.history["imbalance_covariance"][samples].tolist(),
            "imbalance_rotor_covariance": run.rotor_covariance.tolist(),
            "imbalance_half_width_kg_m": (NORMAL_95 * np.sqrt(np.diag(run.imbalance_covariance))).tolist(),
            "friction_arm_m": run.history["friction_arm"][samples].T.tolist(),
            "friction_variance": run.history["friction_variance"][samples].T.tolist(),
            "friction_half_width_m": run.friction_half_width.tolist(),
        },
        **run.rows().document(),
    }


def eccentric_history(run: EccentricRun) -> dict[str, Sequence[Any]]:
    """Columns of every sample by name; vectors rotor-fixed, angles not wrapped."""
    history = run.history
    stages = run.stages
    stage_index = np.searchsorted([stage.start for stage in stages], run.time, side="right") - 1
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
        "energy_J": run.history["energy"],
        "imbalance_x_kg_m": history["imbalance"][:, 0],
        "imbalance_y_kg_m": history["imbalance"][:, 1],
        "imbalance_variance_xx_kg2_m2": history["imbalance_covariance"][:, 0, 0],
        "imbalance_variance_xy_kg2_m2": history["imbalance_covariance"][:, 0, 1],
        "imbalance_variance_yy_kg2_m2": history["imbalance_covariance"][:, 1, 1],
        **_each("friction_arm_{}_m", history["friction_arm"].T),
        **_each("friction_variance_{}_m2", history["friction_variance"].T),
    }
    return {
        **{name: values.tolist() for name, values in columns.items()},
        "drive_off": run.drive_off.astype(int).tolist(),
        "stage": [stages[index].name for index in stage_index],
    }


def _each(name: str, values: FloatArray) -> dict[str, FloatArray]:
    return {name.format(mass): row for mass, row in enumerate(values, start=1)}


def eccentric_rows(run: EccentricRun) -> Rows:
    """Quantities, findings and stages of the run."""
    x, y = (float(each) for each in run.history["imbalance"][-1])
    width = NORMAL_95 * math.sqrt(float(np.max(np.linalg.eigvalsh(run.imbalance_covariance))))
    size = math.hypot(x, y)
    values: list[tuple[str, str, str, float | None, float]] = [
        ("settling_time", "settling time", "s", run.settling_time, 0.0),
        ("final_amplitude", "amplitude at the end", "m", run.final_amplitude, 0.0),
        ("worst_amplitude", "amplitude at worst", "m", run.worst_amplitude, 0.0),
        ("limit", "limit", "m", run.limit, 0.0),
        ("residual_ratio", "of the vibration without balancing", "1", run.residual_ratio, 0.0),
        ("imbalance", "imbalance", "kg m", size, width),
        ("imbalance_angle", "angle of the imbalance", "rad", math.atan2(y, x) % math.tau, 0.0),
        ("energy", "electrical energy", "J", run.electrical_energy, 0.0),
    ]
    arms = zip(run.history["friction_arm"][-1], run.friction_half_width, strict=True)
    for number, (arm, half) in enumerate(arms, start=1):
        values.append(
            (f"friction_arm_{number}", f"friction arm of mass {number}", "m", float(arm), float(half))
        )
    for number, angle in enumerate(run.mass_angle[:, -1], start=1):
        values.append((f"mass_angle_{number}", f"mass {number} at", "rad", float(angle) % math.tau, 0.0))
    quantities = []
    for key, name, unit, value, half in values:
        low, high = (None, None) if value is None else around(value, half)
        origin = "given" if key == "limit" else "simulated"
        quantities.append(
            Quantity(key=key, name=name, unit=unit, value=value, lower=low, upper=high, origin=origin)
        )
    ends = np.searchsorted(run.time, [stage.end for stage in run.stages])
    stages = [
        (stage.name, f"{stage.start:.3f}", f"{stage.end:.3f}", format_given(float(amplitude), "m", digits=4))
        for stage, amplitude in zip(run.stages, run.amplitude[ends], strict=True)
    ]
    return Rows(
        title=f"Run of {run.scene.name} ({run.scene.source}), eccentric masses",
        quantities=tuple(quantities),
        findings=(run.ended, *run.warned),
        facts=(("amplitude (log)", amplitude_line(run.time, run.amplitude, end=float(run.time[-1]))),),
        tables=(Table(caption="Stages", heads=("stage", "from, s", "to, s", "amplitude"), rows=stages),),
    )


def amplitude_band(runs: Sequence[RunResult], *, end: float) -> dict[str, Any]:
    """Smallest, median and largest amplitude of runs at equally spaced times; the amplitude of a run is its
    maximum since the time before, so that no peak is lost.

    Args: `end`: last of the times, s. Returns: Plain numbers for JSON, SI; a run that ended before has its
        last value.
    """
    time = np.linspace(0.0, end, _BAND_INSTANTS)
    peaks = []
    for result in runs:
        run = result.run
        edges = np.minimum(np.searchsorted(run.time, time), run.time.size - 1)
        since = np.concatenate([edges[:1], edges[:-1]])
        peaks.append([run.amplitude[a : max(b, a) + 1].max() for a, b in zip(since, edges, strict=True)])
    low, middle, high = (row.tolist() for row in np.quantile(np.array(peaks), [0.0, 0.5, 1.0], axis=0))
    return {
        "time_s": time.tolist(),
        "low_m": low,
        "middle_m": middle,
        "high_m": high,
        "runs": len(runs),
        "settled": sum(each.settled for each in runs),
    }
