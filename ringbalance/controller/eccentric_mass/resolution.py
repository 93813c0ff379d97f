"""Uncertainty of the estimated imbalance by the uncertainty of the rotor.

In a steady whirl the filter estimates (D_b/D)(theta + p) - p_b, with D = K_B - M W^2 + j C_B W of the rotor,
p = b sum exp(j phi_i) of the masses, and D_b, p_b as configured.  The initial transient, which enters the
estimation as well, increases the error by a wrong bearing by up to half.  Therefore the filter is run,
without noise, on the whirl of a rotor with one input off by one standard deviation; the change of the
estimate counts.
"""

from __future__ import annotations

import numpy as np

from ringbalance.controller.eccentric_mass.imbalance_filter import (
    WhirlModel,
    imbalance_filter,
    imbalance_history,
    locked_masses,
    whirl_transition,
)
from ringbalance.controller.eccentric_mass.plant import PlantParameters
from ringbalance.controller.eccentric_mass.scene_records import EccentricScene
from ringbalance.controller.eccentric_mass.settings import filter_settings, off_by_one
from ringbalance.scene.arrays import FloatArray

_MAX_STEPS = 2_000
"""Largest number of steps of the simulated estimation; longer steps have proportionally less noise."""
_INPUTS = ("rotor.mass", "rotor.stiffness", "rotor.damping", "masses.mass", "masses.guide_radius")


def rotor_covariance(
    scene: EccentricScene, *, imbalance: complex, speed: float, begin: float, duration: float
) -> FloatArray:
    """Covariance of an estimated imbalance by the stated uncertainties of rotor and masses, kg^2 m^2.

    Args: `imbalance`: value from the filter, kg m. `speed`: speed during the estimation, rad/s. `begin`,
    `duration`: of the estimation, s.
    Returns: Shape (2, 2), along the rotor's axes; zero without stated uncertainties, and for a rotor at rest.
    """
    covariance, plants = np.zeros((2, 2)), list(off_by_one(scene, _INPUTS))
    if speed == 0 or not plants:
        return covariance
    step = max(scene.imbalance_filter.step, duration / _MAX_STEPS)
    count = max(round(duration / step), 1)
    settings = filter_settings(scene)._replace(step=step, euler=False)
    constants, assumed = imbalance_filter(settings, speeds=speed), scene.imbalance_filter
    variance = np.repeat([assumed.position_noise**2, assumed.velocity_noise**2], 2) * (assumed.step / step)
    masses = locked_masses(PlantParameters.of(scene).mass_vector(scene.masses.initial_angle))

    def estimated(plant: EccentricScene) -> FloatArray:
        """Imbalance that the filter estimates on this rotor, started from rest, kg m along both axes."""
        true = PlantParameters.of(plant)
        model = WhirlModel(true.mass, true.damping, true.stiffness)
        drive = imbalance + true.mass_vector(plant.masses.initial_angle)
        state = np.array([0.0, 0.0, 0.0, 0.0, drive.real, drive.imag])
        if begin > 0:
            state = whirl_transition(model, speed, begin) @ state
        transition, whirls = whirl_transition(model, speed, step), np.empty((count, 6))
        for i in range(count):
            state = transition @ state
            whirls[i] = state
        samples = whirls @ constants.observation[0].T
        states, _ = imbalance_history(constants, samples=samples, variance=variance, masses=masses)
        return np.asarray(states[-1, 4:6])

    nominal = estimated(scene)
    for plant in plants:
        change = estimated(plant) - nominal
        covariance += np.outer(change, change)
    return covariance
