"""A manufactured flow on the curved half section of a turning tube, every term of the equation at work.

In the plane u = d psi/dz, v = -d psi/dy with psi = sin(a y + 0.3) exp(b z)/5, so that div u = 0; along the
tube w = 1 + cos(c y) sin(d z + 0.4)/2; p = sin(e y) cos(f z + 0.2).  The body force is what

    inertia (u . grad) u + rotation C u - viscosity lap u + grad p = f

asks for, with velocities given all round.
"""

from __future__ import annotations

from dataclasses import replace
from functools import partial
from typing import Final

import numpy as np

from ringbalance.scene.arrays import FloatArray
from ringbalance.scene.models import Scene
from ringbalance.verification.evidence import Evidence, Level
from ringbalance.verification.navier_stokes.newton import FlowSolution, solve_flow
from ringbalance.verification.navier_stokes.rotating_section import CORIOLIS, SectionMesh
from ringbalance.verification.navier_stokes.space import FlowSpace
from ringbalance.verification.navier_stokes.system import Coefficients, Dirichlet, FlowSystem
from ringbalance.verification.orders import OrderStudy, order_figure, orders_found

_AROUND: Final = {"light": (1, 2, 4, 8), "heavy": (1, 2, 4, 8, 16)}
_TRUE: Final = Coefficients(inertia=3.0, viscosity=0.7, rotation=5.0)
"""Chosen so that no term hides behind another."""
_A, _B, _C, _D, _E, _F = 2.1, 1.2, 2.7, 3.1, 1.7, 1.3
_ACROSS: Final = 1.5
"""Cells of the ring between core and wall per cell around."""
_WALL_RATIO: Final = 3.0


def velocity(places: FloatArray) -> FloatArray:
    """The manufactured velocity along (y, z, x), shape (3, ...), at places (y, z) over the bore."""
    y, z = places
    growth = np.exp(_B * z) / 5
    return np.stack(
        [
            _B * np.sin(_A * y + 0.3) * growth,
            -_A * np.cos(_A * y + 0.3) * growth,
            1 + np.cos(_C * y) * np.sin(_D * z + 0.4) / 2,
        ]
    )


def _gradient(places: FloatArray) -> FloatArray:
    """d u_c / d x_d, shape (3, 2, ...)."""
    y, z = places
    growth, sine, cosine = np.exp(_B * z) / 5, np.sin(_A * y + 0.3), np.cos(_A * y + 0.3)
    return np.stack(
        [
            np.stack([_A * _B * cosine * growth, _B**2 * sine * growth]),
            np.stack([_A**2 * sine * growth, -_A * _B * cosine * growth]),
            np.stack(
                [
                    -_C * np.sin(_C * y) * np.sin(_D * z + 0.4) / 2,
                    _D * np.cos(_C * y) * np.cos(_D * z + 0.4) / 2,
                ]
            ),
        ]
    )


def _laplacian(places: FloatArray) -> FloatArray:
    u, v, w = velocity(places)
    plane = _B**2 - _A**2
    return np.stack([plane * u, plane * v, -(_C**2 + _D**2) * (w - 1)])


def pressure(places: FloatArray) -> FloatArray:
    """The manufactured pressure, up to a constant."""
    return np.asarray(np.sin(_E * places[0]) * np.cos(_F * places[1] + 0.2))


def body_force(places: FloatArray) -> FloatArray:
    """The body force along (y, z, x) that makes this flow the solution."""
    y, z = places
    u = velocity(places)
    carried = np.einsum("d...,cd...->c...", u[:2], _gradient(places))
    turning = np.einsum("cd,d...->c...", np.array(CORIOLIS), u)
    slope = np.stack(
        [
            _E * np.cos(_E * y) * np.cos(_F * z + 0.2),
            -_F * np.sin(_E * y) * np.sin(_F * z + 0.2),
            np.zeros_like(y),
        ]
    )
    rotation = float(np.asarray(_TRUE.rotation))
    return np.asarray(
        _TRUE.inertia * carried + rotation * turning - _TRUE.viscosity * _laplacian(places) + slope
    )


def compute(scene: Scene, level: Level, defect: str | None = None) -> Evidence:
    used, around = _spoiled(defect), _AROUND[level]
    solved = [_solve(count, used) for count in around]
    size = [around[0] / count for count in around]
    flow = OrderStudy.of(size=size, error=[_velocity_error(*pair) for pair in solved])
    stress = OrderStudy.of(size=size, error=[_pressure_error(*pair) for pair in solved])
    unknowns = [space.unknowns for space, _ in solved]
    note = f"unknowns {', '.join(map(str, unknowns))}"
    return Evidence(
        found=orders_found({"velocity": flow, "pressure": stress}),
        numbers={"unknowns": float(unknowns[-1])},
        series=(order_figure({"velocity": flow, "pressure": stress}),),
        convergence=(
            flow.table("velocity, relative error", 3.0, geometry="quadratic", note=note),
            stress.table("pressure, relative error", 2.0, geometry="quadratic", note=note),
        ),
    )


def _spoiled(defect: str | None) -> Coefficients:
    changes = {
        None: _TRUE,
        "coriolis_dropped": replace(_TRUE, rotation=0.0),
        "inertia_off_by_a_percent": replace(_TRUE, inertia=1.01 * _TRUE.inertia),
        "viscosity_off_by_a_percent": replace(_TRUE, viscosity=1.01 * _TRUE.viscosity),
    }
    if defect not in changes:
        raise ValueError(f"unknown defect {defect}")
    return changes[defect]


def _solve(around: int, coefficients: Coefficients) -> tuple[FlowSpace, FlowSolution]:
    across = max(1, round(_ACROSS * around))
    cells = SectionMesh(around=around, across=across, wall_ratio=_WALL_RATIO)
    space = FlowSpace.taylor_hood(mesh=cells.mesh(), components=3)
    conditions = [
        Dirichlet(boundary=name, component=c, value=partial(_component, c))
        for name in ("symmetry", "wall")
        for c in range(3)
    ]
    system = FlowSystem.of(
        space=space, conditions=conditions, enclosed=True, coriolis=CORIOLIS, body_force=body_force
    )
    solution = solve_flow(system=system, coefficients=coefficients)
    if not solution.status.ok:
        raise ValueError(solution.status.text)
    return space, solution


def _component(component: int, places: FloatArray) -> FloatArray:
    return np.asarray(velocity(places)[component])


def _velocity_error(space: FlowSpace, solution: FlowSolution) -> float:
    found, _ = space.at_points(solution.velocity)
    true = velocity(space.points)
    return float(np.sqrt(np.sum(space.weights * (found - true) ** 2) / np.sum(space.weights * true**2)))


def _pressure_error(space: FlowSpace, solution: FlowSolution) -> float:
    found = solution.pressure[space.pressure.element_dofs.T] @ space.pressure_shape
    true = pressure(space.points)
    found, true = (field - np.sum(space.weights * field) / space.weights.sum() for field in (found, true))
    return float(np.sqrt(np.sum(space.weights * (found - true) ** 2) / np.sum(space.weights * true**2)))
