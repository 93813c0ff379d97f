"""The target-vector algorithm for many members at once, number for number the one of `TargetVector`."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from ringbalance.scene.models import Scene

FloatArray = npt.NDArray[np.float64]
IntArray = npt.NDArray[np.int64]


@dataclass(frozen=True, kw_only=True, eq=False)
class VectorCommands:
    """Two valves for each member, or one with a single pair of chambers."""

    chambers: IntArray
    """Indices of the driven chambers, shape (valves, members)."""
    durations: FloatArray
    """s, zero for a valve that does not open, shape (valves, members)."""


class VectorPid:
    """State of the algorithm for all members; lives inside one call of `run_members`."""

    def __init__(self, *, scene: Scene, proportional: FloatArray) -> None:
        self.chambers, self.settings = scene.disc.chambers, scene.controller
        self.proportional = proportional
        self.integral, self.amplitude, self.phase = (np.zeros(proportional.size) for _ in range(3))
        self.time = np.full(proportional.size, np.inf)

    def rest(self, who: IntArray) -> None:
        """Forget everything, as at or below the limit.

        Args:
            who: members.
        """
        self.integral[who], self.time[who] = 0.0, np.inf

    def step(
        self, who: IntArray, amplitude: FloatArray, phase: FloatArray, time: FloatArray
    ) -> VectorCommands:
        """Decide on one sample above the limit.

        Args:
            who: members.
            amplitude: m, of each of them.
            phase: rad, of each of them.
            time: s, of all members of the block.

        Returns:
            VectorCommands for those members.

        Source: as `TargetVector`.
        """
        longest = self.settings.maximum_gas_time
        wanted = self._pid(who, amplitude, phase, time[who])
        angle = phase + self.settings.assumed_lag_angle
        chambers, shares = _components(self.chambers, angle, np.clip(wanted, 0.0, longest))
        opens = (shares > 0) & (shares >= self.settings.minimum_gas_time)
        return VectorCommands(chambers=chambers, durations=np.where(opens, np.minimum(shares, longest), 0.0))

    def _pid(self, who: IntArray, amplitude: FloatArray, phase: FloatArray, time: FloatArray) -> FloatArray:
        settings, gain = self.settings, self.proportional[who]
        dt = time - self.time[who]
        later = dt > 0
        reversed_ = np.cos(phase - self.phase[who]) < 0
        before = self.amplitude[who]
        safe = np.where(later, dt, 1.0)
        grown = self.integral[who] + (amplitude + before) / 2 * safe
        integral = np.where(reversed_, 0.0, grown)
        slope = settings.derivative_time * (amplitude - before) / safe
        part = 0.0 if settings.integral_time is None else integral / settings.integral_time
        wanted = gain * np.where(later, amplitude + part + slope, amplitude)
        keeps = ~later | ((wanted > settings.maximum_gas_time) & ~reversed_)
        self.integral[who] = np.where(keeps, self.integral[who], integral)
        self.amplitude[who], self.phase[who], self.time[who] = amplitude, phase, time
        return np.asarray(wanted, dtype=np.float64)


def _components(chambers: int, angle: FloatArray, length: FloatArray) -> tuple[IntArray, FloatArray]:
    """As `target_vector.components`."""
    if chambers == 2:
        along = length * np.cos(angle)
        return (along < 0).astype(np.int64)[None], np.abs(along)[None]
    spacing = 2 * np.pi / chambers
    turn = np.remainder(angle, 2 * np.pi)
    before = np.minimum((turn / spacing).astype(np.int64), chambers - 1)
    past = turn - before * spacing
    scale = length / np.sin(spacing)
    shares = np.stack(
        [scale * np.maximum(np.sin(spacing - past), 0.0), scale * np.maximum(np.sin(past), 0.0)]
    )
    return np.stack([before, (before + 1) % chambers]), shares
