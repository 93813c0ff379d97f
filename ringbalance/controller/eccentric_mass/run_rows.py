"""Presentation of a run with two eccentric masses: JSON document, table of its history, printed rows."""

from __future__ import annotations

import cmath
import math
from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any, Final, NamedTuple

import numpy as np

from ringbalance.controller.document import amplitude_line
from ringbalance.controller.eccentric_mass.run_record import EccentricRun
from ringbalance.results.numbers import format_given
from ringbalance.results.result import Rows, Table
from ringbalance.results.rows import Quantity, around
from ringbalance.scene.arrays import FloatArray
from ringbalance.scene.uncertain import NORMAL_95

_DOCUMENT_INSTANTS: Final = 2500
"""Number of instants in the document; a run has about a hundred times as many samples."""


class _Signal(NamedTuple):
    """Signal of a run: name and unit of its key, its values, and the names of its components."""

    name: str
    unit: str
    values: Callable[[EccentricRun], FloatArray]
    """Shape (n,), or one row for each component."""
    parts: tuple[str, ...] = ("",)
    documented: bool = False
    """True if the document has it as a list."""


_MASSES: Final = ("1", "2")
_SIGNALS: Final = (
    _Signal("time", "s", lambda run: run.time, documented=True),
    _Signal("speed", "rad_s", lambda run: run.speed, documented=True),
    _Signal("whirl", "m", lambda run: run.history["state"][:, :2].T, ("x", "y")),
    _Signal("amplitude", "m", lambda run: run.amplitude, documented=True),
    _Signal("phase", "rad", lambda run: run.phase, documented=True),
    _Signal("mass_angle", "rad", lambda run: run.mass_angle, _MASSES, documented=True),
    _Signal("mass_rate", "rad_s", lambda run: run.mass_rate, _MASSES),
    _Signal("goal", "rad", lambda run: run.goal, _MASSES, documented=True),
    _Signal("voltage", "V", lambda run: run.voltage, _MASSES, documented=True),
    _Signal("energy", "J", lambda run: run.history["energy"]),
    _Signal("imbalance", "kg_m", lambda run: run.history["imbalance"].T, ("x", "y")),
    _Signal(
        "imbalance_variance",
        "kg2_m2",
        lambda run: run.history["imbalance_covariance"].reshape(-1, 4).T[[0, 1, 3]],
        ("xx", "xy", "yy"),
    ),
    _Signal("friction_arm", "m", lambda run: run.history["friction_arm"].T, _MASSES),
    _Signal("friction_variance", "m2", lambda run: run.history["friction_variance"].T, _MASSES),
)
"""Signals of a run in the order of its history's columns."""


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
        **{
            f"{signal.name}_{signal.unit}": signal.values(run)[..., samples].tolist()
            for signal in _SIGNALS
            if signal.documented
        },
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
    columns = {}
    for signal in _SIGNALS:
        for part, values in zip(signal.parts, np.atleast_2d(signal.values(run)), strict=True):
            columns["_".join(filter(None, (signal.name, part, signal.unit)))] = values.tolist()
    stages = run.stages
    index = np.searchsorted([stage.start for stage in stages], run.time, side="right") - 1
    names = np.array([stage.name for stage in stages])
    return {**columns, "drive_off": run.drive_off.astype(int).tolist(), "stage": names[index].tolist()}


def eccentric_rows(run: EccentricRun) -> Rows:
    """Quantities, findings and stages of the run."""
    width = NORMAL_95 * math.sqrt(float(np.max(np.linalg.eigvalsh(run.imbalance_covariance))))
    arms, places = run.history["friction_arm"][-1].tolist(), np.mod(run.mass_angle[:, -1], math.tau).tolist()
    values: list[tuple[str, str, str, float | None, float]] = [
        ("settling_time", "settling time", "s", run.settling_time, 0.0),
        ("final_amplitude", "amplitude at the end", "m", run.final_amplitude, 0.0),
        ("worst_amplitude", "amplitude at worst", "m", run.worst_amplitude, 0.0),
        ("limit", "limit", "m", run.limit, 0.0),
        ("residual_ratio", "of the vibration without balancing", "1", run.residual_ratio, 0.0),
        ("imbalance", "imbalance", "kg m", abs(run.imbalance), width),
        ("imbalance_angle", "angle of the imbalance", "rad", cmath.phase(run.imbalance) % math.tau, 0.0),
        ("energy", "electrical energy", "J", run.electrical_energy, 0.0),
        *(
            (f"friction_arm_{number}", f"friction arm of mass {number}", "m", arm, half)
            for number, arm, half in zip((1, 2), arms, run.friction_half_width.tolist(), strict=True)
        ),
        *(
            (f"mass_angle_{number}", f"mass {number} at", "rad", angle, 0.0)
            for number, angle in zip((1, 2), places, strict=True)
        ),
    ]
    quantities = []
    for key, name, unit, value, half in values:
        low, high = (None, None) if value is None else around(value, half)
        quantity = Quantity(key=key, name=name, unit=unit, value=value, lower=low, upper=high)
        quantities.append(replace(quantity, origin="given" if key == "limit" else "simulated"))
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
