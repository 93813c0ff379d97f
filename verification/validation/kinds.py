"""Measurements by others that come with the program, and each kind of them as the program predicts it.

A new kind is an entry of `KINDS`.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from importlib.resources import files
from types import MappingProxyType
from typing import Any, Final

import numpy as np

from ringbalance.identification.data.measurements import Measurements, MeasurementsError
from ringbalance.physics.gas import HEAT_CAPACITY_RATIO, GasLine
from ringbalance.physics.sloshing import FREQUENCY_UNCERTAINTY
from ringbalance.physics.sloshing_system import sloshing_system
from ringbalance.physics.tube.friction import friction_factor, friction_uncertainty
from ringbalance.physics.tube.local_losses import entrance_loss, exit_loss
from ringbalance.scene.arrays import FloatArray
from ringbalance.scene.models import Disc, Tube

_WIDEST: Final = 20
"""Long over short side of a duct that is accepted."""
_TERMS: Final = 100
"""Up to which odd terms of a series are summed that fall like 1/n^5."""
CALIBRATING: Final = (
    "tube 1 (bore)",
    "tube 2 (bore)",
    "tube 3 (bore)",
    "tube 4 (bore)",
    "tube 5 (bore)",
    "cut (bore)",
)
"""Points of Eisenklam that gave the bore of their tube, and are not judged."""
_LAMINAR: Final = 100.0
"""Critical Re over the usual one, for flow that is known to be laminar."""
CONDUCTANCE_UNCERTAINTY: Final = 0.1
"""U (95 %), relative, of a conductance computed from an opening's area: its discharge coefficient."""
_CRITICAL_RATIO: Final = 0.5
"""b of a sharp opening, where the data do not give one."""
_STEPS: Final = 2000
_RADIUS: Final = 1e4
"""Of the chamber, in widths of the tank."""
_DEPTHS: Final = (0.01, 10.0)
_CELLS: Final = (8, 16)


@dataclass(frozen=True, kw_only=True)
class _Prediction:
    """What the program says of each point, SI."""

    value: FloatArray
    stated: FloatArray
    """Expanded uncertainty (95 %) that it states."""


@dataclass(frozen=True, kw_only=True)
class Kind:
    """One kind of data."""

    title: str
    measured: str
    """Column that is predicted."""
    columns: Mapping[str, str]
    """Columns that the prediction needs, with what they hold."""
    optional: Mapping[str, str] = field(default_factory=dict)
    """Columns that it uses where they are there."""
    predict: Callable[[Measurements], _Prediction]


def measurements(name: str) -> Measurements:
    """The data set of a file in `data/`, by its name without ".csv"."""
    path = files("ringbalance.verification.validation") / "data" / f"{name}.csv"
    return Measurements.parsed(path.read_text(encoding="utf-8"), file=f"{name}.csv")


def laminar_ratio(aspect_ratio: FloatArray) -> FloatArray:
    """Laminar friction of rectangular ducts over that of a tube of their hydraulic diameter; 0 for tubes.

    f Re = 96/[(1 + 1/a)^2 (1 - 192/(pi^5 a) sum tanh(n pi a/2)/n^5)] over odd n, against 64.
    Source: Fourier series of the velocity across the short side.
    """
    a, n = np.maximum(aspect_ratio, 1.0), np.arange(1, _TERMS, 2)
    terms = np.sum(np.tanh(np.pi / 2 * n * a[:, None]) / n**5, axis=1)
    ratio = 1.5 / ((1 + 1 / a) ** 2 * (1 - 192 / (np.pi**5 * a) * terms))
    return np.where(aspect_ratio > 0, ratio, 1.0)


def _friction(data: Measurements) -> _Prediction:
    none = np.zeros(len(data))
    aspect, roughness = (data.columns.get(name, none) for name in ("aspect_ratio", "relative_roughness"))
    if not np.all((aspect == 0) | ((aspect >= 1) & (aspect <= _WIDEST))):
        raise MeasurementsError(f"aspect_ratio must be 0 or from 1 to {_WIDEST} in every row")
    reynolds, ratio = data.columns["reynolds"], laminar_ratio(aspect)

    def each(formula: Callable[..., Any]) -> FloatArray:
        """One wall after the other."""
        found = np.empty_like(reynolds)
        for wall in np.unique(roughness):
            here = roughness == wall
            found[here] = formula(
                reynolds=reynolds[here], relative_roughness=float(wall), laminar_ratio=ratio[here]
            )
        return found

    return _Prediction(value=each(friction_factor), stated=each(friction_uncertainty))


def _pressure(data: Measurements) -> _Prediction:
    """(rho u^2/2) (k + 1) with k of friction, entrance and exit; no bend, no rotation."""
    columns = {"laminar": np.zeros(len(data)), **data.columns}
    if not np.all(np.isin(columns["laminar"], (0.0, 1.0))):
        raise MeasurementsError("laminar must be 0 or 1 in every row")
    reynolds, slenderness = tube_numbers(data)
    critical = np.where(columns["laminar"] > 0, _LAMINAR, 1.0)
    rows = zip(slenderness, reynolds, critical, strict=True)
    k, half_width = np.array([tube_loss(*(float(value) for value in row)) for row in rows]).T
    velocity = reynolds * columns["kinematic_viscosity"] / columns["bore"]
    dynamic = columns["density"] * velocity**2 / 2
    return _Prediction(value=dynamic * (k + 1), stated=dynamic * half_width)


def tube_numbers(data: Measurements) -> tuple[FloatArray, FloatArray]:
    """Re and L/d of each point."""
    columns = data.columns
    velocity = columns["flow"] / (np.pi / 4 * columns["bore"] ** 2)
    return velocity * columns["bore"] / columns["kinematic_viscosity"], columns["length"] / columns["bore"]


def tube_loss(slenderness: float, reynolds: float, critical: float) -> tuple[float, float]:
    """k of a smooth tube with a rounded entrance, and its expanded uncertainty (95 %).

    Args: `slenderness`: L/d. `critical`: critical Re over the usual one.
    """
    tube = _tube(slenderness)
    friction = {"reynolds": reynolds, "relative_roughness": 0.0, "critical_ratio": critical}
    terms: list[tuple[FloatArray, FloatArray]] = [
        (slenderness * friction_factor(**friction), slenderness * friction_uncertainty(**friction)),
        entrance_loss(tube=tube, reynolds=reynolds, critical_ratio=critical),
        exit_loss(tube=tube, reynolds=reynolds, critical_ratio=critical),
    ]
    values, half_widths = np.array(terms, dtype=np.float64).T
    return float(np.sum(values)), float(np.linalg.norm(half_widths))


def _tube(slenderness: float) -> Tube:
    return Tube(
        bore=1.0,
        port_radius=0.0,
        hump_radius=None,
        hump_position=0.5,
        hump_shape="arc",
        hump_gas="vented",
        length=slenderness,
        roughness=0.0,
        entrance="rounded",
        entrance_radius=1.0,
        bends=(),
        extra_loss=0.0,
        drag_coefficient=None,
    )


def _vessel_time(data: Measurements) -> _Prediction:
    """Times of a gas vessel: middle of both limits, stated as wide as these and the conductance leave it.

    Gas that exchanges heat with the walls lies between isothermal and adiabatic. With tau of `GasLine`,
    filling takes 1/gamma of the isothermal time when adiabatic; venting has dp/dt = -gamma (p/tau)
    sqrt(T/T_0) phi with T/T_0 = (p/p_start)^((gamma - 1)/gamma), integrated here.
    """
    _checked(data)
    columns = {"critical_ratio": np.full(len(data), _CRITICAL_RATIO), **data.columns}
    names = ("pressure", "start_pressure", "far_pressure", "temperature", "volume", "conductance")
    rows = zip(*(columns[name] for name in (*names, "critical_ratio")), strict=True)
    limits = np.array([_limits(*(float(value) for value in row)) for row in rows])
    middle = limits.mean(axis=1)
    half = np.abs(limits[:, 1] - limits[:, 0]) / 2
    return _Prediction(value=middle, stated=np.hypot(half, CONDUCTANCE_UNCERTAINTY * middle))


def _checked(data: Measurements) -> None:
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


def _frequency(data: Measurements) -> _Prediction:
    given = data.columns["depth_over_width"]
    if not np.all((given >= _DEPTHS[0]) & (given <= _DEPTHS[1])):
        raise MeasurementsError(f"depth_over_width must lie from {_DEPTHS[0]} to {_DEPTHS[1]} in every row")
    depths, place = np.unique(given, return_inverse=True)
    found = np.array([tank_frequency(float(depth)) for depth in depths])[place]
    return _Prediction(value=found, stated=FREQUENCY_UNCERTAINTY * found)


def tank_frequency(depth: float) -> float:
    """Lowest natural frequency of a rectangular tank, sigma sqrt(L/g). Args: `depth`: in widths L.

    A chamber whose radius is large against its width is such a tank under gravity: its Coriolis force
    vanishes beside waves that are many times faster than its rotation.
    """
    disc = Disc(
        outer_radius=_RADIUS,
        inner_radius=_RADIUS - 2 * depth,
        axial_width=1.0,
        central_angle=1 / _RADIUS,
        chambers=4,
        plate_thickness=0.0,
        max_fill_ratio=1.0,
        initial_fill=0.5,
    )
    surface = _RADIUS - depth
    lowest = sloshing_system(disc=disc, surface_radius=surface, cells=_CELLS).natural_frequencies()[0]
    # Gravity of the rotation is omega^2 a, so sigma = s omega = s sqrt(g/a).
    return float(lowest) / math.sqrt(surface)


KINDS: Final[Mapping[str, Kind]] = MappingProxyType(
    {
        "friction": Kind(
            title="Darcy friction factor of a long straight tube or duct at rest",
            measured="friction_factor",
            columns={"reynolds": "Reynolds number with the hydraulic diameter and the mean velocity"},
            optional={
                "relative_roughness": "ks/d, grain of the wall over the bore; smooth without this column",
                "aspect_ratio": "long over short side of a rectangular duct; 0, or no such column, "
                "for a tube",
            },
            predict=_friction,
        ),
        "tube_at_rest": Kind(
            title="pressure that drives liquid through a straight smooth tube at rest",
            measured="pressure",
            columns={
                "flow": "volume of liquid in a time",
                "bore": "of the tube",
                "length": "of the tube, whose entrance is rounded and whose outlet is open",
                "density": "of the liquid",
                "kinematic_viscosity": "of the liquid",
            },
            optional={"laminar": "1 where flow is known to be laminar, whatever Re; 0 without this column"},
            predict=_pressure,
        ),
        "vessel": Kind(
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
            predict=_vessel_time,
        ),
        "wave_frequency": Kind(
            title="lowest natural frequency of liquid in a rectangular tank, sigma sqrt(L/g)",
            measured="frequency_ratio",
            columns={"depth_over_width": "depth of the liquid over the width L of the tank"},
            predict=_frequency,
        ),
    }
)
"""Kinds of data that the program can predict."""
