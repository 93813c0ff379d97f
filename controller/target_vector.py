"""The target-vector algorithm: PID on the amplitude gives the gas time, the phase says where it goes."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Literal

from ringbalance.controller.algorithm import Command, Measurement, usable, valve_commands

OnReversal = Literal["reset", "accumulate"]


@dataclass(frozen=True, kw_only=True)
class TargetVectorState:
    """Everything that the algorithm remembers between samples."""

    integral: float = 0.0
    """Integral of the amplitude over time, m s."""
    previous: Measurement | None = None
    """The last usable sample above the limit."""


@dataclass(frozen=True, kw_only=True)
class TargetVector:
    """Gas time of the correction *vector*, T = Kc (e + 1/Ti int e dt + Td de/dt), split over two chambers.

    e is the measured amplitude, dt the actual interval between samples, the integral by trapezoids, as in
    LabVIEW's PID.  The vector points to the unbalance, phase + lag; its gas time goes to the two chambers on
    either side, each by its component, with both valves open together.

    Limits: T is held within [0, maximum_gas_time], which keeps the vector's direction; while it is cut the
    integral stands still (anti-windup).  A valve whose share is below minimum_gas_time does not open.
    At or below `limit` the algorithm rests and forgets its integral.  A dropped sample or a NaN changes
    nothing: no valve opens, the state is held, and the next usable sample sees the whole interval.

    An amplitude has no sign, so its integral could only grow and would go on pushing after the residual has
    turned round.  `on_reversal = "reset"` (default) therefore drops what was integrated when the residual has
    turned by more than 90 degrees, as a Clegg integrator does at a change of sign; "accumulate" is the
    literal formula.

    Source: section 4.2 of the liquid-ring paper; PID form of the LabVIEW PID and Fuzzy Logic Toolkit help;
        Clegg, "A nonlinear integrator for servomechanisms", Trans. AIEE 77 (1958).
    """

    chambers: int
    """n, even."""
    lag_angle: float
    """What the algorithm believes, rad."""
    limit: float
    """m."""
    proportional: float
    """Kc, s/m."""
    integral_time: float | None
    """Ti, s; None: no integral part."""
    derivative_time: float
    """Td, s."""
    minimum_gas_time: float
    """s."""
    maximum_gas_time: float
    """s."""
    on_reversal: OnReversal = "reset"
    """What becomes of the integral when the residual turns round."""

    @property
    def rises_tolerated(self) -> int:
        """Two: this algorithm lowers the amplitude with every operation unless its beliefs are wrong."""
        return 2

    def start(self) -> TargetVectorState:
        """The state before the first sample.

        Returns:
            TargetVectorState.
        """
        return TargetVectorState()

    def step(
        self, state: TargetVectorState, measurement: Measurement | None
    ) -> tuple[TargetVectorState, Command]:
        """Decide on one sample.

        Args:
            state: as returned by the previous step or by `start`.
            measurement: the sample, or None when it was dropped.

        Returns:
            The next state and the command.
        """
        if measurement is None or not usable(measurement, needs_phase=True):
            return state, Command(reason="no usable sample")
        if measurement.amplitude <= self.limit:
            return TargetVectorState(), Command(resting=True)
        wanted, integral = self._pid(state, measurement)
        shares = components(
            chambers=self.chambers, angle=measurement.phase + self.lag_angle, length=self._limited(wanted)
        )
        valves = valve_commands(
            shares, minimum_gas_time=self.minimum_gas_time, maximum_gas_time=self.maximum_gas_time
        )
        reason = "" if valves else "the gas time is below the minimum"
        return replace(state, integral=integral, previous=measurement), Command(valves=valves, reason=reason)

    def _limited(self, gas_time: float) -> float:
        return min(max(gas_time, 0.0), self.maximum_gas_time)

    def _pid(self, state: TargetVectorState, now: Measurement) -> tuple[float, float]:
        """Unlimited gas time of the vector and the integral to remember."""
        before = state.previous
        if before is None or now.time <= before.time:
            return self.proportional * now.amplitude, state.integral
        dt = now.time - before.time
        reversed_ = math.cos(now.phase - before.phase) < 0 and self.on_reversal == "reset"
        area = (now.amplitude + before.amplitude) / 2 * dt
        integral = 0.0 if reversed_ else state.integral + area
        slope = self.derivative_time * (now.amplitude - before.amplitude) / dt
        wanted = self.proportional * (now.amplitude + self._integral_part(integral) + slope)
        if wanted > self.maximum_gas_time and not reversed_:
            return wanted, state.integral
        return wanted, integral

    def _integral_part(self, integral: float) -> float:
        return 0.0 if self.integral_time is None else integral / self.integral_time


def components(*, chambers: int, angle: float, length: float) -> tuple[tuple[int, float], ...]:
    """Split a vector over the two chamber directions on either side of it.

    With the spacing D = 2 pi/n and d the angle past the chamber before it, the shares are
    length sin(D - d)/sin D and length sin(d)/sin D; four chambers: T|cos|, T|sin|.  Two chambers have one
    axis: the share is the component along it.

    Args:
        chambers: n, even.
        angle: of the vector, rad, any multiple of a full turn away.
        length: of the vector, at least zero, any unit.

    Returns:
        (chamber index, share) for one or two chambers; shares are at least zero, in the unit of `length`.

    Source: section 4.2 of the liquid-ring paper, by oblique components for other numbers of chambers.
    """
    if chambers == 2:
        along = length * math.cos(angle)
        return ((0, along),) if along >= 0 else ((1, -along),)
    spacing = 2 * math.pi / chambers
    turn = math.remainder(angle, 2 * math.pi) % (2 * math.pi)
    before = min(int(turn / spacing), chambers - 1)
    past = turn - before * spacing
    scale = length / math.sin(spacing)
    shares = (scale * max(math.sin(spacing - past), 0.0), scale * max(math.sin(past), 0.0))
    return (before, shares[0]), ((before + 1) % chambers, shares[1])
