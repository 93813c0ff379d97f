"""The target-vector algorithm: PID on the amplitude gives the valve-open time, the phase says where it
goes."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Final, Literal

from ringbalance.controller.algorithms.algorithm import Command, Measurement, opening
from ringbalance.controller.formulas import vector_gas_time, vector_shares

OnReversal = Literal["reset", "accumulate"]

NEVER: Final = Measurement(time=math.inf, amplitude=0.0, phase=0.0)
"""In the place of a sample before the first one."""


@dataclass(frozen=True, kw_only=True)
class _TargetVectorState:
    """Everything that the algorithm remembers between samples."""

    integral: float = 0.0
    """Integral of the amplitude over time, m s."""
    previous: Measurement | None = None
    """The last usable sample above the limit."""


@dataclass(frozen=True, kw_only=True)
class TargetVector:
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

    chambers: int
    """n, even."""
    lag_angle: float
    """What the algorithm assumes, rad."""
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
    offsets: tuple[float, ...] = ()
    """Added to a valve's share, one for each chamber, s; empty: none."""
    on_reversal: OnReversal = "reset"
    """What becomes of the integral when the residual turns round."""

    @property
    def rises_tolerated(self) -> int:
        """Two: this algorithm lowers the amplitude with every operation unless its beliefs are wrong."""
        return 2

    def start(self) -> _TargetVectorState:
        return _TargetVectorState()

    def step(
        self, state: _TargetVectorState, measurement: Measurement | None
    ) -> tuple[_TargetVectorState, Command]:
        if measurement is None or not measurement.usable(needs_phase=True):
            return state, Command(reason="no usable sample")
        if measurement.amplitude <= self.limit:
            return _TargetVectorState(), Command(resting=True)
        wanted, integral = self._pid(state, measurement)
        shares = components(
            chambers=self.chambers,
            angle=measurement.phase + self.lag_angle,
            length=min(max(wanted, 0.0), self.maximum_gas_time),
            at_residual=measurement.at_residual,
        )
        command = opening(
            shares,
            minimum_gas_time=self.minimum_gas_time,
            maximum_gas_time=self.maximum_gas_time,
            offsets=self.offsets,
        )
        return replace(state, integral=integral, previous=measurement), command

    def _pid(self, state: _TargetVectorState, now: Measurement) -> tuple[float, float]:
        """Unlimited valve-open time of the vector and the integral to remember."""
        before = state.previous or NEVER
        return vector_gas_time(
            now.amplitude,
            now.phase,
            now.time,
            state.integral,
            before.amplitude,
            before.phase,
            before.time,
            self.proportional,
            math.inf if self.integral_time is None else self.integral_time,
            self.derivative_time,
            self.maximum_gas_time,
            self.on_reversal == "reset",
        )


def components(
    *, chambers: int, angle: float, length: float, at_residual: tuple[bool, ...] = ()
) -> tuple[tuple[int, float], ...]:
    """Split a vector over the chamber directions on either side of it; (chamber, share >= 0) each.

    With the angle D between the two, the spacing 2 pi/n, and d the angle past the first, the shares are
    length sin(D - d)/sin D and length sin(d)/sin D; four chambers: T|cos|, T|sin|. Two chambers have one
    axis: the share is the component along it.
    With six chambers or more one that is `at_residual` is passed over for the next one on its side, as long
    as D stays below pi.  Beyond it, and so with four chambers, the two that are left cannot form the vector:
    it is split over its nearest directions.
    Source: section 4.2 of the liquid-ring paper, by oblique components for other numbers of chambers.
    """
    without = at_residual or (False,) * chambers
    first, share, second, other = vector_shares(chambers, angle, length, without)
    return ((first, share),) if chambers == 2 else ((first, share), (second, other))
