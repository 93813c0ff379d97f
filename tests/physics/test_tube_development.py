"""Decay of disturbances along the rotating tube against exact ones, and what k(u) takes from it."""

from __future__ import annotations

import dataclasses
from functools import lru_cache

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.linalg import eig
from scipy.optimize import root
from scipy.special import jv, roots_jacobi

from ringbalance.physics.tube.local_losses import ROTATING_PROFILE_UNCERTAINTY, kinetic_factor
from ringbalance.physics.tube.loss import (
    DEVELOPMENT_SHARE,
    _development_uncertainty,
    developing_length,
)
from ringbalance.physics.tube.rotation_table import rotating_friction_ratio
from ringbalance.verification.cases.sections import _decay_length, _slowest_decay
from ringbalance.verification.navier_stokes.flow import FlowSystem
from ringbalance.verification.navier_stokes.newton import FlowSolution, NewtonSettings, solve_flow
from ringbalance.verification.navier_stokes.tube import (
    SectionMesh,
    developed_section,
    solve_section_without_inertia,
)
from ringbalance.verification.reference import bent_tube
from ringbalance.verification.reference.bent_tube import Segment, swept_tube

Array = np.ndarray


@lru_cache(maxsize=2)
def section(around: int = 5, across: int = 8, wall_ratio: float = 12.0) -> FlowSystem:
    return SectionMesh(around=around, across=across, wall_ratio=wall_ratio).system()


def bound(re: float, rotation: float) -> float:
    ratio = rotating_friction_ratio(reynolds=re, rotation_reynolds=rotation).value
    return float(developing_length(reynolds=re, rotation_reynolds=rotation, friction_ratio=ratio))


def test_creeping_end_effect_has_the_exact_axisymmetric_rate() -> None:
    """z (J0^2 + J1^2) = 2 J0 J1 of Stokes flow in a pipe, z the rate per radius."""

    def equation(parts: Array) -> list[float]:
        z = complex(*parts)
        rest = z * (jv(0, z) ** 2 + jv(1, z) ** 2) - 2 * jv(0, z) * jv(1, z)
        return [rest.real, rest.imag]

    exact = 2 * complex(*root(equation, [4.5, 1.5]).x)
    assert exact == pytest.approx(2 * (4.4663 + 1.4675j), abs=1e-3)  # as printed in the literature
    rates = _slowest_decay(system=section(), reynolds=0.0, rotation_reynolds=0.0, count=12)
    assert np.min(np.abs(rates + exact)) < 2e-3 * abs(exact)


def _axisymmetric_rates(re: float, order: int = 40) -> Array:
    """Chebyshev collocation of a disturbance of Poiseuille flow: unknowns w, v, p and lambda (w, v)."""
    x = np.cos(np.pi * np.arange(order + 1) / order)
    c = np.hstack([2, np.ones(order - 1), 2]) * (-1.0) ** np.arange(order + 1)
    d = np.outer(c, 1 / c) / (x[:, None] - x[None, :] + np.eye(order + 1))
    d = 2 * (d - np.diag(d.sum(axis=1)))  # r = (1 + x)/2, wall first, axis last
    r = (1 + x) / 2
    n, one, nu = order + 1, np.eye(order + 1), 2 / re
    profile, slope = np.diag(2 * (1 - r**2)), np.diag(-4 * r)
    rr = np.diag(r)
    lap = rr @ rr @ d @ d + rr @ d
    zero = np.zeros((n, n))
    # r^2 times both momentum equations, r times continuity; state (w, v, p, lw, lv) with l = lambda.
    a = np.block(
        [
            [nu * lap, -rr @ rr @ slope, zero, zero, zero],
            [zero, nu * (lap - one), -rr @ rr @ d, zero, zero],
            [zero, rr @ d + one, zero, zero, zero],
            [zero, zero, zero, one, zero],
            [zero, zero, zero, zero, one],
        ]
    )
    r2 = rr @ rr
    b = np.block(
        [
            [r2 @ profile, zero, r2, -nu * r2, zero],
            [zero, r2 @ profile, zero, zero, -nu * r2],
            [-rr, zero, zero, zero, zero],
            [one, zero, zero, zero, zero],
            [zero, one, zero, zero, zero],
        ]
    )
    for row, block, what in ((0, 0, one), (n - 1, 0, d), (n, 1, one), (2 * n - 1, 1, one)):
        a[row], b[row] = 0, 0
        a[row, block * n : (block + 1) * n] = what[row % n]
    rates = eig(a, b, right=False)
    return np.asarray(2 * rates[np.isfinite(rates)])


def test_disturbed_poiseuille_flow_has_the_rate_of_a_spectral_solution() -> None:
    rates = _slowest_decay(system=section(), reynolds=100.0, rotation_reynolds=0.0, count=6)
    spectral = _axisymmetric_rates(100.0)
    slowest = max(rate.real for rate in spectral if rate.real < -0.05 and abs(rate.imag) < 1e-6)
    assert np.min(np.abs(rates - slowest)) < 2e-3 * abs(slowest)
    # Classical entry lengths of 0.056 Re to within a per cent of the centre's velocity fit this decay.
    assert 0.056 * 100 * abs(slowest) == pytest.approx(3.6, abs=0.3)


def _geostrophic_rate(count: int) -> float:
    """lambda sqrt(R) of ((1 - e^2)^(-1/4) p')' = -(lambda sqrt(R)/2) e (1 - e^2)^(-1/2) p, -1 < e < 1.

    Geostrophic flow of pressure p over the depth h of the section, up and down its slopes h', fed by the
    Ekman layers of thickness sqrt(nu a/(omega h)): h' p_x = (delta p_y/2)_y.
    """
    basis = [np.polynomial.legendre.Legendre.basis(k) for k in range(count)]
    slopes, weights = roots_jacobi(2 * count, -0.25, -0.25)
    values, others = roots_jacobi(2 * count, -0.5, -0.5)
    d, p = (
        np.array([f(at) for f in fs]) for fs, at in (([b.deriv() for b in basis], slopes), (basis, values))
    )
    rates = eig(d * weights @ d.T, p * (others * values) @ p.T, right=False)
    return 2 * float(min(rate.real for rate in rates if np.isfinite(rate) and rate.real > 1.0))


def test_the_coefficient_of_fast_rotation_is_that_of_geostrophic_flow() -> None:
    """The case `developing_flow` finds it by finite elements."""
    limit = _geostrophic_rate(40)
    assert limit == pytest.approx(47.21, abs=0.01)
    assert limit == pytest.approx(_geostrophic_rate(60), rel=1e-5)
    # The same theory has the known friction: mean velocity int (1 - e^2)^(5/4) de/pi G/sqrt(omega nu).
    mean = quad(lambda e: (1 - e * e) ** 1.25, -1, 1)[0] / np.pi
    assert 1 / (32 * mean) == pytest.approx(0.07863, rel=1e-4)


@pytest.mark.parametrize(("re", "rotation"), [(0.0, 100.0), (100.0, 0.0), (100.0, 100.0), (20.0, 200.0)])
def test_developing_length_bounds_the_slowest_decay(re: float, rotation: float) -> None:
    length = _decay_length(section(), re, rotation)
    assert length <= 1.05 * bound(re, rotation) <= 1.05 * 3 * length


@pytest.mark.heavy
@pytest.mark.parametrize("rotation", [0.0, 1.0, 10.0, 30.0, 100.0, 300.0, 1000.0, 3000.0, 1e4])
def test_developing_length_bounds_the_slowest_decay_everywhere(rotation: float) -> None:
    fine = section(8, 12, 20.0)
    for re in (0.0, 3.0, 30.0, 300.0, 2000.0):
        if re * rotation <= 3e5:
            length = _decay_length(fine, re, rotation)
            assert length <= 1.05 * bound(re, rotation) <= 1.05 * 3 * length, (re, rotation)


def _alpha(flow: FlowSolution, system: FlowSystem) -> float:
    weights, axial = system.weights, system.at_points(flow.velocity)[0][2]
    return float((weights * axial**3).sum() / weights.sum())


@pytest.mark.parametrize(
    ("re", "rotation"), [(0.0, 30.0), (0.0, 1e3), (300.0, 10.0), (300.0, 100.0), (30.0, 300.0)]
)
def test_profile_in_rotation_carries_the_energy_that_the_formula_says(re: float, rotation: float) -> None:
    system = section()
    if re == 0:
        flow = solve_section_without_inertia(system=system, rotation_reynolds=rotation)
    else:
        flow = developed_section(system=system, kl=re * rotation, s=rotation / re)
    ratio = rotating_friction_ratio(reynolds=re, rotation_reynolds=rotation).value
    found = kinetic_factor(reynolds=max(re, 1e-3), friction_ratio=ratio)
    assert float(found) == pytest.approx(_alpha(flow, system), abs=ROTATING_PROFILE_UNCERTAINTY)


def test_kinetic_factor_has_its_exact_ends() -> None:
    assert float(kinetic_factor(reynolds=1.0)) == pytest.approx(2.0, abs=1e-9)
    areas = [quad(lambda e, n=n: (1 - e * e) ** n, -1, 1)[0] * 2 / np.pi for n in (2.75, 1.25)]
    fast = areas[0] / areas[1] ** 3
    assert float(kinetic_factor(reynolds=1.0, friction_ratio=1e6)) == pytest.approx(fast, abs=2e-3)


def test_what_development_adds_never_exceeds_rotations_share() -> None:
    lengths = np.geomspace(1e-3, 1e3, 50)
    spread = _development_uncertainty(length=0.1, bore=1e-3, developing=lengths, rotation_loss=-8.0)
    assert np.all(np.diff(spread) > 0)
    assert spread[-1] == pytest.approx(8.0, rel=0.06)
    assert spread[0] == pytest.approx(8 * DEVELOPMENT_SHARE * 1e-5, rel=1e-6)


def _entry_excess(re: float, rotation: float, blunt: float) -> float:
    """Head lost beyond developed friction, over U^2/2, behind an inflow ~ 1 - (2 r/d)^blunt, in 3-D."""
    cells = SectionMesh(around=2, across=4, wall_ratio=6.0)
    system = cells.system()
    developed = developed_section(system=system, kl=re * rotation, s=rotation / re)
    way = 5 * bound(re, rotation)
    tube = swept_tube(section=cells.mesh(), segments=[Segment(length=way, cells=16, ratio=6.0)])
    flow = bent_tube._system(tube, system, developed, re)
    profile = 1 - np.minimum(2 * np.hypot(*system.nodes), 1.0) ** blunt
    profile *= system.weights.sum() / (system.load() @ profile)
    given = flow.fixed_values.copy().reshape(-1)
    inlet, count = flow.boundary_nodes("inlet"), flow.nodes.shape[1]
    for component, value in enumerate((profile[tube.section_node[inlet]], 0.0, 0.0)):
        given[component * count + inlet] = value
    solution = solve_flow(
        system=dataclasses.replace(flow, fixed_values=given),
        coefficients=bent_tube.coefficients(reynolds=re, rotation_reynolds=rotation),
        start=bent_tube._guess(tube, flow, developed, re),
        settings=NewtonSettings(tolerance=1e-6),
    )
    assert solution.status.ok
    head = 2 / re * bent_tube._mean_pressure(tube, system, solution)
    head = head + bent_tube._energy_flux(tube, system, solution)
    return float(head[0] - head[-1] - 2 / re * developed.driving_gradient * way)


@pytest.mark.heavy
@pytest.mark.parametrize(("re", "rotation"), [(100.0, 100.0), (20.0, 200.0), (200.0, 50.0)])
@pytest.mark.parametrize("blunt", [2.0, 8.0])
def test_development_of_the_secondary_flow_costs_less_than_its_half_width(
    re: float, rotation: float, blunt: float
) -> None:
    added = _entry_excess(re, rotation, blunt) - _entry_excess(re, 1e-6, blunt)
    ratio = float(rotating_friction_ratio(reynolds=re, rotation_reynolds=rotation).value)
    scale = (ratio - 1) * 64 / re * bound(re, rotation)
    assert abs(added) < 0.8 * DEVELOPMENT_SHARE * scale
