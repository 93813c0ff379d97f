"""The page that shows the kept comparison with OpenFOAM."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from ringbalance.results.numbers import rounded

_TITLES = {
    "tube": "Straight turning tube, laminar",
    "bend": "Turning tube with two bends, laminar, three dimensions",
    "turbulent": "Straight turning tube, turbulent (k-omega SST)",
    "waves": "Waves on the ring in a chamber without plates",
    "jet": "Crater of a gas jet near its hole",
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
    "jet": """\
interFoam in two dimensions, on a block aligned with the axes: a jet from a slot of the width d on a bath
3 d below, gas 0.012 times as dense as the liquid, no surface tension, no turbulence model. In water the
bath sloshes and its waves grow until liquid flies off; in a liquid of 1,000 cSt the crater keeps its
depth, and the uncertainty contains what is left of the waves. Here: the depth whose pressure is that
with which the jet stops, without an uncertainty of its own; a plane and a round jet keep that pressure
on the axis over some five widths. Depths fall with finer cells, from 2 to 3 % above on the coarsest to 4
to 8 % below on the finest, presumably because there the jet rolls up before it meets the liquid: the
agreement is no closer than that. How a round jet decays farther away is not compared.""",
}
_HEAD = """# Beside OpenFOAM

What the program computes, beside an independent code that shares nothing with it but the cells of the
tube's section. OpenFOAM {openfoam} of Debian, run by `make bench-cfd`. The uncertainty of
OpenFOAM is that of its cells (grid convergence index on three meshes, 95 %), that of the program is
what it states for the quantity. The two agree when their difference is within both. Times are of one
processor core, on the finest mesh.
"""
_TRIED = """
## Transfer over the crest: tried, not compared

interFoam of this build is wrong on meshes that are not aligned with the axes, so only plane channels could
be tried: an inverted U, 10 mm wide and 8 widths high, under gravity, in two dimensions, once and by hand.
Liquid whose head ends below the crest stays. A full siphon, 10 widths of head, runs at 0.67 m/s on 6 cells
across the channel; the balance of pressures gives 0.64 m/s, 0.57 to 0.75 with what two square corners may
cost. Liquid that spills, 0.3 to 0.75 widths of head above the lip, starts within a fifth of the rate of a
weir. How soon it carries the gas out depends on the cells: at 0.3 widths a siphon runs after 1.6 s with 6
cells across, and does not after 2.4 s with 12, because cells that are half liquid take gas along. The
Froude number at which gas leaves is therefore not verified by it.
"""


def page(document: Mapping[str, Any]) -> str:
    """Markdown of the kept results."""
    head, dates = _HEAD.format(openfoam=document["openfoam"]), document["dates"]
    sections = (_section(name, dates[name], rows) for name, rows in document["rows"].items())
    return head + "".join(sections) + _TRIED


def _section(name: str, date: str, rows: list[Mapping[str, Any]]) -> str:
    lines = [f"\n## {_TITLES[name]}\n", f"{_NOTES[name]} Run on {date}.\n"]
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
    if half_width == 0.0:
        return f"{value:.3g}"
    return f"{rounded(value, half_width)} ± {rounded(half_width, half_width)}"


def _seconds(value: float) -> str:
    return f"{value:.0f} s" if value >= 10 else f"{value:.1g} s"
