"""Waves on the liquid ring in a chamber without plates, in OpenFOAM: the surface moves with the mesh.

Lengths in R2, times in 1/omega, in the frame of the disc, where gravity rotates backwards once a turn.  The
chamber lies between the angles 0 and theta; `pimpleFoam` moves its mesh with the surface.  With plates the
surface meets the wall at an angle and the tracking fails after a few turns, so plates are left out.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from openfoam_case import HexMesh, extruded, field, run, sides, write_case

from ringbalance.scene.arrays import FloatArray, IntArray

_VISCOSITY = 1e-5
"""Kinematic viscosity over omega R2^2: thin layers, whose damping is not compared."""
GRAVITY = 0.005
"""Gravity, g over omega^2 R2: small waves."""
_SLIP = {"type": "slip"}
_EMPTY = {"type": "empty"}
_NAMES = ("wall", "surface", "left", "right")
_TURN = 2 * np.pi
_THICKNESS = 0.05
_PUSH = 0.3 * GRAVITY
"""Force that starts free waves, a third as high as gravity's: frequencies depend on their height."""
_EVERY = 5
"""Steps between the samples for frequencies: thirty samples a turn."""
_NOISE = 1e-2
"""Fraction of the largest singular value below which others are noise."""

Force = Callable[[FloatArray], FloatArray]
"""Gravity's components in the disc's frame by time, shape (n, 2)."""


@dataclass(frozen=True, kw_only=True)
class Chamber:
    """Case to solve: central angle, rad, surface radius over R2, and the cells across and around."""

    central_angle: float
    surface_radius: float
    cells: tuple[int, int]


@dataclass(frozen=True, kw_only=True, eq=False)
class Record:
    """A run: mean pressure on the outer wall by time, and the moment of the liquid."""

    time: FloatArray
    wall: FloatArray
    moment_time: FloatArray
    moment: FloatArray
    """Integral of (x, y) over the liquid, shape (n, 2)."""
    seconds: float


def _grid(chamber: Chamber) -> tuple[FloatArray, IntArray, dict[str, IntArray]]:
    """Points (n, 2), quadrilaterals (m, 4) and edges by side, each row along the boundary."""
    across, around = chamber.cells
    r = np.geomspace(chamber.surface_radius, 1.0, across + 1)
    angle = np.linspace(0.0, chamber.central_angle, around + 1)
    points = np.stack([np.outer(r, np.cos(angle)), np.outer(r, np.sin(angle))], axis=-1).reshape(-1, 2)
    number = np.arange(len(points)).reshape(across + 1, around + 1)
    quads = np.stack([number[:-1, :-1], number[1:, :-1], number[1:, 1:], number[:-1, 1:]], axis=-1)

    def edges_of(line: IntArray) -> IntArray:
        return np.stack([line[:-1], line[1:]], axis=1)

    lines = {"wall": number[-1], "surface": number[0], "left": number[:, 0], "right": number[:, -1]}
    return points, quads.reshape(-1, 4), {name: edges_of(line) for name, line in lines.items()}


def _mesh(chamber: Chamber) -> tuple[HexMesh, IntArray]:
    plane, quads, edges = _grid(chamber)
    points = np.stack([np.column_stack([plane, np.full(len(plane), z)]) for z in (0.0, _THICKNESS)])
    corners, cells = extruded(points=points, quads=quads)
    patches: dict[str, Any] = {
        name: (sides(edges=edge, count=len(plane), slabs=1), {"type": "wall"}) for name, edge in edges.items()
    }
    patches["flat"] = (np.concatenate([quads, quads + len(plane)]), {"type": "empty"})
    return HexMesh(points=corners, cells=cells, patches=patches), quads


def _boundary(**entries: Any) -> dict[str, Any]:
    return {name: entries.get(name, entries["other"]) for name in _NAMES} | {"flat": _EMPTY}


def _fields() -> dict[str, Any]:
    zero = {"type": "fixedValue", "value": "uniform (0 0 0)"}
    speed = "[0 1 -1 0 0 0 0]"
    surface = {"type": "freeSurfaceVelocity", "value": "uniform (0 0 0)"}
    balance = {"type": "fixedFluxExtrapolatedPressure"}
    motion = _boundary(surface=zero, wall=zero, other=_SLIP)
    return {
        "0/U": field(
            kind="volVectorField", dimensions=speed, value="(0 0 0)",
            boundary=_boundary(surface=surface, other=_SLIP),
        ),
        "0/p": field(
            kind="volScalarField", dimensions="[0 2 -2 0 0 0 0]", value="0",
            boundary=_boundary(surface={"type": "fixedValue", "value": "uniform 0"}, other=balance),
        ),
        "0/pointMotionU": field(
            kind="pointVectorField", dimensions=speed, value="(0 0 0)", boundary=motion
        ),
    }  # fmt: skip


def _mean_pressure(patch: str) -> dict[str, Any]:
    return {
        "type": "surfaceFieldValue", "libs": "(fieldFunctionObjects)", "fields": "(p)", "writeFields": "no",
        "regionType": "patch", "name": patch, "operation": "areaAverage", "log": "no",
        "writeControl": "timeStep", "writeInterval": 1,
    }  # fmt: skip


def _control(*, turns: float, steps: int, writes: int) -> dict[str, Any]:
    """Entries of controlDict for a run. Args: `steps`, `writes`: per turn."""
    return {
        "libs": "(interfaceTrackingFvMesh)", "application": "pimpleFoam", "startFrom": "startTime",
        "startTime": 0, "stopAt": "endTime", "endTime": turns * _TURN, "deltaT": _TURN / steps,
        "writeControl": "timeStep", "writeInterval": steps // writes, "purgeWrite": 0, "writeFormat": "ascii",
        "writePrecision": 12, "timePrecision": 10,
        "functions": {"wallPressure": _mean_pressure("wall")},
    }  # fmt: skip


def _numerics() -> dict[str, Any]:
    linear = {"default": "Gauss linear"}
    flat = {"default": "Gauss linear corrected"}
    pressure = {"solver": "GAMG", "smoother": "GaussSeidel", "tolerance": 1e-10, "relTol": 0,
                "cacheAgglomeration": "no"}  # fmt: skip
    velocity = {"solver": "smoothSolver", "smoother": "symGaussSeidel", "tolerance": 1e-11, "relTol": 0}
    mesh = {"solver": "PCG", "preconditioner": "DIC", "tolerance": 1e-10, "relTol": 0}
    common = {"interpolationSchemes": {"default": "linear"}, "snGradSchemes": {"default": "corrected"}}
    return {
        "system/fvSchemes": {
            "ddtSchemes": {"default": "backward"}, "gradSchemes": linear,
            "divSchemes": {
                "default": "none", "div(phi,U)": "Gauss linear",
                "div((nuEff*dev2(T(grad(U)))))": "Gauss linear",
            },
            "laplacianSchemes": flat, **common,
        },
        "system/faSchemes": {
            "ddtSchemes": {"default": "none"}, "gradSchemes": linear, "divSchemes": linear,
            "laplacianSchemes": flat, **common,
        },
        "system/faSolution": {"solvers": {}, "relaxationFactors": {}},
        "system/fvSolution": {
            "solvers": {'"(p|pFinal)"': pressure, '"pcorr.*"': pressure, '"(U|UFinal)"': velocity,
                        '"(cellMotionU|cellMotionUFinal)"': mesh},
            "PIMPLE": {
                "correctPhi": "no", "nOuterCorrectors": 4, "nCorrectors": 3, "nNonOrthogonalCorrectors": 0,
                "pRefCell": 0, "pRefValue": 0, "moveMeshOuterCorrectors": "true", "consistent": "true",
            },
            "relaxationFactors": {"equations": {'"U.*"': 1}},
        },
    }  # fmt: skip


def _moving_mesh() -> dict[str, Any]:
    def side(name: str, kind: str = "patch") -> dict[str, Any]:
        return {"type": kind, "ownerPolyPatch": "surface", "neighbourPolyPatch": name}

    return {
        "constant/dynamicMeshDict": {
            "motionSolverLibs": "(fvMotionSolvers interfaceTrackingFvMesh)",
            "dynamicFvMesh": "interfaceTrackingFvMesh", "motionSolver": "velocityLaplacian",
            "diffusivity": "uniform", "fsPatchName": "surface", "fixedFreeSurfacePatches": "()",
            "pointNormalsCorrectionPatches": "(left right)", "normalMotionDir": "true", "smoothing": "true",
        },
        "constant/faMesh/faMeshDefinition": {
            "polyMeshPatches": "(surface)",
            "boundary": {"left": side("left"), "right": side("right"), "flat": side("flat", "empty")},
        },
        "constant/turbulenceProperties": {"simulationType": "laminar"},
        "constant/transportProperties": {
            "transportModel": "Newtonian", "nu": f"[0 2 -1 0 0 0 0] {_VISCOSITY}",
            "rho": "rho [1 -3 0 0 0 0 0] 1", "sigma": "sigma [1 0 -2 0 0 0 0] 0",
        },
        "constant/fvOptions": {
            "turning": {
                "type": "tabulatedAccelerationSource", "active": "yes",
                "tabulatedAccelerationSourceCoeffs": {
                    "timeDataFileName": '"<constant>/acceleration"', "selectionMode": "all", "U": "U",
                },
            }
        },
        "constant/g": {
            "class": "uniformDimensionedVectorField", "dimensions": "[0 1 -2 0 0 0 0]", "value": "(0 0 0)",
        },
    }  # fmt: skip


def _acceleration(force: Force, turns: float) -> str:
    """Table of time, acceleration of the origin (minus gravity), angular velocity and its rate."""
    time = np.linspace(0.0, turns * _TURN + 1.0, int(96 * turns) + 2)
    rows = [
        f"({t:.12g} (({-x:.12g} {-y:.12g} 0) (0 0 1) (0 0 0)))"
        for t, (x, y) in zip(time, force(time), strict=True)
    ]
    return "(\n" + "\n".join(rows) + "\n)\n"


def track(*, folder: Path, chamber: Chamber, force: Force, turns: float, steps: int, writes: int) -> Record:
    """Run of the liquid from rest in the disc's frame under a force that starts from zero."""
    mesh, quads = _mesh(chamber)
    files = {"system/controlDict": _control(turns=turns, steps=steps, writes=writes)}
    files |= _numerics() | _moving_mesh() | _fields()
    write_case(folder=folder, mesh=mesh, files=files)
    (folder / "constant/acceleration").write_text(_acceleration(force, turns), encoding="ascii")
    run("makeFaMesh", folder=folder)
    done = run("pimpleFoam", folder=folder)
    time, wall = _history(folder / "postProcessing/wallPressure/0/surfaceFieldValue.dat")
    at, moment = _moments(folder, quads)
    return Record(
        time=time, wall=wall, moment_time=at, moment=moment, seconds=done.seconds
    )  # fmt: skip


def _history(path: Path) -> tuple[FloatArray, FloatArray]:
    table = np.loadtxt(path)
    return table[:, 0], table[:, 1]


def _moments(folder: Path, quads: IntArray) -> tuple[FloatArray, FloatArray]:
    """Times and moments from the written meshes: exact for straight-sided quadrilaterals."""
    folders = [path for path in folder.iterdir() if (path / "polyMesh/points").exists()]
    modes = sorted(
        (float(path.name), _points(path / "polyMesh/points")) for path in folders if path.name != "constant"
    )
    return np.array([time for time, _ in modes]), np.array([_moment(points[quads]) for _, points in modes])


def _points(path: Path) -> FloatArray:
    lines = path.read_text(encoding="ascii").splitlines()
    rows = [line.strip("() ").split() for line in lines if line.startswith("(") and len(line) > 1]
    return np.array(rows, dtype=np.float64)[:, :2]


def _moment(corner: FloatArray) -> FloatArray:
    """Integral of (x, y) over quadrilaterals, shape (m, 4, 2), by Green's theorem."""
    x, y = corner[..., 0], corner[..., 1]
    across, up = np.roll(x, -1, axis=1), np.roll(y, -1, axis=1)
    twice = x * up - across * y
    return np.array([np.sum(twice * (x + across)), np.sum(twice * (y + up))]) / 6


def turning_gravity(*, ramp: float) -> Force:
    """Gravity that rotates backwards once a turn, raised smoothly over a number of turns."""

    def force(time: FloatArray) -> FloatArray:
        share = np.clip(time / (ramp * _TURN), 0.0, 1.0)
        size = GRAVITY * share**3 * (10 - 15 * share + 6 * share**2)
        return np.stack([size * np.cos(time), -size * np.sin(time)], axis=1)

    return force


def push(*, duration: float) -> Force:
    """Smooth force pulse, a part of a turn long, after which the liquid oscillates freely."""

    def force(time: FloatArray) -> FloatArray:
        inside = time < duration * _TURN
        size = np.where(inside, _PUSH * np.sin(np.pi * time / (duration * _TURN)) ** 2, 0.0)
        return np.stack([0.8 * size, -0.6 * size], axis=1)

    return force


def swing(time: FloatArray, values: FloatArray, *, turns: float) -> complex:
    """Complex amplitude at the rotation frequency over the last turns: least squares with mean and drift."""
    last = time > time[-1] - turns * _TURN
    t = time[last]
    basis = np.stack([np.ones_like(t), t - t[-1], np.cos(t), np.sin(t)], axis=1)
    fit = np.linalg.lstsq(basis, values[last], rcond=None)[0]
    return complex(fit[2], -fit[3])


def quasi_static(chamber: Chamber) -> tuple[float, float]:
    """Amplitudes of moment and mean wall pressure for a surface that follows gravity at once.

    eta = (g - mean g)_r, over the surface, with g_r = g cos(angle + t): linear in g.
    """
    a, half = chamber.surface_radius, chamber.central_angle / 2
    mean = np.sin(half) / half
    square = 0.5 + np.sin(2 * half) / (4 * half)
    # Along the chamber's middle and across it; the liquid's moment loses eta a where the surface moves out.
    axial = a**2 * 2 * half * (square - mean**2)
    across = a**2 * 2 * half * (1 - square)
    return GRAVITY * float(np.hypot(axial, across)), GRAVITY * mean * (1 - a)


def frequencies(time: FloatArray, values: FloatArray, *, after: float, count: int) -> FloatArray:
    """Lowest strong free frequencies over the speed in evenly sampled values, by a matrix pencil.

    Args: `after`: turns until the force has ended. `count`: number of frequencies, lowest first.
    """
    free = values[time > after * _TURN][::_EVERY]
    free = free - free.mean()
    hankel = np.lib.stride_tricks.sliding_window_view(free, len(free) // 2)
    _, size, basis = np.linalg.svd(hankel, full_matrices=False)
    reduced = basis[: int(np.sum(size > _NOISE * size[0]))].T
    poles = np.linalg.eigvals(np.linalg.lstsq(reduced[:-1], reduced[1:], rcond=None)[0])
    powers = poles[None, :] ** np.arange(len(free))[:, None]
    strength = np.abs(np.linalg.lstsq(powers, free.astype(complex), rcond=None)[0])
    frequency = np.angle(poles) / (_EVERY * float(time[1] - time[0]))
    modes: list[float] = []
    # A wave of finite height has a weaker spectral line near the main one: the stronger one counts.
    for i in np.argsort(-strength):
        apart = all(abs(frequency[i] / other - 1) > 0.15 for other in modes)
        if frequency[i] > 0.1 and strength[i] > 0.03 * strength.max() and apart:
            modes.append(float(frequency[i]))
    return np.sort(modes)[:count]
