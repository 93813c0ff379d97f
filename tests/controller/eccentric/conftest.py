"""The paper's scene of eccentric masses: whole, its plant, and at its first speed for a while."""

from __future__ import annotations

import pytest
from eccentric_runs import bundled

from ringbalance.controller.eccentric_mass.plant import PlantParameters
from ringbalance.controller.eccentric_mass.scene_records import EccentricScene
from ringbalance.verification.papers import at_constant_speed


@pytest.fixture(scope="session")
def paper() -> EccentricScene:
    return bundled("eccentric_mass_paper")


@pytest.fixture(scope="session")
def parameters(paper: EccentricScene) -> PlantParameters:
    return PlantParameters.of(paper)


@pytest.fixture(scope="session")
def scene(paper: EccentricScene) -> EccentricScene:
    """At 100 rpm for twenty seconds."""
    return at_constant_speed(paper, time_limit=20.0)
