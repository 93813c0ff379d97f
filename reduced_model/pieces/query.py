"""One query of the compact law: direction of flow, status, surface and moment of a chamber; as `point`."""

from math import sqrt

from ringbalance.reduced_model.pieces.point import (
    BLOCKED,
    CAVITY,
    CHAMBER_CELLS,
    CHAMBER_SCALE,
    CREST,
    DOWN_GAS,
    DOWN_LEVEL,
    DRIVING,
    END,
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
    MOMENT,
    MOMENT_0,
    MOMENT_1,
    MOMENT_2,
    MOMENT_WIDTH,
    OK,
    OPPOSITE_FILL,
    PORT,
    PRESSURE,
    PRIMED,
    PRIMED_AFTER,
    RADIUS,
    REGIME,
    RESTING,
    REVERSE,
    SQUARE_0,
    SQUARE_1,
    SQUARE_2,
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
    piece,
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


def chamber_piece(c: Law, k: Cells, p: Pieces, fill: float) -> int:
    """Row of a chamber's surface and moment that holds a fill within the range."""
    return piece(p, int(k[int(fill * c[CHAMBER_SCALE] + c[CHAMBER_CELLS])]), fill)


def surface_radius(c: Law, k: Cells, p: Pieces, fill: float) -> float:
    """Radius of a chamber's concentric free surface, m."""
    x = within(c, fill)
    row = chamber_piece(c, k, p, x)
    t = x - p[row][END]
    return sqrt(larger(p[row][SQUARE_0] + t * (p[row][SQUARE_1] + t * p[row][SQUARE_2]), 0.0))


def moment(c: Law, k: Cells, p: Pieces, fill: float) -> float:
    """Balancing moment of one chamber, kg m; a pair's is the difference of two."""
    x = within(c, fill)
    row = chamber_piece(c, k, p, x)
    t = x - p[row][END]
    return p[row][MOMENT_0] + t * (p[row][MOMENT_1] + t * p[row][MOMENT_2])


def moment_uncertainty(c: Law, k: Cells, p: Pieces, fill: float) -> float:
    """Expanded uncertainty (95 %) of `moment`, the largest of the fills in a piece, kg m."""
    return p[chamber_piece(c, k, p, within(c, fill))][MOMENT_WIDTH]


def answer_all(c: Law, k: Cells, p: Pieces, q: Levels, w: Query) -> None:
    """The answer, and surface radius, m, and moment, kg m, of the driven chamber."""
    answer(c, k, p, q, w)
    w[RADIUS] = surface_radius(c, k, p, w[FILL])
    w[MOMENT] = moment(c, k, p, w[FILL])
