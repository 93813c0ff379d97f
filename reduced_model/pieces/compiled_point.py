"""The compact law at many points, and where its inverse looks, compiled; with the bits of plain Python."""

from __future__ import annotations

from ringbalance.reduced_model.pieces.inverse import set_roots
from ringbalance.reduced_model.pieces.point import (
    FILL,
    MARGIN,
    MARGIN_SQUARE,
    OPPOSITE_FILL,
    PLACES,
    PRESSURE,
    PRIMED,
    PRIMED_AFTER,
    REGIME,
    UNCERTAINTY,
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
    asked: tuple[FloatArray, FloatArray, FloatArray, BoolArray],
    w: FloatArray,
    answers: tuple[FloatArray, FloatArray, IntArray, BoolArray],
    margins: FloatArray,
) -> None:
    """Answer n queries of fill, opposite fill, pressure and primed, with `w` to work in.

    Args: `answers`: velocity, half-width, regime and primed afterwards. `margins`: with their squared
        half-widths, shape (2, n), or (2, 0) where they are not asked for.
    """
    fill, opposite, pressure, primed = asked
    k = c[PLACES:]
    velocity, uncertainty, regime, after = answers
    for i in range(fill.size):
        w[FILL], w[OPPOSITE_FILL], w[PRESSURE] = fill[i], opposite[i], pressure[i]
        w[PRIMED] = 1.0 if primed[i] else 0.0
        answer(c, k, p, p, w, True)
        velocity[i], uncertainty[i] = w[VELOCITY], w[UNCERTAINTY]
        regime[i], after[i] = int(w[REGIME]), w[PRIMED_AFTER] != 0.0
        if margins.shape[1]:
            margins[0, i], margins[1, i] = w[MARGIN], w[MARGIN_SQUARE]
