"""Base of the program's algorithms, and the two that do not model the liquid: target vector and trial."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Final, Literal

import numpy as np

from ringbalance.controller.algorithms.algorithm import Command, Measurement, ValveCommand
from ringbalance.controller.algorithms.target_steps import (
    FIRST_CHAMBER,
    GAIN,
    HAS_BEFORE,
    RESTING,
    SINCE,
    VIBRATION_X,
    VIBRATION_Y,
    sample,
)
from ringbalance.controller.algorithms.trial_steps import FIRST_CHAMBER as FIRST_TRIED
from ringbalance.controller.algorithms.trial_steps import sample as try_one
from ringbalance.controller.algorithms.valve_steps import AT_RESIDUAL, OPEN_TIME, PER_CHAMBER
from ringbalance.controller.loop_records import (
    NO_PHASE,
    TARGET_VECTOR,
    TOO_SHORT,
    TRIAL,
    UNUSABLE,
    USABLE,
)
from ringbalance.controller.rotor import chamber_directions, chamber_letters
from ringbalance.reduced_model.injection.dynamics import MOTION
from ringbalance.scene.arrays import Record, Records
from ringbalance.scene.models import Scene
from ringbalance.scene.platform.compiled import in_place

NO_SAMPLE: Final = "no usable sample"
"""Reason that every algorithm gives for doing nothing on a dropped sample or a NaN."""
BELOW_MINIMUM: Final = "the valve-open time is below the minimum"
REASONS: Final = {0: "", UNUSABLE: NO_SAMPLE, TOO_SHORT: BELOW_MINIMUM}


@dataclass(frozen=True, kw_only=True, eq=False)
class BuiltIn:
    """An algorithm of the program, whose step is compiled within the loop."""

    scene: Scene
    """Scene with the algorithm's settings."""

    @property
    def rises_tolerated(self) -> int:
        """Tolerated rises in a row: one, and another after an assumption has been corrected."""
        return 2

    def fill(self, loop: Record, run: Record) -> None:  # noqa: ARG002
        """Write the settings into an element of type `LOOP`, the initial memory into one of type `RUN`."""
        settings, chambers = self.scene.controller, self.scene.disc.chambers
        loop["chambers"], loop["rest_limit"] = chambers, settings.limit
        loop["minimum_gas_time"] = settings.minimum_gas_time
        loop["maximum_gas_time"] = settings.maximum_gas_time
        loop["offset"][:chambers] = settings.offsets(chambers)

    def liquid(self) -> Records:
        """Pairs as estimated at the start; empty for an algorithm that does not model the liquid."""
        return np.zeros(0, dtype=MOTION)


@in_place
def open_valve(loop: Record, run: Record, chamber: int, share: float, offset: float) -> None:
    """Open a chamber's valve for its share of the time plus its offset, s, unless the share is too short."""
    if share > 0.0 and share >= loop.minimum_gas_time:
        half = loop.chambers // 2
        run.asked[chamber % half] = min(share + offset, loop.maximum_gas_time)
        run.side[chamber % half] = chamber // half


def show(run: Record, measurement: Measurement | None) -> None:
    """Write a measurement into an element of type `RUN`."""
    run["usable"] = 0
    if measurement is not None:
        run["seen_amplitude"], run["seen_phase"] = measurement.amplitude, measurement.phase
        if math.isfinite(measurement.time) and math.isfinite(measurement.amplitude):
            run["usable"] = USABLE if math.isfinite(measurement.phase) else NO_PHASE


def command_of(sample: Record, chambers: int) -> Command:
    """The command in an element of type `RUN` or `SAMPLE`."""
    half = chambers // 2
    pairs = np.flatnonzero(sample["asked"])
    opened = sorted((int(sample["side"][p]) * half + int(p), float(sample["asked"][p])) for p in pairs)
    valves = tuple(ValveCommand(chamber=chamber, duration=duration) for chamber, duration in opened)
    return Command(valves=valves, resting=bool(sample["resting"]), reason=REASONS[int(sample["reason"])])


OnReversal = Literal["reset", "accumulate"]


@dataclass(frozen=True, kw_only=True, eq=False)
class TargetVector(BuiltIn):
    """Valve-open time of the correction *vector*, T = Kc (e + 1/Ti int e dt + Td de/dt), split over two
    chambers.

    e is the measured amplitude, dt the actual interval between samples, the integral by trapezoids, as in
    LabVIEW's PID.  The vector points to the unbalance, phase + lag; its valve-open time goes to the two
    chambers on either side, each by its component, with both valves open together.  A chamber that has no
    more liquid to give is passed over for its neighbour.

    Limits: T is limited to [0, maximum_gas_time], which keeps the vector's direction; while it is limited the
    integral is held (anti-windup).  A valve whose share is below minimum_gas_time does not open; any other
    stays open longer by its offset, the time in which gas fills the chamber and moves no liquid.
    At or below `limit` the algorithm rests and resets its integral.  A dropped sample or a NaN changes
    nothing: no valve opens, the state is held, and the next usable sample covers the whole interval.

    An amplitude has no sign, so its integral could only grow and would still lengthen T after the residual
    has reversed.  `on_reversal = "reset"` (default) therefore resets the integral when the residual has
    turned by more than 90 degrees, as a Clegg integrator does at a change of sign; "accumulate" is the
    literal formula.
    Source: section 4.2 of the liquid-ring paper; PID form of the LabVIEW PID and Fuzzy Logic Toolkit help;
        Clegg, "A nonlinear integrator for servomechanisms", Trans. AIEE 77 (1958).
    """

    on_reversal: OnReversal = "reset"
    """Treatment of the integral when the residual reverses."""

    def fill(self, loop: Record, run: Record) -> None:
        """Write the settings, those of this algorithm included."""
        super().fill(loop, run)
        constants = self.constants
        loop["algorithm"], loop["settings"][: len(constants)] = TARGET_VECTOR, constants
        run["proportional"], run["before_time"] = self.scene.controller.proportional, math.inf

    @property
    def constants(self) -> tuple[float, ...]:
        """Settings of `target_steps`, in the order of their indices there."""
        settings, chambers = self.scene.controller, self.scene.disc.chambers
        sensor = self.scene.sensor
        lag, axes = settings.assumed_lag_angle, chamber_directions(chambers).tolist()
        sectors = zip(axes, settings.offsets(chambers), strict=True)
        return (
            float(chambers),
            settings.limit,
            settings.proportional,
            0.0 if settings.integral_time is None else 1.0 / settings.integral_time,
            settings.derivative_time,
            settings.minimum_gas_time,
            settings.maximum_gas_time,
            settings.period,
            float(self.on_reversal == "reset"),
            *(math.cos(lag), math.sin(lag)),
            *(sensor.amplitude_noise**2, sensor.phase_noise**2),
            *(number for axis, offset in sectors for number in (axis.real, axis.imag, offset)),
        )


@in_place
def target_vector_step(loop: Record, run: Record) -> None:
    """One step of `TargetVector` on a usable sample."""
    c, w = loop.settings, run.memory
    c[GAIN] = run.proportional
    w[VIBRATION_X] = run.seen_amplitude * math.cos(run.seen_phase)
    w[VIBRATION_Y] = run.seen_amplitude * math.sin(run.seen_phase)
    w[SINCE] = run.time - run.before_time if w[HAS_BEFORE] != 0.0 else 0.0
    for chamber in range(loop.chambers):
        at = FIRST_CHAMBER + PER_CHAMBER * chamber
        w[at + OPEN_TIME], w[at + AT_RESIDUAL] = 0.0, float(run.at_residual[chamber])
    sample(c, w)
    run.resting, run.before_time = int(w[RESTING]), run.time if w[HAS_BEFORE] != 0.0 else math.inf
    _open_valves(loop, run, FIRST_CHAMBER)


@in_place
def _open_valves(loop: Record, run: Record, first: int) -> None:
    """Command the valve-open times of the chambers, which the memory holds from index `first` on."""
    for chamber in range(loop.chambers):
        opened = run.memory[first + PER_CHAMBER * chamber + OPEN_TIME]
        if opened > 0.0:
            run.asked[chamber % (loop.chambers // 2)] = opened
            run.side[chamber % (loop.chambers // 2)] = chamber // (loop.chambers // 2)


@dataclass(frozen=True, kw_only=True, eq=False)
class Trial(BuiltIn):
    """Gas into one chamber at a time, with a step that shrinks near the goal; the phase is not read.

    The first trial of a chamber is short.  If the amplitude falls, the chamber is kept, and the next step is
    long if the amplitude is at or above `fine_below`, else short; if it does not fall, the next chamber of
    the sequence gets its first trial.  Below `fine_below` a first trial is no longer than the short step.

    At or below `limit` the algorithm rests and keeps its chamber.  A dropped sample or a NaN amplitude
    changes nothing: no valve opens and the state is held; a NaN phase does not matter.
    Source: section 4.1 of the liquid-ring paper.
    """

    @property
    def rises_tolerated(self) -> int:
        """Length of the sequence: a trial on the wrong chamber raises the amplitude."""
        return len(self.scene.controller.sequence)

    def fill(self, loop: Record, run: Record) -> None:
        """Write the settings, those of this algorithm included."""
        super().fill(loop, run)
        constants = self.constants
        loop["algorithm"], loop["settings"][: len(constants)] = TRIAL, constants

    @property
    def constants(self) -> tuple[float, ...]:
        """Settings of `trial_steps`, in the order of their indices there."""
        settings, letters = self.scene.controller, chamber_letters(self.scene.disc.chambers)
        return (
            float(len(letters)),
            settings.limit,
            settings.minimum_gas_time,
            settings.maximum_gas_time,
            settings.period,
            settings.first_trial,
            settings.long_step,
            settings.short_step,
            settings.fine_below,
            float(len(settings.sequence)),
            *(float(letters.index(letter)) for letter in settings.sequence),
        )


@in_place
def trial_step(loop: Record, run: Record) -> None:
    """One step of `Trial` on a sample with an amplitude."""
    c, w = loop.settings, run.memory
    w[VIBRATION_X], w[VIBRATION_Y] = run.seen_amplitude, 0.0
    for chamber in range(loop.chambers):
        w[FIRST_TRIED + PER_CHAMBER * chamber + OPEN_TIME] = 0.0
    try_one(c, w)
    run.resting = int(w[RESTING])
    _open_valves(loop, run, FIRST_TRIED)
