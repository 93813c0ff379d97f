"""The same pressure problems in NGSolve: curved tetrahedra of any order, static condensation, sparse
Cholesky."""

from __future__ import annotations

import time

import ngsolve as ng
import numpy as np
from netgen.occ import ArcOfCircle, Face, OCCGeometry, Pnt, Segment, Wire, Z
from pressure_problems import Trial, paper_surface

from ringbalance.mesh.geometry import half_angle
from ringbalance.scene.models import Disc

VERSION = ng.__version__
SETTINGS = tuple(
    (order, size)
    for size, highest in ((1.0, 8), (0.6, 8), (0.3, 7), (0.2, 6), (0.15, 5))
    for order in range(2, highest + 1)
)
"""Finer meshes of the highest orders take seconds and are far better than any target."""


def geometry(disc: Disc) -> OCCGeometry:
    """The liquid of one chamber in units of the outer radius, its free surface by name.

    Returns: The solid.
    """
    unit, low = disc.outer_radius, -disc.axial_width / 2 / disc.outer_radius

    def point(radius: float, side: int) -> Pnt:
        angle = side * float(half_angle(disc=disc, radius=radius))
        return Pnt(radius / unit * np.cos(angle), radius / unit * np.sin(angle), low)

    a, outer = paper_surface(disc), disc.outer_radius
    edges = [
        ArcOfCircle(point(a, -1), Pnt(a / unit, 0, low), point(a, 1)),
        Segment(point(a, 1), point(outer, 1)),
        ArcOfCircle(point(outer, 1), Pnt(1, 0, low), point(outer, -1)),
        Segment(point(outer, -1), point(a, -1)),
    ]
    solid = Face(Wire(edges)).Extrude(disc.axial_width / unit * Z)
    arcs = []
    for face in solid.faces:
        face.name = "wall"
        if abs(face.center.z) < 1e-6 and abs(face.center.y) < 1e-6:
            arcs.append(face)
    min(arcs, key=lambda face: face.center.x).name = "free_surface"
    return OCCGeometry(solid)


def _exact(problem: str, surface: float) -> tuple[ng.CoefficientFunction, ng.CoefficientFunction]:
    """Exact pressure and source."""
    square = (ng.x**2 + ng.y**2) / 2
    if problem == "physical":
        return square - surface**2 / 2, ng.CF(2.0)
    wave = ng.exp(ng.x) * ng.sin(2 * ng.y + 0.3) * ng.cos(1.5 * ng.z + 0.2)
    return square + wave, 2 - 5.25 * wave


def solve(mesh: ng.Mesh, problem: str, order: int, surface: float) -> tuple[ng.GridFunction, int]:
    """Assemble and solve.

    Args: `mesh`: curved to the order. `problem`: "physical" or "made_up". `order`: of the elements.
        `surface`: radius of the free surface in units of R2.
    Returns: The solution and its number of unknowns.
    """
    pressure, source = _exact(problem, surface)
    flux = ng.CF((pressure.Diff(ng.x), pressure.Diff(ng.y), pressure.Diff(ng.z)))
    space = ng.H1(mesh, order=order, dirichlet="free_surface")
    u, v = space.TnT()
    form = ng.BilinearForm(space, symmetric=True, condense=True)
    form += ng.grad(u) * ng.grad(v) * ng.dx
    load = ng.LinearForm(space)
    load += -source * v * ng.dx
    load += (flux * ng.specialcf.normal(3)) * v * ng.ds("wall")
    form.Assemble()
    load.Assemble()
    found = ng.GridFunction(space)
    found.Set(pressure, definedon=mesh.Boundaries("free_surface"))
    rest = load.vec.CreateVector()
    rest.data = load.vec - form.mat * found.vec
    rest.data += form.harmonic_extension_trans * rest
    found.vec.data += form.mat.Inverse(space.FreeDofs(True), "sparsecholesky") * rest
    found.vec.data += form.harmonic_extension * found.vec
    found.vec.data += form.inner_solve * rest
    return found, int(space.ndof)


def trial(disc: Disc, problem: str, order: int, size: float) -> Trial:
    """Mesh, solve and judge once.

    Args: `problem`: "physical" or "made_up". `order`: of elements and geometry. `size`: largest cell, in
        units of R2.
    """
    surface = paper_surface(disc) / disc.outer_radius
    start = time.process_time()
    mesh = ng.Mesh(geometry(disc).GenerateMesh(maxh=size))
    mesh.Curve(order)
    meshed = time.process_time()
    found, unknowns = solve(mesh, problem, order, surface)
    solved = time.process_time()
    true, _ = _exact(problem, surface)
    points = 2 * order + 4
    error = ng.Integrate((found - true) ** 2, mesh, order=points)
    return Trial(
        problem=problem,
        solver="NGSolve",
        setting=f"order {order}, h {size:g}",
        unknowns=unknowns,
        error=float(np.sqrt(error / ng.Integrate(true**2, mesh, order=points))),
        mesh_seconds=meshed - start,
        solve_seconds=solved - meshed,
    )
