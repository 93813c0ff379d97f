"""The compact law at many points, compiled from `point`; the bits are those of plain Python."""

from __future__ import annotations

from ringbalance.reduced_model.pieces.point import (
    FILL,
    MARGIN,
    MARGIN_SQUARE,
    OPPOSITE_FILL,
    PRESSURE,
    PRIMED,
    PRIMED_AFTER,
    REGIME,
    UNCERTAINTY,
    VELOCITY,
    answer,
)
from ringbalance.scene.arrays import FloatArray
from ringbalance.scene.platform.compiled import in_place


@in_place
def answer_each(c: FloatArray, p: FloatArray, asked: FloatArray, w: FloatArray, answers: FloatArray) -> None:
    """Answer the queries of `asked`, shape (4, n), into `answers`, shape (6, n), with `w` to work in."""
    for i in range(asked.shape[1]):
        w[FILL], w[OPPOSITE_FILL] = asked[0, i], asked[1, i]
        w[PRESSURE], w[PRIMED] = asked[2, i], asked[3, i]
        answer(c, p, w, True)
        answers[0, i], answers[1, i], answers[2, i] = w[VELOCITY], w[UNCERTAINTY], w[REGIME]
        answers[3, i], answers[4, i], answers[5, i] = w[PRIMED_AFTER], w[MARGIN], w[MARGIN_SQUARE]
