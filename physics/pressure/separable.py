"""Inverses of sums of products over the axes of a chamber's grid, near those of the forms on it.

A chamber is one patch of s, eta and zeta in which its metric is nearly a product: in a sector without plates
det(J) |grad s|^2 goes as r, det(J) |grad eta|^2 as 1/r.  The closest products, in the mean of logarithms, are

    A ~ K_s x M_eta x M_zeta + M_s x K_eta x M_zeta + M_s x M_eta x K_zeta,

whose inverse needs one generalised eigenproblem along each axis (fast diagonalisation).  Conjugate gradients
with it take a number of steps that does not grow with the mesh.
Source: Lynch, Rice and Thomas (1964), doi:10.1007/BF01386067.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ringbalance.physics.pressure.assembly import Facets, Line, Stiffness, gauss_line
from ringbalance.scene.arrays import FloatArray


@dataclass(frozen=True, kw_only=True)
class _SeparableInverse:
    """An inverse that is diagonal in products of one set of vectors along each axis."""

    vectors: tuple[FloatArray, ...]
    """Shape (nodes, vectors) along each axis."""
    factors: FloatArray
    """Of each product of vectors, shape (vectors along each axis)."""

    def __call__(self, residual: FloatArray) -> FloatArray:
        """The inverse times a vector over the grid's nodes."""
        field = residual
        for vectors in self.vectors:  # each product moves the first axis to the end
            field = field.reshape(len(vectors), -1).T @ vectors
        field = field.reshape(self.factors.shape) * self.factors
        for vectors in self.vectors:
            field = field.reshape(len(vectors), -1).T @ vectors.T
        return np.asarray(field).ravel()


def stiffness_inverse(stiffness: Stiffness, *, pinned_surface: bool) -> _SeparableInverse:
    """Near inverse of the form.

    Args: `pinned_surface`: True leaves out the nodes of the free surface, False keeps them and gives back
        fields without their constant part.
    """
    chamber = stiffness.chamber
    line, axes = gauss_line(chamber.order), range(chamber.dimension)
    own, others = _profiles(stiffness, line)
    vectors, values = [], []
    for axis in axes:
        first = 1 if pinned_surface and axis == 0 else 0
        stiff = _assembled(line.slopes, own[axis])[first:, first:]
        mass = _assembled(line.values, others[axis])[first:, first:]
        found = _eigenvectors(stiff, mass)
        vectors.append(found[1])
        values.append(found[0].reshape(-1, *(1,) * (len(axes) - 1 - axis)))
    total = np.asarray(sum(values))
    if not pinned_surface:
        total[(0,) * len(axes)] = np.inf
    return _SeparableInverse(vectors=tuple(vectors), factors=1 / total)


def mass_inverse(facets: Facets, *, cells: tuple[int, ...], line: Line) -> _SeparableInverse:
    """Near inverse of the integrals of u v over one side. Args: `cells`: along the side's axes."""
    points = (len(line.weights),) * len(cells)
    logs = np.log(facets.weights.reshape(*points, *cells))
    vectors = []
    for axis in range(len(cells)):
        profile = _profile(logs, axis) - logs.mean() * (1 - 1 / len(cells))
        root = np.linalg.cholesky(_assembled(line.values, np.exp(profile)))
        vectors.append(np.linalg.inv(root).T)
    return _SeparableInverse(vectors=tuple(vectors), factors=np.ones([len(v) for v in vectors]))


def _profiles(stiffness: Stiffness, line: Line) -> tuple[list[FloatArray], list[FloatArray]]:
    """Weights of the one-dimensional stiffness and mass along each axis, shape (points, cells) each."""
    dimension, cells = stiffness.chamber.dimension, stiffness.chamber.cells
    axes = range(dimension)
    metric = np.concatenate(
        [np.stack([block[axis, axis] for axis in axes]) for block in stiffness.metric], axis=-1
    )
    logs = np.log(metric.reshape(dimension, *(len(line.weights),) * dimension, *cells))
    # The weights of the other axes' points are in each mean; theirs is a factor of the whole.
    own = [np.exp(_profile(logs[axis], axis)) for axis in axes]
    others = [
        np.exp(np.mean([_profile(logs[a], axis) - logs[a].mean() for a in axes if a != axis], axis=0))
        for axis in axes
    ]
    return own, others


def _profile(logs: FloatArray, axis: int) -> FloatArray:
    """Means along all axes but one, shape (points, cells)."""
    dimension = logs.ndim // 2
    rest = tuple(k for k in range(logs.ndim) if k % dimension != axis)
    return np.asarray(logs.mean(axis=rest))


def _assembled(shapes: FloatArray, weights: FloatArray) -> FloatArray:
    """Matrix over one axis's nodes of the integrals of products of its functions or their slopes."""
    local = shapes.T @ (weights.T[:, :, None] * shapes)
    order = shapes.shape[1] - 1
    matrix = np.zeros((order * len(local) + 1,) * 2)
    for k, block in enumerate(local):
        matrix[order * k : order * (k + 1) + 1, order * k : order * (k + 1) + 1] += block
    return matrix


def _eigenvectors(stiff: FloatArray, mass: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Values and vectors T of stiff T = mass T diag(values) with T^T mass T = 1, values ascending."""
    inverse = np.linalg.inv(np.linalg.cholesky(mass))
    reduced = inverse @ stiff @ inverse.T
    values, vectors = np.linalg.eigh((reduced + reduced.T) / 2)
    return values, inverse.T @ vectors
