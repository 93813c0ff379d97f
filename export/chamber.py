"""Surface and moment of a chamber beside the law's answer, from the pieces of an export; as `point`."""

from math import sqrt

from ringbalance.reduced_model.pieces.point import (
    CHAMBER_CELLS,
    CHAMBER_SCALE,
    END,
    FILL,
    MOMENT,
    MOMENT_0,
    MOMENT_1,
    MOMENT_2,
    RADIUS,
    SQUARE_0,
    SQUARE_1,
    SQUARE_2,
    Law,
    Pieces,
    Query,
    answer,
    larger,
    piece,
    width,
    within,
)


def chamber_piece(c: Law, p: Pieces, fill: float) -> int:
    """Row of a chamber's surface and moment that holds a fill within the range."""
    return piece(p, c[int(fill * c[CHAMBER_SCALE] + c[CHAMBER_CELLS])], fill)


def surface_radius(c: Law, p: Pieces, fill: float) -> float:
    """Radius of a chamber's concentric free surface, m."""
    x = within(c, fill)
    row = chamber_piece(c, p, x)
    t = x - p[row][END]
    return sqrt(larger(p[row][SQUARE_0] + t * (p[row][SQUARE_1] + t * p[row][SQUARE_2]), 0.0))


def moment(c: Law, p: Pieces, fill: float) -> float:
    """Balancing moment of one chamber, kg m; a pair's is the difference of two."""
    x = within(c, fill)
    row = chamber_piece(c, p, x)
    t = x - p[row][END]
    return p[row][MOMENT_0] + t * (p[row][MOMENT_1] + t * p[row][MOMENT_2])


def moment_uncertainty(c: Law, p: Pieces, fill: float) -> float:
    """Expanded uncertainty (95 %) of `moment`, kg m."""
    x = within(c, fill)
    row = chamber_piece(c, p, x)
    return width(p, row, x - p[row][END])


def answer_all(c: Law, p: Pieces, w: Query) -> None:
    """The answer, and surface radius, m, and moment, kg m, of the driven chamber."""
    answer(c, p, w, True)
    w[RADIUS] = surface_radius(c, p, w[FILL])
    w[MOMENT] = moment(c, p, w[FILL])
