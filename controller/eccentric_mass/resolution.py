"""How well the filter can know the imbalance by what is not known of the rotor.

In a steady whirl the filter finds (D_b/D)(theta + p) - p_b, with D = K_B - M W^2 + j C_B W of the rotor, D_b
as configured and p = b sum exp(j phi_i) of the masses.  An estimation takes in the start's transient as well,
from which a wrong bearing takes up to half as much again: so the filter is given, without noise, the whirl of
a rotor that is one standard deviation off in one input, and what it then finds differently counts.
"""

from __future__ import annotations

import cmath

import numpy as np

from ringbalance.controller.eccentric_mass.control_records import ImbalanceFilter
from ringbalance.controller.eccentric_mass.imbalance_filter import (
    FilterMatrices,
    ImbalanceEstimate,
    MassInput,
    ProcessNoise,
    WhirlModel,
    filter_matrices,
    imbalance_history,
    start_estimate,
    whirl_transition,
)
from ringbalance.controller.eccentric_mass.scene_records import EccentricScene
from ringbalance.controller.eccentric_mass.settings import believed_whirl
from ringbalance.scene.arrays import FloatArray
from ringbalance.scene.origins import value_at, with_values_at
from ringbalance.scene.uncertain import NORMAL_95

_LONGEST_STEPS = 2_000
"""Steps in which an estimation is repeated; with fewer than the filter takes, each carries less noise."""
_INPUTS = ("rotor.mass", "rotor.stiffness", "rotor.damping", "masses.mass", "masses.guide_radius")


def _start(told: ImbalanceFilter) -> ImbalanceEstimate:
    return start_estimate(told.initial_position, told.initial_velocity, told.initial_unbalance)


def _process_noise(told: ImbalanceFilter) -> ProcessNoise:
    return ProcessNoise(told.velocity_walk**2, told.unbalance_walk**2)


def _variance(told: ImbalanceFilter, share: float) -> FloatArray:
    """Of each sensor, times a share."""
    return np.repeat([told.position_noise**2, told.velocity_noise**2], 2) * share


def rotor_covariance(
    scene: EccentricScene, *, imbalance: complex, speed: float, begin: float, duration: float
) -> FloatArray:
    """Covariance that the stated uncertainties of rotor and masses give an imbalance, kg^2 m^2.

    Args: `imbalance`: estimated, kg m. `speed`: at which it was estimated, rad/s. `begin`, `duration`: of the
    estimation, s.
    Returns: Shape (2, 2), along the rotor's axes; zero without stated uncertainties, and for a rotor at rest.
    """
    found = np.zeros((2, 2))
    stated = [each for each in scene.uncertainty if each.quantity in _INPUTS]
    if speed == 0 or not stated:
        return found
    step = max(scene.imbalance_filter.step, duration / _LONGEST_STEPS)
    count = max(round(duration / step), 1)
    told, laboratory = scene.imbalance_filter, scene.sensor.frame == "laboratory"
    matrices = filter_matrices(believed_whirl(scene), _process_noise(told), speed, step, laboratory, False)

    def estimated(plant: EccentricScene) -> FloatArray:
        samples = _samples(plant, matrices, imbalance, begin=begin, step=step, count=count)
        return _found(scene, matrices, samples, share=told.step / step)

    middle = estimated(scene)
    for each in stated:
        value = value_at(scene, each.quantity)
        off = value + each.absolute(value) / NORMAL_95
        plant = with_values_at(scene, {each.quantity: off})
        change = estimated(plant) - middle
        found += np.outer(change, change)
    return found


def _place(scene: EccentricScene) -> complex:
    """p = b sum exp(j phi_i) of the masses where they start, kg m."""
    moment = scene.masses.mass * scene.masses.guide_radius
    return moment * sum(cmath.exp(1j * angle) for angle in scene.masses.initial_angle)


def _samples(
    plant: EccentricScene,
    matrices: FilterMatrices,
    imbalance: complex,
    *,
    begin: float,
    step: float,
    count: int,
) -> FloatArray:
    """What the sensors show of a rotor that starts from rest, without noise, shape (n, 4)."""
    rotor = plant.rotor
    model = WhirlModel(rotor.mass + 2 * plant.masses.mass, rotor.damping, rotor.stiffness)
    drive = imbalance + _place(plant)
    state = np.array([0.0, 0.0, 0.0, 0.0, drive.real, drive.imag])
    if begin > 0:
        state = whirl_transition(model, matrices.speed, begin) @ state
    onward = whirl_transition(model, matrices.speed, step)
    states = np.empty((count, 6))
    for i in range(count):
        state = onward @ state
        states[i] = state
    return np.asarray(states @ matrices.observation.T)


def _found(
    scene: EccentricScene, matrices: FilterMatrices, samples: FloatArray, *, share: float
) -> FloatArray:
    """The filter's imbalance at the end, shape (2,). Args: `share`: of the variance of one sample."""
    told, place = scene.imbalance_filter, _place(scene)
    states, _ = imbalance_history(
        _start(told),
        matrices=matrices,
        samples=samples,
        variance=_variance(told, share),
        masses=MassInput(place, 0.0j, np.zeros((2, 2)), 0.0),
    )
    return np.asarray(states[-1, 4:6])
