"""Factors slab by slab against dense algebra."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import sparse

from ringbalance.verification.navier_stokes.linear import Factors, factorize_layers, layers_of


def _matrix(slabs: int, seed: int) -> tuple[sparse.csc_matrix, np.ndarray]:
    """A matrix of dense elements: each slab has two elements that share its faces and their own unknowns."""
    rng = np.random.default_rng(seed)
    face, inside, element_dofs, slab = 4, 5, [], []
    first_inside = face * (slabs + 1)
    for k in range(slabs):
        own = first_inside + inside * k + np.arange(inside)
        for part in (own[:3], own[2:]):
            dofs = np.concatenate([face * k + np.arange(2 * face), part])
            element_dofs.append(dofs)
            slab.append(k)
    size = first_inside + inside * slabs
    matrix = np.zeros((size, size))
    for dofs in element_dofs:
        matrix[np.ix_(dofs, dofs)] += rng.normal(size=(dofs.size, dofs.size)) + 6 * np.eye(dofs.size)
    shuffle = rng.permutation(size)
    layers = layers_of(slab=np.array(slab), element_dofs=np.array(element_dofs).T, size=size)
    return sparse.csc_matrix(matrix[np.ix_(shuffle, shuffle)]), layers[shuffle]


@pytest.mark.parametrize("slabs", [1, 2, 3, 7])
def test_the_solution_is_that_of_dense_algebra(slabs: int) -> None:
    matrix, layers = _matrix(slabs, slabs)
    right = np.random.default_rng(0).normal(size=matrix.shape[0])
    x = factorize_layers(matrix=matrix, layers=layers).solve(right)
    assert np.allclose(x, np.linalg.solve(matrix.toarray(), right), rtol=1e-9, atol=1e-10)
    refined = Factors.of(matrix=matrix, along_diagonal=False, layers=layers).solve(right)
    assert np.abs(matrix @ refined - right).max() < 1e-12


def test_memory_grows_with_the_length_alone() -> None:
    held = [factorize_layers(matrix=m, layers=y).numbers() for m, y in (_matrix(n, n) for n in (4, 8, 12))]
    assert held[2] - held[1] == held[1] - held[0]


def test_slabs_that_are_not_neighbours_are_refused() -> None:
    with pytest.raises(ValueError, match="neighbours"):
        layers_of(slab=np.array([0, 2]), element_dofs=np.array([[0, 1], [1, 2]]), size=3)
