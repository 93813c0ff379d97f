"""Names of boundaries: what a file has is compared with what a chamber needs, facet by facet."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from types import MappingProxyType
from typing import Final

import numpy as np

from ringbalance.scene.arrays import BoolArray, IntArray
from ringbalance.scene.chamber_file.contents import Body, Elements
from ringbalance.scene.chamber_file.elements import CORNERS, key_of
from ringbalance.scene.chamber_file.record import OUTER_WALL
from ringbalance.scene.chamber_file.topology import Facets
from ringbalance.scene.faults import closest, did_you_mean
from ringbalance.scene.kinds import Finding
from ringbalance.scene.toml import toml_text

PORT: Final = "port"
WALLS: Final = "walls"
VOLUME: Final = "chamber"
MEANINGS: Final[Mapping[str, str]] = MappingProxyType(
    {
        OUTER_WALL: "farthest from the shaft, where the liquid lies; needed",
        "inner_wall": "nearest to the shaft",
        "plate_left": "radial plate at the higher angle about the shaft",
        "plate_right": "radial plate at the lower angle",
        "end_back": "end wall at the lower coordinate along the shaft",
        "end_front": "end wall at the higher coordinate along the shaft",
        "gas_tube": "outside of a tube or a pin inside the chamber",
        "gas_hole": "mouth of the gas line, or of a gas tube",
        PORT: "opening of the connecting tube; without `port_radius` its mean radius is used",
        WALLS: "any other wall; facets without a name count as this",
    }
)
KNOWN_NAMES: Final = tuple(MEANINGS)


def boundaries_of(body: Body, facets: Facets) -> tuple[dict[str, IntArray], tuple[Finding, ...]]:
    """Facets of a body by name, each as its cell has them, and what is wrong with the names."""
    found = [*_volume_names(body), *_unknown(body), *_missing(body)]
    sides = facets.outer[np.argsort(facets.keys[facets.outer], kind="stable")]
    held = np.zeros((len(KNOWN_NAMES), len(sides)), dtype=np.bool_)
    for block in body.named:
        at, real = _places(body, facets, block, facets.keys[sides])
        found += _no_facets(body, facets, block, real)
        found += _other_middles(body, facets.nodes[sides[at[real]]], block, real)
        for name in set(block.names) & set(KNOWN_NAMES):
            held[KNOWN_NAMES.index(name), at[real]] = True
    found += _named_twice(body, facets.nodes[sides, : facets.corners], held)
    held[KNOWN_NAMES.index(WALLS)] |= ~held.any(axis=0)
    marked = {name: facets.nodes[sides[inside]] for name, inside in zip(KNOWN_NAMES, held, strict=True)}
    return {name: each for name, each in marked.items() if len(each)}, tuple(found)


def _places(body: Body, facets: Facets, block: Elements, keys: IntArray) -> tuple[IntArray, BoolArray]:
    """Where the facets of a block stand among sorted keys, and which of them do."""
    wanted = key_of(block.nodes[:, : CORNERS[block.kind]], len(body.points))
    at = np.minimum(np.searchsorted(keys, wanted), len(keys) - 1)
    return at, (keys[at] == wanted) & (CORNERS[block.kind] == facets.corners)


def _volume_names(body: Body) -> Iterator[Finding]:
    """All cells have the name of the volume, or none has a name."""
    for name, cells in body.cell_names:
        if name != VOLUME:
            hint = did_you_mean(name, [VOLUME])
            problem = f"the cells of the volume {toml_text(name)} are not the chamber{hint}: "
            labels = body.cell_labels(np.flatnonzero(cells))
            yield Finding(problem=problem + labels, allowed=f'the name "{VOLUME}", or no named volume')
    marks = [cells for name, cells in body.cell_names if name == VOLUME]
    if marks and not marks[0].all() and len(body.cell_names) == 1:
        problem = (
            f'cells do not belong to the volume "{VOLUME}": {body.cell_labels(np.flatnonzero(~marks[0]))}'
        )
        yield Finding(problem=problem, allowed=f'every cell in "{VOLUME}"')


def _unknown(body: Body) -> Iterator[Finding]:
    for name in dict.fromkeys(name for block in body.named for name in block.names):
        if name in KNOWN_NAMES:
            continue
        blocks = [block for block in body.named if name in block.names]
        corners = blocks[0].nodes[:, : CORNERS[blocks[0].kind]]
        labels = body.facet_labels(corners, blocks[0].numbers)
        problem = f"unknown name of a boundary, {toml_text(name)}{did_you_mean(name, KNOWN_NAMES)}: {labels}"
        yield Finding(problem=problem, allowed=", ".join(KNOWN_NAMES))


def _missing(body: Body) -> Iterator[Finding]:
    """An error where no facet is the outer wall, with the names that the file does have."""
    names = dict.fromkeys(name for block in body.named for name in block.names)
    if any(closest(name, KNOWN_NAMES) == OUTER_WALL for name in names):
        return
    volumes = [name for name, _ in body.cell_names]
    if OUTER_WALL in (*body.lesser, *volumes):
        what = "lines or points" if OUTER_WALL in body.lesser else "cells"
        yield Finding(
            problem=f'"{OUTER_WALL}" names {what}, not facets', allowed="a name of surface elements"
        )
        return
    there = [*names, *volumes, *body.lesser, *body.other_names]
    listed = ", ".join(toml_text(name) for name in dict.fromkeys(there)) or "none"
    problem = f'no facets have the name "{OUTER_WALL}"; names in the file: {listed[:300]}'
    yield Finding(problem=problem, allowed=f'a named boundary "{OUTER_WALL}" (Gmsh: Physical Surface)')


def _no_facets(body: Body, facets: Facets, block: Elements, real: BoolArray) -> Iterator[Finding]:
    """Named elements that are no outer facet: between two cells, or of no cell."""
    every = np.sort(facets.keys)
    _, side = _places(body, facets, block, every)
    names = " and ".join(toml_text(name) for name in block.names)
    for wrong, what in ((side & ~real, "lie between two cells"), (~side, "are no side of any cell")):
        if wrong.any():
            corners = block.nodes[wrong, : CORNERS[block.kind]]
            labels = body.facet_labels(corners, block.numbers[wrong])
            problem = f"facets named {names} {what} ({len(corners)}): {labels}"
            yield Finding(problem=problem, allowed="facets of the chamber's surface")


def _other_middles(body: Body, cell: IntArray, block: Elements, real: BoolArray) -> Iterator[Finding]:
    """Facets of second order whose mid-side nodes are not those of their cell."""
    if cell.shape[1] != block.nodes.shape[1]:
        return
    nodes = block.nodes[real]
    wrong = (np.sort(cell, axis=1) != np.sort(nodes, axis=1)).any(axis=1)
    if wrong.any():
        corners = nodes[wrong, : CORNERS[block.kind]]
        labels = body.facet_labels(corners, block.numbers[real][wrong])
        problem = f"named facets have other mid-side nodes than their cells ({len(corners)}): {labels}"
        yield Finding(problem=problem, allowed="facets and cells with the same nodes")


def _named_twice(body: Body, corners: IntArray, held: BoolArray) -> Iterator[Finding]:
    wrong = held.sum(axis=0) > 1
    if wrong.any():
        both = held[:, np.flatnonzero(wrong)[0]]
        names = " and ".join(toml_text(KNOWN_NAMES[place]) for place in np.flatnonzero(both))
        problem = f"facets have two names, {names} ({wrong.sum()}): {body.facet_labels(corners[wrong])}"
        yield Finding(problem=problem, allowed="one name for each facet")
