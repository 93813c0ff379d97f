"""The rotating tube in OpenFOAM: laminar and turbulent, straight; laminar with two bends.

Lengths over the bore, velocities over the mean velocity; SRFSimpleFoam in the rotating frame.  A straight
tube is one slab of cells between cyclic ends, driven to a mean velocity of one.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from openfoam_case import HexMesh, Run, extruded, field, last_number, run, sides, vector, write_case

from ringbalance.scene.arrays import FloatArray, IntArray
from ringbalance.verification.navier_stokes.tube import SectionMesh
from ringbalance.verification.reference.bent_tube import Segment, swept_tube

_SLAB = 0.05
_VELOCITY = "[0 1 -1 0 0 0 0]"
_PRESSURE = "[0 2 -2 0 0 0 0]"


def section(*, around: int, across: int, wall_ratio: float) -> tuple[FloatArray, IntArray, Any]:
    """Vertices (n, 2) and quadrilaterals (m, 4) of the half section, and the mesh they come from."""
    mesh = SectionMesh(around=around, across=across, wall_ratio=wall_ratio).mesh()
    points = np.asarray(mesh.doflocs[:, : mesh.nvertices]).T
    quads = np.asarray(mesh.t[:4]).T
    corner = points[quads]
    (ax, ay), (bx, by) = (corner[:, 1] - corner[:, 0]).T, (corner[:, 2] - corner[:, 0]).T
    turn = ax * by - ay * bx
    quads[turn < 0] = quads[turn < 0][:, ::-1]
    return points, quads, mesh


def swept_mesh(*, cells: tuple[int, int, float], stations: FloatArray, ends: Mapping[str, Any]) -> HexMesh:
    """The half section along stations of a path.

    Args: `cells`: around, across and the ratio towards the wall. `stations`: point and unit tangent in the
        plane of the path, shape (levels, 4). `ends`: boundary entries of inlet and outlet.
    """
    around, across, ratio = cells
    plane, quads, mesh = section(around=around, across=across, wall_ratio=ratio)
    centre, tangent = stations[:, :2], stations[:, 2:]
    left = np.stack([-tangent[:, 1], tangent[:, 0]], axis=1)
    flat = centre[:, None] + plane[None, :, :1] * left[:, None]
    height = np.broadcast_to(plane[None, :, 1:], (len(stations), len(plane), 1))
    points, hexahedra = extruded(points=np.concatenate([flat, height], axis=2), quads=quads)
    count, slabs = len(plane), len(stations) - 1
    edges = {name: np.asarray(mesh.facets[:, boundary]).T for name, boundary in mesh.boundaries.items()}
    patches = {name: sides(edges=edges[name], count=count, slabs=slabs) for name in ("wall", "symmetry")}
    kinds = {"wall": {"type": "wall"}, "symmetry": {"type": "symmetryPlane"}}
    return HexMesh(
        points=points,
        cells=hexahedra,
        patches={
            **{name: (faces, kinds[name]) for name, faces in patches.items()},
            "inlet": (quads, ends["inlet"]),
            "outlet": (quads + slabs * count, ends["outlet"]),
        },
    )


def _cyclic() -> dict[str, Any]:
    return {
        name: {"type": "cyclic", "neighbourPatch": other, "matchTolerance": 1e-4}
        for name, other in (("inlet", "outlet"), ("outlet", "inlet"))
    }


def _boundary(wall: Mapping[str, Any], ends: Mapping[str, Any] | None = None) -> dict[str, Any]:
    boundary = ends or {name: {"type": "cyclic"} for name in ("inlet", "outlet")}
    return {"wall": wall, "symmetry": {"type": "symmetryPlane"}, **boundary}


_SOLVERS = {
    "p": {"solver": "GAMG", "smoother": "GaussSeidel", "tolerance": 1e-12, "relTol": 0.01},
    '"(Urel|k|omega)"': {"solver": "PBiCGStab", "preconditioner": "DILU", "tolerance": 1e-12, "relTol": 0.01},
}


def _schemes() -> dict[str, Any]:
    bounded = "bounded Gauss linearUpwind grad(Urel)"
    return {
        "ddtSchemes": {"default": "steadyState"},
        "gradSchemes": {"default": "Gauss linear"},
        "divSchemes": {
            "default": "none",
            "div(phi,Urel)": "Gauss linear",
            "div(phi,k)": bounded.replace("grad(Urel)", "grad(k)"),
            "div(phi,omega)": bounded.replace("grad(Urel)", "grad(omega)"),
            "div((nuEff*dev2(T(grad(Urel)))))": "Gauss linear",
        },
        "laplacianSchemes": {"default": "Gauss linear corrected"},
        "interpolationSchemes": {"default": "linear"},
        "snGradSchemes": {"default": "corrected"},
        "wallDist": {"method": "meshWave"},
    }


def _common(
    *, omega: float, viscosity: float, steps: int, residual: float, turbulent: bool
) -> dict[str, Any]:
    model = {
        "simulationType": "RAS",
        "RAS": {"RASModel": "kOmegaSST", "turbulence": "on", "printCoeffs": "off"},
    }
    return {
        "system/controlDict": {
            "application": "SRFSimpleFoam", "startFrom": "startTime", "startTime": 0, "stopAt": "endTime",
            "endTime": steps, "deltaT": 1, "writeControl": "timeStep", "writeInterval": steps,
            "purgeWrite": 1, "writeFormat": "ascii", "writePrecision": 12,
        },
        "system/fvSchemes": _schemes(),
        "system/fvSolution": {
            "solvers": _SOLVERS,
            "SIMPLE": {
                "nNonOrthogonalCorrectors": 0, "consistent": "yes", "pRefCell": 0, "pRefValue": 0,
                "residualControl": {"Urel": residual, "p": residual},
            },
            "relaxationFactors": {
                "fields": {"p": 1.0},
                "equations": {"Urel": 0.7, "k": 0.7, "omega": 0.7},
            },
        },
        "constant/transportProperties": {"transportModel": "Newtonian", "nu": viscosity},
        "constant/turbulenceProperties": model if turbulent else {"simulationType": "laminar"},
        "constant/SRFProperties": {
            "SRFModel": "rpm", "origin": "(0 0 0)", "axis": "(0 0 1)",
            "rpmCoeffs": {"rpm": omega * 30 / np.pi},
        },
    }  # fmt: skip


def _driven() -> dict[str, Any]:
    return {
        "drive": {
            "type": "meanVelocityForce", "selectionMode": "all", "fields": "(Urel)", "Ubar": "(1 0 0)",
        }
    }  # fmt: skip


def straight_tube(
    *, folder: Path, reynolds: float, rotation_reynolds: float, cells: tuple[int, int, float], turbulent: bool
) -> tuple[float, Run]:
    """Friction factor (Darcy) of developed flow in the rotating tube, and the run.

    Args: `rotation_reynolds`: R = omega d^2/nu. `cells`: as `swept_mesh` takes them. `turbulent`: by the
        k-omega SST model down to the wall.
    """
    stations = np.array([[-_SLAB / 2, 0.0, 1.0, 0.0], [_SLAB / 2, 0.0, 1.0, 0.0]])
    mesh = swept_mesh(cells=cells, stations=stations, ends=_cyclic())
    no_slip = {"type": "fixedValue", "value": "uniform (0 0 0)"}
    flat = {"type": "zeroGradient"}
    files = _common(
        omega=rotation_reynolds / reynolds, viscosity=1 / reynolds, residual=1e-8, turbulent=turbulent,
        # Without rotation there is no cross-flow; the residual of its equation is noise that ends no run.
        steps=4000 if turbulent else 20000,
    )  # fmt: skip
    files |= {
        "constant/fvOptions": _driven(),
        "0/Urel": field(
            kind="volVectorField", dimensions=_VELOCITY, value="(1 0 0)", boundary=_boundary(no_slip)
        ),
        "0/p": field(kind="volScalarField", dimensions=_PRESSURE, value="0", boundary=_boundary(flat)),
    }
    if turbulent:
        files |= _turbulence(reynolds)
    write_case(folder=folder, mesh=mesh, files=files)
    done = run("SRFSimpleFoam", folder=folder)
    return 2 * last_number(done.text, "pressure gradient"), done


def _turbulence(reynolds: float) -> dict[str, Any]:
    """Uniform start of k and omega, and their values at the wall."""
    k, omega = 0.005, 5.0

    def scalar(dimensions: str, value: float, wall: Mapping[str, Any]) -> dict[str, Any]:
        return field(
            kind="volScalarField", dimensions=dimensions, value=f"{value:.8g}", boundary=_boundary(wall)
        )

    return {
        "0/k": scalar("[0 2 -2 0 0 0 0]", k, {"type": "fixedValue", "value": "uniform 1e-12"}),
        "0/omega": scalar("[0 0 -1 0 0 0 0]", omega, {"type": "omegaWallFunction", "value": "uniform 1e4"}),
        "0/nut": scalar(
            "[0 2 -1 0 0 0 0]", 10 / reynolds, {"type": "nutLowReWallFunction", "value": "uniform 0"}
        ),
    }


@dataclass(frozen=True, kw_only=True, eq=False)
class BentRun:
    """Loss along a bent tube."""

    arc_length: FloatArray
    """Arc length over the bore, at the middle of every slab of cells."""
    head: FloatArray
    """Reduced pressure and carried kinetic energy over rho U^2/2, mean over the slab."""
    seconds: float

    def loss(self, start: float, end: float) -> float:
        """Loss coefficient between two arc lengths."""
        first, last = np.interp([start, end], self.arc_length, self.head)
        return float(first - last)


def bent_tube(
    *, folder: Path, segments: Sequence[Segment], cells: tuple[int, int, float], reynolds: float,
    rotation_reynolds: float,
) -> BentRun:  # fmt: skip
    """Laminar flow through a rotating tube along a plane path across the axis, developed at the inlet."""
    omega = rotation_reynolds / reynolds
    _, entry = straight_tube(
        folder=folder / "inflow", reynolds=reynolds, rotation_reynolds=rotation_reynolds, cells=cells,
        turbulent=False,
    )  # fmt: skip
    plane, quads, half = section(around=cells[0], across=cells[1], wall_ratio=cells[2])
    middle = plane[quads].mean(axis=1)
    inflow = _values(folder / "inflow", "Urel")
    developed = _values(folder / "inflow", "p")[:, 0] - (omega * middle[:, 0]) ** 2 / 2
    tube = swept_tube(section=half, segments=segments)
    stations = np.hstack([tube.path[:, ::2].T, tube.direction[:, ::2].T])
    stations[:, :2] -= stations[:, :2].mean(axis=0)
    patch = {"inlet": {"type": "patch"}, "outlet": {"type": "patch"}}
    mesh = swept_mesh(cells=cells, stations=stations, ends=patch)
    last = stations[-1, :2] + middle[:, :1] * np.array([-stations[-1, 3], stations[-1, 2]])
    outlet = developed + omega**2 / 2 * np.sum(last**2, axis=1)
    files = _common(omega=omega, viscosity=1 / reynolds, steps=3000, residual=1e-7, turbulent=False)
    files |= _bent_fields(inflow, outlet)
    write_case(folder=folder / "tube", mesh=mesh, files=files)
    done = run("SRFSimpleFoam", folder=folder / "tube")
    head = _heads(folder / "tube", mesh, slabs=len(stations) - 1, omega=omega)
    ends = tube.arc_length[::2]
    return BentRun(
        arc_length=(ends[1:] + ends[:-1]) / 2, head=head, seconds=entry.seconds + done.seconds
    )  # fmt: skip


def _bent_fields(inflow: FloatArray, outlet: FloatArray) -> dict[str, Any]:
    def listed(kind: str, rows: Sequence[str]) -> dict[str, str]:
        return {
            "type": "fixedValue",
            "value": f"nonuniform List<{kind}>\n{len(rows)}\n(\n" + "\n".join(rows) + "\n)",
        }

    no_slip, flat = {"type": "fixedValue", "value": "uniform (0 0 0)"}, {"type": "zeroGradient"}
    entering = listed("vector", [vector(row) for row in inflow])
    leaving = listed("scalar", [f"{value:.12g}" for value in outlet])
    return {
        "0/Urel": field(
            kind="volVectorField", dimensions=_VELOCITY, value="(0 0 0)",
            boundary=_boundary(no_slip, {"inlet": entering, "outlet": flat}),
        ),
        "0/p": field(
            kind="volScalarField", dimensions=_PRESSURE, value="0",
            boundary=_boundary(flat, {"inlet": {"type": "zeroGradient"}, "outlet": leaving}),
        ),
    }  # fmt: skip


def _values(folder: Path, name: str) -> FloatArray:
    """Cell values of the last time that was written, shape (cells, components)."""
    times = [path for path in folder.iterdir() if path.name.isdigit() and path.name != "0"]
    text = (max(times, key=lambda path: int(path.name)) / name).read_text(encoding="ascii")
    body = text[text.index("internalField") :]
    rows = body[body.index("\n(\n") + 3 : body.index("\n)\n")].splitlines()
    return np.array([row.strip("()").split() for row in rows], dtype=np.float64)


def _heads(folder: Path, mesh: HexMesh, *, slabs: int, omega: float) -> FloatArray:
    """Mean over each slab of 2 (p/rho - (omega r)^2/2), and of |u|^2 weighted with the flow."""
    corner = mesh.points[mesh.cells]
    middle = corner.mean(axis=1)
    # The slabs' cells stand between two copies of one section: area by its diagonals, times thickness.
    diagonal = np.cross(corner[:, 2] - corner[:, 0], corner[:, 3] - corner[:, 1])
    axial = corner[:, 4:].mean(axis=1) - corner[:, :4].mean(axis=1)
    weight = np.abs(np.sum(diagonal * axial, axis=1)).reshape(slabs, -1)
    u = _values(folder, "Urel")
    carried = np.abs(np.sum(u * axial, axis=1)) / np.linalg.norm(axial, axis=1) * np.sum(u**2, axis=1)
    reduced = 2 * _values(folder, "p")[:, 0] - omega**2 * np.sum(middle[:, :2] ** 2, axis=1)
    return np.asarray(np.average((reduced + carried).reshape(slabs, -1), axis=1, weights=weight))
