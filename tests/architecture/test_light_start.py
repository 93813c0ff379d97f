"""`--help` and `import ringbalance` load nothing heavy; threads are set before numpy could see them."""

from __future__ import annotations

import json
import subprocess
import sys
from functools import cache

import pytest

HEAVY = {
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
}
SCENE = "import ringbalance as r\nscene = r.load_scene(r.bundled_scene('liquid_ring_paper'))\n"
REPORT = "import json, sys; sys.stderr.write(json.dumps(sorted(sys.modules)))"


@cache
def modules(code: str) -> frozenset[str]:
    """Modules that a fresh interpreter has after running some code."""
    command = [sys.executable, "-c", f"{code}\n{REPORT}"]
    child = subprocess.run(command, capture_output=True, text=True, check=True)
    return frozenset(json.loads(child.stderr))


@pytest.mark.parametrize(
    ("code", "refused"),
    [
        ("from ringbalance.cli import main\nassert main(['--help']) == 0", HEAVY),
        ("import ringbalance\ndir(ringbalance)", HEAVY),
        ("from ringbalance.cli import main\nassert main(['verify', '--list']) == 0", {"numba"}),
        (f"{SCENE}r.calibrate(scene)", {"pyamg", "meshio"}),
        (
            f"{SCENE}r.sweep(scene, {{'tube.bore': [1e-3, 2e-3]}}, intervals=False)",
            {"numba", "skfem", "pyamg", "ringbalance.design.runs"},
        ),
    ],
    ids=["help", "import", "list of cases", "calibration", "static sweep"],
)
def test_nothing_heavy_is_loaded_early(code: str, refused: set[str]) -> None:
    assert modules(code) & refused == set()


def test_a_heavy_start_would_be_seen() -> None:
    assert {"numpy", "numba"} <= modules("import ringbalance.controller.compiled_loop")
