"""One query of the compact law, in + - * / sqrt and comparisons, which IEEE 754 fixes to the last bit.

The one source of every host: Python runs it as it stands, `translate` writes it in other languages, so it
keeps to numbers, rows of numbers, `if`, `while` and functions.  `c` holds the law's numbers, `p` its pieces,
`q` those of the levels, `k` cells of equal length that say at which piece to begin looking, the levels'
first, `w` a query with its answer and all between; the names below are places in them.  A piece is a
polynomial in the distance from its end.  Gauge pressures in Pa, velocities in m/s, half-widths at 95 %;
upstream is the chamber that gives liquid.  Source: `tube.regime`, whose conditions these are; half-widths by
linear propagation.

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
# Of the law; OF_...: squared half-widths, relative but for that of the crest.
LARGEST_FILL, AMBIENT, GAS_FACTOR, PORT, CREST, COLUMN, TRAPPED, VAPOUR = 0, 1, 2, 3, 4, 5, 6, 7
RELEASED, CAVITY_KNOWN, OF_DENSITY, OF_BLOWN, OF_SPEED, OF_GAS, OF_CREST = 8, 9, 10, 11, 12, 13, 14
OF_LIQUID, CLEARING_KNOWN, LOWEST, HIGHEST, LEVEL_SCALE, LEAST_PRESSURE = 15, 16, 17, 18, 19, 20
# Row of the way back; where a block that builds on the law has its own numbers; how a velocity carries gas.
CHAMBER_SCALE, CHAMBER_CELLS, WAY_BACK, BLOCK, CARRY, CARRY_FROM, PLACES = 21, 22, 23, 24, 25, 26, 27

# Rows of the pieces that say where velocities are found: of the whole tube, and up to the crest.
SIPHON, THERE = 0, 1
# In them: pressure below which a flow creeps, velocity over it there, largest eighth root of one, cells; of
# the whole tube rows from a piece to what is beside it; pressures at which half of the gas over the crest is
# carried out, none and all.
SLOWEST, CREEP, LAST, SCALE, CELLS, SHARES, HALF, NONE, ALL = 0, 1, 2, 3, 4, 5, 6, 7, 8
# In a piece: its end, the polynomial, and a half-width that is straight; of a chamber two polynomials.
END, C0, C1, C2, C3, C4, C5, WIDTH, WIDTH_SLOPE = 0, 1, 2, 3, 4, 5, 6, 7, 8
SQUARE_0, SQUARE_1, SQUARE_2, MOMENT_0, MOMENT_1, MOMENT_2 = 1, 2, 3, 4, 5, 6
# Beside a piece of the whole tube: part of its pressure that is lost up to the crest, there and back, with
# the half-width of both.
SHARE_0, SHARE_1, SHARE_2, BACK_0, BACK_1, BACK_2, OFF, OFF_SLOPE = 0, 1, 2, 3, 4, 5, 6, 7

# Of a query, and of its answer.
FILL, OPPOSITE_FILL, PRESSURE, PRIMED = 0, 1, 2, 3
VELOCITY, UNCERTAINTY, REGIME, STATUS, PRIMED_AFTER = 4, 5, 6, 7, 8
# In one direction: pressures at the tube's ends, half-widths of levels, and what lies over the crest.
UP_GAS, DOWN_GAS, UP_LEVEL, UP_WIDTH, DOWN_LEVEL, DOWN_WIDTH, LEVEL_WIDTH = 9, 10, 11, 12, 13, 14, 15
BLOWN, FALL, DRIVING, ABOVE, RESTING, CAVITY, LEAST, MOST, GAS_THERE = 16, 17, 18, 19, 20, 21, 22, 23, 24
# Where a velocity was looked for: square and eighth root of the pressure, piece, distance from its end; its
# growth with the logarithm of the pressure, m/s, and the squared half-width of its loss.
ROOT, EIGHTH, ROW, TO_END, GROWTH, LOSS = 25, 26, 27, 28, 29, 30
FULL_ROOT, FULL_ROW, FULL_TO_END = 31, 32, 33
# Of the column up to the crest: pressure that holds it; at first, before a part of the gas is carried out,
# with its velocity there; whether a column is there afterwards; part of the driving pressure that a full
# siphon loses, and that pressure.
HOLDS, AT_FIRST, SLOWER, SWEPT, PART_LOST, LOST = 34, 35, 36, 37, 38, 39
# Row beside the piece of the whole tube, and its velocity where that is worked out, too.
BESIDE, FULL = 40, 41
# Lowest pressure of a full siphon less what lies over the crest, and the square of its half-width; that of
# the upstream chamber's pressure.
MARGIN, MARGIN_SQUARE, UP_SQUARE = 42, 43, 44
# Of the driven chamber, where these are asked for too.
RADIUS, MOMENT, PLACES_OF_QUERY = 45, 46, 47

BLOCKED, SIPHONING, SEPARATED, REVERSE, UNDECIDED = 0.0, 1.0, 2.0, 3.0, 4.0
OK, EXTRAPOLATED, STANDS, UNSURE, INVALID = 0.0, 1.0, 2.0, 3.0, 4.0

# Parts of what a full siphon loses beyond which a tabulated share decides which velocity is the smaller one.
GREATEST_PRESSURE, FILL_SLACK, SURELY, PERHAPS, ALIKE = 1e12, 1e-9, 0.997, 1.003, 1.000001
# fmt: on


@both_ways
def larger(a: float, b: float) -> float:
    """Of two numbers."""
    if a > b:
        return a
    return b


@both_ways
def smaller(a: float, b: float) -> float:
    """Of two numbers."""
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
def level(c: Law, k: Cells, q: Levels, w: Query, fill: float) -> float:
    """Hydrostatic pressure of a chamber's liquid, with its half-width; a fill within the range."""
    row = int(k[int(fill * c[LEVEL_SCALE])])
    t = fill - q[row][END]
    w[LEVEL_WIDTH] = q[row][WIDTH] + t * q[row][WIDTH_SLOPE]
    return larger(
        q[row][C0]
        + t * (q[row][C1] + t * (q[row][C2] + t * (q[row][C3] + t * (q[row][C4] + t * q[row][C5])))),
        0.0,
    )


@both_ways
def set_levels(c: Law, k: Cells, q: Levels, w: Query, up: float, down: float) -> None:
    """Levels of both chambers; fills within the range."""
    w[UP_LEVEL] = level(c, k, q, w, up)
    w[UP_WIDTH] = w[LEVEL_WIDTH]
    w[DOWN_LEVEL] = level(c, k, q, w, down)
    w[DOWN_WIDTH] = w[LEVEL_WIDTH]


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
    w[EIGHTH] = s
    w[ROW] = float(row)
    w[TO_END] = s - p[row][END]


@both_ways
def velocity(k: Cells, p: Pieces, w: Query, way: int, pressure: float) -> float:
    """Velocity that a pressure drives: its root times a tabulated ratio."""
    find(k, p, w, way, pressure)
    return w[ROOT] * quintic(p, int(w[ROW]), w[TO_END])


@both_ways
def set_speed(p: Pieces, w: Query, widths: bool) -> None:
    """Velocity of the pressure that was looked up; with `widths` its growth and its loss's half-width too."""
    row = int(w[ROW])
    t = w[TO_END]
    if widths:
        slope = p[row][C5]
        value = p[row][C4] + t * slope
        slope = value + t * slope
        value = p[row][C3] + t * value
        slope = value + t * slope
        value = p[row][C2] + t * value
        slope = value + t * slope
        value = p[row][C1] + t * value
        slope = value + t * slope
        value = p[row][C0] + t * value
        w[VELOCITY] = w[ROOT] * value
        w[GROWTH] = 0.5 * w[ROOT] * (value + 0.25 * w[EIGHTH] * slope)
        w[LOSS] = p[row][WIDTH] + t * p[row][WIDTH_SLOPE]
    else:
        w[VELOCITY] = w[ROOT] * quintic(p, row, t)


@both_ways
def half_width(w: Query, driven: float, square: float, part: float) -> float:
    """Half-width of the last velocity, m/s.

    Args: `driven`: its pressure, Pa. `square`: of what is known of that, Pa^2. `part`: of what else it is
        off by, m/s.
    """
    slope = w[GROWTH] / driven
    return sqrt(w[GROWTH] * w[GROWTH] * w[LOSS] + slope * slope * square + part * part)


@both_ways
def set_drive(c: Law, w: Query) -> None:
    """What drives the tube: gas, and the fall of the liquid."""
    w[BLOWN] = w[UP_GAS] - w[DOWN_GAS]
    w[FALL] = w[UP_LEVEL] - larger(w[DOWN_LEVEL], c[PORT])
    w[DRIVING] = w[BLOWN] + w[FALL]


@both_ways
def set_crest(c: Law, w: Query, covered: bool) -> None:
    """The crest's pressure at rest, and what it stands against.

    Args: `covered`: whether the downstream liquid covers the port.
    """
    w[ABOVE] = w[UP_LEVEL] - c[COLUMN]
    w[RESTING] = w[UP_GAS] + w[ABOVE]
    w[CAVITY] = w[DOWN_GAS]
    w[LEAST] = w[DOWN_GAS]
    w[MOST] = w[DOWN_GAS]
    w[GAS_THERE] = w[DOWN_GAS]
    if covered:
        w[CAVITY] = c[VAPOUR]
        w[LEAST] = c[VAPOUR]
        w[MOST] = c[VAPOUR]
        if c[RELEASED] != 0.0:
            w[MOST] = larger(w[DOWN_GAS], c[VAPOUR])
            w[CAVITY] = c[VAPOUR] + c[RELEASED] * (w[MOST] - c[VAPOUR])
            if c[CAVITY_KNOWN] != 0.0:
                w[LEAST] = w[CAVITY]
                w[MOST] = w[CAVITY]
        if c[TRAPPED] != 0.0:
            w[GAS_THERE] = w[DOWN_GAS] + (w[DOWN_LEVEL] - c[PORT])


@both_ways
def full_square(c: Law, w: Query) -> float:
    """Squared half-width of what drives a full siphon, Pa^2."""
    square = w[UP_WIDTH] * w[UP_WIDTH] + w[DOWN_WIDTH] * w[DOWN_WIDTH]
    return square + c[OF_BLOWN] * w[BLOWN] * w[BLOWN] + c[OF_SPEED] * w[FALL] * w[FALL]


@both_ways
def set_status(c: Law, w: Query) -> None:
    """Whether a velocity is one of those that the law is made for; an undecided regime stays so."""
    if w[VELOCITY] < c[LOWEST]:
        w[STATUS] = EXTRAPOLATED
    elif w[VELOCITY] > c[HIGHEST]:
        w[STATUS] = EXTRAPOLATED


@both_ways
def set_full(c: Law, k: Cells, p: Pieces, w: Query, widths: bool) -> None:
    """The answer of a tube without a crest in which liquid flows."""
    find(k, p, w, SIPHON, w[DRIVING])
    set_speed(p, w, widths)
    w[REGIME] = SIPHONING
    w[STATUS] = OK
    w[PRIMED_AFTER] = 1.0
    if widths:
        w[UNCERTAINTY] = half_width(w, w[DRIVING], full_square(c, w), 0.0)
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
        elif w[HOLDS] <= p[way][NONE]:
            w[LEAST] = w[GAS_THERE]
            w[MOST] = w[GAS_THERE]
        else:
            w[AT_FIRST] = w[HOLDS]
            w[SLOWER] = velocity(k, p, w, way, w[HOLDS])
            part = w[SLOWER] * c[CARRY] - c[CARRY_FROM]
            w[HOLDS] = w[HOLDS] + part * part * (3.0 - 2.0 * part) * gain
            if c[CLEARING_KNOWN] == 0.0:
                w[MOST] = w[GAS_THERE]
            elif w[AT_FIRST] < p[way][HALF]:
                w[LEAST] = w[GAS_THERE]
                w[MOST] = w[GAS_THERE]


@both_ways
def lost_part(p: Pieces, row: int, t: float, way: int) -> float:
    """Part of the driving pressure that is lost up to the crest; `row`: beside a piece of the whole tube."""
    if way == THERE:
        return p[row][SHARE_0] + t * (p[row][SHARE_1] + t * p[row][SHARE_2])
    return p[row][BACK_0] + t * (p[row][BACK_1] + t * p[row][BACK_2])


@both_ways
def lost_width(p: Pieces, row: int, t: float) -> float:
    """Half-width of `lost_part`."""
    return p[row][OFF] + t * p[row][OFF_SLOPE]


@both_ways
def up_square(c: Law, w: Query) -> float:
    """Squared half-width of the upstream chamber's pressure by gas and level, Pa^2."""
    return w[UP_WIDTH] * w[UP_WIDTH] + c[OF_GAS] * w[UP_GAS] * w[UP_GAS]


@both_ways
def known_of(w: Query, lost: float, spread: float) -> float:
    """Squared half-width of a full siphon's crest pressure by gas, levels and what else it may be off by."""
    kept = 1.0 - lost
    down = lost * w[DOWN_WIDTH]
    return spread * spread + kept * kept * w[UP_SQUARE] + down * down


@both_ways
def set_margin(c: Law, w: Query, lost: float, width: float, known: float) -> None:
    """Lowest pressure of a full siphon less what lies over the crest, and the square of its half-width.

    p_m - p_c = p_A - p_c + P_A - D_m - R p_d,  R = (alpha + k_up)/(k + 1), p_d the driving pressure.
    Args: `lost`: R. `width`: by how much that may be off (95 %). `known`: as `known_of`, Pa^2.
    Source: energy balance from the upstream chamber to the crest; inputs by sensitivity, ASME V&V 20.
    """
    liquid = w[ABOVE] - lost * w[FALL]
    part = width * w[DRIVING]
    w[MARGIN] = w[HOLDS] - w[LOST]
    w[MARGIN_SQUARE] = known + c[OF_CREST] + c[OF_LIQUID] * liquid * liquid + part * part


@both_ways
def held_velocity(k: Cells, p: Pieces, w: Query, way: int, pressure: float) -> float:
    """Velocity of the column up to the crest, which may be known already."""
    if pressure == w[AT_FIRST]:
        return w[SLOWER]
    return velocity(k, p, w, way, pressure)


@both_ways
def full_speed(p: Pieces, w: Query) -> float:
    """Velocity of the whole tube, as it was looked up."""
    return w[FULL_ROOT] * quintic(p, int(w[FULL_ROW]), w[FULL_TO_END])


@both_ways
def fastest(k: Cells, p: Pieces, w: Query, way: int, pressure: float) -> float:
    """Velocity of the column up to the crest, but not above that of the full siphon."""
    if pressure < w[LOST]:
        return velocity(k, p, w, way, pressure)
    if w[FULL] == 0.0:
        return full_speed(p, w)
    return w[FULL]


@both_ways
def set_widths(c: Law, k: Cells, p: Pieces, w: Query, way: int) -> None:
    """Half-width of the answer over a crest, and whether it allows another regime."""
    lower = larger(w[RESTING] - w[MOST], 0.0)
    upper = w[RESTING] - w[LEAST]
    below = w[HOLDS] - lower
    above = upper - w[HOLDS]
    w[UP_SQUARE] = up_square(c, w)
    part = 0.0
    if w[REGIME] == SEPARATED:
        if below > 0.0:
            part = w[VELOCITY] - held_velocity(k, p, w, way, lower)
        # A velocity grows with its pressure the less the greater that is.
        if above > ALIKE * below:
            part = larger(part, fastest(k, p, w, way, upper) - w[VELOCITY])
        gas = w[UP_GAS] - w[CAVITY]
        square = w[UP_SQUARE] + w[DOWN_WIDTH] * w[DOWN_WIDTH] + c[OF_CREST]
        square = square + c[OF_DENSITY] * gas * gas + c[OF_SPEED] * w[ABOVE] * w[ABOVE]
        w[UNCERTAINTY] = half_width(w, w[HOLDS], square, part)
    else:
        if lower < w[LOST]:
            part = larger(w[VELOCITY] - held_velocity(k, p, w, way, lower), 0.0)
        w[UNCERTAINTY] = half_width(w, w[DRIVING], full_square(c, w), part)
    off = lost_width(p, int(w[BESIDE]), w[FULL_TO_END])
    set_margin(c, w, w[PART_LOST], off, known_of(w, w[PART_LOST], larger(below, above)))
    if w[MARGIN] * w[MARGIN] < w[MARGIN_SQUARE]:
        w[REGIME] = UNDECIDED
        w[STATUS] = UNSURE


@both_ways
def set_lost(k: Cells, p: Pieces, w: Query, way: int) -> None:
    """What of the driving pressure a full siphon loses up to the crest."""
    find(k, p, w, SIPHON, w[DRIVING])
    w[FULL_ROOT] = w[ROOT]
    w[FULL_ROW] = w[ROW]
    w[FULL_TO_END] = w[TO_END]
    w[BESIDE] = w[ROW] + p[SIPHON][SHARES]
    w[PART_LOST] = lost_part(p, int(w[BESIDE]), w[TO_END], way)
    w[LOST] = w[PART_LOST] * w[DRIVING]


@both_ways
def set_slower(k: Cells, p: Pieces, w: Query, way: int, covered: bool, widths: bool) -> None:
    """The slower of the whole tube, which has been looked up, and the column up to the crest.

    Args: `covered`: whether the downstream liquid covers the port; else a column that separates runs out.
    """
    w[FULL] = 0.0
    w[PRIMED_AFTER] = w[SWEPT]
    if w[HOLDS] < w[LOST]:
        w[REGIME] = SEPARATED
        w[PRIMED_AFTER] = 0.0
        if covered:
            w[PRIMED_AFTER] = w[SWEPT]
        find(k, p, w, way, w[HOLDS])
        set_speed(p, w, widths)
        if w[HOLDS] > SURELY * w[LOST]:
            w[FULL] = full_speed(p, w)
            w[VELOCITY] = smaller(w[VELOCITY], w[FULL])
    else:
        w[REGIME] = SIPHONING
        set_speed(p, w, widths)
        if w[HOLDS] < PERHAPS * w[LOST]:
            w[VELOCITY] = smaller(w[VELOCITY], velocity(k, p, w, way, w[HOLDS]))


@both_ways
def over_crest(c: Law, k: Cells, p: Pieces, w: Query, way: int, widths: bool) -> None:
    """The answer of a tube with a crest, if liquid flows; `way`: row of the column up to the crest."""
    covered = w[DOWN_LEVEL] >= c[PORT]
    set_crest(c, w, covered)
    w[SWEPT] = w[PRIMED]
    w[AT_FIRST] = 0.0
    w[SLOWER] = 0.0
    if w[PRIMED] == 0.0:
        set_swept(c, k, p, w, way)
    else:
        w[HOLDS] = w[RESTING] - w[CAVITY]
    if w[HOLDS] <= 0.0:
        return
    set_lost(k, p, w, way)
    set_slower(k, p, w, way, covered, widths)
    w[STATUS] = OK
    if widths:
        set_widths(c, k, p, w, way)
    set_status(c, w)
