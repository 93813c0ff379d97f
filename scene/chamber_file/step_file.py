"""Solids in STEP: meshed by Gmsh, which is an extra, in a process that ends when it takes too long."""

from __future__ import annotations

import subprocess
import sys
import tempfile
from importlib.util import find_spec
from pathlib import Path
from typing import Final

from ringbalance.scene.chamber_file.contents import Contents, MeshFileError
from ringbalance.scene.chamber_file.gmsh_file import read_gmsh

STEP_ENDINGS: Final = (".step", ".stp")
STEP_UNIT: Final = "m"
_LONGEST: Final = 300
"""Seconds."""
_COARSEST, _FINEST = 1 / 6, 1 / 40
"""Size of cells over the extent of the solid."""


def meshed_step(content: bytes, *, tolerance: float) -> Contents:
    """The mesh of a STEP file in metres, of second order.

    The size of the cells over the extent of the solid is the cube root of the tolerance over 2: what
    quadratic cells leave of a field falls with the third power of their size.
    Raises: MeshFileError: no Gmsh is there, or it cannot mesh the solid in time.
    """
    if find_spec("gmsh") is None:
        problem = "a STEP file needs the extra cad, which meshes it"
        raise MeshFileError.of(problem, 'pip install "ringbalance[cad]", or a mesh in place of the solid')
    if b"ISO-10303-21" not in content[:1000]:
        raise MeshFileError.of("this is not a STEP file: it does not begin with ISO-10303-21")
    share = min(max(tolerance ** (1 / 3) / 2, _FINEST), _COARSEST)
    with tempfile.TemporaryDirectory() as folder:
        source, target = Path(folder) / "solid.step", Path(folder) / "solid.msh"
        source.write_bytes(content)
        command = [sys.executable, "-m", "ringbalance.scene.chamber_file.step_meshing"]
        try:
            child = subprocess.run(
                [*command, str(source), str(target), repr(share)],
                capture_output=True,
                timeout=_LONGEST,
                check=False,
                cwd=folder,
            )
        except subprocess.TimeoutExpired as error:
            raise MeshFileError.of(f"Gmsh has not meshed the solid within {_LONGEST} s", "a mesh") from error
        if child.returncode or not target.exists():
            lines = child.stderr.decode("utf-8", errors="replace").strip().splitlines()
            reason = "".join(each for each in (lines or ["it ended"])[-1] if each.isprintable())[:200]
            raise MeshFileError.of(f"Gmsh cannot mesh the solid: {reason}", "one solid with a closed surface")
        return read_gmsh(target.read_bytes())
