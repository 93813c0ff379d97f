"""Algorithms of the program: what all share, and the two that follow no liquid, target vector and trial."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final, Literal

import numpy as np

from ringbalance.controller.algorithms.algorithm import Command, Measurement, ValveCommand
from ringbalance.controller.loop_records import (
    NO_PHASE,
    TARGET_VECTOR,
    TOO_SHORT,
    TRIAL,
    UNUSABLE,
    USABLE,
)
from ringbalance.controller.rotor import chamber_letters
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
    """Whose settings it has."""

    @property
    def rises_tolerated(self) -> int:
        """As `Controller` has it: a rise, and another after what was assumed has been corrected."""
        return 2

    def fill(self, loop: Record, run: Record) -> None:  # noqa: ARG002
        """Write the settings into an element of type `LOOP`, and the first memory into one of type `RUN`."""
        settings, chambers = self.scene.controller, self.scene.disc.chambers
        loop["chambers"], loop["rest_limit"] = chambers, settings.limit
        loop["minimum_gas_time"] = settings.minimum_gas_time
        loop["maximum_gas_time"] = settings.maximum_gas_time
        loop["offset"][:chambers] = settings.offsets(chambers)

    def liquid(self) -> Records:
        """The pairs as the algorithm believes them to be at the start; empty where it has no belief."""
        return np.zeros(0, dtype=MOTION)


@in_place
def open_valve(loop: Record, run: Record, chamber: int, share: float, offset: float) -> None:
    """Command gas into a chamber for a share and its offset, s, unless the share is below the minimum."""
    if share > 0.0 and share >= loop.minimum_gas_time:
        half = loop.chambers // 2
        run.asked[chamber % half] = min(share + offset, loop.maximum_gas_time)
        run.side[chamber % half] = chamber // half


def show(run: Record, measurement: Measurement | None) -> None:
    """Write what a sensor gave into an element of type `RUN`."""
    run["usable"] = 0
    if measurement is not None:
        run["seen_amplitude"], run["seen_phase"] = measurement.amplitude, measurement.phase
        if math.isfinite(measurement.time) and math.isfinite(measurement.amplitude):
            run["usable"] = USABLE if math.isfinite(measurement.phase) else NO_PHASE


def command_of(sample: Record, chambers: int) -> Command:
    """The command in an element of type `RUN` or `SAMPLE`."""
    half = chambers // 2
    asked = np.flatnonzero(sample["asked"])
    opened = sorted((int(sample["side"][p]) * half + int(p), float(sample["asked"][p])) for p in asked)
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

    Limits: T is held within [0, maximum_gas_time], which keeps the vector's direction; while it is cut the
    integral stands still (anti-windup).  A valve whose share is below minimum_gas_time does not open;
    another stays open for its offset, too, in which gas fills the chamber and moves nothing.
    At or below `limit` the algorithm rests and forgets its integral.  A dropped sample or a NaN changes
    nothing: no valve opens, the state is held, and the next usable sample sees the whole interval.

    An amplitude has no sign, so its integral could only grow and would keep pushing after the residual has
    turned round.  `on_reversal = "reset"` (default) therefore drops what was integrated when the residual has
    turned by more than 90 degrees, as a Clegg integrator does at a change of sign; "accumulate" is the
    literal formula.
    Source: section 4.2 of the liquid-ring paper; PID form of the LabVIEW PID and Fuzzy Logic Toolkit help;
        Clegg, "A nonlinear integrator for servomechanisms", Trans. AIEE 77 (1958).
    """

    on_reversal: OnReversal = "reset"
    """What becomes of the integral when the residual turns round."""

    def fill(self, loop: Record, run: Record) -> None:
        """As `BuiltIn.fill`."""
        super().fill(loop, run)
        settings = self.scene.controller
        loop["algorithm"], loop["resets"] = TARGET_VECTOR, self.on_reversal == "reset"
        loop["assumed_lag"], loop["derivative_time"] = settings.assumed_lag_angle, settings.derivative_time
        loop["integral_time"] = math.inf if settings.integral_time is None else settings.integral_time
        run["proportional"], run["before_time"] = settings.proportional, math.inf


@in_place
def target_vector_step(loop: Record, run: Record) -> None:
    """One step of `TargetVector` on a usable sample."""
    if run.seen_amplitude <= loop.rest_limit:
        run.resting, run.integral, run.before_time = 1, 0.0, math.inf
        return
    wanted, run.integral = _vector_gas_time(
        run.seen_amplitude,
        run.seen_phase,
        run.time,
        run.integral,
        run.before_amplitude,
        run.before_phase,
        run.before_time,
        run.proportional,
        loop.integral_time,
        loop.derivative_time,
        loop.maximum_gas_time,
        loop.resets > 0,
    )
    run.before_amplitude, run.before_phase, run.before_time = run.seen_amplitude, run.seen_phase, run.time
    length = min(max(wanted, 0.0), loop.maximum_gas_time)
    angle = run.seen_phase + loop.assumed_lag
    first, share, second, other = vector_shares(loop.chambers, angle, length, run.at_residual)
    open_valve(loop, run, first, share, loop.offset[first])
    open_valve(loop, run, second, other, loop.offset[second])


@in_place
def _vector_gas_time(
    amplitude: float,
    phase: float,
    time: float,
    integral: float,
    before_amplitude: float,
    before_phase: float,
    before_time: float,
    proportional: float,
    integral_time: float,
    derivative_time: float,
    maximum_gas_time: float,
    resets: bool,
) -> tuple[float, float]:
    """PID on the amplitude, T = Kc (e + 1/Ti int e dt + Td de/dt), s, not limited yet, and the new integral.

    An infinite `before_time`: there was no sample before; an infinite Ti: no integral part. While T is above
    `maximum_gas_time` the integral stands still; with `resets` it is dropped when the residual has turned by
    more than 90 degrees.
    """
    dt = time - before_time
    if not dt > 0.0:
        return proportional * amplitude, integral
    turned = resets and math.cos(phase - before_phase) < 0.0
    summed = 0.0 if turned else integral + (amplitude + before_amplitude) / 2.0 * dt
    slope = derivative_time * (amplitude - before_amplitude) / dt
    wanted = proportional * (amplitude + summed / integral_time + slope)
    if turned or wanted <= maximum_gas_time:
        return wanted, summed
    return wanted, integral


@in_place
def vector_shares(
    chambers: int, angle: float, length: float, at_residual: Sequence[bool]
) -> tuple[int, float, int, float]:
    """Split a vector over the two chamber directions on either side of it; each chamber takes its component.

    Args: `at_residual`: of every chamber, whether it is passed over for the next one.
    Returns: Chamber index and share of either; a share of zero where one chamber takes all.
    """
    if chambers == 2:
        along = length * math.cos(angle)
        return (0, along, 1, 0.0) if along >= 0.0 else (1, -along, 0, 0.0)
    spacing = 2.0 * math.pi / chambers
    turn = angle % (2.0 * math.pi)
    nearest = min(int(turn / spacing), chambers - 1)
    before, after = nearest, nearest + 1
    while at_residual[before % chambers] and after - before < chambers:
        before -= 1
    while at_residual[after % chambers] and after - before < chambers:
        after += 1
    if 2 * (after - before) >= chambers:
        before, after = nearest, nearest + 1
    between, past = (after - before) * spacing, turn - before * spacing
    scale = length / math.sin(between)
    return (
        before % chambers,
        scale * max(math.sin(between - past), 0.0),
        after % chambers,
        scale * max(math.sin(past), 0.0),
    )


@dataclass(frozen=True, kw_only=True, eq=False)
class Trial(BuiltIn):
    """Gas into one chamber at a time, with a step that shrinks near the goal; the phase is not read.

    The first trial of a chamber is short.  If the amplitude falls, the chamber stays and the step is long
    while the amplitude is at or above `fine_below`, short below it; if it does not fall, the next chamber of
    the sequence gets its first trial.  Below `fine_below` a first trial is no longer than the short step.

    At or below `limit` the algorithm rests and keeps its chamber.  A dropped sample or a NaN amplitude
    changes nothing: no valve opens and the state is held; a NaN phase does not matter.
    Source: section 4.1 of the liquid-ring paper.
    """

    @property
    def rises_tolerated(self) -> int:
        """One round through the sequence: a rise is how this algorithm learns."""
        return len(self.scene.controller.sequence)

    def fill(self, loop: Record, run: Record) -> None:
        """As `BuiltIn.fill`."""
        super().fill(loop, run)
        settings, letters = self.scene.controller, chamber_letters(self.scene.disc.chambers)
        sequence = [letters.index(letter) for letter in settings.sequence]
        loop["algorithm"], loop["trials"], loop["sequence"][: len(sequence)] = TRIAL, len(sequence), sequence
        for name in ("first_trial", "long_step", "short_step", "fine_below"):
            loop[name] = getattr(settings, name)


@in_place
def trial_step(loop: Record, run: Record) -> None:
    """One step of `Trial` on a usable sample."""
    amplitude = run.seen_amplitude
    if amplitude <= loop.rest_limit:
        run.resting, run.tried = 1, 0
        return
    fell = run.tried > 0 and amplitude < run.before_amplitude
    if run.tried > 0 and not fell:
        run.position = (run.position + 1) % loop.trials
    step = loop.long_step if fell else loop.first_trial
    if amplitude < loop.fine_below:
        step = loop.short_step if fell else min(step, loop.short_step)
    run.tried, run.before_amplitude = 1, amplitude
    open_valve(loop, run, loop.sequence[run.position], step, 0.0)
