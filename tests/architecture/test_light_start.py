"""`--help` and `import ringbalance` load nothing heavy; threads are set before numpy could see them."""

from __future__ import annotations

import json
import subprocess
import sys
from functools import cache

HEAVY = (
    "numpy",
    "scipy",
    "vtk",
    "vtkmodules",
    "pyvista",
    "skfem",
    "matplotlib",
    "fluids",
    "meshio",
    "numba",
)
CALIBRATION = "import ringbalance as r\nr.calibrate(r.load_scene(r.bundled_scene('liquid_ring_paper')))"
REPORT = "import json, sys; sys.stderr.write(json.dumps(sorted(sys.modules)))"


@cache
def modules(code: str) -> frozenset[str]:
    """Modules that a fresh interpreter has after running some code."""
    command = [sys.executable, "-c", f"{code}\n{REPORT}"]
    child = subprocess.run(command, capture_output=True, text=True, check=True)
    return frozenset(json.loads(child.stderr))


def loaded(code: str) -> set[str]:
    """Top-level names of these modules."""
    return {name.split(".")[0] for name in modules(code)}


def test_help_loads_nothing_heavy() -> None:
    code = "from ringbalance.cli import main\nassert main(['--help']) == 0"
    assert loaded(code) & set(HEAVY) == set()


def test_import_loads_nothing_heavy() -> None:
    assert loaded("import ringbalance\ndir(ringbalance)") & set(HEAVY) == set()


def test_a_list_of_cases_loads_no_compiler() -> None:
    code = "from ringbalance.cli import main\nassert main(['verify', '--list']) == 0"
    assert "numba" not in loaded(code)


def test_a_calibration_loads_no_compiler_no_flow_solver_and_no_mesh_files() -> None:
    assert loaded(CALIBRATION) & {"numba", "pyamg", "meshio"} == set()
    assert [name for name in modules(CALIBRATION) if ".navier_stokes" in name] == []


def test_a_static_sweep_loads_no_compiler_no_mesh_and_no_run() -> None:
    scene = "import ringbalance as r\nscene = r.load_scene(r.bundled_scene('liquid_ring_paper'))\n"
    found = modules(scene + "r.sweep(scene, {'tube.bore': [1e-3, 2e-3]}, intervals=False)")
    assert {name.split(".")[0] for name in found} & {"numba", "skfem", "pyamg"} == set()
    assert "ringbalance.design.runs" not in found


def test_a_compiler_would_be_seen() -> None:
    assert "numba" in loaded("import ringbalance.controller.compiled_loop")


def test_a_heavy_start_would_be_seen() -> None:
    assert "numpy" in loaded("import ringbalance.mesh.geometry")
