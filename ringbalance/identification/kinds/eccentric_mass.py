"""Kinds of measurement on a rotor with eccentric masses, and their predictions by its scene."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from typing import Final, NamedTuple

import numpy as np

from ringbalance.controller.eccentric_mass.plant import (
    ANGLE,
    FLAG,
    LOCKED,
    VOLTAGE,
    PlantParameters,
    X,
    Y,
    plant_row,
    plant_step,
    substeps,
)
from ringbalance.controller.eccentric_mass.scene_records import EccentricScene
from ringbalance.identification.kinds.kind import (
    Grid,
    Kind,
    Observations,
    always,
    amplitude,
    column,
    measured,
    parts,
    phase,
    positive,
)
from ringbalance.scene.arrays import FloatArray, IntArray

MOST_STEPS: Final = 300_000
"""Largest number of steps of all motions of a file, some 0.2 s for a prediction: a fit takes 1 to 2 min."""
_MOST_SUBSTEPS: Final = 20_000
"""Largest number of steps in one call of the plant, some 0.02 s: Ctrl-C acts only between calls."""
_VOLTAGES: Final = (0.25, 0.5, 1.0)
"""Candidate voltages over the voltage limit; without a limit, only voltages of the data are candidates."""
_POSITIONING_TIMES_S: Final = (0.1, 0.4, 1.0)
_SPEEDS: Final = 9
"""Number of candidate speeds, from half of the lowest speed of the scene to the highest."""


def _steady_whirls(scene: EccentricScene, observations: Observations, _: object) -> FloatArray:
    """Vibration over the speed in the rotor's frame, m, both masses clamped at their initial angles.

    Steady state, as in a run-up that is slow compared with the decay of the rotor's motion.
    """
    plant, angles = PlantParameters.of(scene), scene.masses.initial_angle
    speeds = observations.columns["speed"].tolist()
    return parts(np.array([plant.steady_whirl(speed, angles) for speed in speeds], dtype=np.complex128))


def _positions(scene: EccentricScene, observations: Observations, _: object) -> FloatArray:
    """Angular travel of one mass under a constant voltage, rad, with the other mass clamped.

    The mass starts at rest from its initial angle, on a rotor in steady whirl at constant speed. Rows of
    equal series, mass, voltage and speed are one motion.
    """
    plant, angles = PlantParameters.of(scene), scene.masses.initial_angle
    moved, times = np.empty(len(observations)), observations.columns["time"]
    for motion, rows in _motions(observations):
        speed, state = float(motion.speed), plant_row(angles)
        state[FLAG + 1 - motion.mass], state[VOLTAGE + motion.mass] = LOCKED, motion.voltage
        whirl = plant.steady_whirl(speed, angles) if speed else 0j
        state[X], state[Y], now = whirl.real, whirl.imag, 0.0
        for row, time in zip(rows.tolist(), times[rows].tolist(), strict=True):
            calls = math.ceil(substeps(plant, speed, 0.0, time - now) / _MOST_SUBSTEPS) if time > now else 0
            for _ in range(calls):
                plant_step(plant, state, speed, 0.0, (time - now) / calls)
            now = time
            moved[row] = state[ANGLE + motion.mass] - angles[motion.mass]
    return moved


def _moved_masses(observations: Observations) -> IntArray:
    """Index, 0 or 1, of the moved mass of each row."""
    return np.asarray(observations.columns.get("moved_mass", np.ones(len(observations))) - 1, dtype=np.int64)


def _informs(observations: Observations) -> tuple[str, ...]:
    """Names of parameters: friction arm of every moved mass, and constants of the motor."""
    arms = (f"masses.friction_arm[{mass}]" for mass in sorted(set(_moved_masses(observations).tolist())))
    return (*arms, "motor.torque_constant", "motor.back_emf_constant")


def _too_long(scene: EccentricScene, observations: Observations) -> str:
    """Reason why integration takes too long, some hundred times in a fit; empty if it does not."""
    plant, times = PlantParameters.of(scene), observations.columns["time"]
    motions = _motions(observations)
    steps = sum(substeps(plant, motion.speed, 0.0, times[rows[-1]]) for motion, rows in motions)
    if steps <= MOST_STEPS:
        return ""
    return (
        f"the motions take {steps} steps of integration, and a fit at most {MOST_STEPS}: check the units of "
        "time and speed, or leave out the latest times and some of the voltages"
    )


class _MassMotion(NamedTuple):
    series: str
    mass: int
    """Index of the moved mass."""
    voltage: float
    speed: float


def _motions(observations: Observations) -> Iterator[tuple[_MassMotion, IntArray]]:
    """Yield every motion with its rows in order of time."""
    columns, series = observations.columns, observations.series.tolist()
    set_to = zip(series, _moved_masses(observations), columns["voltage"], columns["speed"], strict=True)
    rows_of: dict[_MassMotion, list[int]] = {}
    for row, values in enumerate(set_to):
        rows_of.setdefault(_MassMotion(*values), []).append(row)
    for motion, rows in rows_of.items():
        yield motion, np.array(rows)[np.argsort(columns["time"][rows], kind="stable")]


def _some_speeds(scene: EccentricScene) -> Grid:
    speeds = [point.speed for point in scene.rotor.speed_profile]
    return {"speed": np.linspace(min(speeds) / 2, max(speeds), _SPEEDS).tolist()}


def _some_motions(scene: EccentricScene) -> Grid:
    largest = scene.motor.maximum_voltage
    return {
        "moved_mass": [1.0, 2.0],
        "voltage": [] if largest is None else [x * largest for x in _VOLTAGES],
        "speed": [min(point.speed for point in scene.rotor.speed_profile)],
        "time": _POSITIONING_TIMES_S,
    }


ECCENTRIC_MASS: Final[Mapping[str, Kind]] = {
    "run_up": Kind(
        title="vibration of the rotor over its speed, both masses clamped",
        balancer="eccentric_mass",
        columns=(
            positive("speed [rpm]", "of the rotor"),
            amplitude("amplitude [um]", "of the vibration"),
            phase("phase [deg]"),
        ),
        predict=_steady_whirls,
        informs=always("rotor.stiffness", "rotor.damping", "imbalance.mass", "imbalance.phase"),
        offers=_some_speeds,
    ),
    "positioning": Kind(
        title="angle of one mass under a constant motor voltage",
        balancer="eccentric_mass",
        columns=(
            column("time [s]", "from when the voltage was applied", lowest=0.0, highest=100.0),
            column("voltage [V]", "of the motor", highest=1000.0),
            column("speed [rpm]", "of the rotor", lowest=0.0, highest=1000.0),
            measured("angle [deg]", "moved by the mass on its track since then, not wrapped"),
            column(
                "moved_mass",
                "1 or 2, the mass that moves while the other one is clamped; 1 without this column",
                optional=True,
                lowest=1.0,
                highest=2.0,
                integer=True,
            ),
        ),
        predict=_positions,
        informs=_informs,
        obstacle=_too_long,
        offers=_some_motions,
    ),
}
