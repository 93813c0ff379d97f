"""Kinds of measurement on test benches without a balancer, and their predictions, without a scene."""

from __future__ import annotations

import math
from collections.abc import Mapping
from functools import partial
from typing import Final

import numpy as np

from ringbalance.identification.kinds.kind import Kind, Observations, column, positive
from ringbalance.physics.gas import HEAT_CAPACITY_RATIO, GasLine
from ringbalance.physics.sloshing import FREQUENCY_UNCERTAINTY
from ringbalance.physics.sloshing_system import sloshing_system
from ringbalance.physics.tube.friction import friction_factor, friction_uncertainty
from ringbalance.physics.tube.local_losses import (
    entrance_loss,
    entrance_uncertainty,
    exit_loss,
    exit_uncertainty,
)
from ringbalance.scene.arrays import FloatArray
from ringbalance.scene.models import Disc, Tube

_WIDEST: Final = 20.0
"""Largest accepted ratio of long to short side of a duct."""
_TERMS: Final = 100
"""Upper limit of the odd terms n of a series that decrease with 1/n^5."""
_LAMINAR: Final = 100.0
"""Ratio of critical Re to the usual one for flow known to be laminar."""
_CONDUCTANCE_UNCERTAINTY: Final = 0.1
"""Relative expanded uncertainty (95 %) of a conductance from an area, by the discharge coefficient."""
_CRITICAL_RATIO: Final = 0.5
"""Default critical pressure ratio b: that of a sharp opening."""
_STEPS: Final = 2000
_RADIUS: Final = 1e4
"""Ratio of the chamber's radius to the width of the tank."""
_CELLS: Final = (8, 16)


Stated = tuple[FloatArray, FloatArray]
"""Prediction of each row, SI, and its expanded uncertainty (95 %) as stated by the program."""


def laminar_ratio(aspect_ratio: FloatArray) -> FloatArray:
    """Ratio of laminar friction of rectangular ducts to that of a tube of equal hydraulic diameter.

    f Re = 96/[(1 + 1/a)^2 (1 - 192/(pi^5 a) sum tanh(n pi a/2)/n^5)] over odd n, against 64.
    Args: `aspect_ratio`: long over short side; 0 for tubes.
    Source: Fourier series of the velocity across the short side.
    """
    a, n = np.maximum(aspect_ratio, 1.0), np.arange(1, _TERMS, 2)
    terms = np.sum(np.tanh(np.pi / 2 * n * a[:, None]) / n**5, axis=1)
    ratio = 1.5 / ((1 + 1 / a) ** 2 * (1 - 192 / (np.pi**5 * a) * terms))
    return np.where(aspect_ratio > 0, ratio, 1.0)


def _friction(data: Observations) -> Stated:
    none = np.zeros(len(data))
    aspect, roughness = (data.columns.get(name, none) for name in ("aspect_ratio", "relative_roughness"))
    reynolds, ratio = data.columns["reynolds"], laminar_ratio(aspect)

    factor, width = np.empty_like(reynolds), np.empty_like(reynolds)
    for wall in np.unique(roughness):
        rows = roughness == wall
        flow = {"reynolds": reynolds[rows], "laminar_ratio": ratio[rows]}
        factor[rows] = friction_factor(relative_roughness=float(wall), **flow)
        width[rows] = friction_uncertainty(relative_roughness=float(wall), **flow)
    return factor, width


def _pressure(data: Observations) -> Stated:
    """Pressure difference (rho u^2/2) (k + 1), Pa, k by friction, entrance and exit; no bend, no rotation."""
    columns = {"laminar": np.zeros(len(data)), **data.columns}
    reynolds, slenderness = tube_numbers(data)
    critical = np.where(columns["laminar"] > 0, _LAMINAR, 1.0)
    rows = zip(slenderness, reynolds, critical, strict=True)
    k, half_width = np.array([tube_loss(*(float(value) for value in row)) for row in rows]).T
    velocity = reynolds * columns["kinematic_viscosity"] / columns["bore"]
    dynamic = columns["density"] * velocity**2 / 2
    return dynamic * (k + 1), dynamic * half_width


def tube_numbers(data: Observations) -> tuple[FloatArray, FloatArray]:
    """Reynolds number and slenderness L/d of each row."""
    columns = data.columns
    velocity = columns["flow"] / (np.pi / 4 * columns["bore"] ** 2)
    return velocity * columns["bore"] / columns["kinematic_viscosity"], columns["length"] / columns["bore"]


def tube_loss(slenderness: float, reynolds: float, critical: float) -> tuple[float, float]:
    """Loss coefficient k of a smooth tube with rounded entrance, and its expanded uncertainty (95 %).

    Args: `slenderness`: L/d. `critical`: ratio of critical Re to the usual one.
    """
    tube = Tube(
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
    flow = {"reynolds": reynolds, "critical_ratio": critical}
    friction = {**flow, "relative_roughness": 0.0}
    values = slenderness * friction_factor(**friction), entrance_loss(tube=tube, **flow), exit_loss(**flow)
    half_widths = (
        slenderness * friction_uncertainty(**friction),
        entrance_uncertainty(tube=tube, **flow),
        exit_uncertainty(tube=tube, **flow),
    )
    return float(np.sum(values)), float(np.linalg.norm(half_widths))


def _vessel_time(data: Observations) -> Stated:
    """Filling or venting times of a gas vessel, s: mean of the isothermal and the adiabatic limit.

    The stated uncertainty covers both limits, since gas exchanges heat with the walls, and the conductance.
    With tau of `GasLine`, filling takes 1/gamma of the isothermal time when adiabatic; venting has dp/dt =
    -gamma (p/tau) sqrt(T/T_0) phi with T/T_0 = (p/p_start)^((gamma - 1)/gamma), integrated here.
    """
    columns = {"critical_ratio": np.full(len(data), _CRITICAL_RATIO), **data.columns}
    names = ("pressure", "start_pressure", "far_pressure", "temperature", "volume", "conductance")
    limits, gamma = np.empty((len(data), 2)), HEAT_CAPACITY_RATIO
    rows = zip(*(columns[name].tolist() for name in (*names, "critical_ratio")), strict=True)
    for row, (pressure, start, far, temperature, volume, conductance, b) in enumerate(rows):
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
            limits[row] = time, time / gamma
            continue
        begin, rest = line.venting_time(np.array([start, pressure]), volume=volume)
        falling: FloatArray = np.geomspace(1.0, pressure / start, _STEPS)
        phi = np.sqrt(np.maximum(1 - (np.maximum(far / start / falling - b, 0.0) / (1 - b)) ** 2, 0.0))
        cooled = falling ** ((gamma - 1) / (2 * gamma))
        adiabatic = float(-np.trapezoid(1 / (gamma * falling * cooled * phi), falling))
        limits[row] = float(begin - rest), line.time_constant(volume=volume) * adiabatic
    middle = limits.mean(axis=1)
    half = np.abs(limits[:, 1] - limits[:, 0]) / 2
    return middle, np.hypot(half, _CONDUCTANCE_UNCERTAINTY * middle)


def _no_duct(_: object, data: Observations) -> str:
    aspect = data.columns.get("aspect_ratio", np.zeros(1))
    return (
        "aspect_ratio is long over short side, from 1 on, or 0" if np.any((aspect > 0) & (aspect < 1)) else ""
    )


def _not_between(_: object, data: Observations) -> str:
    reached, start, far = (data.columns[name] for name in ("pressure", "start_pressure", "far_pressure"))
    between = np.all((reached - start) * (far - reached) > 0)
    return "" if between else "pressure must lie between start_pressure and far_pressure in every row"


def _frequency(data: Observations) -> Stated:
    depths, rows = np.unique(data.columns["depth_over_width"], return_inverse=True)
    frequencies = np.array([_tank_frequency(float(depth)) for depth in depths])[rows]
    return frequencies, FREQUENCY_UNCERTAINTY * frequencies


def _tank_frequency(depth: float) -> float:
    """Lowest natural frequency of a rectangular tank, sigma sqrt(L/g). Args: `depth`: over width L.

    A chamber of a radius much larger than its width is equivalent to such a tank under gravity: its waves are
    so much faster than its rotation that the Coriolis force is negligible.
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
    # Centrifugal acceleration is omega^2 a, so sigma = s omega = s sqrt(g/a).
    return float(lowest) / math.sqrt(surface)


_measured: Final = partial(positive, measured=True)
_optional: Final = partial(column, optional=True, lowest=0.0)
BENCH: Final[Mapping[str, Kind]] = {
    "friction": Kind(
        title="Darcy friction factor of a long straight tube or duct at rest",
        columns=(
            _measured("friction_factor", "measured"),
            positive("reynolds", "Reynolds number with the hydraulic diameter and the mean velocity"),
            _optional(
                "relative_roughness", "ks/d, grain of the wall over the bore; smooth without this column"
            ),
            _optional(
                "aspect_ratio",
                "long over short side of a rectangular duct; 0, or no such column, for a tube",
                highest=_WIDEST,
            ),
        ),
        stated=_friction,
        obstacle=_no_duct,
    ),
    "tube_at_rest": Kind(
        title="pressure that drives liquid through a straight smooth tube at rest",
        columns=(
            _measured("pressure [kPa]", "between both ends"),
            positive("flow [ml/s]", "volume of liquid in a time"),
            positive("bore [mm]", "of the tube"),
            positive("length [mm]", "of the tube, whose entrance is rounded and whose outlet is open"),
            positive("density [kg/m^3]", "of the liquid"),
            positive("kinematic_viscosity [mm^2/s]", "of the liquid"),
            _optional(
                "laminar",
                "1 where flow is known to be laminar, whatever Re; 0 without this column",
                highest=1.0,
                integer=True,
            ),
        ),
        stated=_pressure,
    ),
    "vessel": Kind(
        title="time in which a vessel fills with air or vents it, taken as an ideal gas",
        columns=(
            _measured("time [s]", "from the start"),
            positive("pressure [bar]", "reached after that time, absolute"),
            positive("start_pressure [bar]", "at time zero, absolute"),
            positive(
                "far_pressure [bar]",
                "at the other end of the line, absolute: of the supply, or the surroundings",
            ),
            positive("temperature [K]", "of the gas at the start"),
            positive("volume [l]", "of the vessel"),
            positive("conductance [l/(s*bar)]", "C of valve and line (ISO 6358), known to 10 %"),
            _optional("critical_ratio", "b of valve and line; 0.5 without this column", highest=0.999),
        ),
        stated=_vessel_time,
        obstacle=_not_between,
    ),
    "wave_frequency": Kind(
        title="lowest natural frequency of liquid in a rectangular tank, sigma sqrt(L/g)",
        columns=(
            _measured("frequency_ratio", "measured"),
            column(
                "depth_over_width",
                "depth of the liquid over the width L of the tank",
                lowest=0.01,
                highest=10.0,
            ),
        ),
        stated=_frequency,
    ),
    "vibration": Kind(
        title="vibration of a rotor with washers at one place",
        columns=(
            _measured("amplitude [um]", "zero to peak"),
            column("washers", "their number", lowest=0.0, highest=100.0),
        ),
    ),
}
