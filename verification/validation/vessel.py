"""Times of gas vessels that fill or vent through an opening, beside what the program's gas supply predicts.

Gas that exchanges heat with the walls lies between isothermal and adiabatic. With tau of `GasLine`, filling
takes 1/gamma of the isothermal time when adiabatic; venting has dp/dt = -gamma (p/tau) sqrt(T/T_0) phi with
T/T_0 = (p/p_start)^((gamma - 1)/gamma), integrated here.
"""

from __future__ import annotations

from typing import Final

import numpy as np

from ringbalance.identification.data.measurements import Measurements, MeasurementsError
from ringbalance.physics.gas import HEAT_CAPACITY_RATIO, GasLine
from ringbalance.scene.arrays import FloatArray
from ringbalance.verification.validation.kinds import Kind, Prediction

CONDUCTANCE_UNCERTAINTY: Final = 0.1
"""U (95 %), relative, of a conductance computed from an opening's area: its discharge coefficient."""
_CRITICAL_RATIO: Final = 0.5
"""b of a sharp opening, where the data do not give one."""
_STEPS: Final = 2000


def _predict(data: Measurements) -> Prediction:
    """Middle of both limits, stated as wide as the limits and the conductance leave it."""
    _check(data)
    columns = {"critical_ratio": np.full(len(data), _CRITICAL_RATIO), **data.columns}
    names = ("pressure", "start_pressure", "far_pressure", "temperature", "volume", "conductance")
    rows = zip(*(columns[name] for name in (*names, "critical_ratio")), strict=True)
    limits = np.array([_limits(*(float(value) for value in row)) for row in rows])
    middle = limits.mean(axis=1)
    half = np.abs(limits[:, 1] - limits[:, 0]) / 2
    return Prediction(value=middle, stated=np.hypot(half, CONDUCTANCE_UNCERTAINTY * middle))


def _check(data: Measurements) -> None:
    reached, start, far = (data.columns[name] for name in ("pressure", "start_pressure", "far_pressure"))
    if not np.all((reached - start) * (far - reached) > 0):
        raise MeasurementsError("pressure must lie between start_pressure and far_pressure in every row")
    if "critical_ratio" in data.columns and not np.all(data.columns["critical_ratio"] < 1):
        raise MeasurementsError("critical_ratio must be below 1 in every row")


def _limits(
    pressure: float, start: float, far: float, temperature: float, volume: float, conductance: float, b: float
) -> tuple[float, float]:
    """Isothermal and adiabatic time from the start to a pressure, s."""
    filling = far > start
    line = GasLine(
        supply_pressure=far if filling else start,
        ambient_pressure=start if filling else far,
        temperature=temperature,
        conductance=conductance,
        critical_ratio=b,
        process="isothermal",
    )
    if filling:
        time = float(line.filling_time(pressure, volume=volume))
        return time, time / HEAT_CAPACITY_RATIO
    whole, rest = line.venting_time(np.array([start, pressure]), volume=volume)
    tau = line.time_constant(volume=volume)
    return float(whole - rest), tau * _adiabatic_venting(pressure / start, far / start, b)


def _adiabatic_venting(ratio: float, far: float, b: float) -> float:
    """Time over tau until the pressure is a ratio of its start."""
    gamma = HEAT_CAPACITY_RATIO
    falling: FloatArray = np.geomspace(1.0, ratio, _STEPS)
    phi = np.sqrt(np.maximum(1 - (np.maximum(far / falling - b, 0.0) / (1 - b)) ** 2, 0.0))
    cooled = falling ** ((gamma - 1) / (2 * gamma))
    return float(-np.trapezoid(1 / (gamma * falling * cooled * phi), falling))


VESSEL: Final = Kind(
    title="time in which a vessel fills with air or vents it, taken as an ideal gas",
    measured="time",
    columns={
        "pressure": "reached after that time, absolute",
        "start_pressure": "at time zero, absolute",
        "far_pressure": "at the other end of the line, absolute: of the supply, or the surroundings",
        "temperature": "of the gas at the start, in K",
        "volume": "of the vessel",
        "conductance": "C of valve and line (ISO 6358), known to 10 %",
    },
    optional={"critical_ratio": "b of valve and line; 0.5 without this column"},
    predict=_predict,
)
