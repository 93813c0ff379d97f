"""What all tests share: one thread, no display, Hypothesis examples that are the same on every run."""

from __future__ import annotations

import os
from typing import TYPE_CHECKING, cast

import pytest
from hypothesis import settings

import ringbalance

if TYPE_CHECKING:
    from ringbalance.scene.models import Scene

# None of the imports above brings numpy or matplotlib; both read these when they are imported.
for _name in ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ.setdefault(_name, "1")
os.environ["MPLBACKEND"] = "Agg"

settings.register_profile("ci", derandomize=True, deadline=None, max_examples=25, database=None)
settings.register_profile("dev", deadline=None, max_examples=200)
settings.load_profile(os.environ.get("HYPOTHESIS_PROFILE", "ci"))


@pytest.fixture(scope="session")
def paper_scene() -> Scene:
    """The liquid-ring paper's disc, as bundled."""
    return cast("Scene", ringbalance.load_scene(ringbalance.bundled_scene("liquid_ring_paper")))
