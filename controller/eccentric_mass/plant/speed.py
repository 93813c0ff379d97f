"""The rotor's speed over time, as the scene prescribes it."""

from __future__ import annotations

from ringbalance.controller.compilation.compiled import compiled
from ringbalance.scene.arrays import FloatArray


@compiled
def speed_at(times: FloatArray, speeds: FloatArray, time: float) -> tuple[float, float]:
    """W, rad/s, and W', rad/s^2, just after a time; constant before the first corner and after the last."""
    if time < times[0]:
        return speeds[0], 0.0
    for place in range(len(times) - 1):
        if time < times[place + 1]:
            rate = (speeds[place + 1] - speeds[place]) / (times[place + 1] - times[place])
            return speeds[place] + rate * (time - times[place]), rate
    return speeds[-1], 0.0


@compiled
def turned(times: FloatArray, speeds: FloatArray, time: float) -> float:
    """Angle of the rotor, the integral of its speed from time zero. Returns: rad, not wrapped."""
    angle: float = speeds[0] * min(time, times[0])
    for place in range(len(times) - 1):
        end = min(time, times[place + 1])
        if end > times[place]:
            now, _ = speed_at(times, speeds, times[place])
            slope = (speeds[place + 1] - speeds[place]) / (times[place + 1] - times[place])
            length = end - times[place]
            angle += now * length + 0.5 * slope * length * length
    angle += speeds[-1] * max(0.0, time - times[-1])
    return angle
