"""Every kind of measurement that is predicted, by its name in the data.

A prediction of a few lines stands here, a longer one in a module of its own.
"""

from __future__ import annotations

import cmath
from collections.abc import Callable, Mapping
from dataclasses import replace
from types import MappingProxyType
from typing import Any, Final

import numpy as np
from scipy.optimize import newton

from ringbalance.controller.eccentric_mass.plant import PlantParameters
from ringbalance.controller.eccentric_mass.scene_records import EccentricScene
from ringbalance.identification.data.measurements import Observations
from ringbalance.identification.predict.device import Device, Models, runs_back
from ringbalance.identification.predict.injections import INJECTION
from ringbalance.identification.predict.positionings import POSITIONING
from ringbalance.identification.predict.predicted import PredictedKind, always, parts, spread_out
from ringbalance.mesh.geometry import surface_radius
from ringbalance.physics.tube.loss import corrected_state
from ringbalance.scene.arrays import ComplexArray, FloatArray
from ringbalance.scene.models import Scene

_DONE: Final = 1e-10
"""In ln u."""


def _by_scene_alone(predict: Callable[[Any, Observations], FloatArray]) -> Callable[..., FloatArray]:
    """A prediction that takes no models."""
    return lambda scene, observations, _: predict(scene, observations)


def _vibrations(predict: Callable[[Any, Observations], FloatArray], **declared: Any) -> PredictedKind:
    """One measured vibration a row."""
    return PredictedKind(
        predict=_by_scene_alone(predict),
        measured=lambda observations: parts(observations.vectors()),
        covariance=lambda observations: spread_out(
            observations.vector_covariance(given="amplitude" in observations.uncertainty)
        ),
        noise_given=lambda observations: "amplitude" in observations.uncertainty,
        column=lambda _: "amplitude",
        **declared,
    )


def _trial_changes(scene: Scene, observations: Observations) -> FloatArray:
    """Change of the vibration by known unbalances, real and then imaginary parts, m, shape (2 n,).

    V = V0 + K U exp(j angle), K = kappa exp(-j lag).  V0 is that of the series and not of the scene: it is
    fitted with every parameter, and known beforehand to nobody.
    Source: Eq. 23 of the liquid-ring paper.
    """
    return parts(_change(scene, observations))


def _trial_amplitudes(scene: Scene, observations: Observations) -> FloatArray:
    """|V0 + K U exp(j angle)|, m zero to peak, shape (n,).

    Without a phase V0 cannot be eliminated: it is the scene's vibration at the start, and its amplitude and
    its phase are parameters.  Only its phase against K U matters, so that the phase and the lag are not
    identified by themselves.
    """
    start = cmath.rect(scene.rotor.initial_amplitude, scene.rotor.initial_phase)
    return np.asarray(np.abs(start + _change(scene, observations)))


def _change(scene: Scene, observations: Observations) -> ComplexArray:
    k = scene.rotor.influence
    unbalance = observations.columns["unbalance"] * np.exp(1j * observations.columns["angle"])
    return np.asarray(k * unbalance, dtype=np.complex128)


def _effect_of_starts(observations: Observations) -> FloatArray:
    """Effect of the two parts of every series' V0, shape (2 n, 2 series)."""
    names = np.unique(observations.series)
    belongs = (observations.series[:, None] == names[None, :]).astype(np.float64)
    return np.kron(np.eye(2), belongs)


def _transferred_column(observations: Observations) -> str:
    """Whether mass or volume was measured of the liquid that an injection moves."""
    return "mass" if "mass" in observations.columns else "volume"


def _transferred(scene: Scene, observations: Observations, models: Models) -> FloatArray:
    """V (x_before - x_after), m^3, times rho for a mass, kg, once the liquid rests again."""
    device = Device.of(scene, models)
    volume = device.law.chamber_volume * device.once(observations, _moved)
    return np.asarray(
        scene.liquid.density * volume if _transferred_column(observations) == "mass" else volume
    )


def _moved(device: Device, observations: Observations) -> FloatArray:
    columns, total = observations.columns, 2 * device.scene.disc.initial_fill
    rows = zip(columns["fill_ratio"], columns["pressure"], columns["gas_time"], strict=True)
    return np.array(
        [
            min(x, total)
            - device.injected(fill=min(float(x), total), chamber=0, pressure=float(p), gas_time=float(t))
            for x, p, t in rows
        ]
    )


def _flow_rates(scene: Scene, observations: Observations, models: Models) -> FloatArray:
    """Flow through the tube alone, at rest: (k + 1) rho u^2/2 = p, Q = S u, k without rotation.

    Returns: Q, m^3/s, shape (n,), by the secant in ln u.
    Source: definition of k, Eq. 14 of the liquid-ring paper, between two reservoirs at rest.
    """
    return Device.of(scene, models).once(observations, _flow_rate)


def _flow_rate(device: Device, observations: Observations) -> FloatArray:
    scene = device.scene
    head = observations.columns["pressure_difference"] / scene.liquid.density
    log_u = np.log(np.sqrt(2 * head / (_loss(scene, np.sqrt(head)) + 1)))

    def lacking(log_u: FloatArray) -> FloatArray:
        return np.asarray(np.log(_loss(scene, np.exp(log_u)) + 1) + 2 * log_u - np.log(2 * head))

    return np.asarray(scene.tube.area * np.exp(newton(lacking, log_u, tol=_DONE)))


def _loss(scene: Scene, velocity: FloatArray) -> FloatArray:
    """k of the tube at rest."""
    return corrected_state(replace(scene, rotor=replace(scene.rotor, speed=0.0)), velocity).k


def _pressures(scene: Scene, observations: Observations) -> FloatArray:
    """Pressure of the turning liquid over that of its gas, rho omega^2 (r^2 - a^2)/2; zero above the liquid.

    Returns: Pa, shape (n,). Source: Eq. 11 of the liquid-ring paper, integrated.
    """
    columns = observations.columns
    surface = columns.get("surface_radius")
    if surface is None:
        surface = surface_radius(disc=scene.disc, fill_ratio=columns["fill_ratio"])
    speed = columns.get("speed", np.full(len(observations), scene.rotor.speed))
    depth = np.maximum(columns["radius"] ** 2 - surface**2, 0.0)
    return np.asarray(scene.liquid.density * speed**2 * depth / 2)


def _steady_whirls(scene: EccentricScene, observations: Observations) -> FloatArray:
    """Vibration over the speed, both eccentric masses clamped where they stand at the start.

    At constant speed, as in a run-up that is slow against the decay of the rotor's motion.
    Returns: in the rotor's frame, real and then imaginary parts, m, shape (2 n,).
    """
    plant, angles = PlantParameters.of(scene), scene.masses.initial_angle
    speeds = observations.columns["speed"].tolist()
    return parts(np.array([plant.steady_whirl(speed, angles) for speed in speeds], dtype=np.complex128))


PREDICTED: Final[Mapping[str, PredictedKind]] = MappingProxyType(
    {
        "trial_weight": _vibrations(
            _trial_changes,
            informs=always("influence_coefficient", "lag_angle"),
            free=_effect_of_starts,
        ),
        "trial_amplitude": PredictedKind.numbers(
            lambda _: "amplitude",
            predict=_by_scene_alone(_trial_amplitudes),
            informs=always("influence_coefficient", "initial_amplitude", "initial_phase"),
        ),
        "injection": INJECTION,
        "transfer": PredictedKind.numbers(
            _transferred_column,
            predict=_transferred,
            informs=always("bore", "extra_loss"),
            obstacle=runs_back,
        ),
        "flow": PredictedKind.numbers(
            lambda _: "flow_rate", predict=_flow_rates, informs=always("bore", "extra_loss")
        ),
        "pressure": PredictedKind.numbers(
            lambda _: "pressure", predict=_by_scene_alone(_pressures), informs=always("density")
        ),
        "run_up": _vibrations(
            _steady_whirls,
            informs=always("rotor.stiffness", "rotor.damping", "imbalance.mass", "imbalance.phase"),
        ),
        "positioning": POSITIONING,
    }
)
