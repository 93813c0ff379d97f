"""One query of the compact law, in + - * / sqrt and comparisons, which IEEE 754 fixes to the last bit.

The one source of every host: Python runs it as it stands, `translate` writes it in other languages, so it
keeps to numbers, rows of numbers, `if`, `while` and functions.  `c` holds the law's numbers, `p` its pieces,
`q` those of the levels, `k` cells of equal length, the levels' first, each with the piece at which a search
begins, `w` a query with its answer and intermediate values; the names below are indices into them.  A piece
is a polynomial in the distance from its end.  Gauge pressures in Pa, velocities in m/s; upstream is the
chamber that gives liquid.  Source: `tube.regime`, whose conditions these are.

A full siphon loses a part R of what drives it, p_d, up to the crest, so that a column separates where the
pressure that holds it there is below R p_d.  Both velocities are worked out only next to that, where an
error of the tabulated R could show.
"""

from collections.abc import Sequence
from math import sqrt

from ringbalance.scene.arrays import FloatArray
from ringbalance.scene.platform.both_ways import both_ways

Law = Sequence[float] | FloatArray
Cells = Sequence[float] | FloatArray
Pieces = Sequence[Sequence[float]] | FloatArray
Levels = Sequence[Sequence[float]] | FloatArray
Query = list[float] | FloatArray

# fmt: off
# Indices of the law's numbers.
LARGEST_FILL, AMBIENT, GAS_FACTOR, PORT, CREST, COLUMN, TRAPPED, VAPOUR, RELEASED = 0, 1, 2, 3, 4, 5, 6, 7, 8
LOWEST, HIGHEST, LEVEL_SCALE, LEAST_PRESSURE, CHAMBER_SCALE, CHAMBER_CELLS = 9, 10, 11, 12, 13, 14
# Row of the way back; rows from a piece of the whole tube to its shares; first number of a block that builds
# on the law; factor and offset of a velocity that carries gas out; number of these.
WAY_BACK, SHARES, BLOCK, CARRY, CARRY_FROM, PLACES = 15, 16, 17, 18, 19, 20

# Rows that locate the pieces of velocities: of the whole tube, and of the way up to the crest.
SIPHON, THERE = 0, 1
# In such a row: pressure below which a flow creeps, velocity over pressure there, largest eighth root of a
# pressure, cells per unit of it, their offset; pressures at which half, none and all gas is carried out.
SLOWEST, CREEP, LAST, SCALE, CELLS, HALF, NONE, ALL = 0, 1, 2, 3, 4, 5, 6, 7
# In a piece: its end and the polynomial; of a chamber two polynomials and the half-width of the second.
END, C0, C1, C2, C3, C4, C5 = 0, 1, 2, 3, 4, 5, 6
SQUARE_0, SQUARE_1, SQUARE_2, MOMENT_0, MOMENT_1, MOMENT_2, MOMENT_WIDTH = 1, 2, 3, 4, 5, 6, 7
# Shares of a piece of the whole tube: part of the pressure lost up to the crest, there and back.
SHARE_0, SHARE_1, SHARE_2, BACK_0, BACK_1, BACK_2 = 0, 1, 2, 3, 4, 5

# Indices of a query: conditions, answer.
FILL, OPPOSITE_FILL, PRESSURE, PRIMED = 0, 1, 2, 3
VELOCITY, REGIME, STATUS, PRIMED_AFTER = 4, 5, 6, 7
# In one direction: pressures at the tube's ends, and what lies over the crest.
UP_GAS, DOWN_GAS, UP_LEVEL, DOWN_LEVEL = 8, 9, 10, 11
BLOWN, FALL, DRIVING, ABOVE, RESTING, CAVITY, GAS_THERE = 12, 13, 14, 15, 16, 17, 18
# Where a velocity was looked for: square root of the pressure, piece, distance from its end.
ROOT, ROW, TO_END, FULL_ROOT, FULL_ROW, FULL_TO_END = 19, 20, 21, 22, 23, 24
# Column up to the crest: pressure that holds it; true if primed or swept of gas; part of the driving pressure
# that a full siphon loses on this way, and that loss; the holding pressure less the loss.
HOLDS, SWEPT, PART_LOST, LOST, MARGIN = 25, 26, 27, 28, 29
# Radius and moment of the driven chamber, if needed; size of a query.
RADIUS, MOMENT, PLACES_OF_QUERY = 30, 31, 32

BLOCKED, SIPHONING, SEPARATED, REVERSE = 0.0, 1.0, 2.0, 3.0
OK, EXTRAPOLATED, STANDS, INVALID = 0.0, 1.0, 2.0, 4.0

# Largest gas pressure and smallest driving pressure, Pa; under less a velocity loses digits or underflows.
GREATEST_PRESSURE, LEAST_DRIVING = 1e12, 1e-300
# Tolerance of a fill ratio; holding pressure over loss outside which the tabulated share alone decides.
FILL_SLACK, SURELY, PERHAPS = 1e-9, 0.997, 1.003
# fmt: on


@both_ways
def larger(a: float, b: float) -> float:
    """The larger of two numbers."""
    if a > b:
        return a
    return b


@both_ways
def smaller(a: float, b: float) -> float:
    """The smaller of two numbers."""
    if a < b:
        return a
    return b


@both_ways
def within(c: Law, fill: float) -> float:
    """A fill ratio within the law's range; its end for what is not a number."""
    return larger(0.0, smaller(fill, c[LARGEST_FILL]))


@both_ways
def piece(p: Pieces, first: int, x: float) -> int:
    """Row of the piece that holds x, from that of the cell on."""
    row = first
    while x > p[row][END]:
        row = row + 1
    return row


@both_ways
def quintic(p: Pieces, row: int, t: float) -> float:
    """Value of a piece."""
    return p[row][C0] + t * (
        p[row][C1] + t * (p[row][C2] + t * (p[row][C3] + t * (p[row][C4] + t * p[row][C5])))
    )


@both_ways
def level(c: Law, k: Cells, q: Levels, fill: float) -> float:
    """Hydrostatic pressure of a chamber's liquid; a fill within the range."""
    row = int(k[int(fill * c[LEVEL_SCALE])])
    t = fill - q[row][END]
    return larger(
        q[row][C0]
        + t * (q[row][C1] + t * (q[row][C2] + t * (q[row][C3] + t * (q[row][C4] + t * q[row][C5])))),
        0.0,
    )


@both_ways
def set_levels(c: Law, k: Cells, q: Levels, w: Query, up: float, down: float) -> None:
    """Levels of both chambers; fills within the range."""
    w[UP_LEVEL] = level(c, k, q, up)
    w[DOWN_LEVEL] = level(c, k, q, down)


@both_ways
def find(k: Cells, p: Pieces, w: Query, way: int, pressure: float) -> None:
    """Look a pressure up; below the table a flow creeps, in proportion to it."""
    if pressure < p[way][SLOWEST]:
        root = sqrt(p[way][SLOWEST])
        w[ROOT] = larger(pressure, 0.0) / root
        s = sqrt(sqrt(root))
    else:
        root = sqrt(pressure)
        w[ROOT] = root
        s = smaller(sqrt(sqrt(root)), p[way][LAST])
    row = piece(p, int(k[int(s * p[way][SCALE] + p[way][CELLS])]), s)
    w[ROW] = float(row)
    w[TO_END] = s - p[row][END]


@both_ways
def speed(p: Pieces, w: Query) -> float:
    """Velocity of the pressure that was looked up."""
    return w[ROOT] * quintic(p, int(w[ROW]), w[TO_END])


@both_ways
def velocity(k: Cells, p: Pieces, w: Query, way: int, pressure: float) -> float:
    """Velocity that a pressure drives: its root times a tabulated ratio."""
    find(k, p, w, way, pressure)
    return speed(p, w)


@both_ways
def set_drive(c: Law, w: Query) -> None:
    """Pressures that drive the tube: gas, and the fall of the liquid."""
    w[BLOWN] = w[UP_GAS] - w[DOWN_GAS]
    w[FALL] = w[UP_LEVEL] - larger(w[DOWN_LEVEL], c[PORT])
    w[DRIVING] = w[BLOWN] + w[FALL]


@both_ways
def set_crest(c: Law, w: Query, covered: bool) -> None:
    """The crest's pressure at rest, and those of cavity and gas over it.

    Args: `covered`: true if the downstream liquid covers the port.
    """
    w[ABOVE] = w[UP_LEVEL] - c[COLUMN]
    w[RESTING] = w[UP_GAS] + w[ABOVE]
    w[CAVITY] = w[DOWN_GAS]
    w[GAS_THERE] = w[DOWN_GAS]
    if covered:
        w[CAVITY] = c[VAPOUR]
        if c[RELEASED] != 0.0:
            w[CAVITY] = c[VAPOUR] + c[RELEASED] * (larger(w[DOWN_GAS], c[VAPOUR]) - c[VAPOUR])
        if c[TRAPPED] != 0.0:
            w[GAS_THERE] = w[DOWN_GAS] + (w[DOWN_LEVEL] - c[PORT])


@both_ways
def set_status(c: Law, w: Query) -> None:
    """Mark a velocity beyond those of the law as extrapolated."""
    if w[VELOCITY] < c[LOWEST]:
        w[STATUS] = EXTRAPOLATED
    elif w[VELOCITY] > c[HIGHEST]:
        w[STATUS] = EXTRAPOLATED


@both_ways
def set_full(c: Law, k: Cells, p: Pieces, w: Query) -> None:
    """The answer of a tube without a crest in which liquid flows."""
    w[VELOCITY] = velocity(k, p, w, SIPHON, w[DRIVING])
    w[REGIME] = SIPHONING
    w[STATUS] = OK
    w[PRIMED_AFTER] = 1.0
    set_status(c, w)


@both_ways
def set_swept(c: Law, k: Cells, p: Pieces, w: Query, way: int) -> None:
    """The column up to the crest, out of which the flow carries gas."""
    gain = w[GAS_THERE] - w[CAVITY]
    gas = gain > 0.0
    if gas:
        w[HOLDS] = w[RESTING] - w[GAS_THERE]
    else:
        w[HOLDS] = w[RESTING] - w[CAVITY]
    if w[HOLDS] > p[way][HALF]:
        if w[DRIVING] > p[SIPHON][HALF]:
            w[SWEPT] = 1.0
    if gas:
        if w[HOLDS] > p[way][ALL]:
            w[HOLDS] = w[RESTING] - w[CAVITY]
        elif w[HOLDS] > p[way][NONE]:
            part = velocity(k, p, w, way, w[HOLDS]) * c[CARRY] - c[CARRY_FROM]
            w[HOLDS] = w[HOLDS] + part * part * (3.0 - 2.0 * part) * gain


@both_ways
def lost_part(p: Pieces, row: int, t: float, way: int) -> float:
    """Part of the driving pressure that is lost up to the crest; `row`: of the shares of a piece."""
    if way == THERE:
        return p[row][SHARE_0] + t * (p[row][SHARE_1] + t * p[row][SHARE_2])
    return p[row][BACK_0] + t * (p[row][BACK_1] + t * p[row][BACK_2])


@both_ways
def set_lost(c: Law, k: Cells, p: Pieces, w: Query, way: int) -> None:
    """The part of the driving pressure that a full siphon loses up to the crest."""
    find(k, p, w, SIPHON, w[DRIVING])
    w[FULL_ROOT] = w[ROOT]
    w[FULL_ROW] = w[ROW]
    w[FULL_TO_END] = w[TO_END]
    w[PART_LOST] = lost_part(p, int(w[ROW] + c[SHARES]), w[TO_END], way)
    w[LOST] = w[PART_LOST] * w[DRIVING]


@both_ways
def set_slower(k: Cells, p: Pieces, w: Query, way: int, covered: bool) -> None:
    """The slower of the whole tube, which has been looked up, and the column up to the crest.

    Args: `covered`: true if the downstream liquid covers the port; else a column that separates runs out.
    """
    w[PRIMED_AFTER] = w[SWEPT]
    if w[HOLDS] < w[LOST]:
        w[REGIME] = SEPARATED
        w[PRIMED_AFTER] = 0.0
        if covered:
            w[PRIMED_AFTER] = w[SWEPT]
        w[VELOCITY] = velocity(k, p, w, way, w[HOLDS])
        if w[HOLDS] > SURELY * w[LOST]:
            full = w[FULL_ROOT] * quintic(p, int(w[FULL_ROW]), w[FULL_TO_END])
            w[VELOCITY] = smaller(w[VELOCITY], full)
    else:
        w[REGIME] = SIPHONING
        w[VELOCITY] = speed(p, w)
        if w[HOLDS] < PERHAPS * w[LOST]:
            w[VELOCITY] = smaller(w[VELOCITY], velocity(k, p, w, way, w[HOLDS]))


@both_ways
def over_crest(c: Law, k: Cells, p: Pieces, w: Query, way: int) -> None:
    """The answer of a tube with a crest, if liquid flows; `way`: row of the column up to the crest."""
    covered = w[DOWN_LEVEL] >= c[PORT]
    set_crest(c, w, covered)
    w[SWEPT] = w[PRIMED]
    if w[PRIMED] == 0.0:
        set_swept(c, k, p, w, way)
    else:
        w[HOLDS] = w[RESTING] - w[CAVITY]
    if w[HOLDS] <= 0.0:
        return
    set_lost(c, k, p, w, way)
    w[MARGIN] = w[HOLDS] - w[LOST]
    set_slower(k, p, w, way, covered)
    w[STATUS] = OK
    set_status(c, w)
