"""The rotation ratio against its exact limits and against spectral solutions of the turning tube."""

from __future__ import annotations

import numpy as np
import pytest
from fluids.friction import helical_turbulent_fd_Mori_Nakayama
from numpy.polynomial import chebyshev
from scipy.linalg import solve, toeplitz

from ringbalance.physics.tube.friction import (
    _curved_friction_ratio,
    critical_reynolds,
    turbulent_friction_ratio,
    turbulent_ratio_uncertainty,
)
from ringbalance.physics.tube.rotation_table import rotating_friction_ratio

Array = np.ndarray


def ratio(re: float, rotation: float) -> float:
    return float(rotating_friction_ratio(reynolds=re, rotation_reynolds=rotation).value)


def _chebyshev(order: int) -> tuple[Array, Array]:
    x = np.cos(np.pi * np.arange(order + 1) / order)
    c = np.hstack([2, np.ones(order - 1), 2]) * (-1) ** np.arange(order + 1)
    d = np.outer(c, 1 / c) / (x[:, None] - x[None, :] + np.eye(order + 1))
    return d - np.diag(d.sum(axis=1)), x


class Disc:
    """Chebyshev-Fourier collocation on the unit disc: derivatives, Laplacian, mean value."""

    def __init__(self, order: int, angles: int) -> None:
        d, r = _chebyshev(order)
        half = (order - 1) // 2
        step = 2 * np.pi / angles
        j = np.arange(1, angles)
        first = np.hstack([0, 0.5 * (-1.0) ** j / np.tan(j * step / 2)])
        second = np.hstack(
            [-(np.pi**2) / (3 * step**2) - 1 / 6, -0.5 * (-1.0) ** j / np.sin(j * step / 2) ** 2]
        )
        radius = r[: half + 1]

        def fold(matrix: Array) -> Array:
            near, far = matrix[: half + 1, : half + 1], matrix[: half + 1, order:half:-1]
            return np.kron(near, np.eye(angles)) + np.kron(far, np.roll(np.eye(angles), angles // 2, axis=1))

        dr, inverse = fold(d), np.diag(1 / radius)
        d_theta = np.kron(inverse, toeplitz(first, -first))
        theta = np.tile(2 * np.pi * np.arange(angles) / angles, half + 1)[:, None]
        self.laplacian = fold(d @ d) + np.kron(inverse, np.eye(angles)) @ dr
        self.laplacian += np.kron(inverse @ inverse, toeplitz(second))
        self.dr, self.rim = dr, np.arange(angles)
        self.dx, self.dy = (
            np.cos(theta) * dr - np.sin(theta) * d_theta,
            np.sin(theta) * dr + np.cos(theta) * d_theta,
        )
        even = np.cos(np.outer(np.arccos(radius), 2 * np.arange(half + 1)))
        moments = [float(np.diff(chebyshev.chebval([0, 1], self._ring(n)))[0]) for n in range(half + 1)]
        self.mean = np.kron(np.linalg.solve(even.T, np.array(moments)), np.full(angles, 2 / angles))

    @staticmethod
    def _ring(n: int) -> Array:
        return chebyshev.chebint(chebyshev.chebmul([0, 1], [0] * (2 * n) + [1]))


def spectral_ratio(disc: Disc, rotation: float, re: float, start: Array | None = None) -> tuple[float, Array]:
    """Newton solution of developed flow in a turning tube: psi, vorticity, axial w and pressure drop.

    lap(psi) = -zeta; lap(zeta) + 2 q w_y = J; lap(w) + 2 q psi_y + G = J, with q = omega a^2/nu, in units of
    the radius a and nu/a; no slip; mean w = Re/2.  Re = 0 stands for the linear problem.
    """
    q, mean, inertia = rotation / 4, re / 2 if re else 1.0, float(re > 0)
    n, lap, dx, dy, rim = len(disc.dr), disc.laplacian, disc.dx, disc.dy, disc.rim
    x = np.zeros(3 * n + 1) if start is None else start * (mean / (disc.mean @ start[2 * n : -1]))
    for _ in range(40):
        psi, zeta, w = x[:n], x[n : 2 * n], x[2 * n : -1]
        carry = inertia * ((dy @ psi)[:, None] * dx - (dx @ psi)[:, None] * dy)

        def carried(f: Array) -> Array:
            return np.asarray(inertia * ((dx @ f)[:, None] * dy - (dy @ f)[:, None] * dx))

        zero, one = np.zeros((n, n)), np.zeros((n, 1))
        jac = np.block(
            [
                [lap, np.eye(n), zero, one],
                [-carried(zeta), lap - carry, 2 * q * dy, one],
                [2 * q * dy - carried(w), zero, lap - carry, one + 1],
                [np.zeros((1, 2 * n)), disc.mean[None, :], np.zeros((1, 1))],
            ]
        )
        residual = np.hstack(
            [
                lap @ psi + zeta,
                lap @ zeta + 2 * q * (dy @ w) - carry @ zeta,
                lap @ w + 2 * q * (dy @ psi) + x[-1] - carry @ w,
                disc.mean @ w - mean,
            ]
        )
        for offset, column, row in ((0, 0, np.eye(n)), (n, 0, disc.dr), (2 * n, 2 * n, np.eye(n))):
            jac[offset + rim] = 0
            jac[offset + rim, column : column + n] = row[rim]
            residual[offset + rim] = row[rim] @ x[column : column + n]
        change = solve(jac, -residual, overwrite_a=True, check_finite=False)
        x = x + change
        if np.max(np.abs(change)) < 1e-9 * np.max(np.abs(x)) or not inertia:
            break
    else:
        raise AssertionError("the reference solution did not converge")
    return float(x[-1] / (8 * mean)), x


@pytest.fixture(scope="module")
def disc() -> Disc:
    return Disc(23, 20)


def test_no_rotation_changes_nothing_to_the_last_bit() -> None:
    assert ratio(1000.0, 0.0) == 1.0
    assert float(turbulent_friction_ratio(reynolds=1e4, rotation_reynolds=0.0)) == 1.0
    assert float(critical_reynolds(rotation_reynolds=0.0)) == 1070 * 28**0.23
    assert float(rotating_friction_ratio(reynolds=1e3, rotation_reynolds=0.0).uncertainty) < 1e-20


@pytest.mark.parametrize(("re", "rotation"), [(1e-6, 1.0), (1e4, 1e-3), (42.0, 0.3)])
def test_slow_rotation_follows_the_exact_series(re: float, rotation: float) -> None:
    exact = rotation**2 / 9216 + (rotation * re) ** 2 / 16515072
    assert ratio(re, rotation) - 1 == pytest.approx(exact, rel=0.02, abs=3e-6)


def test_fast_rotation_at_vanishing_flow_has_the_exact_limit() -> None:
    error = [abs(ratio(1e-9, r) / (0.07863 * r**0.5) - 1) for r in (1e5, 1e7, 1e9)]
    assert error[0] > error[1] > error[2]
    assert error[2] < 3e-4


def test_reference_solver_meets_the_exact_series(disc: Disc) -> None:
    linear, start = spectral_ratio(disc, 2.0, 0.0)
    assert linear - 1 == pytest.approx(4 / 9216, rel=2e-3)
    inertial, _ = spectral_ratio(disc, 0.5, 200.0, start)
    assert inertial - 1 == pytest.approx(0.25 / 9216 + 100.0**2 / 16515072, rel=2e-2)


@pytest.mark.parametrize(
    ("rotation", "speeds"), [(30.0, (30, 150)), (120.0, (0, 100, 500)), (500.0, (0, 250))]
)
def test_ratio_agrees_with_spectral_solutions(disc: Disc, rotation: float, speeds: tuple[float, ...]) -> None:
    _, start = spectral_ratio(disc, rotation, 0.0)
    for re in speeds:
        found, start = spectral_ratio(disc, rotation, re, start)
        estimate = rotating_friction_ratio(reynolds=max(re, 1e-9), rotation_reynolds=rotation)
        assert abs(float(estimate.value) - found) <= float(estimate.uncertainty), (rotation, re, found)


@pytest.mark.heavy
@pytest.mark.parametrize("rotation", [10.0, 60.0, 250.0, 1000.0, 3500.0])
def test_ratio_agrees_with_spectral_solutions_up_to_its_range(rotation: float) -> None:
    fine = Disc(49, 44)
    _, start = spectral_ratio(fine, rotation, 0.0)
    re = rotation / 50
    # Above, further steady flows exist, and steps as long as these may land on one of them.
    while rotation * re < 1.5e6 and re < 2e4:
        found, start = spectral_ratio(fine, rotation, re, start)
        estimate = rotating_friction_ratio(reynolds=re, rotation_reynolds=rotation)
        # 44 angles resolve the thinnest layers here to about one part in a thousand.
        allowed = float(estimate.uncertainty) + 1e-3 * found
        assert abs(float(estimate.value) - found) <= allowed, (rotation, re, found)
        re *= 1.6


def test_literature_turbulent_formula_of_ito_and_nanbu() -> None:
    for kt, expected in ((10.0, 0.942 + 0.058 * 10**0.282), (5000.0, 0.942 * 5000**0.05)):
        found = turbulent_friction_ratio(reynolds=1e4, rotation_reynolds=(kt * 1e4) ** 0.5)
        assert float(found) == pytest.approx(expected, rel=1e-3)
    below = turbulent_friction_ratio(reynolds=1e5, rotation_reynolds=10.0)
    assert float(below) == pytest.approx(1.0, abs=1e-6)


@pytest.mark.parametrize("ratio_of_diameters", [0.02, 0.05, 0.2])
def test_literature_curved_tube_of_mori_and_nakayama(ratio_of_diameters: float) -> None:
    """The array form of the library's formula, where its T is above one."""
    re = np.geomspace(1.01 / ratio_of_diameters**2, 1e6, 30)
    published = [helical_turbulent_fd_Mori_Nakayama(r, 1.0, 1 / ratio_of_diameters) for r in re]
    found = _curved_friction_ratio(curvature_number=re * ratio_of_diameters**2)
    np.testing.assert_allclose(found, published / (0.3164 * re**-0.25), rtol=1e-9)


def test_turbulent_half_width_reaches_from_no_effect_to_the_curved_tube() -> None:
    re, kt = 2e4, np.geomspace(0.01, 1e6, 60)
    rotation = np.sqrt(kt * re)
    found = turbulent_friction_ratio(reynolds=re, rotation_reynolds=rotation)
    width = turbulent_ratio_uncertainty(reynolds=re, rotation_reynolds=rotation)
    low, high = found - width, found + width
    for other in (
        1.0,
        _curved_friction_ratio(curvature_number=kt),
        _curved_friction_ratio(curvature_number=kt / 4),
    ):
        assert np.all((low <= other + 1e-12) & (high >= other - 1e-12))
    # The recalled formula lies near the analogy, which shares nothing with it but the physics.
    strong = kt > 10
    assert np.max(np.abs(found / _curved_friction_ratio(curvature_number=kt / 4) - 1)[strong]) < 0.06
    assert np.max((width / (found - 1))[strong]) < 1.5
    assert float(turbulent_ratio_uncertainty(reynolds=1e4, rotation_reynolds=0.0)) == 0.0
