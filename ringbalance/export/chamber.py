"""Free surface and moment of a chamber from the pieces of an export, in the same operations as `point`."""

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
    MOMENT_WIDTH,
    RADIUS,
    SQUARE_0,
    SQUARE_1,
    SQUARE_2,
    Cells,
    Law,
    Levels,
    Pieces,
    Query,
    larger,
    piece,
    within,
)
from ringbalance.reduced_model.pieces.query import answer


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
