"""The gains that bring the masses to their targets: linear-quadratic, continuous or for a held input.

With whirl and friction compensated, each mass is its own: (J + J_add) phi'' + C_add phi' = u.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import numpy.typing as npt
from scipy.linalg import expm, solve_continuous_are, solve_discrete_are

from ringbalance.controller.eccentric_mass.estimation.friction_filter import TrackModel
from ringbalance.scene.arrays import ComplexArray, FloatArray


class LqrGain(NamedTuple):
    """A linear-quadratic regulator, u = -K [phi - phi_d, phi']."""

    gain: FloatArray
    """K, shape (2, 4), N m/rad and N m s/rad, for the states (phi_1, phi_2, phi_1', phi_2')."""
    riccati: FloatArray
    """P of the Riccati equation, shape (4, 4)."""
    poles: ComplexArray
    """Of the closed loop, 1/s, shape (4,); of a held input, log of those per step over the step."""


def paper_weights(*, state_weight: float, input_weight: float) -> tuple[FloatArray, FloatArray]:
    """Q = q diag(0.1, 0.1, 0.01, 0.01) and R = r diag(0.1, 0.1).

    Args: `state_weight`: q, above zero. `input_weight`: r, above zero.
    Returns: Q, shape (4, 4), and R, shape (2, 2).
    Raises: ValueError: a weight that is not above zero.
    Source: section 4 of the paper on eccentric masses.
    """
    if not (state_weight > 0 and input_weight > 0):
        raise ValueError("the weights q and r must be above zero")
    return state_weight * np.diag([0.1, 0.1, 0.01, 0.01]), input_weight * np.diag([0.1, 0.1])


def track_matrices(track: TrackModel) -> tuple[FloatArray, FloatArray]:
    """A and B of X' = A X + B u for both masses.

    Args: `track`: inertia and damping of each mass with its drive.
    Returns: A, shape (4, 4), and B, shape (4, 2).
    Source: Eq. 42 of the paper on eccentric masses; its back-EMF lost the minus sign.
    """
    zero, one = np.zeros((2, 2)), np.eye(2)
    a = np.block([[zero, one], [zero, -track.damping / track.inertia * one]])
    return a, np.vstack([zero, one / track.inertia])


def lqr_gain(*, track: TrackModel, state_weight: float, input_weight: float) -> LqrGain:
    """Gain for an input that changes at every instant.

    A^T P + P A - P B R^-1 B^T P + Q = 0, K = R^-1 B^T P.
    Args: `track`: inertia and damping of each mass with its drive. `state_weight`: q, above zero.
        `input_weight`: r, above zero.
    Raises: ValueError: a weight that is not above zero.
    Source: Eqs. 42 to 49 of the paper on eccentric masses.
    """
    q, r = paper_weights(state_weight=state_weight, input_weight=input_weight)
    a, b = track_matrices(track)
    riccati = solve_continuous_are(a, b, q, r)
    gain = np.linalg.solve(r, b.T @ riccati)
    return LqrGain(gain, riccati, _sorted(np.linalg.eigvals(a - b @ gain)))


def lqr_gain_discrete(*, track: TrackModel, state_weight: float, input_weight: float, step: float) -> LqrGain:
    """Gain for an input that is held over a step, with the same cost integral.

    Cost and motion over one step follow from one matrix exponential; the cross weight of state and input
    that holding brings is kept.
    Args: `track`: inertia and damping of each mass with its drive. `state_weight`: q, above zero.
        `input_weight`: r, above zero. `step`: for which the input is held, s, above zero.
    Raises: ValueError: a weight or a step that is not above zero.
    Source: Van Loan, "Computing integrals involving the matrix exponential", IEEE Trans. Automat. Contr. 23
    (1978).
    """
    if not step > 0:
        raise ValueError("the step must be above zero")
    q, r = paper_weights(state_weight=state_weight, input_weight=input_weight)
    a, b = track_matrices(track)
    whole = np.block([[a, b], [np.zeros((2, 6))]])
    cost = np.block([[q, np.zeros((4, 2))], [np.zeros((2, 4)), r]])
    power = expm(np.block([[-whole.T, cost], [np.zeros((6, 6)), whole]]) * step)
    move = power[6:, 6:]
    weight = move.T @ power[:6, 6:]
    f, g, s = move[:4, :4], move[:4, 4:], weight[:4, 4:]
    riccati = solve_discrete_are(f, g, _even(weight[:4, :4]), _even(weight[4:, 4:]), s=s)
    gain = np.linalg.solve(_even(weight[4:, 4:]) + g.T @ riccati @ g, g.T @ riccati @ f + s.T)
    multipliers = np.linalg.eigvals(f - g @ gain).astype(np.complex128)
    return LqrGain(gain, riccati, _sorted(np.log(multipliers) / step))


def _even(matrix: FloatArray) -> FloatArray:
    return 0.5 * (matrix + matrix.T)


def _sorted(values: npt.ArrayLike) -> ComplexArray:
    found = np.asarray(values, dtype=np.complex128)
    return found[np.lexsort((found.imag, found.real))]
