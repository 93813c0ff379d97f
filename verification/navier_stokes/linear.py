"""Sparse factors of a saddle-point matrix: the sparsest ordering first, checked, with pivoting in reserve.

On quadrilaterals, eliminating along the diagonal keeps the factors three to four times sparser than partial
pivoting does, because fill-in gives the pressure block its diagonal in time; on triangles it does not, and
pivots off the diagonal make the factors far denser.  It is not safe by construction, so every solve checks
its residual, refines it, and falls back on partial pivoting when that does not help.

A long, thin mesh is solved directly, slab by slab along it.  Unknowns inside a slab couple only with its two
faces.  They are eliminated first, then the faces one after the other: dense blocks throughout, at the speed
of matrix products, where a general sparse factorization of so dense a three-dimensional element takes many
times as long.  Rows are exchanged inside a block only; what that costs in accuracy is seen in the residual
and made good by iterative refinement.
"""

from __future__ import annotations

import warnings
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.linalg import LinAlgWarning, lu_factor, lu_solve
from scipy.sparse.linalg import splu

from ringbalance.scene.arrays import FloatArray, IntArray

_GOOD, _USABLE, _REFINEMENTS = 1e-12, 1e-8, 3


@dataclass(eq=False)
class Factors:
    """A matrix with its factors; made by `Factors.of`."""

    matrix: Any
    factors: Any
    pivoted: bool

    @classmethod
    def of(cls, *, matrix: Any, along_diagonal: bool, layers: IntArray | None = None) -> Factors:
        """Factors of a square CSC matrix of symmetric pattern. Raises: RuntimeError: it is singular.

        Args: `along_diagonal`: try without pivoting first. `layers`: of the unknowns on a long, thin mesh,
            from `layers_of`; None for a mesh of any shape.
        """
        if layers is not None:
            return cls(matrix=matrix, factors=factorize_layers(matrix=matrix, layers=layers), pivoted=True)
        if not along_diagonal:
            return cls(matrix=matrix, factors=_with_pivoting(matrix), pivoted=True)
        try:
            symmetric = {"SymmetricMode": True}
            factors = splu(matrix, permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options=symmetric)
        except RuntimeError:
            return cls(matrix=matrix, factors=_with_pivoting(matrix), pivoted=True)
        return cls(matrix=matrix, factors=factors, pivoted=False)

    def solve(self, right: FloatArray) -> FloatArray:
        """Solution of A x = b, refined, with pivots if need be. Raises: RuntimeError: A is singular."""
        x, gap = _refined(self.matrix, self.factors, right)
        if gap > _USABLE and not self.pivoted:
            self.factors, self.pivoted = _with_pivoting(self.matrix), True
            x, gap = _refined(self.matrix, self.factors, right)
        return x


def _refined(matrix: Any, factors: Any, right: FloatArray) -> tuple[FloatArray, float]:
    """Solution with up to three refinements, and its relative residual."""
    scale = float(np.abs(right).max()) or 1.0
    x = np.asarray(factors.solve(right), dtype=np.float64)
    gap = np.inf
    for _ in range(_REFINEMENTS):
        residual = right - matrix @ x
        gap, before = float(np.abs(residual).max()) / scale, gap
        if gap <= _GOOD or not gap < before / 2:
            break
        x = x + factors.solve(residual)
    return x, gap if np.isfinite(gap) else np.inf


def _with_pivoting(matrix: Any) -> Any:
    return splu(matrix, permc_spec="COLAMD")


@dataclass(frozen=True, kw_only=True, eq=False)
class _Slab:
    """An eliminated slab: its own unknowns, and those of the faces it touches."""

    own: IntArray
    faces: IntArray
    factors: Any
    to_faces: Any
    """Sparse block (own, faces)."""
    from_faces: Any
    """Sparse block (faces, own)."""


@dataclass(frozen=True, kw_only=True, eq=False)
class _Face:
    """A face between two slabs, with its coupling to the next face."""

    own: IntArray
    factors: Any
    ahead: FloatArray
    """Inverse of the diagonal block times the block (own, next)."""
    behind: FloatArray
    """Block (next, own)."""


@dataclass(frozen=True, kw_only=True, eq=False)
class _LayeredFactors:
    """Factors of a matrix whose unknowns lie in slabs and on the faces between them."""

    slabs: tuple[_Slab, ...]
    faces: tuple[_Face, ...]

    def solve(self, right: FloatArray) -> FloatArray:
        """Solution of A x = b."""
        x = np.array(right, dtype=np.float64)
        for slab in self.slabs:
            x[slab.own] = _solved(slab.factors, x[slab.own])
            x[slab.faces] -= slab.from_faces @ x[slab.own]
        for face, following in zip(self.faces, self.faces[1:], strict=False):
            x[face.own] = _solved(face.factors, x[face.own])
            x[following.own] -= face.behind @ x[face.own]
        if self.faces:
            x[self.faces[-1].own] = _solved(self.faces[-1].factors, x[self.faces[-1].own])
        for face, following in reversed(list(zip(self.faces, self.faces[1:], strict=False))):
            x[face.own] -= face.ahead @ x[following.own]
        for slab in self.slabs:
            x[slab.own] -= _solved(slab.factors, slab.to_faces @ x[slab.faces])
        return x

    def numbers(self) -> int:
        """How many floating-point numbers the factors hold. Returns: The count."""
        dense = sum(s.factors[0].size for s in self.slabs)
        return int(dense + sum(f.factors[0].size + f.ahead.size + f.behind.size for f in self.faces))


def _factored(block: FloatArray) -> Any:
    """LU factors of a dense block; a singular one leaves infinities, which the solve's residual shows."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", LinAlgWarning)
        return lu_factor(block, overwrite_a=True, check_finite=False)


def _solved(factors: Any, right: FloatArray) -> FloatArray:
    return np.asarray(lu_solve(factors, right, check_finite=False), dtype=np.float64)


def layers_of(*, slab: IntArray, element_dofs: IntArray, size: int) -> IntArray:
    """Layer of every unknown: 2 k inside slab k, 2 k + 1 on the face between slabs k and k + 1.

    Args: `slab`: by element, shape (elements,). `element_dofs`: shape (local, elements).
    Raises: ValueError: an unknown shared by slabs that are not neighbours.
    """
    low, high = np.full(size, np.iinfo(np.int64).max), np.full(size, -1)
    for dofs in element_dofs:
        np.minimum.at(low, dofs, slab)
        np.maximum.at(high, dofs, slab)
    if np.any(high - low > 1):
        raise ValueError("an unknown is shared by slabs that are not neighbours")
    return np.asarray(low + high, dtype=np.int64)


def _eliminated(
    rows: Any, own: IntArray, faces: IntArray, sizes: tuple[int, int]
) -> tuple[_Slab, FloatArray]:
    """A slab's factors, and what its elimination takes from the block of its faces."""
    to_faces, from_faces = rows[own][:, faces], rows[faces][:, own]
    factors = _factored(rows[own][:, own].toarray(order="F"))
    solved = _solved(factors, to_faces.toarray(order="F"))
    kept = _Slab(own=own, faces=faces, factors=factors, to_faces=to_faces, from_faces=from_faces)
    return kept, np.asarray(from_faces.toarray() @ solved).reshape(sum(sizes), sum(sizes))


def factorize_layers(*, matrix: Any, layers: IntArray) -> _LayeredFactors:
    """Factors slab by slab of a matrix whose unknowns lie in layers from `layers_of`."""
    rows = matrix.tocsr()
    members = [np.flatnonzero(layers == m) for m in range(int(layers.max()) + 1)]
    if len(members) % 2 == 0:
        members.append(np.zeros(0, dtype=np.int64))
    slabs: list[_Slab] = []
    faces: list[_Face] = []
    pending: FloatArray | None = None
    for k in range(0, len(members), 2):
        before = members[k - 1] if k > 0 else members[0][:0]
        after = members[k + 1] if k + 1 < len(members) else members[0][:0]
        slab, taken = _eliminated(
            rows, members[k], np.concatenate([before, after]), (before.size, after.size)
        )
        slabs.append(slab)
        split = before.size
        if pending is not None:
            faces.append(_face(rows, before, after, pending - taken[:split, :split], taken, split))
        pending = rows[after][:, after].toarray() - taken[split:, split:]
        if faces:
            pending -= faces[-1].behind @ faces[-1].ahead
    return _LayeredFactors(slabs=tuple(slabs), faces=tuple(faces))


def _face(
    rows: Any, own: IntArray, following: IntArray, diagonal: FloatArray, taken: FloatArray, split: int
) -> _Face:
    factors = _factored(np.asfortranarray(diagonal))
    coupling = rows[own][:, following].toarray() - taken[:split, split:]
    return _Face(
        own=own,
        factors=factors,
        ahead=_solved(factors, coupling),
        behind=rows[following][:, own].toarray() - taken[split:, :split],
    )
