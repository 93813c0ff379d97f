"""One step in time: what makes its order and its damping, and the tables that it looks things up in."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from ringbalance.reduced_model.injection import column, step
from ringbalance.reduced_model.injection.dynamics import Dynamics
from ringbalance.reduced_model.law.flow_law import BalancerModel
from ringbalance.reduced_model.pieces.point import SIPHON, THERE


def plain_form() -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Weights in the states, in states and Jacobian together, in the end and in the error.

    The program's own are transformed so that no product with the Jacobian is needed.
    """
    a, c = np.zeros((4, 4)), np.zeros((4, 4))
    a[:, :2], c[:, :3] = step._A[[0, 1, 2, 2]], step._C
    gamma = np.linalg.inv(np.eye(4) / step._GAMMA - c)
    alpha = a @ gamma
    return alpha, alpha + gamma, step._B @ gamma, step._E @ gamma


def test_the_step_has_order_four_and_its_error_is_that_of_order_three() -> None:
    alpha, beta, end, error = plain_form()
    a, b = alpha.sum(axis=1), beta.sum(axis=1)
    third = [(np.ones(4), 1.0), (b, 1 / 2), (a**2, 1 / 3), (beta @ b, 1 / 6)]
    fourth = [(a**3, 1 / 4), (a * (alpha @ b), 1 / 8), (beta @ a**2, 1 / 12), (beta @ beta @ b, 1 / 24)]
    for condition, value in third + fourth:
        assert end @ condition == pytest.approx(value, abs=1e-13)
    for condition, _ in third:
        assert error @ condition == pytest.approx(0.0, abs=1e-13)
    assert max(abs(error @ condition) for condition, _ in fourth) > 1e-3


def test_the_step_damps_what_is_infinitely_stiff() -> None:
    _, beta, end, _ = plain_form()
    assert 1.0 - end @ np.linalg.solve(beta, np.ones(4)) == pytest.approx(0.0, abs=1e-4)


def test_a_loss_and_the_velocity_that_its_pressure_drives_are_each_others_inverse(
    calibrated: BalancerModel, plant: Callable[..., Dynamics]
) -> None:
    known = plant(calibrated, "tube inertia").kept_plant(total=0.5)[0]
    for which in (SIPHON, THERE):
        for speed in np.geomspace(1e-7, 1e4, 300).tolist():
            head, slope = column.tube_loss(known, which, speed, speed)
            pressure = float(head * known["density"])
            assert column.quasi_steady(known, which, pressure, 0.0) == pytest.approx(speed, rel=1e-12)
            faster = column.tube_loss(known, which, speed * (1 + 1e-7), speed * (1 + 1e-7))[0]
            assert (faster - head) / (1e-7 * speed) == pytest.approx(slope, rel=1e-5)
