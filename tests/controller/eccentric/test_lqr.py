"""Regulator gains against Hamiltonian eigenvectors, closed forms, and simulated costs."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.linalg import expm

from ringbalance.controller.eccentric_mass.estimation.friction_filter import TrackModel
from ringbalance.controller.eccentric_mass.strategy.lqr import (
    lqr_gain,
    lqr_gain_discrete,
    paper_weights,
    track_matrices,
)

TRACKS = [TrackModel(0.0112, 0.16, 0.0414), TrackModel(0.5, 0.0, 0.1), TrackModel(0.01, 2.0, 0.03)]
PAPER = TRACKS[0]


@pytest.mark.parametrize("track", TRACKS)
@pytest.mark.parametrize("weight", [0.5, 3.5, 40.0])
def test_gain_is_that_of_the_hamiltonians_stable_eigenvectors(track: TrackModel, weight: float) -> None:
    a, b = track_matrices(track)
    q, r = paper_weights(state_weight=weight, input_weight=2.0)
    hamiltonian = np.block([[a, -b @ np.linalg.inv(r) @ b.T], [-q, -a.T]])
    values, vectors = np.linalg.eig(hamiltonian)
    stable = vectors[:, values.real < 0]
    riccati = (stable[4:] @ np.linalg.inv(stable[:4])).real
    found = lqr_gain(track=track, state_weight=weight, input_weight=2.0)
    np.testing.assert_allclose(found.riccati, riccati, rtol=1e-8, atol=1e-12)
    np.testing.assert_allclose(found.gain, np.linalg.inv(r) @ b.T @ riccati, rtol=1e-8, atol=1e-10)
    assert np.all(found.poles.real < 0)


def test_gain_in_closed_form() -> None:
    """One mass: k_p = sqrt(q/r), k_d = -C + sqrt(C^2 + 2 J k_p + 0.1 q/r)."""
    found = lqr_gain(track=PAPER, state_weight=3.5, input_weight=1.0).gain
    k_p = math.sqrt(3.5)
    k_d = -PAPER.damping + math.sqrt(PAPER.damping**2 + 2 * PAPER.inertia * k_p + 0.35)
    expected = np.array([[k_p, 0, k_d, 0], [0, k_p, 0, k_d]])
    np.testing.assert_allclose(found, expected, rtol=1e-9, atol=1e-12)


def cost(gain: np.ndarray, step: float) -> float:
    """Integral cost of a held input from a fixed start, by fine steps of the exact motion."""
    a, b = track_matrices(PAPER)
    q, r = paper_weights(state_weight=3.5, input_weight=1.0)
    parts = 20
    fine = expm(np.block([[a, b], [np.zeros((2, 6))]]) * step / parts)
    state, total = np.array([1.0, -0.5, 0.0, 0.3]), 0.0
    for _ in range(int(6.0 / step)):
        held = -gain @ state
        for part in range(parts + 1):
            share = step / parts * (0.5 if part in {0, parts} else 1.0)
            total += share * (state @ q @ state + held @ r @ held)
            if part < parts:
                state = fine[:4, :4] @ state + fine[:4, 4:] @ held
    return total


def test_a_held_input_wants_the_discrete_gain() -> None:
    """Which costs less than the continuous one when held for long, and is the same when held briefly."""
    step = 0.03
    continuous = lqr_gain(track=PAPER, state_weight=3.5, input_weight=1.0)
    discrete = lqr_gain_discrete(track=PAPER, state_weight=3.5, input_weight=1.0, step=step)
    best = cost(discrete.gain, step)
    assert best < cost(continuous.gain, step)
    for change in (0.97, 1.03):
        assert best < cost(discrete.gain * change, step)
    short = lqr_gain_discrete(track=PAPER, state_weight=3.5, input_weight=1.0, step=1e-6)
    np.testing.assert_allclose(short.gain, continuous.gain, rtol=1e-3, atol=1e-9)
    np.testing.assert_allclose(short.poles, continuous.poles, rtol=1e-3)


def test_the_back_emf_printed_without_its_sign_is_another_plant() -> None:
    """Eq. 10 lost its minus signs: a mass that its own motor drives on has another gain."""
    wrong = PAPER._replace(damping=-PAPER.damping)
    right = lqr_gain(track=PAPER, state_weight=3.5, input_weight=1.0).gain
    other = lqr_gain(track=wrong, state_weight=3.5, input_weight=1.0).gain
    assert other[0, 2] > right[0, 2] + 0.3


@pytest.mark.parametrize("weights", [(0.0, 1.0), (1.0, 0.0), (-1.0, 1.0), (1.0, math.nan)])
def test_weights_must_be_above_zero(weights: tuple[float, float]) -> None:
    with pytest.raises(ValueError, match="above zero"):
        lqr_gain(track=PAPER, state_weight=weights[0], input_weight=weights[1])


def test_a_step_must_be_above_zero() -> None:
    with pytest.raises(ValueError, match="step"):
        lqr_gain_discrete(track=PAPER, state_weight=1.0, input_weight=1.0, step=0.0)
