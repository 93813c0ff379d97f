"""Errors that are supposed of the models of k, against the uncertainty that stands with them."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from ringbalance.physics.tube.loss import MODEL_CAUSES, model_parts, with_errors
from ringbalance.physics.tube.state import TubeState, tube_state
from ringbalance.scene.fitted import ModelError
from ringbalance.scene.models import Scene, Tube
from ringbalance.scene.uncertain import NORMAL_95

VELOCITIES = np.array([1.0, 3.0, 8.0, 20.0])


def erring(scene: Scene, *errors: tuple[str, float, float]) -> tuple[Tube, TubeState]:
    supposed = tuple(
        ModelError.named(f"model: {cause}, {part}", size)
        for cause, *both in errors
        for part, size in zip(("even", "odd"), both, strict=True)
    )
    tube = replace(scene.tube, model_errors=supposed)
    state = tube_state(scene, VELOCITIES, tube=tube)
    return tube, with_errors(tube=tube, state=state)


@pytest.mark.parametrize("cause", [name for name in MODEL_CAUSES if name != "left out"])
def test_both_parts_together_are_the_stated_uncertainty_at_every_velocity(
    paper_scene: Scene, cause: str
) -> None:
    """Independent parts of one standard deviation each: e^2 = U^2/1.96^2 (cos^2 + sin^2)."""
    tube, right = erring(paper_scene)
    sides = [erring(paper_scene, (cause, n, 1 - n))[1].k - right.k for n in (1.0, 0.0)]
    stated = model_parts(tube=tube, state=right)[cause] / NORMAL_95
    assert np.hypot(*sides) == pytest.approx(stated, rel=1e-9)
    angle = np.log(right.reynolds)
    assert sides[0] == pytest.approx(stated * np.cos(angle), abs=1e-12)


def test_an_error_of_bends_stays_with_the_bends(paper_scene: Scene) -> None:
    """Of two bends alike one lies before the crest, and half of the error with it."""
    (_, right), (_, wrong) = erring(paper_scene), erring(paper_scene, ("bends", 1.0, 0.0))
    assert sum(wrong.bends) == pytest.approx(wrong.terms["bends"])
    before = wrong.upstream_loss(0.5) - right.upstream_loss(0.5)
    assert before == pytest.approx((wrong.k - right.k) / 2)


def test_a_prescribed_loss_has_no_model_to_err(paper_scene: Scene) -> None:
    prescribed = replace(paper_scene, tube=replace(paper_scene.tube, drag_coefficient=50.0))
    errors = [(cause, 1.0, 1.0) for cause in MODEL_CAUSES]
    assert np.array_equal(erring(prescribed, *errors)[1].k, np.full(4, 50.0))
