"""Flow in the section of a turning tube: exact limits, a manufactured solution, decay rates along the tube;
and the friction formula's blend of laminar and turbulent flow.

The manufactured flow on the curved half section, every term of the equation at work: in the plane
u = d psi/dz, v = -d psi/dy with psi = sin(a y + 0.3) exp(b z)/5, so that div u = 0; along the tube
w = 1 + cos(c y) sin(d z + 0.4)/2; p = sin(e y) cos(f z + 0.2).  The body force f is that of

    inertia (u . grad) u + rotation C u - viscosity lap u + grad p = f

with velocities given on the whole boundary.

Laminar flow in a rotating tube becomes developed at the rate at which disturbances decay along it.  A small
steady disturbance of developed flow goes as exp(lambda x/d).  With lengths over d, axial velocity over U and
mu = lambda Re, its equations in the section are quadratic in mu, pressure and diffusion along the tube
included:

    [A0 + mu A1 + mu^2 A2] q = 0

A0 is the section's own Jacobian; A1 is convection by the axial velocity, with pressure and continuity along
the tube; A2 is diffusion along it.  At Re = 0 velocities are over U throughout and mu is lambda itself.  The
modes are those that are their own mirror images in the plane normal to the rotation axis.
"""

from __future__ import annotations

import math
from dataclasses import replace
from functools import lru_cache, partial
from typing import Any, Final

import numpy as np
from scipy import sparse
from scipy.sparse.linalg import LinearOperator, eigs

from ringbalance.physics.tube.friction import friction_factor
from ringbalance.physics.tube.loss import developing_length
from ringbalance.physics.tube.rotation_table import rotating_friction_ratio
from ringbalance.scene.arrays import ComplexArray, FloatArray
from ringbalance.scene.models import Scene
from ringbalance.verification.evidence import (
    CaseTable,
    Convergence,
    Evidence,
    FigureCurve,
    Found,
    Level,
    as_found,
    figure,
    order_figure,
    orders_found,
)
from ringbalance.verification.finite_elements import relative_rms, slopes
from ringbalance.verification.navier_stokes.flow import Coefficients, Dirichlet, FlowSystem
from ringbalance.verification.navier_stokes.newton import Factors, FlowSolution, solve_flow
from ringbalance.verification.navier_stokes.tube import (
    SectionMesh,
    developed_section,
    friction_ratio,
    section_coefficients,
    solve_section,
    solve_section_without_inertia,
)

_SLOW_SERIES: Final = 9216.0
_INERTIA_SERIES: Final = 16515072.0
_FAST_LIMIT: Final = 0.07863
_SLOW_ROTATION: Final = 1.0
_SLOW_KL: Final = 20.0
_ROTATIONS: Final = np.array([1e1, 1e2, 1e3, 1e4])
_FACTORS: Final = {None: 1.0, "coriolis_off_by_a_percent": 1.01, "radius_for_bore": 0.25}
_SECTION_AROUND: Final = {"light": 8, "heavy": 20}
_AROUND: Final = {"light": (1, 2, 4, 8), "heavy": (1, 2, 4, 8, 16)}
_ACROSS: Final = 1.5
"""Cells of the ring between core and wall per cell around."""
_WALL_RATIO: Final = 3.0
_TURNING: Final = ((0.0, 0.0, 5.0), (0.0, 0.0, 0.0), (-5.0, 0.0, 0.0))
_TRUE: Final = Coefficients(inertia=3.0, viscosity=0.7, rotation=_TURNING)
"""Chosen so that no term hides behind another."""
_SPOILED: Final = {
    None: _TRUE,
    "coriolis_dropped": replace(_TRUE, rotation=None),
    "inertia_off_by_a_percent": replace(_TRUE, inertia=1.01 * _TRUE.inertia),
    "viscosity_off_by_a_percent": replace(_TRUE, viscosity=1.01 * _TRUE.viscosity),
}
_A, _B, _C, _D, _E, _F = 2.1, 1.2, 2.7, 3.1, 1.7, 1.3
_CREEPING_PER_DIAMETER: Final = 2 * (4.46629832 + 1.46746761j)
"""Root of z (J0^2 + J1^2) = 2 J0 J1 per radius."""
_GEOSTROPHIC: Final = 47.211
"""lambda sqrt(R), least eigenvalue of geostrophic flow over the section's depth with Ekman friction."""
_FAST: Final = (1e3, 1e4)
_POINTS: Final = {
    "light": ((20.0, 0.0), (100.0, 100.0)),
    "heavy": ((100.0, 0.0), (20.0, 200.0), (1e3, 100.0)),
}
_MESHES: Final = {
    "light": (
        SectionMesh(around=4, across=7, wall_ratio=30.0),
        SectionMesh(around=6, across=11, wall_ratio=50.0),
    ),
    "heavy": (
        SectionMesh(around=6, across=10, wall_ratio=15.0),
        SectionMesh(around=14, across=24, wall_ratio=200.0),
    ),
}
_SHIFTS: Final = (1.0, 0.35, 0.12)
"""Shifts over the expected rate, around which modes are searched."""
_EIGENVALUE_TOLERANCE: Final = 1e-8
"""Tolerance of eigenvalues, far below the 1e-4 of the expected rate by which distinct rates differ."""
_NOT_A_MODE: Final = 0.03
"""Rate over the expected one below which only the flow rate and the pressure level are modes, at zero."""
_MAX_RESIDUAL: Final = 1e-6
"""Largest relative residual of a mode."""


def rotating_section(scene: Scene, level: Level, defect: str | None = None) -> Evidence:
    """The rotating section at rest, in slow rotation and in fast rotation."""
    around, factor = _SECTION_AROUND[level], _FACTORS[defect]
    system = SectionMesh(around=around, across=3 * around // 2, wall_ratio=15.0).system()
    rest = _without_inertia(system, 0.0)
    slow = (_without_inertia(system, factor * _SLOW_ROTATION) - rest) / (_SLOW_ROTATION**2 / _SLOW_SERIES)
    flow = solve_section(system=system, kl=factor * _SLOW_KL, s=0.0)
    inertia = (friction_ratio(flow) - rest) / (_SLOW_KL**2 / _INERTIA_SERIES)
    fast = np.array([_without_inertia(system, factor * rotation) for rotation in _ROTATIONS.tolist()])
    limit = _FAST_LIMIT * np.sqrt(_ROTATIONS)
    gaps = fast / limit - 1
    shown = figure(
        "friction over that at rest, without inertia",
        ("rotation Reynolds number", "1", _ROTATIONS),
        FigureCurve("finite elements", "1", fast),
        FigureCurve("slow series", "1", 1 + _ROTATIONS**2 / _SLOW_SERIES, style="reference"),
        FigureCurve("fast limit", "1", limit, style="reference"),
        log=True,
    )
    return Evidence(
        # Against exact limits.
        quantities={
            "at_rest": Found(value=abs(rest - 1)),
            "slow": Found(value=slow).against(1.0),
            "inertia": Found(value=inertia).against(1.0),
            "ekman": Found(value=float(gaps[2] / gaps[3])).against(math.sqrt(10)),
        },
        numbers={"gap": float(gaps[-1])},
        series=(shown,),
    )


def _without_inertia(system: FlowSystem, rotation: float) -> float:
    flow = solve_section_without_inertia(system=system, rotation_reynolds=rotation)
    if not flow.status.ok:
        raise ValueError(flow.status.text)
    return friction_ratio(flow)


def velocity(points: FloatArray) -> FloatArray:
    """The manufactured velocity along (y, z, x), shape (3, ...), at points (y, z) over the bore."""
    y, z = points
    growth = np.exp(_B * z) / 5
    return np.stack(
        [
            _B * np.sin(_A * y + 0.3) * growth,
            -_A * np.cos(_A * y + 0.3) * growth,
            1 + np.cos(_C * y) * np.sin(_D * z + 0.4) / 2,
        ]
    )


def pressure(points: FloatArray) -> FloatArray:
    """The manufactured pressure, up to a constant."""
    return np.asarray(np.sin(_E * points[0]) * np.cos(_F * points[1] + 0.2))


def body_force(points: FloatArray) -> FloatArray:
    """The body force along (y, z, x) that makes this flow the solution."""
    u = velocity(points)
    plane = _B**2 - _A**2
    laplacian = np.stack([plane * u[0], plane * u[1], -(_C**2 + _D**2) * (u[2] - 1)])
    carried = np.einsum("d...,cd...->c...", u[:2], slopes(velocity, points))
    turning = np.einsum("cd,d...->c...", np.array(_TURNING), u)
    slope = np.concatenate([slopes(pressure, points), np.zeros_like(points[:1])])
    return np.asarray(_TRUE.inertia * carried + turning - _TRUE.viscosity * laplacian + slope)


def manufactured_flow(scene: Scene, level: Level, defect: str | None = None) -> Evidence:
    """Orders and finest errors of the manufactured flow on ever finer meshes."""
    around = _AROUND[level]
    conditions = [
        Dirichlet(boundary=name, component=c, value=partial(_component, c))
        for name in ("symmetry", "wall")
        for c in range(3)
    ]
    velocity_errors, pressure_errors, unknowns = [], [], []
    for count in around:
        across = max(1, round(_ACROSS * count))
        system = FlowSystem.of(
            mesh=SectionMesh(around=count, across=across, wall_ratio=_WALL_RATIO).mesh(),
            conditions=conditions,
            components=3,
            enclosed=True,
            body_force=body_force,
        )
        solution = solve_flow(system=system, coefficients=_SPOILED[defect])
        if not solution.status.ok:
            raise ValueError(solution.status.text)
        weights = system.weights
        computed = system.at_points(solution.velocity)[0]
        velocity_errors.append(relative_rms(computed, velocity(system.points), weights))
        # The pressure is determined up to a constant.
        fields = (np.asarray(system.pressure.interpolate(solution.pressure)), pressure(system.points))
        centred, true = (field - np.sum(weights * field) / weights.sum() for field in fields)
        pressure_errors.append(relative_rms(centred, true, weights))
        unknowns.append(system.unknowns)
    studies = {
        name: Convergence.of_errors(
            f"{name}, relative error",
            order,
            size=[around[0] / count for count in around],
            error=errors,
            geometry="quadratic",
            note=f"unknowns {', '.join(map(str, unknowns))}",
        )
        for name, order, errors in (("velocity", 3.0, velocity_errors), ("pressure", 2.0, pressure_errors))
    }
    return Evidence(
        quantities=orders_found(studies),
        numbers={"unknowns": float(unknowns[-1])},
        series=(order_figure(studies),),
        convergence=tuple(studies.values()),
    )


def _component(component: int, points: FloatArray) -> FloatArray:
    return np.asarray(velocity(points)[component])


def developing_flow(scene: Scene, level: Level, defect: str | None = None) -> Evidence:
    """Decay rates along the turning tube: creeping flow at rest, fast rotation, the bound that k(u) uses."""
    coarse, fine = (_section(cells) for cells in _MESHES[level])
    speed = 0.7 if defect == "coriolis_too_weak" else 1.0
    rates = _slowest_decay(system=coarse, reynolds=0.0, rotation_reynolds=0.0, count=12)
    exact = _CREEPING_PER_DIAMETER / (2 if defect == "radius_for_bore" else 1)
    fast = [_decay_length(fine, 0.0, speed * rotation) ** -1 * rotation**0.5 for rotation in _FAST]
    # The departure from the limit goes as R^(-1/4) and is eliminated with two rates.
    step = (_FAST[1] / _FAST[0]) ** 0.25
    points = _POINTS[level]
    lengths = [_decay_length(coarse, *point) for point in points]
    bounds = [_length_bound(*point) for point in points]
    shares = np.divide(lengths, bounds)
    table = CaseTable(
        name="way on which a disturbance falls by e",
        columns={
            "Re": [re for re, _ in points],
            "R": [rotation for _, rotation in points],
            "found": lengths,
            "bound": bounds,
        },
        units={"found": "d", "bound": "d"},
    )
    return Evidence(
        quantities={
            "creeping": Found(value=float(np.min(np.abs(rates + exact)) / abs(exact))),
            "fast": Found(value=(fast[1] * step - fast[0]) / (step - 1)).against(_GEOSTROPHIC),
            "bound": Found(value=float(shares.max())),
        },
        numbers={"slower": fast[0], "faster": fast[1], "least": float(shares.min())},
        tables=(table,),
    )


def _decay_length(system: FlowSystem, reynolds: float, rotation_reynolds: float) -> float:
    """Length on which the slowest disturbance falls by e, in diameters."""
    rates = _slowest_decay(system=system, reynolds=reynolds, rotation_reynolds=rotation_reynolds, count=1)
    return -1 / float(rates[0].real)


@lru_cache(maxsize=2)
def _section(cells: SectionMesh) -> FlowSystem:
    return cells.system()


@lru_cache(maxsize=16)
def _slowest_decay(
    *, system: FlowSystem, reynolds: float, rotation_reynolds: float, count: int
) -> ComplexArray:
    """Rates per diameter of the slowest disturbances downstream of laminar developed flow, mirror-symmetric.

    Slowest first, real parts negative.
    Raises: ArithmeticError: the developed flow or a mode of it was not found.
    Source: quadratic eigenproblem by finite elements, solved by shift and invert.
    """
    if reynolds == 0:
        flow = solve_section_without_inertia(system=system, rotation_reynolds=rotation_reynolds)
        c = section_coefficients(kl=rotation_reynolds, s=rotation_reynolds, inertia=0.0)
        matrices = _matrices(system, flow, c, 1.0)
    else:
        kl, s = reynolds * rotation_reynolds, rotation_reynolds / reynolds
        flow = developed_section(system=system, kl=kl, s=s)
        matrices = _matrices(system, flow, section_coefficients(kl=kl, s=s), reynolds**-2)
    scale, expected = reynolds or 1.0, _length_bound(reynolds, rotation_reynolds)
    modes = []
    for share in _SHIFTS:
        mu, residual = _modes(matrices, -share * scale / expected, count + 4)
        rates = mu / scale
        decaying = (rates.real < 0) & (np.abs(rates) > _NOT_A_MODE / expected)
        modes.append(rates[decaying & (residual < _MAX_RESIDUAL)])
    rates = np.concatenate(modes)
    if rates.size == 0 or not flow.status.ok:
        raise ArithmeticError("no mode found: refine the section's mesh")
    ordered = rates[np.lexsort((rates.imag, -np.round(rates.real, 6)))]
    distinct = np.append(True, np.abs(np.diff(ordered)) > 1e-4 / expected)
    return np.asarray(ordered[distinct][:count])


def _length_bound(reynolds: float, rotation_reynolds: float) -> float:
    """Developing length of the tube law, in diameters."""
    ratio = rotating_friction_ratio(reynolds=reynolds, rotation_reynolds=rotation_reynolds).value
    return float(
        developing_length(reynolds=reynolds, rotation_reynolds=rotation_reynolds, friction_ratio=ratio)
    )


def _matrices(
    system: FlowSystem, flow: FlowSolution, c: Coefficients, lengthwise: float
) -> tuple[Any, Any, Any]:
    """A0, A1 and A2 without the wall's unknowns.

    Args: `lengthwise`: factor of pressure and diffusion along the tube.
    """
    constant = system.linear_matrix(c)
    if c.inertia != 0.0:
        constant = constant + c.inertia * system.convection_matrix(flow.vector)
    carried = c.inertia * system.weighted_mass(system.at_points(flow.velocity)[0][2])
    coupling = system.pressure_mass()
    linear = system.of_all(sparse.kron(sparse.identity(3), carried)).tolil()
    first, nodes = flow.velocity.size, flow.velocity.shape[1]
    axial, pressure = slice(first - nodes, first), slice(first, None)
    linear[axial, pressure], linear[pressure, axial] = lengthwise * coupling.T, -coupling
    quadratic = system.of_all(sparse.kron(sparse.identity(3), -lengthwise * system.mass))
    # The pressure's level, pinned in the section's own problem, is a part of what varies along the tube.
    free = np.union1d(system.free, [first])
    a0, a1, a2 = (matrix.tocsr()[free][:, free].tocsc() for matrix in (constant, linear, quadratic))
    return a0, a1, a2


def _modes(matrices: tuple[Any, Any, Any], shift: float, count: int) -> tuple[ComplexArray, FloatArray]:
    """Eigenvalues mu next to a shift, and the relative residuals of their modes."""
    a0, a1, a2 = matrices
    size = a0.shape[0]
    factors = Factors((a0 + shift * a1 + shift**2 * a2).tocsc())

    def inverse(y: FloatArray) -> FloatArray:
        # (q, mu q) linearises the square; one factored matrix of the section's size serves.
        low, high = y[:size], y[size:]
        first = -factors.solve(a1 @ low + a2 @ (high + shift * low))
        return np.concatenate([first, shift * first + low])

    start = np.random.default_rng(0).standard_normal(2 * size)
    operator = LinearOperator((2 * size, 2 * size), matvec=inverse, dtype=np.float64)
    nearness, vectors = eigs(operator, k=count, v0=start, tol=_EIGENVALUE_TOLERANCE)
    mu = shift + 1 / nearness
    q = vectors[:size]
    rest = a0 @ q + (a1 @ q) * mu + (a2 @ q) * mu**2
    scale = abs(a0) @ np.abs(q) + (abs(a1) @ np.abs(q)) * np.abs(mu)
    return mu, np.linalg.norm(rest, axis=0) / np.linalg.norm(scale, axis=0)


_TURBULENT_FROM_RE: Final = 4000.0
_RE_STEP: Final = 1.01


def blend(scene: Scene, level: Level, defect: str | None = None) -> Evidence:
    """Check the blend: exact where laminar, continuous, one velocity per head."""

    def friction_of(reynolds: FloatArray) -> FloatArray:
        f = friction_factor(reynolds=reynolds, relative_roughness=0.0)
        if defect == "sudden_switch":
            f = np.where(reynolds < _TURBULENT_FROM_RE, 0.316 * reynolds**-0.25, f)
            return np.where(reynolds < 2040, 64 / reynolds, f)
        return f / 4 if defect == "fanning_factor" else f

    laminar = np.geomspace(1, 1000, 200)
    sweep = np.exp(np.arange(np.log(100), np.log(1e5), np.log(_RE_STEP)))
    curve = friction_of(sweep)
    shown = figure(
        "friction factor of a smooth tube",
        ("Reynolds number", "1", sweep),
        FigureCurve("blend", "1", curve),
        FigureCurve("64/Re", "1", 64 / sweep, style="reference"),
        log=True,
    )
    return Evidence(
        quantities=as_found(
            laminar=np.max(np.abs(friction_of(laminar) * laminar / 64 - 1)),
            jump=np.max(np.abs(np.diff(curve) / curve[:-1])),
            head_slope=np.min(np.diff(np.log(curve * sweep**2)) / np.log(_RE_STEP)),
        ),
        series=(shown,),
    )
