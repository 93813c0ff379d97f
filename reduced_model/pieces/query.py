"""One query of the compact law: direction of the flow, and status of the answer; as `point`."""

from ringbalance.reduced_model.pieces.point import (
    BLOCKED,
    CAVITY,
    CREST,
    DOWN_GAS,
    DOWN_LEVEL,
    DRIVING,
    EXTRAPOLATED,
    FILL,
    FILL_SLACK,
    GAS_FACTOR,
    GREATEST_PRESSURE,
    INVALID,
    LARGEST_FILL,
    LEAST_DRIVING,
    LEAST_PRESSURE,
    MARGIN,
    OK,
    OPPOSITE_FILL,
    PORT,
    PRESSURE,
    PRIMED,
    PRIMED_AFTER,
    REGIME,
    RESTING,
    REVERSE,
    STANDS,
    STATUS,
    THERE,
    UP_GAS,
    UP_LEVEL,
    VELOCITY,
    WAY_BACK,
    Cells,
    Law,
    Levels,
    Pieces,
    Query,
    larger,
    over_crest,
    set_crest,
    set_drive,
    set_full,
    set_levels,
    within,
)
from ringbalance.scene.platform.both_ways import both_ways


@both_ways
def turn(w: Query) -> None:
    """Swap the upstream and the downstream chamber."""
    swapped = w[UP_LEVEL]
    w[UP_LEVEL] = w[DOWN_LEVEL]
    w[DOWN_LEVEL] = swapped
    swapped = w[UP_GAS]
    w[UP_GAS] = w[DOWN_GAS]
    w[DOWN_GAS] = swapped


@both_ways
def set_flow(c: Law, k: Cells, p: Pieces, w: Query, way: int) -> None:
    """The answer where something drives liquid out of the upstream chamber, whose port must be covered."""
    if w[UP_LEVEL] >= c[PORT]:
        if c[CREST] == 0.0:
            set_full(c, k, p, w)
        else:
            over_crest(c, k, p, w, way)


@both_ways
def stays_full(c: Law, w: Query) -> bool:
    """True if a primed column that nothing drives stays: below a level, or in exact balance."""
    if w[PRIMED] == 0.0:
        return False
    if w[UP_LEVEL] < c[PORT]:
        return False
    if c[CREST] == 0.0:
        return True
    if w[DRIVING] < 0.0:
        return False
    set_crest(c, w, w[DOWN_LEVEL] >= c[PORT])
    return w[RESTING] > w[CAVITY]


@both_ways
def set_answer(c: Law, k: Cells, p: Pieces, w: Query) -> bool:
    """Velocity, regime and primed afterwards; at most one direction flows: what drives one holds the other.

    Returns: true if it is the reverse one, of which the velocity is positive, too.
    """
    w[VELOCITY] = 0.0
    w[REGIME] = BLOCKED
    w[PRIMED_AFTER] = 0.0
    set_drive(c, w)
    if w[DRIVING] > LEAST_DRIVING:
        set_flow(c, k, p, w, THERE)
        return False
    if stays_full(c, w):
        w[PRIMED_AFTER] = 1.0
    turn(w)
    set_drive(c, w)
    if w[DRIVING] > LEAST_DRIVING:
        set_flow(c, k, p, w, int(c[WAY_BACK]))
        if w[REGIME] != BLOCKED:
            w[REGIME] = REVERSE
            return True
    return False


@both_ways
def fill_status(c: Law, fill: float) -> float:
    """Status of a fill for which the nearest within the range is taken."""
    if fill != fill:
        return INVALID
    if fill < -FILL_SLACK or fill > c[LARGEST_FILL] + FILL_SLACK:
        return EXTRAPOLATED
    return OK


@both_ways
def is_usual(c: Law, w: Query) -> bool:
    """True if fills and pressure of a query are within the range of the law."""
    # Not joined by `and`: structured text evaluates both sides.
    if w[FILL] >= 0.0:
        if w[FILL] <= c[LARGEST_FILL]:
            if w[OPPOSITE_FILL] >= 0.0:
                if w[OPPOSITE_FILL] <= c[LARGEST_FILL]:
                    if w[PRESSURE] >= c[LEAST_PRESSURE]:
                        return w[PRESSURE] <= GREATEST_PRESSURE
    return False


@both_ways
def range_status(c: Law, w: Query) -> float:
    """Status of a query outside the range of the law."""
    if w[PRESSURE] >= c[LEAST_PRESSURE] and w[PRESSURE] <= GREATEST_PRESSURE:
        return larger(fill_status(c, w[FILL]), fill_status(c, w[OPPOSITE_FILL]))
    return INVALID


@both_ways
def answer(c: Law, k: Cells, p: Pieces, q: Levels, w: Query) -> None:
    """Velocity out of the driven chamber, m/s, regime, status, primed afterwards."""
    w[MARGIN] = 0.0
    up = w[FILL]
    down = w[OPPOSITE_FILL]
    status = OK
    if not is_usual(c, w):
        status = range_status(c, w)
        if status == INVALID:
            w[VELOCITY] = 0.0
            w[REGIME] = BLOCKED
            w[PRIMED_AFTER] = 0.0
            w[STATUS] = INVALID
            return
        up = within(c, up)
        down = within(c, down)
    w[UP_GAS] = c[GAS_FACTOR] * w[PRESSURE]
    w[DOWN_GAS] = 0.0
    set_levels(c, k, q, w, up, down)
    w[STATUS] = STANDS
    if set_answer(c, k, p, w):
        w[VELOCITY] = -w[VELOCITY]
    if status == EXTRAPOLATED:
        w[STATUS] = EXTRAPOLATED
