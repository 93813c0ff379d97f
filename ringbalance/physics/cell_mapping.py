"""Curved quadratic cells of scikit-fem: what their functions share is evaluated once.

scikit-fem evaluates the shape functions for every component of a place and of its Jacobian, and the inverse
Jacobian for every function of an element: with 27 functions this takes most of the time of a basis.
"""

from __future__ import annotations

from functools import lru_cache
from typing import Any

import numpy as np
from skfem.mapping import MappingIsoparametric
from skfem.quadrature import get_quadrature

from ringbalance.scene.arrays import FloatArray


@lru_cache(maxsize=32)
def quadrature(domain: Any, order: int) -> tuple[FloatArray, FloatArray]:
    """Points, shape (dimension, points), and weights on a reference cell; the same arrays every time."""
    return get_quadrature(domain, order)  # type: ignore[no-any-return]  # scikit-fem has no types


class CellMapping(MappingIsoparametric):  # type: ignore[misc]  # scikit-fem has no types
    """Mapping from the reference cell that keeps shape functions and inverse Jacobians of the last points."""

    def __init__(self, mesh: Any) -> None:
        super().__init__(mesh, mesh.elem(), mesh.bndelem)
        self._shapes: tuple[Any, list[tuple[Any, Any]]] = (None, [])
        self._inverse: tuple[Any, Any] = (None, None)

    def at_points(self, nodal: FloatArray, points: FloatArray) -> FloatArray:
        """Values in all cells, shape (cells, points), of a field given at all nodes of the mesh."""
        return self._summed(nodal, None, [value for value, _ in self._shapes_at(points)])

    def Fmap(self, i: int, X: Any, tind: Any = None) -> Any:  # noqa: N802
        """Coordinate i of points X of the reference cell, in all cells or in those of `tind`."""
        return self._summed(self.mesh.doflocs[i], tind, [value for value, _ in self._shapes_at(X)])

    def _J(self, i: int, j: int, X: Any, tind: Any = None) -> Any:  # noqa: N802
        return self._summed(self.mesh.doflocs[i], tind, [slope[j] for _, slope in self._shapes_at(X)])

    def invDF(self, X: Any, tind: Any = None) -> Any:  # noqa: N802
        """Inverse Jacobian at points X of the reference cell, in all cells or in those of `tind`."""
        if tind is not None:
            return super().invDF(X, tind)
        if self._inverse[0] is not X:
            self._inverse = (X, super().invDF(X))
        return self._inverse[1]

    def _shapes_at(self, points: Any) -> list[tuple[Any, Any]]:
        if self._shapes[0] is not points:
            count = self.mesh.dofs.element_dofs.shape[0]
            self._shapes = (points, [self.elem.lbasis(points, each) for each in range(count)])
        return self._shapes[1]

    def _summed(self, nodal: FloatArray, tind: Any, shapes: list[Any]) -> FloatArray:
        nodes = self.mesh.dofs.element_dofs
        nodes = nodes if tind is None else nodes[:, tind]
        total = np.zeros((nodes.shape[1], shapes[0].shape[-1]))
        for row, shape in zip(nodes, shapes, strict=True):
            total += nodal[row][:, None] * shape
        return total
