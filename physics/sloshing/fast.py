"""Waves of the surface that are faster than twice the speed, by their pressure, and how many are slower.

With Q as in `physics/sloshing/body.py` and J = e_z x, above s = 2 the displacement follows from the pressure,

    xi = (s^2 - 2 i s J)^-1 grad Q,   K(s) Q = M Q,   M: <Q/g, v> on the free surface,
    K(s): ([(grad_h Q + (2 i/s) J grad_h Q)/(s^2 - 4) + Q_z e_z/s^2], grad v).

K(s) is Hermitian, at least 0, and falls with s.  So the eigenvalues l_j(s) of K(s) Q = l M Q, in order, fall
with s, and each meets 1 once: the number of l_j(s) below 1, but for the constant's, is the number of waves
slower than s.  No wave between two others can be missed, however close they are, and there are no inertial
waves.  Fields on a mesh give upper bounds of all l_j, and of the frequencies.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np
from scipy.linalg import eigh
from scipy.sparse import csr_matrix, diags_array
from scipy.sparse.linalg import LinearOperator

from ringbalance.physics.sloshing.projection import Fields, gradient_errors
from ringbalance.scene.arrays import BoolArray, ComplexArray, FloatArray

LOWEST: Final = 2.1
"""Frequency ratio from which waves are taken from here: at 2 the problem changes its type."""
_SPARE: Final = 3
"""Fields improved beyond those asked for: a neighbour's shape is not left to chance."""
_ACCURACY: Final = 5e-4
"""Error of an eigenvalue by what the iteration has not removed; its bound is some ten times too high."""
_ITERATIONS: Final = 25
_NEGLIGIBLE: Final = 1e-9
"""Share of the surface in a field's energy, and of a field that is new, below which it is rounding."""


@dataclass(frozen=True, kw_only=True)
class FastWaves:
    """Waves of one surface faster than `LOWEST`."""

    slower: int
    """Number of slower waves of the surface; a lower bound where all waves asked for are slower."""
    frequency: FloatArray
    """s, lowest first, shape (n,)."""
    error: FloatArray
    """Of s, by mesh and iteration, shape (n,)."""
    vortical_share: FloatArray
    """Of the kinetic energy, what is no potential flow, shape (n,)."""


@dataclass(frozen=True)
class _Parts:
    """Matrices of K(s) and M, on a mesh or on a few fields."""

    across: csr_matrix | ComplexArray
    turned: csr_matrix | ComplexArray
    along: csr_matrix | ComplexArray
    mass: csr_matrix | ComplexArray

    def on(self, fields: ComplexArray) -> tuple[ComplexArray, ...]:
        """Each, of a mesh, times the columns; real and imaginary parts as columns of real numbers."""
        parts = np.ascontiguousarray(fields).view(np.float64)
        matrices = (self.across, self.turned, self.along, self.mass)
        return tuple(np.asarray(matrix @ parts).view(np.complex128) for matrix in matrices)


@dataclass(frozen=True)
class _Shapes:
    """The first waves in the space of some fields: coefficients, s and l, which is 1 from `LOWEST` on."""

    columns: ComplexArray
    frequency: FloatArray
    eigenvalue: FloatArray


@dataclass(frozen=True)
class _State:
    """The first waves as far as they are known."""

    small: _Parts
    basis: ComplexArray
    shapes: _Shapes
    found: ComplexArray
    """Nodal pressures."""
    fast: BoolArray
    """Those with l of 1; that others are slower is certain, as what is found bounds l from above."""
    steps: ComplexArray
    """By which one cycle would improve the fast ones."""
    left: FloatArray
    """Error of l_j that the iteration has not removed, bounded; zero for slower ones."""


def fast_waves(fields: Fields, start: FloatArray, waves: int) -> FastWaves:
    """Those among the first waves of the surface that are faster than `LOWEST`.

    Args:
        start: columns of nodal pressures, the constant among them.
        waves: number of the first waves, slower ones counted.
    Source: the equations at the head of this module, derived there; the iteration after Knyazev (2001),
        doi:10.1137/S1064827500366124, with each wave's own s.
    """
    parts, asked = _parts(fields), waves + 1
    state = _improved(fields, parts, _orthonormal(start.astype(np.complex128)), asked + _SPARE)
    before = state.found[:, :0]
    for _ in range(_ITERATIONS):
        if np.all(state.left[:asked] < _ACCURACY):
            break
        basis = np.concatenate([state.found, state.steps, before], axis=1)
        before = state.found[:, state.fast]
        state = _improved(fields, parts, _orthonormal(basis), asked + _SPARE)
    return _described(fields, state, asked)


def _improved(fields: Fields, parts: _Parts, basis: ComplexArray, count: int) -> _State:
    applied, adjoint = parts.on(basis), basis.conj().T
    small = _Parts(*(adjoint @ part for part in applied))
    shapes = _shapes(small, count)
    fast = shapes.eigenvalue >= 1
    residuals = _residuals(applied, shapes)[:, fast]
    steps, left = _columnwise(fields.shifted.cycle, residuals), np.zeros(fast.size)
    # K(s) is at least the stiffness over s (s + 2).
    left[fast] = np.einsum("ij,ij->j", residuals.conj(), steps).real
    left *= shapes.frequency * (shapes.frequency + 2)
    return _State(small, basis, shapes, basis @ shapes.columns, fast, steps, left)


def _parts(fields: Fields) -> _Parts:
    space = fields.space
    x, y, z = (csr_matrix(space.gradient[k::3]) for k in range(3))
    weights = diags_array(space.weights)
    along = csr_matrix(z.T @ (weights @ z))
    half = csr_matrix(y.T @ (weights @ x))
    return _Parts(csr_matrix(space.stiffness - along), csr_matrix(half - half.T), along, fields.surface_mass)


def _orthonormal(fields: ComplexArray) -> ComplexArray:
    """Columns of the same space, twice for rounding."""
    for _ in range(2):
        fields = fields / np.linalg.norm(fields, axis=0)
        squares, axes = np.linalg.eigh(fields.conj().T @ fields)
        kept = squares > _NEGLIGIBLE
        fields = fields @ (axes[:, kept] / np.sqrt(squares[kept]))
    return np.asarray(fields)


def _stiffness(parts: _Parts, s: float) -> ComplexArray:
    """K(s)."""
    return np.asarray((parts.across + (2j / s) * parts.turned) / (s**2 - 4) + parts.along / s**2)


def _slope(parts: _Parts, s: float) -> ComplexArray:
    """dK/ds."""
    across = -2 * s / (s**2 - 4) ** 2 * parts.across
    turned = -2j * (3 * s**2 - 4) / (s * (s**2 - 4)) ** 2 * parts.turned
    return np.asarray(across + turned - 2 / s**3 * parts.along)


def _eigenpairs(parts: _Parts, s: float) -> tuple[FloatArray, ComplexArray]:
    """l_j(s) from the lowest on, and columns with a surface of norm 1; what has no surface is left out."""
    stiff = _stiffness(parts, s)
    share, columns = eigh(parts.mass, (stiff + stiff.conj().T) / 2 + parts.mass)
    kept = np.flatnonzero(share > _NEGLIGIBLE)[::-1]
    return 1 / share[kept] - 1, columns[:, kept] / np.sqrt(share[kept])


def _shapes(parts: _Parts, count: int) -> _Shapes:
    values, columns = _eigenpairs(parts, LOWEST)
    count = min(count, values.size)
    result = _Shapes(columns[:, :count].copy(), np.full(count, LOWEST), values[:count].copy())
    for j in np.flatnonzero(values[:count] > 1):
        s, value = LOWEST, float(values[j])
        column = columns[:, j]
        for _ in range(_NEWTON):
            # Newton's method for 1/sqrt(l(s)), which is nearly linear in s.
            slope = float((column.conj() @ _slope(parts, s) @ column).real)
            s = max(LOWEST, s + 2 * value * (1 - np.sqrt(value)) / slope)
            pairs = _eigenpairs(parts, s)
            value, column = float(pairs[0][j]), pairs[1][:, j]
            if abs(value - 1) < _NEGLIGIBLE:
                break
        result.columns[:, j], result.frequency[j], result.eigenvalue[j] = column, s, max(value, 1.0)
    return result


_NEWTON: Final = 12


def _residuals(applied: tuple[ComplexArray, ...], shapes: _Shapes) -> ComplexArray:
    """K(s_j) Q_j - l_j M Q_j as columns."""
    across, turned, along, mass = (part @ shapes.columns for part in applied)
    s = shapes.frequency
    return np.asarray((across + 2j / s * turned) / (s**2 - 4) + along / s**2 - shapes.eigenvalue * mass)


def _columnwise(cycle: LinearOperator, fields: ComplexArray) -> ComplexArray:
    result = np.empty_like(fields)
    for column, field in zip(result.T, fields.T, strict=True):
        column[:] = cycle @ field.real + 1j * (cycle @ field.imag)
    return result


def _described(fields: Fields, state: _State, asked: int) -> FastWaves:
    """Frequencies, errors and vortical shares; the constant is no wave."""
    small, shapes = state.small, state.shapes
    below = int(np.sum(shapes.eigenvalue < 1))
    chosen = np.arange(below, max(below, min(asked, shapes.frequency.size)))
    frequency, columns = shapes.frequency[chosen], shapes.columns[:, chosen]
    slopes = [(c.conj() @ _slope(small, s) @ c).real for s, c in zip(frequency, columns.T, strict=True)]
    wrong = state.left[chosen] + _mesh_errors(fields, state.found[:, chosen], frequency)
    return FastWaves(
        slower=below - 1,
        frequency=frequency,
        error=wrong / np.abs(np.array(slopes)),
        vortical_share=1 - _potential_shares(fields, state, columns, frequency),
    )


def _mesh_errors(fields: Fields, pressures: ComplexArray, s: FloatArray) -> FloatArray:
    """Of each l_j: the energy K(s_j) of the gradients' errors."""
    space = fields.space
    wrong = gradient_errors(space, space.gradient @ pressures).astype(np.complex128)
    x, y, z = (wrong[k::3] * np.sqrt(space.weights)[:, None] for k in range(3))
    across, turned = _squares(x) + _squares(y), 2 * np.einsum("ij,ij->j", y.conj(), x).imag
    return np.asarray((across - 2 / s * turned) / (s**2 - 4) + _squares(z) / s**2)


def _squares(columns: ComplexArray) -> FloatArray:
    return np.asarray((np.abs(columns) ** 2).sum(axis=0))


def _potential_shares(fields: Fields, state: _State, columns: ComplexArray, s: FloatArray) -> FloatArray:
    """(grad phi)^2/xi^2 of the potential flow phi with the wave's motion of the surface.

    phi is the best in the basis and one cycle's correction: the share errs by the square of what is left.
    """
    space, small, basis = fields.space, state.small, state.basis
    flux = fields.surface_mass @ (basis @ columns)
    stiff = small.across + small.along
    coefficients = np.linalg.lstsq(stiff, basis.conj().T @ flux, rcond=_NEGLIGIBLE)[0]
    rest = flux - space.stiffness @ (basis @ coefficients)
    more = np.einsum("ij,ij->j", rest.conj(), _columnwise(fields.shifted.cycle, rest)).real
    potential = np.einsum("ij,ij->j", coefficients.conj(), stiff @ coefficients).real + more
    across, turned, along = (
        np.einsum("ij,ij->j", columns.conj(), part @ columns)
        for part in (small.across, small.turned, small.along)
    )
    swirl = ((s**2 + 4) * across + 4j * s * turned) / (s * (s**2 - 4)) ** 2
    return np.asarray(np.clip(potential / (swirl + along / s**4).real, 0.0, 1.0))
