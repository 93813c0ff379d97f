"""The page that shows the kept comparison with OpenFOAM."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from ringbalance.reduced_model.budget import rounded

_TITLES = {
    "tube": "Straight turning tube, laminar",
    "bend": "Turning tube with two bends, laminar, three dimensions",
    "turbulent": "Straight turning tube, turbulent (k-omega SST)",
    "waves": "Waves on the ring in a chamber without plates",
}
_NOTES = {
    "tube": """\
SRFSimpleFoam on one slab of cells with cyclic ends. Here: the section solved on one mesh, with the
uncertainty of the table that the tube law reads.""",
    "bend": """\
SRFSimpleFoam, with developed inflow from its own straight tube. Here: the kept solution of the case
`bent_tube_3d`.""",
    "turbulent": """\
The k-omega SST model with cells down to the wall. It was made for a frame at rest: of the turning it
knows the secondary flow that the Coriolis force drives, not what rotation does to turbulence. It is a
second opinion, not a measurement. Here: the tube law's friction with its uncertainty.""",
    "waves": """\
pimpleFoam on a mesh that moves with the surface; kinematic viscosity 1e-5 of omega R2^2, gravity 0.005
of omega^2 R2. Here: linear theory without viscosity; its uncertainty is that of its cells and the
square of the waves' height over the depth. With plates the surface meets the wall at an angle and its
tracking fails after a few turns: waves in chambers with plates are verified by a second calculation only.""",
}
_HEAD = """# Beside OpenFOAM

What the program computes, beside an independent code that shares nothing with it but the cells of the
tube's section. OpenFOAM {openfoam} of Debian, run on {date} by `make bench-cfd`. The uncertainty of
OpenFOAM is that of its cells (grid convergence index on three meshes, 95 %), that of the program is
what it states for the quantity. The two agree when their difference is within both. Times are of one
processor core, on the finest mesh.
"""


def page(document: Mapping[str, Any]) -> str:
    """Markdown of the kept results."""
    head = _HEAD.format(**{key: document[key] for key in ("openfoam", "date")})
    return head + "".join(_section(name, rows) for name, rows in document["rows"].items())


def _section(name: str, rows: list[Mapping[str, Any]]) -> str:
    lines = [f"\n## {_TITLES[name]}\n", f"{_NOTES[name]}\n"]
    heads = ("quantity", "OpenFOAM", "here", "difference", "agree", "time, OpenFOAM", "time, here")
    lines += ["| " + " | ".join(heads) + " |", "|---" * len(heads) + "|"]
    lines += [_line(row) for row in rows]
    return "\n".join(lines) + "\n"


def _line(row: Mapping[str, Any]) -> str:
    theirs, ours = row["openfoam"], row["ringbalance"]
    cells = (
        row["quantity"],
        _with_half_width(theirs, row["openfoam_half_width"]),
        _with_half_width(ours, row["ringbalance_half_width"]),
        f"{theirs / ours - 1:+.2%}".replace("%", " %"),
        "yes" if row["agrees"] else "no",
        _seconds(row["seconds"]),
        _seconds(row["ringbalance_seconds"]),
    )
    return "| " + " | ".join(cells) + " |"


def _with_half_width(value: float, half_width: float) -> str:
    return f"{rounded(value, half_width)} ± {rounded(half_width, half_width)}"


def _seconds(value: float) -> str:
    return f"{value:.0f} s" if value >= 10 else f"{value:.1g} s"
