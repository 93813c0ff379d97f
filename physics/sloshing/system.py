"""Small oscillations of the liquid ring in one chamber, as small matrices on its free surface.

In the frame of the disc a small planar flow obeys u_t + 2 omega e_z x u = -grad p'/rho + grad G.  It stays
free of vorticity, so it has a potential and a stream function, u = grad phi = (psi_y, -psi_x), and
e_z x u = grad psi.  The walls are one streamline, psi = 0.  At the free surface r = a, where centrifugal
gravity is omega^2 a, with q = n . u out of the liquid and everything turning as exp(i s omega t),

    s^2 phi - 2 i s psi - a q = -i s (G + c)        lengths in outer radii, times in 1/omega.

Tested with q' = -d(psi')/d(arc), whose mean vanishes and takes the unknown c along, and with Green's formula
for (phi, q') = int grad psi . grad psi', it becomes

    (-s^2 S + 2 i s C + A + i s sqrt(i s E) W) psi = i s F

with S the kinetic energy (the stiffness matrix condensed onto the surface), C antisymmetric, A the
centrifugal stiffness, W what the Stokes layers on the walls take (E = nu/(omega R2^2)), and F = (G, q').

The pressure is p'/rho = G + c - i s phi - 2 psi, and its mean over the free surface's moved place is zero, so
the mean over the outer wall, where psi = 0, is

    mean_w p'/rho = mean_w G - mean_a G - i s (mean_w phi - mean_a phi) + 2 mean_a psi.

The difference of phi is int grad psi . grad chi for any chi that is 0 on one plate, 1 on the other, and
grows evenly along the arcs of surface and wall: rot chi flows in through the one and out through the other.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from scipy.linalg import cholesky, solve_triangular
from scipy.sparse import csc_matrix
from scipy.sparse.linalg import splu

from ringbalance.mesh.chamber import chamber_mesh
from ringbalance.mesh.tensor_cells import line_shapes
from ringbalance.physics.pressure.sparse import stiffness_matrix
from ringbalance.scene.arrays import FloatArray, IntArray
from ringbalance.scene.models import Disc

_GAUSS, _WEIGHT = np.polynomial.legendre.leggauss(4)
_SHAPE, _SLOPE = line_shapes(np.asarray(_GAUSS, dtype=np.float64))


@dataclass(frozen=True, kw_only=True)
class SloshingSystem:
    """The condensed problem on one mesh; lengths in outer radii, times in 1/omega, per unit depth."""

    kinetic: FloatArray
    """S, shape (n, n), symmetric, positive."""
    coriolis: FloatArray
    """C, antisymmetric."""
    centrifugal: FloatArray
    """A, symmetric, positive."""
    wall_loss: FloatArray
    """W, symmetric, positive, the two ends included."""
    outflow: FloatArray
    """Rows that take psi to the integrals of q, x q and y q over the free surface, shape (3, n)."""
    flux: FloatArray
    """Rows that take psi to q at `places`, shape (m, n)."""
    places: FloatArray
    """Places on the free surface, shape (2, m)."""
    potential: FloatArray
    """Row that takes psi to the mean of phi over the outer wall less that over the surface, shape (n,)."""
    surface_mean: FloatArray
    """Row that takes psi to its mean over the free surface, shape (n,)."""
    wall_drive: complex
    """Mean of x + i y over the outer wall less that over the free surface: the pressure of a surface that
    follows gravity at once."""

    def natural_frequencies(self) -> FloatArray:
        """All positive s, ascending.

        With S = L L^T and y = L^T psi the oscillator y'' + 2 C y' + A y = 0 is d/dt (y', A^(1/2) y) = B (...)
        with a real antisymmetric B, whose eigenvalues are +- i s.
        """
        lower = cholesky(self.kinetic, lower=True)

        def reduced(matrix: FloatArray) -> FloatArray:
            half = solve_triangular(lower, matrix, lower=True)
            return np.asarray(solve_triangular(lower, half.T, lower=True).T, dtype=np.float64)

        turning, stiff = reduced(self.coriolis), reduced(self.centrifugal)
        squares, shapes = np.linalg.eigh((stiff + stiff.T) / 2)
        root = (shapes * np.sqrt(np.maximum(squares, 0.0))) @ shapes.T
        first_order = np.block([[turning.T - turning, -root], [root, np.zeros_like(root)]])
        ratios = np.linalg.eigvalsh(1j * first_order)
        return np.asarray(ratios[squares.size :], dtype=np.float64)


@lru_cache(maxsize=128)
def sloshing_system(*, disc: Disc, surface_radius: float, cells: tuple[int, int]) -> SloshingSystem:
    """Assemble and condense the problem on one mesh.

    Args: `disc`: the disc; its width counts in the loss at the two ends alone. `surface_radius`: a, m.
        `cells`: along the radius and the angle.
    Raises: ValueError: as `chamber_mesh`.
    Source: the equations at the head of this module, derived there.
    """
    chamber = chamber_mesh(disc=disc, surface_radius=surface_radius, cells=cells)
    stiffness = csc_matrix(stiffness_matrix(chamber))
    grid, nodes = chamber.grid, chamber.nodes
    kept, inner = grid[0, 1:-1], grid[1:-1, 1:-1].ravel()
    extension = _extension(stiffness, inner, kept)
    condensed = stiffness[kept][:, kept] + stiffness[kept][:, inner] @ extension[kept.size :]
    kinetic = np.asarray((condensed + condensed.T) / 2, dtype=np.float64)
    surface = _Line.of(nodes[:, grid[0]])
    # The Stokes layers on the two ends see all of the flow, so their share is the kinetic energy's.
    ends = 2 * disc.outer_radius / disc.axial_width * kinetic
    free = np.concatenate([kept, inner])
    walls = np.concatenate([grid[:, 0], grid[-1, 1:-1], grid[::-1, -1]])
    slip = stiffness[walls[1:-1]][:, free] @ extension
    return SloshingSystem(
        kinetic=kinetic,
        coriolis=-surface.integral(_SLOPE, _SHAPE, np.ones_like(surface.stretch))[1:-1, 1:-1],
        centrifugal=surface.integral(_SLOPE, _SLOPE, surface.radius / surface.stretch)[1:-1, 1:-1],
        wall_loss=ends + _loss_at_sides(_Line.of(nodes[:, walls]), slip),
        outflow=surface.outflow()[:, 1:-1],
        flux=surface.flux()[:, 1:-1],
        places=surface.places.reshape(2, -1),
        potential=_even_growth(grid) @ (stiffness[:, free] @ extension),
        surface_mean=surface.mean()[1:-1],
        wall_drive=_Line.of(nodes[:, grid[-1]]).mean_place - surface.mean_place,
    )


def _even_growth(grid: IntArray) -> FloatArray:
    """chi at all nodes: the share of the arc up to each, cells along an arc being of equal length."""
    chi = np.empty(grid.size)
    chi[grid] = np.linspace(0.0, 1.0, grid.shape[1])
    return chi


@dataclass(frozen=True, kw_only=True)
class _Line:
    """A chain of quadratic elements along a boundary; arrays of elements by quadrature points."""

    places: FloatArray
    """Shape (2, elements, points)."""
    stretch: FloatArray
    """Arc length per unit of the reference coordinate, which runs from -1 to 1."""

    @classmethod
    def of(cls, nodes: FloatArray) -> _Line:
        """The chain through nodes of shape (2, 2 elements + 1)."""
        ends = np.stack([nodes[:, :-2:2], nodes[:, 1::2], nodes[:, 2::2]])
        tangent = np.einsum("kie,kq->ieq", ends, _SLOPE)
        return cls(places=np.einsum("kie,kq->ieq", ends, _SHAPE), stretch=np.hypot(*tangent))

    @property
    def radius(self) -> FloatArray:
        return np.asarray(np.hypot(*self.places), dtype=np.float64)

    def integral(self, first: FloatArray, second: FloatArray, factor: FloatArray) -> FloatArray:
        """Matrix of the integrals of factor first second over the reference coordinate."""
        local = np.einsum("iq,jq,eq,q->eij", first, second, factor, _WEIGHT)
        count = 2 * factor.shape[0] + 1
        matrix = np.zeros((count, count))
        for k, block in enumerate(local):
            matrix[2 * k : 2 * k + 3, 2 * k : 2 * k + 3] += block
        return matrix

    def outflow(self) -> FloatArray:
        """Integrals of q, x q and y q with q = -d(psi)/d(arc), rows by node."""
        factors = np.stack([np.ones_like(self.stretch), *self.places])
        local = -np.einsum("jq,feq,q->fej", _SLOPE, factors, _WEIGHT)
        rows = np.zeros((3, 2 * self.stretch.shape[0] + 1))
        for j in range(3):
            rows[:, j : j + local.shape[1] * 2 : 2][:, : local.shape[1]] += local[:, :, j]
        return rows

    def mean(self) -> FloatArray:
        """Row that takes values at the nodes to their mean over the arc."""
        # The shapes sum to one, so the columns of their mass matrix do to each one's integral.
        row = self.integral(_SHAPE, _SHAPE, self.stretch).sum(axis=0)
        return np.asarray(row / row.sum(), dtype=np.float64)

    @property
    def mean_place(self) -> complex:
        """Mean of x + i y over the arc."""
        x, y = np.einsum("feq,eq,q->f", self.places, self.stretch, _WEIGHT)
        return complex(x, y) / float(np.einsum("eq,q->", self.stretch, _WEIGHT))

    def flux(self) -> FloatArray:
        """Values of q at the places, one row a place."""
        elements, points = self.stretch.shape
        rows = np.zeros((elements, points, 2 * elements + 1))
        for k in range(elements):
            rows[k, :, 2 * k : 2 * k + 3] = -_SLOPE.T / self.stretch[k][:, None]
        return rows.reshape(elements * points, -1)


def _loss_at_sides(walls: _Line, slip: FloatArray) -> FloatArray:
    """Integral of the squared velocity along the plates and the outer wall, from the flux through them.

    The surface's two edges belong to the free surface, too; there the velocity is taken as zero.
    """
    mass = walls.integral(_SHAPE, _SHAPE, walls.stretch)[1:-1, 1:-1]
    return np.asarray(slip.T @ np.linalg.solve(mass, slip), dtype=np.float64)


def _extension(stiffness: csc_matrix, inner: IntArray, kept: IntArray) -> FloatArray:
    """Harmonic continuation into the liquid of each unknown on the surface, these first."""
    into = stiffness[inner][:, kept].toarray()
    continued = splu(stiffness[inner][:, inner].tocsc()).solve(into)
    return np.vstack([np.eye(kept.size), -continued])
