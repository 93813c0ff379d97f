"""Flow past a cylinder (benchmark 2D-1) by this program and by NGSolve, at equal error of the drag.

Each side refines its mesh until the drag coefficient is within the target of the reference value; what is
compared is the wall time of that last run, meshing, assembly and Newton's method included, on one thread,
best of three.  NGSolve takes curved Taylor-Hood elements of order 2 and 3 on its own unstructured meshes,
refined at the cylinder, forces from the residual as here, and the fastest direct solver that its build
has for matrices without symmetry (its wheels come without MKL's).

    python benchmarks/tube_flow.py [--target 5e-5] [--json]
"""

from __future__ import annotations

import argparse
import importlib
import json
import sys
import time
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass
from functools import partial
from typing import Any

from published_flows import cylinder_flow, cylinder_forces, cylinder_mesh

DRAG = 5.57953523384
OURS = ((6, 8, 8), (8, 10, 12), (10, 12, 14), (12, 16, 16), (14, 18, 18), (16, 18, 24), (20, 20, 30))
"""Cells around a quarter, across and along."""
THEIRS = tuple((order, h) for order in (2, 3) for h in (0.08, 0.06, 0.045, 0.034, 0.025, 0.018))
"""Order of velocity and mesh size of the channel."""


@dataclass(frozen=True, kw_only=True)
class Run:
    """One solve."""

    program: str
    mesh: str
    unknowns: int
    drag_error: float
    seconds: float


def timed(program: str, mesh: str, solve: Callable[[], tuple[float, int]], repeats: int = 3) -> Run:
    """Best time of a few runs of one solve.

    Args: `program`: name. `mesh`: description. `solve`: gives the drag coefficient and the number of
        unknowns.
    """
    times = []
    for _ in range(repeats):
        begin = time.perf_counter()
        drag, unknowns = solve()
        times.append(time.perf_counter() - begin)
    error = abs(drag / DRAG - 1)
    return Run(program=program, mesh=mesh, unknowns=unknowns, drag_error=error, seconds=min(times))


def ours(*, around: int, across: int, along: int) -> tuple[float, int]:
    """Drag coefficient and unknowns of this program.

    Args: `around`: cells on a quarter of the cylinder. `across`: from the cylinder to the wall. `along`: down
        the channel.
    Raises: RuntimeError: Newton's method failed.
    """
    mesh = cylinder_mesh(around=around, across=across, along=along, shape="quad")
    system, solution = cylinder_flow(mesh=mesh)
    if not solution.status.ok:
        raise RuntimeError(solution.status.text)
    found = cylinder_forces(system=system, solution=solution)
    return found.drag, found.unknowns


def _their_mesh(ngsolve: Any, order: int, size: float) -> Any:
    occ = importlib.import_module("netgen.occ")
    rectangle = occ.WorkPlane().Rectangle(2.2, 0.41).Face()
    circle = occ.WorkPlane().Circle(0.2, 0.2, 0.05).Face()
    rectangle.edges.name = "wall"
    rectangle.edges.Min(occ.X).name, rectangle.edges.Max(occ.X).name = "inflow", "outflow"
    circle.edges.name = "cylinder"
    circle.edges.maxh = size / 6
    geometry = occ.OCCGeometry(rectangle - circle, dim=2)
    return ngsolve.Mesh(geometry.GenerateMesh(maxh=size, grading=0.25)).Curve(order)


def theirs(*, order: int, size: float, inverse: str) -> tuple[float, int]:
    """Drag coefficient and unknowns of NGSolve.

    Args: `order`: of the velocity; the pressure has one less. `size`: largest cell, m. `inverse`: name of its
        direct solver.
    Raises: RuntimeError: Newton's method failed.
    """
    ng = importlib.import_module("ngsolve")
    mesh = _their_mesh(ng, order, size)
    velocity = ng.VectorH1(mesh, order=order, dirichlet="wall|inflow|cylinder")
    space = velocity * ng.H1(mesh, order=order - 1)
    (u, p), (v, q) = space.TnT()
    viscous = 1e-3 * ng.InnerProduct(ng.grad(u), ng.grad(v)) - ng.div(u) * q - ng.div(v) * p
    form = ng.BilinearForm(space)
    form += (viscous + ng.InnerProduct(ng.grad(u) * u, v)) * ng.dx
    stokes = ng.BilinearForm(viscous * ng.dx).Assemble()
    flow = ng.GridFunction(space)
    inflow = ng.CF((1.2 * ng.y * (0.41 - ng.y) / 0.41**2, 0.0))
    flow.components[0].Set(inflow, definedon=mesh.Boundaries("inflow"))
    start = stokes.mat.Inverse(space.FreeDofs(), inverse=inverse)
    flow.vec.data -= start @ stokes.mat * flow.vec
    failed, _ = ng.solvers.Newton(form, flow, inverse=inverse, maxerr=1e-10, maxit=12, printing=False)
    if failed:
        raise RuntimeError("NGSolve's Newton iteration failed")
    residual = flow.vec.CreateVector()
    form.Apply(flow.vec, residual)
    test = ng.GridFunction(space)
    test.components[0].Set(ng.CF((1.0, 0.0)), definedon=mesh.Boundaries("cylinder"))
    return -500.0 * float(ng.InnerProduct(residual, test.vec)), space.ndof


def their_solver() -> str | None:
    """Fastest of NGSolve's direct solvers that this build has for matrices without symmetry.

    Returns: Its name; None when NGSolve is not installed.
    """
    try:
        importlib.import_module("ngsolve")
    except ImportError:
        return None
    found: dict[str, float] = {}
    for inverse in ("pardiso", "umfpack"):
        begin = time.perf_counter()
        try:
            theirs(order=2, size=0.06, inverse=inverse)
        except Exception as error:  # a build without this solver says so in an exception of its own kind
            print(f"NGSolve without {inverse}: {str(error).splitlines()[0]}", file=sys.stderr)
            continue
        found[inverse] = time.perf_counter() - begin
    return min(found, key=lambda name: found[name]) if found else None


def first_within(runs: Sequence[Callable[[], Run]], target: float) -> list[Run]:
    """Runs up to the first whose error is within the target.

    Args: `runs`: from coarse to fine. `target`: of the relative drag error.
    Returns: All runs made.
    """
    done: list[Run] = []
    for run in runs:
        done.append(run())
        print(f"{asdict(done[-1])}", file=sys.stderr)
        if done[-1].drag_error <= target:
            break
    return done


def _our_run(cells: tuple[int, int, int]) -> Run:
    around, across, along = cells
    return timed(
        "ringbalance",
        f"{around} x {across}, {along}",
        lambda: ours(around=around, across=across, along=along),
    )


def _their_run(order: int, size: float, inverse: str) -> Run:
    label = f"order {order}, h {size}, {inverse}"
    return timed("NGSolve", label, lambda: theirs(order=order, size=size, inverse=inverse))


def main() -> int:
    """Run the comparison and print it. Returns: Exit code 0."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--target", type=float, default=5e-5, help="relative error of the drag coefficient")
    parser.add_argument("--json", action="store_true")
    arguments = parser.parse_args()
    runs = first_within([partial(_our_run, c) for c in OURS], arguments.target)
    inverse = their_solver()
    if inverse is None:
        print("NGSolve cannot be imported: one side only", file=sys.stderr)
    else:
        ng = importlib.import_module("ngsolve")
        ng.SetNumThreads(1)
        for order in (2, 3):
            meshes = [size for o, size in THEIRS if o == order]
            runs += first_within([partial(_their_run, order, h, inverse) for h in meshes], arguments.target)
    good = [run for run in runs if run.drag_error <= arguments.target]
    if arguments.json:
        print(json.dumps({"target": arguments.target, "runs": [asdict(r) for r in runs]}, allow_nan=False))
    else:
        for run in good:
            print(
                f"{run.program:12s} {run.mesh:28s} {run.unknowns:7d} unknowns  "
                f"error {run.drag_error:.1e}  {run.seconds:6.2f} s"
            )
    return 0


if __name__ == "__main__":
    sys.exit(main())
