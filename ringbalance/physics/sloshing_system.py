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
centrifugal stiffness, W the loss in the Stokes layers on the walls (E = nu/(omega R2^2)), and F = (G, q').

The pressure is p'/rho = G + c - i s phi - 2 psi, and its mean over the displaced free surface is zero, so
the mean over the outer wall, where psi = 0, is

    mean_w p'/rho = mean_w G - mean_a G - i s (mean_w phi - mean_a phi) + 2 mean_a psi

with int grad phi . grad v = int rot psi . grad v.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np
from scipy.linalg import cholesky, solve_triangular
from scipy.sparse.linalg import splu
from skfem import Basis, BilinearForm, ElementQuad2, ElementTriP2, FacetBasis, LinearForm
from skfem.helpers import grad
from skfem.mapping import MappingIsoparametric
from skfem.models.poisson import mass, unit_load

from ringbalance.mesh.chamber import FREE_SURFACE, chamber_mesh
from ringbalance.mesh.section import LiquidSection, middle_section
from ringbalance.physics.cell_mapping import CellMapping
from ringbalance.physics.pressure.solve import stiffness
from ringbalance.scene.arrays import FloatArray, IntArray
from ringbalance.scene.chamber_file.record import OUTER_WALL, ChamberGeometry
from ringbalance.scene.models import Disc


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
    """Rows that take psi to q at points of the free surface, shape (m, n)."""
    nodes: IntArray
    """Nodes of the mesh to which the values of psi belong, shape (n,)."""
    potential: FloatArray
    """Row that takes psi to the mean of phi over the outer wall less that over the surface, shape (n,)."""
    surface_mean: FloatArray
    """Row that takes psi to its mean over the free surface, shape (n,)."""
    wall_drive: complex
    """Mean of x + i y over the outer wall less that over the free surface: the pressure with a surface that
    follows gravity instantly."""

    def natural_frequencies(self) -> FloatArray:
        """All natural frequencies s > 0 over the speed, ascending.

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


@lru_cache(maxsize=512)
def sloshing_system(*, disc: Disc, surface_radius: float, cells: tuple[int, int]) -> SloshingSystem:
    """Assemble and condense the problem in the chamber of a disc, on one mesh.

    Args: `disc`: the disc, whose width enters only the loss at the two ends. `surface_radius`: a, m.
        `cells`: along the radius and the angle.
    Raises: ValueError: as `chamber_mesh`.
    """
    chamber = chamber_mesh(disc=disc, surface_radius=surface_radius, cells=cells)
    return section_system(chamber.mesh, ends=2 * disc.outer_radius / disc.axial_width)


@lru_cache(maxsize=128)
def imported_system(
    geometry: ChamberGeometry, *, surface_radius: float, width: float, coarse: bool
) -> tuple[SloshingSystem, float]:
    """System in the middle section of an imported chamber, and its unit of length, m.

    Args: `coarse`: true for a mesh on the corners of the cells alone.
    Raises: ValueError: as `middle_section`.
    """
    section: LiquidSection = middle_section(geometry, surface_radius=surface_radius, coarse=coarse)
    return section_system(section.mesh, ends=2 * section.scale / width), section.scale


def section_system(mesh: Any, *, ends: float) -> SloshingSystem:
    """Assemble and condense the problem on any section.

    Args: `mesh`: lengths in outer radii, its boundaries named; all but the free surface are one wall.
        `ends`: area of the two ends over that of the section, times outer radius over width: 2 R2/B.
    Source: the equations at the head of this module, derived there.
    """
    mapping: Any = mesh.mapping()
    element: Any = ElementTriP2()
    if isinstance(mapping, MappingIsoparametric):
        mapping, element = _FilmMapping(mesh), ElementQuad2()
    basis = Basis(mesh, element, mapping=mapping, intorder=4)

    def on_facets(facets: Any) -> Any:
        return FacetBasis(mesh, element, mapping=mapping, facets=facets, intorder=6)

    top = on_facets(FREE_SURFACE)
    sides = on_facets(np.setdiff1d(mesh.boundary_facets(), mesh.boundaries[FREE_SURFACE]))
    surface, walls = basis.get_dofs(top.find).all(), basis.get_dofs(sides.find).all()
    free, inner = np.setdiff1d(surface, walls), np.setdiff1d(np.arange(basis.N), np.union1d(surface, walls))
    matrix = stiffness(basis)
    # Harmonic continuation into the liquid of each unknown on the surface.
    extension = np.zeros((basis.N, free.size))
    extension[free] = np.eye(free.size)
    into = matrix[inner][:, free].toarray()
    extension[inner] = -splu(matrix[inner][:, inner].tocsc()).solve(into)
    condensed = matrix[free] @ extension
    kinetic = np.asarray((condensed + condensed.T) / 2, dtype=np.float64)
    # The Stokes layers on the two ends cover the whole flow, so their loss is proportional to the kinetic
    # energy. Along the sides it is the integral of the squared velocity, from the flux through them; at the
    # surface's two edges the velocity is taken as zero.
    wetted, flux = np.setdiff1d(walls, surface), matrix @ extension
    inverse = splu(mass.assemble(sides)[wetted][:, wetted].tocsc())
    wall_loss = ends * kinetic + np.asarray(flux[wetted].T @ inverse.solve(flux[wetted]))
    # q at the quadrature points of the surface.
    normal, facets = top.normals, np.arange(top.nelems)
    rows = np.zeros((top.nelems, top.dx.shape[1], top.N))
    for numbers, (function,) in zip(top.element_dofs, top.basis, strict=True):
        rows[facets, :, numbers] += normal[0] * function.grad[1] - normal[1] * function.grad[0]
    means = [load / load.sum() for load in map(unit_load.assemble, (on_facets(OUTER_WALL), top))]
    difference, points = means[0] - means[1], basis.doflocs[0] + 1j * basis.doflocs[1]
    # Adjoint of the map from psi to the difference of the means of phi, its harmonic conjugate.
    adjoint = np.zeros(basis.N)
    adjoint[1:] = splu(matrix[1:][:, 1:].tocsc()).solve(difference[1:])

    def on_surface(form: Any) -> FloatArray:
        return np.asarray(form.assemble(top)[free][:, free].toarray())

    return SloshingSystem(
        kinetic=kinetic,
        coriolis=on_surface(_coriolis),
        centrifugal=on_surface(_centrifugal),
        wall_loss=wall_loss,
        outflow=np.stack([form.assemble(top)[free] for form in _OUTFLOW]),
        flux=rows.reshape(-1, top.N)[:, free],
        nodes=free,
        potential=np.asarray(_turned.assemble(basis).T @ adjoint) @ extension,
        surface_mean=means[1][free],
        wall_drive=complex(difference @ points),
    )


class _FilmMapping(CellMapping):
    """Mapping for films, where rounding exceeds the 1e-12 at which scikit-fem's Newton method ends.

    An end at 1e-6 suffices, because the method converges quadratically.  Points of a facet are located once.
    """

    def __init__(self, mesh: Any) -> None:
        super().__init__(mesh)
        self._located: tuple[Any, Any, Any] = (None, None, None)

    def invF(self, x: Any, tind: Any = None, **_: Any) -> Any:  # noqa: N802
        if self._located[0] is not x or not np.array_equal(self._located[1], tind):
            self._located = (x, tind, super().invF(x, tind, newton_tol=1e-6))
        return self._located[2]


def _outward(psi: Any, w: Any) -> Any:
    """q = n . rot psi, the flow out of the liquid."""
    return w.n[0] * grad(psi)[1] - w.n[1] * grad(psi)[0]


@BilinearForm  # type: ignore[untyped-decorator]  # scikit-fem has no types
def _coriolis(psi: Any, v: Any, w: Any) -> Any:
    return (psi * _outward(v, w) - v * _outward(psi, w)) / 2


@BilinearForm  # type: ignore[untyped-decorator]  # scikit-fem has no types
def _centrifugal(psi: Any, v: Any, w: Any) -> Any:
    return np.hypot(*w.x) * _outward(psi, w) * _outward(v, w)


@BilinearForm  # type: ignore[untyped-decorator]  # scikit-fem has no types
def _turned(psi: Any, v: Any, _: Any) -> Any:
    return grad(psi)[1] * grad(v)[0] - grad(psi)[0] * grad(v)[1]


_OUTFLOW = (
    LinearForm(_outward),
    LinearForm(lambda v, w: w.x[0] * _outward(v, w)),
    LinearForm(lambda v, w: w.x[1] * _outward(v, w)),
)
