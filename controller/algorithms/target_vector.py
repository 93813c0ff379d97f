"""The target-vector algorithm: PID on the amplitude gives the valve-open time, the phase says where it
goes."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Final, Literal

from ringbalance.controller.algorithms.built_in import BuiltIn, Memory, open_valve
from ringbalance.controller.formulas import vector_gas_time, vector_shares
from ringbalance.controller.loop_records import TARGET_VECTOR, Record
from ringbalance.scene.platform.compiled import in_place

OnReversal = Literal["reset", "accumulate"]
_vector_gas_time: Final = in_place(vector_gas_time)
_vector_shares: Final = in_place(vector_shares)


@dataclass(frozen=True, kw_only=True)
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

    def fill(self, loop: Record, run: Record) -> None:
        """As `BuiltIn.fill`."""
        loop["algorithm"], loop["chambers"], loop["rest_limit"] = TARGET_VECTOR, self.chambers, self.limit
        loop["assumed_lag"], loop["resets"] = self.lag_angle, self.on_reversal == "reset"
        loop["integral_time"] = math.inf if self.integral_time is None else self.integral_time
        loop["derivative_time"] = self.derivative_time
        loop["minimum_gas_time"], loop["maximum_gas_time"] = self.minimum_gas_time, self.maximum_gas_time
        loop["offset"][: len(self.offsets)] = self.offsets
        run["proportional"], run["before_time"] = self.proportional, math.inf

    def react(self, loop: Record, memory: Memory) -> None:
        """As `BuiltIn.react`."""
        target_vector_step(loop, memory.run[0])


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
    first, share, second, other = _vector_shares(loop.chambers, angle, length, run.at_residual)
    open_valve(loop, run, first, share, loop.offset[first])
    open_valve(loop, run, second, other, loop.offset[second])
