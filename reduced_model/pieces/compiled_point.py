"""The compact law at many points, and search tables of its inverse; compiled, bit for bit as in Python."""

from __future__ import annotations

from ringbalance.reduced_model.pieces.inverse import set_roots
from ringbalance.reduced_model.pieces.point import (
    FILL,
    MARGIN,
    OPPOSITE_FILL,
    PLACES,
    PRESSURE,
    PRIMED,
    PRIMED_AFTER,
    REGIME,
    VELOCITY,
)
from ringbalance.reduced_model.pieces.query import answer
from ringbalance.scene.arrays import BoolArray, FloatArray, IntArray
from ringbalance.scene.platform.compiled import in_place


@in_place
def set_all_roots(c: FloatArray, p: FloatArray, ways: int, cells: FloatArray, roots: FloatArray) -> None:
    """`set_roots` of each way. Args: `cells`: shape (ways, `ROOT_PLACES`)."""
    for way in range(ways):
        set_roots(c, p, way, cells[way], roots)


@in_place
def answer_each(
    c: FloatArray,
    p: FloatArray,
    conditions: tuple[FloatArray, FloatArray, FloatArray, BoolArray],
    w: FloatArray,
    answers: tuple[FloatArray, IntArray, BoolArray, FloatArray],
) -> None:
    """Answer n queries of fill, opposite fill, pressure and primed, with `w` as workspace.

    Args: `answers`: velocity, regime, primed afterwards, and margin over the crest.
    """
    fill, opposite, pressure, primed = conditions
    k = c[PLACES:]
    velocity, regime, after, margin = answers
    for i in range(fill.size):
        w[FILL], w[OPPOSITE_FILL], w[PRESSURE] = fill[i], opposite[i], pressure[i]
        w[PRIMED] = 1.0 if primed[i] else 0.0
        answer(c, k, p, p, w)
        velocity[i], regime[i], after[i] = w[VELOCITY], int(w[REGIME]), w[PRIMED_AFTER] != 0.0
        margin[i] = w[MARGIN]
