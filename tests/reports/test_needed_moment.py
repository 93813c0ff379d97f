"""What a disc is asked for is known no better than what it follows from."""

from __future__ import annotations

from dataclasses import replace

import pytest

from ringbalance.reports.pages.first_page import needed_uncertainty
from ringbalance.scene import Scene


def test_the_needed_moment_is_no_surer_than_the_influence_coefficient(paper_scene: Scene) -> None:
    """Of a scene that states no uncertainty of it: 5 %, as in the runs that `tune` draws."""
    unstated = replace(paper_scene, uncertainty=())
    rotor = unstated.rotor
    needed = rotor.initial_amplitude / rotor.influence_coefficient
    assert needed_uncertainty(unstated) == pytest.approx(0.05 * needed, rel=1e-12)
