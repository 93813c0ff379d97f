"""Values of a flow at points and on another mesh, on curved elements too."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from ringbalance.scene.arrays import FloatArray, IntArray
from ringbalance.verification.navier_stokes.flow import FlowSystem
from ringbalance.verification.navier_stokes.newton import FlowSolution

_MARGIN = 0.05
"""Accepted distance outside an element, over its size: a chord's sagitta on a coarser mesh."""


def _candidates(system: FlowSystem, points: FloatArray) -> tuple[IntArray, IntArray]:
    """Pairs (point, element) whose bounding box holds the point."""
    corners = system.nodes[:, system.velocity.element_dofs]
    low, high = corners.min(axis=1), corners.max(axis=1)
    margin = _MARGIN * (high - low) + 1e-12
    inside = np.ones((points.shape[1], low.shape[1]), dtype=bool)
    for x, below, above, m in zip(points, low, high, margin, strict=True):
        inside &= (x[:, None] >= below - m) & (x[:, None] <= above + m)
    point, element = np.nonzero(inside)
    return point.astype(np.int64), element.astype(np.int64)


def _shape_at(element: Any, local: FloatArray, count: int) -> tuple[FloatArray, FloatArray]:
    pairs = [element.lbasis(local, i) for i in range(count)]
    shape = np.stack([np.broadcast_to(phi, local.shape[1]) for phi, _ in pairs])
    return shape, np.stack([np.broadcast_to(dphi, local.shape) for _, dphi in pairs])


def _reference_coordinates(system: FlowSystem, points: FloatArray, elements: IntArray) -> FloatArray:
    """Newton's inverse of the element map, shape (dimension, pairs)."""
    basis = system.velocity
    nodes = system.nodes[:, basis.element_dofs[:, elements]]
    local = np.full(points.shape, 0.5 if nodes.shape[1] in (9, 27) else 1 / 3)
    for _ in range(12):
        shape, slope = _shape_at(basis.elem, local, basis.Nbfun)
        gap = np.einsum("din,in->dn", nodes, shape) - points
        jacobian = np.einsum("din,ikn->ndk", nodes, slope)
        local = local - np.linalg.solve(jacobian, gap.T[:, :, None])[:, :, 0].T
        local = np.clip(local, -1.0, 2.0)
    return local


def _outside(local: FloatArray, simplex: bool) -> FloatArray:
    """Distance of reference coordinates from the element, 0 inside."""
    excess = np.maximum(-local.min(axis=0), (local.sum(axis=0) if simplex else local.max(axis=0)) - 1)
    return np.asarray(np.maximum(excess, 0.0), dtype=np.float64)


def _locate(*, system: FlowSystem, points: npt.ArrayLike) -> tuple[IntArray, FloatArray]:
    """Element and reference coordinates of points.

    Args: `points`: shape (dimension, n).
    Returns: Elements (n,) and reference coordinates (dimension, n).
    Raises: ValueError: a point outside the mesh.
    """
    at = np.asarray(points, dtype=np.float64)
    point, element = _candidates(system, at)
    local = _reference_coordinates(system, at[:, point], element)
    outside = _outside(local, system.velocity.mesh.refdom.__name__ in ("RefTri", "RefTet"))
    order = np.lexsort((outside, point))
    unique, first = np.unique(point[order], return_index=True)
    best = order[first]
    if unique.size < at.shape[1] or np.any(outside[best] > _MARGIN):
        raise ValueError("a point lies outside the mesh")
    return element[best], local[:, best]


def probe(*, system: FlowSystem, solution: FlowSolution, points: npt.ArrayLike) -> FloatArray:
    """Velocity and pressure at points.

    Args: `points`: shape (dimension, n), inside the mesh.
    Raises: ValueError: a point outside the mesh.
    """
    return _evaluate(system, solution.vector, np.asarray(points, dtype=np.float64))


def _evaluate(system: FlowSystem, vector: FloatArray, points: FloatArray) -> FloatArray:
    element, local = _locate(system=system, points=points)
    velocity, pressure = system.split(vector)
    rows = []
    for basis, values in [(system.velocity, v) for v in velocity] + [(system.pressure, pressure)]:
        shape, _ = _shape_at(basis.elem, local, basis.Nbfun)
        rows.append((values[basis.element_dofs[:, element]] * shape).sum(axis=0))
    return np.stack(rows)


def transfer(*, source: FlowSystem, solution: FlowSolution, target: FlowSystem) -> FloatArray:
    """A flow on another mesh of the same domain, as a start for Newton's method there."""
    velocity = _evaluate(source, solution.vector, target.nodes)[:-1]
    pressure_points = np.asarray(target.pressure.doflocs, dtype=np.float64)
    pressure = _evaluate(source, solution.vector, pressure_points)[-1]
    return np.concatenate([velocity.ravel(), pressure])
