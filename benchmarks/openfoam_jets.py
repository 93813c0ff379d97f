"""Plane gas jet on a bath of liquid, in OpenFOAM: interFoam on a block aligned with the axes, one half of it.

A slot of the width d in the ceiling blows down on the liquid, which lies h below; gas leaves through the
rest of the ceiling.  The bath is 17 d wide, without surface tension; its walls slip.  Gas is 0.012 times as
dense as the liquid and taken as incompressible, so that the ratio of q to (rho - rho_g) g d alone counts.
The liquid is as viscous as an oil of 1,000 cSt and the jet's velocity rises over 0.4 s: in water the bath
sloshes, and its waves grow until liquid flies off.  Stresses of the viscous liquid are those that gas exerts
along it, some hundredths of q.

A plane jet keeps its core, and with it q on its axis, over some five widths; there its crater obeys the
balance of the round one.  Farther away it decays otherwise than the round one and cannot be compared.
"""

from __future__ import annotations

import math
import re
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

import numpy as np
from openfoam_case import HexMesh, extruded, field, run, vector, write_case

from ringbalance.scene.arrays import FloatArray, IntArray

WIDTH_M: Final = 0.01
GRAVITY: Final = 9.81
LIQUID, GAS = 1000.0, 12.0
"""Densities, kg/m^3."""
_RAMP_S: Final = 0.4
_END_S: Final = 1.5
_FAR: Final = 4.0
"""Distance from the axis over d from which on the level counts as that of the bath."""
_SAMPLE_S: Final = 0.02
_WALL = {"type": "slip"}
_FLAT = {"type": "empty"}
_MIDDLE = {"type": "symmetryPlane"}


@dataclass(frozen=True, kw_only=True)
class Bath:
    """Case to solve: q over (rho - rho_g) g d, the distance h over d, and the cells across half the slot."""

    pressure: float
    distance: float
    cells: int

    @property
    def depth(self) -> float:
        """Depth of the liquid over d."""
        return 1.5 + 2 * self.pressure

    def nodes(self) -> tuple[FloatArray, FloatArray]:
        """Positions across and upward over d: even cells about the slot and the crater, wider ones beyond."""
        n = self.cells
        across = _graded((0.5, n, 1.0), (2.0, 3 * n, 2.0), (6.0, 7 * n // 2, 4.0))
        fine, above = self.depth - 0.5, self.distance - 0.5
        upward = _graded(
            (1.0, n, 0.6), (fine, round(2 * fine * n), 1.0), (above, round(1.7 * above * n), 1.4)
        )
        return across, upward


@dataclass(frozen=True, kw_only=True)
class Crater:
    """A run: mean depth on the axis over d in its second half, and its standard deviation."""

    depth: float
    deviation: float
    seconds: float


def _graded(*parts: tuple[float, int, float]) -> FloatArray:
    """Nodes of intervals, each by length, number of cells and ratio of its last cell to its first."""
    steps = []
    for length, count, ratio in parts:
        sizes = ratio ** np.linspace(0.0, 1.0, count)
        steps.append(length * sizes / sizes.sum())
    return np.concatenate([[0.0], np.cumsum(np.concatenate(steps))])


def crater(*, folder: Path, bath: Bath) -> Crater:
    """Depth of the crater below the level of the bath around it."""
    x, z = bath.nodes()
    write_case(folder=folder, mesh=_mesh(x, z), files=_fields(bath, x, z) | _constants() | _numerics())
    done = run("interFoam", folder=folder)
    times = sorted(
        (float(path.name), path)
        for path in folder.iterdir()
        if re.fullmatch(r"[0-9.]+", path.name) and float(path.name) > _END_S / 2
    )
    middle, size = (x[1:] + x[:-1]) / 2, np.diff(x)
    depths = []
    for _, path in times:
        text = (path / "alpha.liquid").read_text(encoding="ascii")
        values = text[text.index("(") + 1 : text.index(")")].split()
        levels = np.array(values, dtype=np.float64).reshape(z.size - 1, -1).T @ np.diff(z)
        depths.append(np.average(levels[middle > _FAR], weights=size[middle > _FAR]) - levels[0])
    return Crater(depth=float(np.mean(depths)), deviation=float(np.std(depths)), seconds=done.seconds)


def _mesh(x: FloatArray, z: FloatArray) -> HexMesh:
    """One layer of cells; the block's y axis points out of it."""
    number = np.arange(x.size * z.size).reshape(z.size, x.size)
    quads = np.stack([number[:-1, :-1], number[:-1, 1:], number[1:, 1:], number[1:, :-1]], axis=-1)
    plane = np.stack(np.meshgrid(x, z), axis=-1).reshape(-1, 2)
    # Seen from the next level, which lies at a smaller y.
    levels = [np.insert(plane, 1, y, axis=1) for y in (0.1, 0.0)]
    points, cells = extruded(points=WIDTH_M * np.array(levels), quads=quads.reshape(-1, 4))
    count = number.size

    def standing(line: IntArray) -> IntArray:
        return np.stack([line[:-1], line[1:], line[1:] + count, line[:-1] + count], axis=-1)

    top, jet = standing(number[-1]), x[1:] <= 0.5 + 1e-9
    flat = np.concatenate([quads.reshape(-1, 4), quads.reshape(-1, 4) + count])
    patches: dict[str, tuple[IntArray, dict[str, Any]]] = {
        "jet": (top[jet], {"type": "patch"}),
        "open": (top[~jet], {"type": "patch"}),
        "wall": (np.concatenate([standing(number[0]), standing(number[:, -1])]), {"type": "wall"}),
        "middle": (standing(number[:, 0]), _MIDDLE),
        "flat": (flat, _FLAT),
    }
    return HexMesh(points=points, cells=cells, patches=patches)


def _fields(bath: Bath, x: FloatArray, z: FloatArray) -> dict[str, Any]:
    def boundary(jet: Any, outside: Any, wall: Any) -> dict[str, Any]:
        return {"jet": jet, "open": outside, "wall": wall, "middle": _MIDDLE, "flat": _FLAT}

    speed = math.sqrt(2 * bath.pressure * (LIQUID - GAS) * GRAVITY * WIDTH_M / GAS)
    slow, fast = vector((0, 0, -0.1 * speed)), vector((0, 0, -speed))
    table = f"table ((0 {slow}) ({_RAMP_S} {fast}) (1000 {fast}))"
    flux = {"type": "fixedFluxPressure", "value": "uniform 0"}
    filled = np.clip((bath.depth - z[:-1]) / np.diff(z), 0.0, 1.0).repeat(x.size - 1)
    liquid = field(
        kind="volScalarField", dimensions="[0 0 0 0 0 0 0]", value="0",
        boundary=boundary(
            {"type": "fixedValue", "value": "uniform 0"},
            {"type": "inletOutlet", "inletValue": "uniform 0", "value": "uniform 0"},
            {"type": "zeroGradient"},
        ),
    )  # fmt: skip
    values = " ".join(f"{value:.6g}" for value in filled)
    return {
        "0/alpha.liquid": liquid | {"internalField": f"nonuniform List<scalar> {filled.size} ({values})"},
        "0/U": field(
            kind="volVectorField", dimensions="[0 1 -1 0 0 0 0]", value="(0 0 0)",
            boundary=boundary(
                {"type": "uniformFixedValue", "uniformValue": table, "value": f"uniform {slow}"},
                {"type": "pressureInletOutletVelocity", "value": "uniform (0 0 0)"},
                _WALL,
            ),
        ),
        "0/p_rgh": field(
            kind="volScalarField", dimensions="[1 -1 -2 0 0 0 0]", value="0",
            boundary=boundary(
                flux, {"type": "totalPressure", "p0": "uniform 0", "value": "uniform 0"}, flux
            ),
        ),
    }  # fmt: skip


def _constants() -> dict[str, Any]:
    return {
        "constant/g": {
            "class": "uniformDimensionedVectorField", "dimensions": "[0 1 -2 0 0 0 0]",
            "value": vector((0, 0, -GRAVITY)),
        },
        "constant/turbulenceProperties": {"simulationType": "laminar"},
        "constant/transportProperties": {
            "phases": "(liquid gas)", "sigma": 0,
            "liquid": {"transportModel": "Newtonian", "nu": 1e-3, "rho": LIQUID},
            "gas": {"transportModel": "Newtonian", "nu": 1.5e-6, "rho": GAS},
        },
        "system/controlDict": {
            "application": "interFoam", "startFrom": "startTime", "startTime": 0, "stopAt": "endTime",
            "endTime": _END_S, "deltaT": 1e-5, "adjustTimeStep": "yes", "maxCo": 0.5, "maxAlphaCo": 0.5,
            "maxDeltaT": 1, "writeControl": "adjustableRunTime", "writeInterval": _SAMPLE_S, "purgeWrite": 0,
            "writeFormat": "ascii", "writePrecision": 7, "timePrecision": 8,
        },
    }  # fmt: skip


def _numerics() -> dict[str, Any]:
    pressure = {"solver": "GAMG", "smoother": "DIC", "tolerance": 1e-6, "relTol": 0.02}
    return {
        "system/fvSchemes": {
            "ddtSchemes": {"default": "Euler"}, "gradSchemes": {"default": "Gauss linear"},
            "divSchemes": {
                "div(rhoPhi,U)": "Gauss linearUpwind grad(U)", "div(phi,alpha)": "Gauss vanLeer",
                "div(phirb,alpha)": "Gauss linear", "div(((rho*nuEff)*dev2(T(grad(U)))))": "Gauss linear",
            },
            "laplacianSchemes": {"default": "Gauss linear corrected"},
            "interpolationSchemes": {"default": "linear"}, "snGradSchemes": {"default": "corrected"},
        },
        "system/fvSolution": {
            "solvers": {
                '"alpha.liquid.*"': {
                    "nAlphaCorr": 2, "nAlphaSubCycles": 1, "cAlpha": 1, "MULESCorr": "yes",
                    "nLimiterIter": 3, "solver": "smoothSolver", "smoother": "symGaussSeidel",
                    "tolerance": 1e-8, "relTol": 0,
                },
                '"pcorr.*"': {"solver": "PCG", "preconditioner": "DIC", "tolerance": 1e-5, "relTol": 0},
                "p_rgh": pressure, "p_rghFinal": pressure | {"relTol": 0.005},
                "U": {"solver": "smoothSolver", "smoother": "symGaussSeidel", "tolerance": 1e-6, "relTol": 0},
            },
            "PIMPLE": {
                "momentumPredictor": "no", "nOuterCorrectors": 1, "nCorrectors": 2,
                "nNonOrthogonalCorrectors": 0,
            },
        },
    }  # fmt: skip
