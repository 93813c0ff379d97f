"""Small oscillations of the liquid in any chamber, in three dimensions, as a small matrix problem.

In the frame of the disc, with displacements xi that keep the volume and slide along the walls, lengths in
outer radii and times in 1/omega,

    xi'' + 2 e_z x xi' = - grad Q,   Q = p'/rho - G,   Q = g n . xi - G on the free surface,

g being the centrifugal gravity there, with that along a vertical shaft.  Tested with any such field u, the
pressure drops out but for the free surface:

    (xi'', u) + 2 (e_z x xi', u) + <g n . xi, n . u> = <G, n . u>.

So a Galerkin method on fields V has the mass matrix 1 (V orthonormal), an antisymmetric C, a symmetric A >= 0
and real frequencies: (-s^2 + 2 i s C + A) c = F.

Which fields.  Without rotation all waves are potential flows grad phi.  The same along the shaft they stay so
with rotation (Proudman: no vorticity is made where nothing varies along z), so potentials are exact for a
chamber that is the same along the shaft and waves that are, too.  Where a wave varies along the shaft, the
Coriolis force makes vorticity: the body's equation becomes Q_xx + Q_yy + (1 - 4/s^2) Q_zz = 0, elliptic for s
> 2 and hyperbolic below.  There the liquid has inertial waves of its own at a dense set of frequencies, and
what a disc can show of a surface wave is a resonance among them.  The fields are therefore grad phi_n and,
level by level, the part of e_z x u that is such a field (Lanczos' method for the Coriolis operator): each
level makes the flow of the waves exact to two further powers of the Coriolis force, and small scales, to
which viscosity leaves nothing, do not enter.  The projection of e_z x u takes grad chi away, with chi = 0 on
the free surface and (grad chi, grad v) = (e_z x u, grad v).
"""

from __future__ import annotations

import warnings
from dataclasses import dataclass
from itertools import product
from typing import Final

import numpy as np
from scipy.linalg import LinAlgWarning
from scipy.sparse.linalg import lobpcg, splu

from ringbalance.mesh.liquid_body import Level
from ringbalance.physics.pressure.tetrahedra import TetrahedronSpace
from ringbalance.physics.sloshing.fast import FastWaves, fast_waves
from ringbalance.physics.sloshing.projection import TOLERANCE, Fields, gradient_errors
from ringbalance.scene.arrays import ComplexArray, FloatArray

_NOISE: Final = 0.05
"""Part of a field of norm 1 that is new, below which it is the mesh's error and not taken up."""
_PLANE: Final = 4
"""Highest power of x + i y in the first level."""
_ROUGH: Final = 0.02
"""Squared error of a potential, relative, above which the mesh does not resolve it, and it is left out."""
_SMALL: Final = 1e-3
"""As `_NOISE`, for potentials: these are smooth."""
_RANDOM: Final = 3
"""Random fields among the first guesses: a wave that is orthogonal to all low powers is found, too."""
_ITERATIONS: Final = 9


@dataclass(frozen=True, kw_only=True)
class _WallMean:
    """Mean of p'/rho over a wall under G = (x + i y) exp(i s t): i s flow . c + surface . c + drive."""

    flow: FloatArray
    """Part of the Coriolis force on the flow, shape (n,)."""
    surface: FloatArray
    """Part of the moved surface, shape (n,)."""
    drive: complex
    """Part of the force itself."""
    still: complex
    """The mean under a surface that follows G at once."""


@dataclass(frozen=True, kw_only=True)
class ReducedWaves:
    """The small problem; lengths in outer radii, times in 1/omega."""

    coriolis: FloatArray
    """C, antisymmetric, shape (n, n)."""
    stiffness: FloatArray
    """A, symmetric, at least 0."""
    wall_loss: FloatArray
    """Integral of the velocity along the walls, squared."""
    outflow: FloatArray
    """Rows that take c to the integrals of n . xi, x n . xi and y n . xi over the surface, shape (3, n)."""
    levels: tuple[int, ...]
    """Number of fields up to each level; the first are potentials."""
    squared_errors: FloatArray
    """Of the gradient of each potential, relative, estimated on its own mesh."""
    left_out: float
    """Largest squared part of a field's Coriolis force that was taken for the mesh's error."""
    displacement: FloatArray
    """Rows that take c to n . xi at the nodes of the surface, shape (nodes, n)."""
    quasi_static: ComplexArray
    """Integrals of (1, x, y) n . xi of a surface that follows G = x + i y at once, shape (3,)."""
    wall: _WallMean
    fast: FastWaves
    residual: float
    """Largest relative one of the linear solves."""
    excess: float
    """Largest residual over the one asked for."""


def reduced_waves(
    *, space: TetrahedronSpace, level: Level, wall: str, waves: int, potentials: int, levels: int
) -> ReducedWaves:
    """Choose the fields on one mesh and assemble the small problem.

    Args:
        space: on the liquid's body, lengths in outer radii; `level` in the same unit.
        wall: boundary over which the mean pressure is taken.
        waves: of the surface, of which those too fast for these fields are found by their pressure.
        potentials: number of waves without rotation in the first level, at most 19, next to the two that
            gravity across the shaft drives.
        levels: of the Coriolis force, at least 1.
    Source: the equations at the head of this module, derived there; Lanczos' method as in Golub and Van Loan,
        "Matrix Computations", chapter 10.
    """
    fields = Fields(space, level)
    start = guesses(fields, potentials + 1)
    potential = _potentials(fields, start)
    errors = _squared_errors(space, space.gradient @ potential)
    resolved = errors < _ROUGH
    first, _ = fields.new_directions(fields.gradient @ potential[:, resolved], [], _NOISE)
    plane = fields.gradient @ fields.harmonic(_plane_functions(space.body.nodes))
    blocks = [np.concatenate([first, fields.new_directions(plane, [first], _SMALL)[0]], axis=1)]
    left_out = []
    for _ in range(levels):
        block, least = fields.new_directions(fields.coriolis_part(blocks[-1]), blocks, _NOISE)
        blocks.append(block)
        left_out.append(least)
    # Without rotation they are close to the waves; the constant and what is random complete them.
    first_guesses = np.concatenate([start[:, :1], potential, start[:, -_RANDOM:]], axis=1)
    fast = fast_waves(fields, first_guesses, waves)
    return _assembled(fields, wall, blocks, errors[resolved], max(left_out), fast)


def _plane_functions(places: FloatArray) -> FloatArray:
    """Real and imaginary parts of (x + i y)^m as columns, of about the same size."""
    turning = places[:, 0] + 1j * places[:, 1]
    powers = (turning / np.abs(turning).max())[:, None] ** np.arange(1, _PLANE + 1)
    return np.concatenate([powers.real, powers.imag], axis=1)


def guesses(fields: Fields, count: int) -> FloatArray:
    """Low powers of x, y and z, the constant first, and random fields on the surface."""
    x, y, z = fields.space.body.nodes.T
    powers = sorted((p for p in product(range(4), repeat=3) if sum(p) < 4), key=sum)[:count]
    noise = fields.surface_mass @ np.random.default_rng(1).standard_normal((x.size, _RANDOM))
    drawn = np.stack([fields.shifted.cycle @ column for column in noise.T], axis=1)
    powers_there = np.stack([x**i * y**j * z**k for i, j, k in powers], axis=1)
    return np.concatenate([powers_there, drawn / np.abs(drawn).max(axis=0)], axis=1)


def _potentials(fields: Fields, start: FloatArray) -> FloatArray:
    """Columns phi of the slowest waves without rotation, K phi = s^2 M phi, (grad phi)^2 = 1."""
    space, mass, near = fields.space, fields.surface_mass, fields.shifted
    with warnings.catch_warnings():
        # It warns that its last fields are rough, or nearly the same; they need not be better.
        warnings.simplefilter("ignore", UserWarning)
        warnings.simplefilter("ignore", LinAlgWarning)
        values, shapes = lobpcg(
            mass, start, B=near.matrix, M=near.cycle, largest=True, tol=1e-14, maxiter=_ITERATIONS
        )
    # The largest belongs to the constant.
    slow = np.argsort(-values)[1 : start.shape[1] - _RANDOM]
    waves = fields.harmonic(shapes[:, slow])
    lower = np.linalg.cholesky(waves.T @ (space.stiffness @ waves))
    small = np.linalg.solve(lower, np.linalg.solve(lower, waves.T @ (mass @ waves)).T)
    _, axes = np.linalg.eigh((small + small.T) / 2)
    return np.asarray(waves @ np.linalg.solve(lower.T, axes[:, ::-1]))


def _assembled(
    fields: Fields,
    wall: str,
    blocks: list[FloatArray],
    errors: FloatArray,
    left_out: float,
    fast: FastWaves,
) -> ReducedWaves:
    surface = fields.surface
    coriolis = np.block([[fields.turned_products(left, right) for right in blocks] for left in blocks])
    sides = np.concatenate([block[fields.body_rows :] for block in blocks], axis=1)
    flux = np.concatenate([fields.along_gradients(block)[surface] for block in blocks], axis=1)
    over = splu(fields.surface_mass[surface][:, surface].tocsc()).solve(flux)  # g n . xi
    stiffness = flux.T @ over
    places = fields.space.body.nodes[surface]
    moments = np.stack([np.ones(len(places)), places[:, 0], places[:, 1]])
    return ReducedWaves(
        coriolis=(coriolis - coriolis.T) / 2,
        stiffness=(stiffness + stiffness.T) / 2,
        wall_loss=np.asarray(sides.T @ sides),
        outflow=moments @ flux,
        levels=tuple(int(n) for n in np.cumsum([block.shape[1] for block in blocks])),
        squared_errors=errors,
        left_out=left_out,
        displacement=over / np.linalg.norm(fields.level.gradient(places), axis=1)[:, None],
        quasi_static=_quasi_static(fields),
        wall=_wall_mean(fields, wall, blocks, over),
        fast=fast,
        residual=fields.pinned.residual,
        excess=fields.pinned.excess,
    )


def _quasi_static(fields: Fields) -> ComplexArray:
    """Integrals of (1, x, y) (G - c)/g over the surface, c such that the first vanishes."""
    places, mass = fields.space.body.nodes, fields.surface_mass
    rows = np.stack([np.ones(len(places)), places[:, 0], places[:, 1]])
    matrix = rows @ (mass @ rows.T)
    drive = matrix[:, 1] + 1j * matrix[:, 2]
    return np.asarray(drive - matrix[:, 0] * drive[0] / matrix[0, 0])


def _wall_mean(fields: Fields, wall: str, blocks: list[FloatArray], over: FloatArray) -> _WallMean:
    """Mean of p'/rho = Q + G over a wall, Q = [g n . xi - G] - 2 i s chi.

    The bracket is continued harmonically from the surface; chi is the potential that projecting e_z x xi
    takes away.  One solve with the mean itself on the right gives both for all fields.
    """
    space, surface = fields.space, fields.surface
    facets = space.facets(wall)
    mean = facets.load(facets.weights, unknowns=space.unknowns) / facets.weights.sum()
    adjoint = np.zeros((space.unknowns, 1))
    adjoint[fields.inner] = fields.pinned.solve(mean[fields.inner][:, None], adjoint[fields.inner], TOLERANCE)
    drawn = fields.gradient @ adjoint
    chi = np.concatenate([fields.turned_products(drawn, block) for block in blocks], axis=1)
    onto = mean[surface] - (space.stiffness @ adjoint)[surface, 0]
    places = space.body.nodes[:, 0] + 1j * space.body.nodes[:, 1]
    over_surface = np.asarray(fields.surface_mass @ np.ones(space.unknowns))
    still = complex(mean @ places - (over_surface @ places) / over_surface.sum())
    drive = complex(mean @ places - onto @ places[surface])
    return _WallMean(flow=-2 * chi[0], surface=onto @ over, drive=drive, still=still)


def _squared_errors(space: TetrahedronSpace, gradients: FloatArray) -> FloatArray:
    """Of each column's gradient, relative; of an eigenvalue it is the relative error."""
    weights = np.repeat(space.weights, 3)
    wrong = gradient_errors(space, gradients)
    return np.asarray((weights @ np.abs(wrong) ** 2) / (weights @ gradients**2))
