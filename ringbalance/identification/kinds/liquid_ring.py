"""Kinds of measurement on a rotor with a liquid ring, and their predictions by its scene.

Injections of a series follow each other: each starts from the fill that the last one leaves, the first from
the scene's initial fill, unless a row states the fill of its chamber.
Source: Eqs. 11, 14 and 21 to 23 of the liquid-ring paper, with the program's own law and moments.
"""

from __future__ import annotations

import cmath
import math
from collections.abc import Mapping
from dataclasses import replace
from functools import partial
from typing import Final

import numpy as np
from scipy.optimize import newton

from ringbalance.controller.balancer import balancer_of
from ringbalance.controller.rotor import chamber_directions, chamber_letters
from ringbalance.identification.device import ModelledDevice, Models, runs_back
from ringbalance.identification.kinds.kind import (
    Grid,
    Kind,
    Observations,
    Ranges,
    always,
    amplitude,
    angle,
    column,
    measured,
    parts,
    phase,
    positive,
)
from ringbalance.mesh.geometry import chamber_volume, surface_radius
from ringbalance.physics.tube.loss import corrected_state
from ringbalance.scene.arrays import ComplexArray, FloatArray, IntArray
from ringbalance.scene.models import Scene
from ringbalance.scene.origins import SceneFile

_DONE: Final = 1e-10
"""Change of ln u at which the iteration ends."""
_FRACTIONS: Final = (0.3, 0.5, 0.7)
"""Candidate fills over the largest fill."""
_PRESSURES: Final = (0.8, 1.0, 1.25)
"""Candidate pressures over the scene's gas pressure."""
_VALVE_OPEN_TIMES_S: Final = (0.05, 0.2, 0.8)
_WEIGHTS: Final = (0.5, 1.0, 2.0)
"""Candidate trial weights over the unbalance of the initial vibration."""


def _trial_changes(scene: SceneFile, observations: Observations, _: object) -> FloatArray:
    """Change of the vibration by known unbalances, m.

    V = V0 + K U exp(j angle), K = kappa exp(-j lag).  V0 is that of the series, not of the scene: an
    unknown without a prior that is eliminated in every fit.
    """
    return parts(balancer_of(scene).rotor().influence * _weights(observations))


def _trial_amplitudes(scene: Scene, observations: Observations, _: object) -> FloatArray:
    """|V0 + K U exp(j angle)|, m zero to peak.

    Without a phase V0 cannot be eliminated: it is the scene's initial vibration as read, with amplitude and
    phase of the rotor's as parameters.  Only its phase relative to K U has an effect, so that neither the
    phase nor the lag is identified alone.
    """
    rotor = scene.rotor_as_read
    start = cmath.rect(rotor.initial_amplitude, rotor.initial_phase)
    return np.asarray(np.abs(start + rotor.influence * _weights(observations)))


def _phase_of_runout_unknown(scene: Scene, _: Observations) -> str:
    """Reason why amplitudes alone tell no vibration of the rotor; empty if they do."""
    if scene.sensor.runout_amplitude is None or scene.sensor.runout_phase is not None:
        return ""
    return "the amplitudes contain sensor.runout, whose phase the scene does not state"


def _weights(observations: Observations) -> ComplexArray:
    """Trial weights U exp(j angle), kg m."""
    return np.asarray(observations.columns["unbalance"] * np.exp(1j * observations.columns["angle"]))


def _effect_of_starts(observations: Observations) -> FloatArray:
    """Effect of real and imaginary part of each series' V0, shape (2 n, 2 series)."""
    names = np.unique(observations.series)
    return np.kron(np.eye(2), (observations.series[:, None] == names).astype(np.float64))


def _injections(scene: Scene, observations: Observations, models: Models) -> FloatArray:
    """Change of the vibration, K [M(x_after) - M(x_before)] e_pair, m.

    M is the moment of the pair of chambers that the gas acts on, e its direction.
    """
    device = ModelledDevice.of(scene, models)
    fills, moment = device.once(observations, _fills), device.law.moment
    before, after = moment.pair_vector(
        fill_ratio=fills, opposite_fill_ratio=2 * scene.disc.initial_fill - fills
    )
    pair = _chamber_numbers(scene, observations) % (scene.disc.chambers // 2)
    moved = scene.disc.moment_factor * (after - before) * chamber_directions(scene.disc.chambers)[pair]
    return parts(scene.rotor.influence * moved)


def _chamber_numbers(scene: Scene, observations: Observations) -> IntArray:
    """Index of the driven chamber of each row."""
    letters = chamber_letters(scene.disc.chambers)
    return np.array([letters.index(letter) for letter in observations.chamber], dtype=np.int64)


def _fills(device: ModelledDevice, observations: Observations) -> FloatArray:
    """Fill of the positive chamber of each row's pair before and after, shape (2, n)."""
    disc, columns = device.scene.disc, observations.columns
    half, total = disc.chambers // 2, 2 * disc.initial_fill
    numbers, fill = (
        _chamber_numbers(device.scene, observations),
        np.full(len(observations), disc.initial_fill),
    )
    follows = list(range(len(observations)))
    if "fill_ratio" in columns:
        stated = np.minimum(columns["fill_ratio"], total)
        fill = np.where(numbers < half, stated, total - stated)
    else:
        last: dict[tuple[str, int], int] = {}
        for i, pair in enumerate(zip(observations.series.tolist(), (numbers % half).tolist(), strict=True)):
            follows[i] = last.get(pair, i)
            last[pair] = i
    return device.injected(
        fill=fill,
        follows=follows,
        chamber=numbers // half,
        pressure=columns["pressure"],
        gas_time=columns["gas_time"],
    )


def _transferred(scene: Scene, observations: Observations, models: Models) -> FloatArray:
    """Transferred volume V (x_before - x_after), m^3, or mass, kg, after the liquid has come to rest."""
    device = ModelledDevice.of(scene, models)
    volume = device.law.chamber_volume * device.once(observations, _moved)
    return np.asarray(scene.liquid.density * volume if "mass" in observations.columns else volume)


def _moved(device: ModelledDevice, observations: Observations) -> FloatArray:
    columns = observations.columns
    before, after = device.injected(
        fill=np.minimum(columns["fill_ratio"], 2 * device.scene.disc.initial_fill),
        chamber=0,
        pressure=columns["pressure"],
        gas_time=columns["gas_time"],
    )
    return np.asarray(before - after)


def _flow_rate(device: ModelledDevice, observations: Observations) -> FloatArray:
    """Flow through the tube alone, at rest: (k + 1) rho u^2/2 = p, Q = S u, k without rotation, m^3/s.

    Secant method in ln u. Source: definition of k, between two reservoirs at rest.
    """
    still = replace(device.scene, rotor=replace(device.scene.rotor, speed=0.0))
    head = observations.columns["pressure_difference"] / still.liquid.density
    log_u = np.log(np.sqrt(2 * head / (corrected_state(still, np.sqrt(head)).k + 1)))

    def lacking(log_u: FloatArray) -> FloatArray:
        k = corrected_state(still, np.exp(log_u)).k
        return np.asarray(np.log(k + 1) + 2 * log_u - np.log(2 * head))

    return np.asarray(still.tube.area * np.exp(newton(lacking, log_u, tol=_DONE)))


def _pressures(scene: Scene, observations: Observations, _: object) -> FloatArray:
    """Excess pressure of the rotating liquid over its gas, rho omega^2 (r^2 - a^2)/2, Pa; zero in the gas."""
    columns = observations.columns
    surface = columns.get("surface_radius")
    if surface is None:
        surface = surface_radius(disc=scene.disc, fill_ratio=columns["fill_ratio"])
    speed = columns.get("speed", scene.rotor.speed)
    depth = np.maximum(columns["radius"] ** 2 - surface**2, 0.0)
    return np.asarray(scene.liquid.density * speed**2 * depth / 2)


def _ranges(scene: Scene) -> Ranges:
    gas, volume = scene.gas.pressure, chamber_volume(disc=scene.disc)
    fastest = math.sqrt(2 * gas / scene.liquid.density)
    return {
        **_ranges_of_rotor(scene),
        "gas_time": (scene.controller.minimum_gas_time, scene.controller.maximum_gas_time),
        "mass": (0.0, scene.liquid.density * volume),
        "volume": (0.0, volume),
        "flow_rate": (0.0, scene.tube.area * fastest),
        "pressure_difference": (gas * 1e-3, gas),
        "pressure": (gas, gas),
    }


def _ranges_of_rotor(scene: SceneFile) -> Ranges:
    rotor = balancer_of(scene).rotor()
    low, high, kappa = rotor.limit, max(rotor.amplitude, rotor.limit), abs(rotor.influence)
    amplitudes = ("amplitude", "amplitude_before", "amplitude_after")
    return {**dict.fromkeys(amplitudes, (low, high)), "unbalance": (low / kappa, high / kappa)}


def _ranges_of_liquid(scene: Scene) -> Ranges:
    disc, speed = scene.disc, scene.rotor.speed
    return {
        "radius": (0.0, disc.outer_radius),
        "surface_radius": (disc.inner_radius, disc.outer_radius),
        "speed": (speed, speed),
        "pressure": (0.0, scene.liquid.density * (speed * disc.outer_radius) ** 2 / 2),
    }


def _some_weights(scene: SceneFile) -> Grid:
    unbalance = abs(balancer_of(scene).rotor().unbalance)
    return {"unbalance": [x * unbalance for x in _WEIGHTS], "angle": [0.0, np.pi / 2, np.pi]}


def _some_injections(scene: Scene) -> Grid:
    pressures = [x * scene.gas.pressure for x in _PRESSURES]
    return {"fill_ratio": _some_fills(scene), "pressure": pressures, "gas_time": _VALVE_OPEN_TIMES_S}


def _some_fills(scene: Scene) -> list[float]:
    return [x * scene.disc.max_fill_ratio for x in _FRACTIONS]


_kind: Final = partial(Kind, balancer="liquid_ring", ranges=_ranges)
_FILL: Final = partial(column, "fill_ratio", lowest=0.0, highest=1.0)
_GAS: Final = positive("pressure [MPa]", "gas pressure in the driven chamber, gauge")
# Of the order of the time in which a chamber of oil is emptied; larger values are milliseconds.
_GAS_TIME: Final = positive("gas_time [ms]", "valve-open time", highest=100.0)
_WEIGHT: Final = (
    column("unbalance [g*mm]", "of the trial weight, mass times radius; 0 is the run without it", lowest=0.0),
    angle("angle [deg]", "of the trial weight on the rotor, positive with the rotation"),
    amplitude("amplitude [um]", "of the vibration"),
)
LIQUID_RING: Final[Mapping[str, Kind]] = {
    "trial_weight": _kind(
        title="vibration with a known unbalance on the rotor",
        any_rotor=True,
        columns=(*_WEIGHT, phase("phase [deg]")),
        predict=_trial_changes,
        informs=always("influence_coefficient", "lag_angle"),
        free=_effect_of_starts,
        offers=_some_weights,
        ranges=_ranges_of_rotor,
    ),
    "trial_amplitude": _kind(
        title="amplitude alone of the vibration with a known unbalance on the rotor",
        columns=_WEIGHT,
        predict=_trial_amplitudes,
        obstacle=_phase_of_runout_unknown,
        informs=always("influence_coefficient", "initial_amplitude", "initial_phase"),
        offers=_some_weights,
    ),
    "injection": _kind(
        title="vibration before and after one injection of gas",
        has_chamber=True,
        columns=(
            _GAS_TIME,
            _GAS,
            amplitude("amplitude_before [um]", "of the vibration before the injection"),
            phase("phase_before [deg]"),
            amplitude("amplitude_after [um]", "of the vibration after it"),
            phase("phase_after [deg]"),
            _FILL(
                meaning="fill ratio of the driven chamber before; without this column it follows from the "
                "injections above in the same series, and at first from the scene's initial_fill",
                optional=True,
            ),
        ),
        predict=_injections,
        informs=always("lambda_factor", "bore", "extra_loss"),
        obstacle=runs_back,
        offers=_some_injections,
    ),
    "transfer": _kind(
        title="liquid that one injection moves, weighed or measured by volume",
        columns=(
            _FILL(meaning="fill ratio of the driven chamber before"),
            _GAS,
            _GAS_TIME,
            measured("mass [g]", "moved, weighed", lowest=0.0),
            measured("volume [ml]", "moved, measured by volume", lowest=0.0),
        ),
        one_of=("mass", "volume"),
        predict=_transferred,
        informs=always("bore", "extra_loss"),
        obstacle=runs_back,
        offers=_some_injections,
    ),
    "flow": _kind(
        title="flow through the tube alone, at rest",
        columns=(
            positive("pressure_difference [kPa]", "between the ends of the tube"),
            positive("flow_rate [ml/s]", "volume flow", measured=True),
        ),
        predict=lambda scene, data, models: ModelledDevice.of(scene, models).once(data, _flow_rate),
        informs=always("bore", "extra_loss"),
        offers=lambda scene: {"pressure_difference": [x * scene.gas.pressure for x in (0.1, 0.3, 1.0)]},
    ),
    "pressure": _kind(
        title="pressure of the turning liquid at a wall or port",
        columns=(
            positive("radius [mm]", "of the place where the pressure is measured"),
            _FILL(meaning="fill ratio of the chamber"),
            positive("surface_radius [mm]", "of the free surface"),
            positive("speed [rpm]", "of the rotor; that of the scene without this column", optional=True),
            measured("pressure [kPa]", "measured, over that of the gas in the chamber", lowest=0.0),
        ),
        one_of=("fill_ratio", "surface_radius"),
        predict=_pressures,
        informs=always("density"),
        offers=lambda scene: {"fill_ratio": _some_fills(scene), "radius": [scene.disc.outer_radius]},
        ranges=_ranges_of_liquid,
    ),
}
