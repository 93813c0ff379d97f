"""Calibrated laws and their compact forms, made once."""

from __future__ import annotations

from functools import cache
from typing import Final, cast

import pytest

import ringbalance as rb
from ringbalance.export.blocks import Block, controller_block, disc_block, law_block
from ringbalance.export.compact import CompactLaw, compact_law
from ringbalance.reduced_model.law.calibrated_law import CalibratedLaw
from ringbalance.scene.models import Scene

Both = tuple[CalibratedLaw, CompactLaw]


FAN: Final = {
    "disc.outer_radius": "200 mm",
    "disc.inner_radius": "120 mm",
    "tube.port_radius": "200 mm",
    "tube.hump_radius": "150 mm",
    "tube.hump_position": 0.4,
    "tube.length": "600 mm",
    "tube.bore": "4 mm",
    "rotor.speed": "1480 rpm",
}
"""A slow disc, in which gravity counts, and whose tube is not the same both ways."""


@cache
def both_laws(name: str) -> Both:
    """Calibrated law of a bundled scene, or of "fan", and its compact form."""
    scene = cast(Scene, rb.load_scene(rb.bundled_scene("six_chamber" if name == "fan" else name)))
    if name == "fan":
        scene = scene.with_values(FAN)
    law = rb.calibrate(scene).flow_law
    return law, compact_law(scene=scene, law=law)


@pytest.fixture(
    scope="session",
    params=["liquid_ring_paper", "six_chamber", "grinding_spindle", "imported_chamber", "fan"],
)
def laws(request: pytest.FixtureRequest) -> Both:
    return both_laws(request.param)


@pytest.fixture(scope="session")
def six() -> Both:
    """Of the scene that has all regimes."""
    return both_laws("six_chamber")


def all_blocks(name: str, both: Both) -> dict[str, Block]:
    """Of a bundled scene, by kind."""
    scene = cast(Scene, rb.load_scene(rb.bundled_scene(name)))
    law, compact = both
    other = scene.with_values({"controller.kind": "law_based"})
    return {
        "law": law_block(compact),
        "disc": disc_block(scene, law),
        "controller": controller_block(scene),
        "trial": controller_block(scene.with_values({"controller.kind": "trial"})),
        "law_based": controller_block(other, law),
    }


@pytest.fixture(scope="session")
def blocks(six: Both) -> dict[str, Block]:
    return all_blocks("six_chamber", six)


@pytest.fixture(scope="session")
def paper_blocks() -> dict[str, Block]:
    """Of a disc with four chambers."""
    return all_blocks("liquid_ring_paper", both_laws("liquid_ring_paper"))
