"""The paper's disc as a record, so that meshes are tested without a scene file."""

from __future__ import annotations

import numpy as np
import pytest

from ringbalance.scene.models import Disc


@pytest.fixture(scope="session")
def disc() -> Disc:
    """The liquid-ring paper's disc with the inferred plate thickness."""
    return Disc(
        outer_radius=44.5e-3,
        inner_radius=20.5e-3,
        axial_width=62e-3,
        central_angle=np.pi / 2,
        chambers=4,
        plate_thickness=2.777e-3,
        max_fill_ratio=0.5,
        initial_fill=0.25,
    )
