"""Gradients and integrals on quadratic tetrahedra and on their named boundaries, by quadrature.

Four points in a cell integrate quadratic functions, so the stiffness of straight cells is exact and that of
curved ones keeps its order; six points on a facet integrate quartic ones.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Final

import numpy as np
from scipy.sparse import csr_matrix, diags_array, vstack

from ringbalance.mesh.quadratic_tetrahedra import (
    EDGES,
    FACES,
    Tetrahedra,
    derivatives,
    face_nodes,
    shapes,
    slopes,
)
from ringbalance.scene.arrays import FloatArray, IntArray


def _permutations(first: float, corners: int) -> FloatArray:
    other = (1 - first) / (corners - 1)
    return np.full((corners, corners), other) + (first - other) * np.eye(corners)


_ROOTS: Final = [(8 - np.sqrt(10) + sign * np.sqrt(38 - 44 * np.sqrt(0.4))) / 18 for sign in (1, -1)]
"""Of the two orbits of the triangle's six points."""
CELL_POINTS: Final = _permutations((5 + 3 * np.sqrt(5)) / 20, 4)
"""Barycentric, one nearest to each corner, shape (4, 4)."""
_CELL_WEIGHT: Final = 1 / 24
_FACET_POINTS: Final = np.vstack([_permutations(1 - 2 * root, 3) for root in _ROOTS])


def _facet_weights() -> FloatArray:
    """Weights that integrate 1 and the square of one coordinate, 1/2 and 1/12."""
    squares = [(orbit[:, 0] ** 2).sum() for orbit in np.split(_FACET_POINTS, 2)]
    pair = np.linalg.solve([[3.0, 3.0], squares], [0.5, 1 / 12])
    return np.repeat(pair, 3)


_FACET_WEIGHTS: Final = _facet_weights()


@dataclass(frozen=True, kw_only=True)
class Facets:
    """Quadrature points of one named boundary."""

    nodes: IntArray
    """Shape (facets, 6)."""
    values: FloatArray
    """Shape functions at the points, shape (points, 6)."""
    points: FloatArray
    """m, shape (facets, points, 3)."""
    area: FloatArray
    """Outward normal times weight, m^2, shape (facets, points, 3)."""

    @property
    def weights(self) -> FloatArray:
        """m^2, shape (facets, points)."""
        return np.asarray(np.linalg.norm(self.area, axis=-1))

    def load(self, density: FloatArray, *, unknowns: int) -> FloatArray:
        """Integrals of f N_i, f times the weights given at the points."""
        return np.bincount(
            self.nodes.ravel(), weights=(density @ self.values).ravel(), minlength=unknowns
        ).astype(np.float64)

    def mass(self, factor: FloatArray, *, unknowns: int) -> csr_matrix:
        """Matrix of the integrals of factor N_i N_j."""
        local = np.einsum("fq,qi,qj->fij", self.weights * factor, self.values, self.values, optimize=True)
        rows = np.repeat(self.nodes, 6, axis=1).ravel()
        columns = np.tile(self.nodes, (1, 6)).ravel()
        return csr_matrix((local.ravel(), (rows, columns)), shape=(unknowns, unknowns))

    def at_points(self, nodal: FloatArray) -> FloatArray:
        """Values at the points of a field given at the nodes."""
        return np.asarray(nodal[self.nodes] @ self.values.T)


@dataclass(frozen=True, kw_only=True)
class TetrahedronSpace:
    """Quadratic elements on a body."""

    body: Tetrahedra

    @property
    def unknowns(self) -> int:
        """Nodes of the body."""
        return len(self.body.nodes)

    @property
    def boundaries(self) -> tuple[str, ...]:
        """Names of those that the body has."""
        present = np.unique(self.body.faces)
        return tuple(self.body.names[number] for number in present[present >= 0])

    @cached_property
    def weights(self) -> FloatArray:
        """m^3, shape (cells * points,)."""
        jacobian = derivatives(self.body.nodes[self.body.cells], CELL_POINTS)
        return np.asarray((np.linalg.det(jacobian) * _CELL_WEIGHT).ravel())

    @cached_property
    def points(self) -> FloatArray:
        """Quadrature points, m, shape (cells * points, 3)."""
        return np.asarray(
            np.einsum("pn,enx->epx", shapes(CELL_POINTS), self.body.nodes[self.body.cells])
        ).reshape(-1, 3)

    def at_points(self, nodal: FloatArray) -> FloatArray:
        """Values at the quadrature points of a field given at the nodes."""
        return np.asarray(nodal[self.body.cells] @ shapes(CELL_POINTS).T).ravel()

    @cached_property
    def gradient(self) -> csr_matrix:
        """Matrix that takes nodal values to gradients at the quadrature points, three rows a point."""
        return self._gradient(self.body.cells, CELL_POINTS)

    def _gradient(self, cells: IntArray, points: FloatArray) -> csr_matrix:
        inverse = np.linalg.inv(derivatives(self.body.nodes[cells], points))
        local = np.einsum("epax,pna->epxn", inverse, slopes(points), optimize=True)
        rows, functions = 3 * len(cells) * len(points), cells.shape[1]
        columns = np.repeat(cells, 3 * len(points), axis=0)
        starts = np.arange(0, (rows + 1) * functions, functions)
        return csr_matrix((local.ravel(), columns.ravel(), starts), shape=(rows, self.unknowns))

    def gradient_at(self, name: str) -> csr_matrix:
        """As `gradient`, at the points of a boundary's facets, in the order of `facets`."""
        number, parts = self.body.names.index(name), []
        for k, corners in enumerate(FACES):
            points = np.zeros((len(_FACET_POINTS), 4))
            points[:, corners] = _FACET_POINTS
            parts.append(self._gradient(self.body.cells[self.body.faces[:, k] == number], points))
        return csr_matrix(vstack(parts))

    @cached_property
    def stiffness(self) -> csr_matrix:
        """Matrix of the integrals of grad N_i . grad N_j."""
        weighted = diags_array(np.repeat(self.weights, 3)) @ self.gradient
        return csr_matrix(self.gradient.T @ weighted)

    def load(self, density: FloatArray) -> FloatArray:
        """Integrals of f N_i, f given at the quadrature points."""
        cells = self.body.cells
        local = (density * self.weights).reshape(len(cells), -1) @ shapes(CELL_POINTS)
        return np.bincount(cells.ravel(), weights=local.ravel(), minlength=self.unknowns).astype(np.float64)

    def facets(self, name: str) -> Facets:
        """Quadrature points of one boundary."""
        number = self.body.names.index(name)
        nodes = np.concatenate(
            [face_nodes(self.body.cells[self.body.faces[:, k] == number], k) for k in range(len(FACES))]
        )
        values, places = shapes(_FACET_POINTS), self.body.nodes[nodes]
        tangent = derivatives(places, _FACET_POINTS)
        area = np.cross(tangent[..., 0], tangent[..., 1]) * _FACET_WEIGHTS[:, None]
        return Facets(
            nodes=nodes,
            values=values,
            points=np.einsum("pn,enx->epx", values, places),
            area=area,
        )

    def prolongation(self, free: IntArray) -> csr_matrix:
        """Interpolation to some nodes from those of them that are corners of cells, as linear elements do."""
        cells = self.body.cells
        corners = np.unique(cells[:, :4])
        middles, first = np.unique(cells[:, 4:], return_index=True)
        ends = cells[:, EDGES].reshape(-1, 2)[first]
        rows = np.concatenate([corners, middles, middles])
        columns = np.concatenate([corners, ends[:, 0], ends[:, 1]])
        entries = np.concatenate([np.ones(corners.size), np.full(2 * middles.size, 0.5)])
        whole = csr_matrix((entries, (rows, columns)), shape=(self.unknowns, self.unknowns))
        return csr_matrix(whole[free][:, np.intersect1d(corners, free)])
