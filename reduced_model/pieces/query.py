"""One query of the compact law: which way its tube flows, and what the answer is worth; as `point`."""

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
    """Look from the other chamber."""
    kept = w[UP_LEVEL]
    w[UP_LEVEL] = w[DOWN_LEVEL]
    w[DOWN_LEVEL] = kept
    kept = w[UP_GAS]
    w[UP_GAS] = w[DOWN_GAS]
    w[DOWN_GAS] = kept


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
    """Whether a primed column that nothing drives is still there: below a level, or in exact balance."""
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

    Returns: whether it is the reverse one, of which the velocity is positive too.
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
    """What a fill is worth for which the nearest within the range is taken."""
    if fill != fill:
        return INVALID
    if fill < -FILL_SLACK or fill > c[LARGEST_FILL] + FILL_SLACK:
        return EXTRAPOLATED
    return OK


@both_ways
def is_usual(c: Law, w: Query) -> bool:
    """Whether fills and pressure of a query are those that the law is made for."""
    # Not joined by `and`: structured text evaluates both sides.
    if w[FILL] >= 0.0:
        if w[FILL] <= c[LARGEST_FILL]:
            if w[OPPOSITE_FILL] >= 0.0:
                if w[OPPOSITE_FILL] <= c[LARGEST_FILL]:
                    if w[PRESSURE] >= c[LEAST_PRESSURE]:
                        return w[PRESSURE] <= GREATEST_PRESSURE
    return False


@both_ways
def worth_of(c: Law, w: Query) -> float:
    """What an unusual query is worth."""
    if w[PRESSURE] >= c[LEAST_PRESSURE] and w[PRESSURE] <= GREATEST_PRESSURE:
        return larger(fill_status(c, w[FILL]), fill_status(c, w[OPPOSITE_FILL]))
    return INVALID


@both_ways
def answer(c: Law, k: Cells, p: Pieces, q: Levels, w: Query) -> None:
    """Velocity out of the driven chamber, m/s, regime, status, primed afterwards."""
    w[MARGIN] = 0.0
    up = w[FILL]
    down = w[OPPOSITE_FILL]
    worth = OK
    if not is_usual(c, w):
        worth = worth_of(c, w)
        if worth == INVALID:
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
    if worth == EXTRAPOLATED:
        w[STATUS] = EXTRAPOLATED
