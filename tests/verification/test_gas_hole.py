"""The safe fill of a gas hole where geometry gives it without any calculation."""

from __future__ import annotations

import dataclasses

import pytest

from ringbalance.scene.models import Scene
from ringbalance.verification.cases.gas_line import gas_hole


def safe_fill(scene: Scene, state: str) -> float:
    return gas_hole(scene, "light").quantities[f"margin_{state}"].value + scene.disc.max_fill_ratio


def test_a_nearly_rectangular_chamber_is_safe_up_to_one_half(paper_scene: Scene) -> None:
    """A rectangle is centrally symmetric: every line through its middle halves it."""
    disc = dataclasses.replace(
        paper_scene.disc,
        inner_radius=0.99,
        outer_radius=1.0,
        central_angle=0.01,
        plate_thickness=0.0,
        chambers=6,
    )
    scene = dataclasses.replace(paper_scene, disc=disc)
    assert safe_fill(scene, "stopped") == pytest.approx(0.5, abs=2e-3)


def test_running_the_safe_fill_is_what_lies_outside_the_hole(paper_scene: Scene) -> None:
    """Without plates, so that areas go with the squared radius; the cells' middles leave 0.0009."""
    disc = dataclasses.replace(paper_scene.disc, plate_thickness=0.0)
    evidence = gas_hole(dataclasses.replace(paper_scene, disc=disc), "light")
    radius = evidence.numbers["best_radius"]
    outside = (disc.outer_radius**2 - radius**2) / (disc.outer_radius**2 - disc.inner_radius**2)
    assert evidence.numbers["safe_running"] == pytest.approx(outside, abs=2e-3)


def test_no_sector_is_safe_beyond_one_half(paper_scene: Scene) -> None:
    """Gravity and its opposite cut the chamber in two through any point: one part holds at most a half."""
    assert safe_fill(paper_scene, "stopped") < 0.5
