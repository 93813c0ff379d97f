"""One query of the compact law, in + - * / sqrt and comparisons, which IEEE 754 fixes to the last bit.

The one source of every host: Python runs it as it stands, `translate` writes it in other languages, so it
keeps to numbers, rows of numbers, `if`, `while` and functions.  `c` holds the law's numbers, `p` its pieces,
`w` a query with its answer and all between; the names below are places in them.  A piece is a polynomial of
degree five in the distance from its end; cells of equal length say at which piece to begin looking.  Gauge
pressures in Pa, velocities in m/s, half-widths at 95 %; upstream is the chamber that gives liquid.  Source:
`tube.regime`, whose conditions these are; half-widths by linear propagation.
"""

from collections.abc import Sequence
from math import sqrt

from ringbalance.scene.arrays import FloatArray
from ringbalance.scene.platform.both_ways import both_ways

Law = Sequence[float] | FloatArray
Pieces = Sequence[Sequence[float]] | FloatArray
Query = list[float] | FloatArray

# fmt: off
# Of the law; OF_...: squared half-widths, relative but for that of the crest.
LARGEST_FILL, AMBIENT, GAS_FACTOR, PORT, CREST, COLUMN, TRAPPED, VAPOUR = 0, 1, 2, 3, 4, 5, 6, 7
RELEASED, CAVITY_KNOWN, OF_DENSITY, OF_BLOWN, OF_SPEED, OF_GAS, OF_CREST = 8, 9, 10, 11, 12, 13, 14
OF_LIQUID, TABULATION, LOWEST, HIGHEST, LEVEL_SCALE, LEVEL_CELLS = 15, 16, 17, 18, 19, 20
# Row of the way back; where a block that builds on the law has its own numbers.
CHAMBER_SCALE, CHAMBER_CELLS, WAY_BACK, BLOCK, PLACES = 21, 22, 23, 24, 25

# Rows of the pieces that say where velocities are found: of the whole tube, and up to the crest.
SIPHON, THERE = 0, 1
# In them: pressure below which a flow creeps, velocity over it there, largest eighth root of one, cells; then
# of the whole tube rows from a piece to what is beside it, of a way velocities at which gas is carried.
SLOWEST, CREEP, LAST, SCALE, CELLS, SHARES = 0, 1, 2, 3, 4, 5
STAYS, CLEARS, CARRY, CARRY_FROM = 5, 6, 7, 8
# In a piece: its end, the polynomial, and a half-width that is straight; of a chamber two polynomials.
END, C0, C1, C2, C3, C4, C5, WIDTH, WIDTH_SLOPE = 0, 1, 2, 3, 4, 5, 6, 7, 8
SQUARE_0, SQUARE_1, SQUARE_2, MOMENT_0, MOMENT_1, MOMENT_2 = 1, 2, 3, 4, 5, 6
# Beside a piece of the whole tube: part of its pressure that is lost up to the crest, there and back.
SHARE_0, SHARE_1, SHARE_2, SHARE_3, OFF, OFF_SLOPE, BACK_0, BACK_1, BACK_2 = 0, 1, 2, 3, 4, 5, 6, 7, 8

# Of a query, and of its answer.
FILL, OPPOSITE_FILL, PRESSURE, PRIMED = 0, 1, 2, 3
VELOCITY, UNCERTAINTY, REGIME, STATUS, PRIMED_AFTER = 4, 5, 6, 7, 8
# In one direction: pressures at the tube's ends, half-widths of levels, and what lies over the crest.
UP_GAS, DOWN_GAS, UP_LEVEL, UP_WIDTH, DOWN_LEVEL, DOWN_WIDTH, LEVEL_WIDTH = 9, 10, 11, 12, 13, 14, 15
DISCHARGE, DRIVING, ABOVE, RESTING, CAVITY, LEAST, MOST, GAS_THERE = 16, 17, 18, 19, 20, 21, 22, 23
# Of the last velocity: eighth root of its pressure, its piece, the distance from its end, the value there.
ROOT, ROW, TO_END, VALUE = 24, 25, 26, 27
FULL, FULL_ROOT, FULL_ROW, FULL_TO_END, FULL_VALUE = 28, 29, 30, 31, 32
# Of the column up to the crest: pressure that holds it, at first before gas is carried out, and velocity.
HOLDS, AT_FIRST, BROKEN, SLOWER, SWEPT = 33, 34, 35, 36, 37
# Of the driven chamber, where these are asked for too.
RADIUS, MOMENT = 38, 39
# Lowest pressure of a full siphon less what lies over the crest, and the square of its half-width.
MARGIN, MARGIN_SQUARE, PLACES_OF_QUERY = 40, 41, 42

BLOCKED, SIPHONING, SEPARATED, REVERSE, UNDECIDED = 0.0, 1.0, 2.0, 3.0, 4.0
OK, EXTRAPOLATED, STANDS, UNSURE, INVALID = 0.0, 1.0, 2.0, 3.0, 4.0

GREATEST_PRESSURE, FILL_SLACK, NO_PRESSURE = 1e12, 1e-9, 1e-100
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
def piece(p: Pieces, first: float, x: float) -> int:
    """Row of the piece that holds x, from that of the cell on."""
    row = int(first)
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
def width(p: Pieces, row: int, t: float) -> float:
    """Half-width of a piece, or its square."""
    return p[row][WIDTH] + t * p[row][WIDTH_SLOPE]


@both_ways
def level(c: Law, p: Pieces, w: Query, fill: float) -> float:
    """Hydrostatic pressure of a chamber's liquid, with its half-width; a fill within the range."""
    row = piece(p, c[int(fill * c[LEVEL_SCALE] + c[LEVEL_CELLS])], fill)
    t = fill - p[row][END]
    w[LEVEL_WIDTH] = width(p, row, t)
    return larger(quintic(p, row, t), 0.0)


@both_ways
def set_levels(c: Law, p: Pieces, w: Query, up: float, down: float) -> None:
    """Levels of both chambers; fills within the range."""
    w[UP_LEVEL] = level(c, p, w, up)
    w[UP_WIDTH] = w[LEVEL_WIDTH]
    w[DOWN_LEVEL] = level(c, p, w, down)
    w[DOWN_WIDTH] = w[LEVEL_WIDTH]


@both_ways
def ratio(c: Law, p: Pieces, w: Query, way: int, s: float) -> float:
    """Velocity over the root of the pressure whose eighth root is s."""
    row = piece(p, c[int(s * p[way][SCALE] + p[way][CELLS])], s)
    w[ROOT] = s
    w[ROW] = float(row)
    w[TO_END] = s - p[row][END]
    return quintic(p, row, w[TO_END])


@both_ways
def velocity(c: Law, p: Pieces, w: Query, way: int, pressure: float) -> float:
    """Velocity that a pressure drives: its root times a tabulated ratio; creeping below the table."""
    if pressure < p[way][SLOWEST]:
        w[VALUE] = ratio(c, p, w, way, sqrt(sqrt(sqrt(p[way][SLOWEST]))))
        w[ROOT] = 0.0
        return larger(pressure, 0.0) * p[way][CREEP]
    root = sqrt(sqrt(pressure))
    w[VALUE] = ratio(c, p, w, way, smaller(sqrt(root), p[way][LAST]))
    return root * root * w[VALUE]


@both_ways
def relative_square(p: Pieces, w: Query, driven: float, square: float) -> float:
    """Squared half-width of the last velocity over its square, by its loss and by what drives it.

    Args: `driven`: its pressure, Pa. `square`: of what is known of it, Pa^2.
    """
    row = int(w[ROW])
    t = w[TO_END]
    if w[ROOT] == 0.0:
        pressure = larger(driven, NO_PRESSURE)
        return width(p, row, t) + square / (pressure * pressure)
    growth = p[row][C1] + t * (
        2.0 * p[row][C2] + t * (3.0 * p[row][C3] + t * (4.0 * p[row][C4] + t * (5.0 * p[row][C5])))
    )
    exponent = 0.5 + 0.125 * w[ROOT] * growth / w[VALUE]
    return exponent * exponent * (width(p, row, t) + square / (driven * driven))


@both_ways
def set_drive(c: Law, w: Query) -> None:
    """What drives the tube."""
    w[DISCHARGE] = larger(w[DOWN_LEVEL], c[PORT])
    w[DRIVING] = w[UP_GAS] - w[DOWN_GAS] + w[UP_LEVEL] - w[DISCHARGE]


@both_ways
def set_crest(c: Law, w: Query) -> None:
    """The crest's pressure at rest, and what it stands against."""
    w[ABOVE] = w[UP_LEVEL] - c[COLUMN]
    w[RESTING] = w[UP_GAS] + w[ABOVE]
    low = c[VAPOUR]
    if w[DOWN_LEVEL] < c[PORT]:
        low = w[DOWN_GAS]
    high = low
    if c[RELEASED] != 0.0:
        high = larger(w[DOWN_GAS], low)
    w[CAVITY] = low + c[RELEASED] * (high - low)
    w[LEAST] = low
    w[MOST] = high
    if c[CAVITY_KNOWN] != 0.0:
        w[LEAST] = w[CAVITY]
        w[MOST] = w[CAVITY]
    w[GAS_THERE] = w[DOWN_GAS]
    if c[TRAPPED] != 0.0:
        w[GAS_THERE] = w[DOWN_GAS] + larger(w[DOWN_LEVEL] - c[PORT], 0.0)


@both_ways
def crest_margin(w: Query) -> float:
    """Crest pressure at rest less that of a primed tube's cavity, or of gas there."""
    if w[PRIMED] != 0.0:
        return w[RESTING] - w[CAVITY]
    return w[RESTING] - larger(w[GAS_THERE], w[CAVITY])


@both_ways
def full_square(c: Law, p: Pieces, w: Query) -> float:
    """`relative_square` of the last velocity, that of the whole tube."""
    gas = w[UP_GAS] - w[DOWN_GAS]
    fall = w[UP_LEVEL] - w[DISCHARGE]
    square = w[UP_WIDTH] * w[UP_WIDTH] + w[DOWN_WIDTH] * w[DOWN_WIDTH]
    return relative_square(p, w, w[DRIVING], square + c[OF_BLOWN] * gas * gas + c[OF_SPEED] * fall * fall)


@both_ways
def set_full(c: Law, p: Pieces, w: Query, widths: bool) -> None:
    """The answer of a tube without a crest in which liquid flows."""
    w[VELOCITY] = velocity(c, p, w, SIPHON, w[DRIVING])
    w[REGIME] = SIPHONING
    w[PRIMED_AFTER] = 1.0
    if widths:
        w[UNCERTAINTY] = w[VELOCITY] * sqrt(full_square(c, p, w) + c[TABULATION])


@both_ways
def carried(p: Pieces, way: int, speed: float) -> float:
    """How far a flow is from leaving gas over the crest, 0, to carrying it out, 1, and beyond."""
    return speed * p[way][CARRY] - p[way][CARRY_FROM]


@both_ways
def set_swept(c: Law, p: Pieces, w: Query, way: int) -> None:
    """The column up to the crest, out of which the flow carries gas."""
    gas = larger(w[GAS_THERE], w[MOST])
    if w[BROKEN] < p[way][CLEARS]:
        w[MOST] = gas
        if w[BROKEN] < p[way][STAYS]:
            w[LEAST] = gas
    part = smaller(carried(p, way, w[BROKEN]), 1.0)
    gain = w[RESTING] - w[CAVITY] - w[HOLDS]
    if part > 0.0:
        if part > 0.5 and carried(p, way, w[FULL]) > 0.5:
            w[SWEPT] = 1.0
        if gain > 0.0:
            w[HOLDS] = w[HOLDS] + part * part * (3.0 - 2.0 * part) * gain
            w[BROKEN] = velocity(c, p, w, way, w[HOLDS])


@both_ways
def set_slower(c: Law, w: Query) -> None:
    """The slower of the whole tube and the column up to the crest."""
    w[REGIME] = SIPHONING
    w[VELOCITY] = w[FULL]
    w[PRIMED_AFTER] = w[SWEPT]
    if w[BROKEN] < w[FULL]:
        w[REGIME] = SEPARATED
        w[VELOCITY] = w[BROKEN]
        if w[DOWN_LEVEL] < c[PORT]:
            w[PRIMED_AFTER] = 0.0


@both_ways
def lost_part(p: Pieces, row: int, t: float, way: int) -> float:
    """Part of the driving pressure that is lost up to the crest; `row`: beside a piece of the whole tube."""
    if way == THERE:
        return p[row][SHARE_0] + t * (p[row][SHARE_1] + t * (p[row][SHARE_2] + t * p[row][SHARE_3]))
    return p[row][BACK_0] + t * (p[row][BACK_1] + t * p[row][BACK_2])


@both_ways
def velocity_held(c: Law, p: Pieces, w: Query, way: int, pressure: float) -> float:
    """Velocity of the column up to the crest, which is known at the first pressure that holds it."""
    if pressure == w[AT_FIRST]:
        return w[SLOWER]
    return velocity(c, p, w, way, pressure)


@both_ways
def lost_width(p: Pieces, row: int, t: float) -> float:
    """Half-width of `lost_part`."""
    return p[row][OFF] + t * p[row][OFF_SLOPE]


@both_ways
def known_of(c: Law, w: Query, lost: float, spread: float) -> float:
    """Squared half-width of a full siphon's crest pressure by gas, levels and what else it may be off by."""
    up = w[UP_WIDTH] * w[UP_WIDTH] + c[OF_GAS] * w[UP_GAS] * w[UP_GAS]
    down = w[DOWN_WIDTH] * w[DOWN_WIDTH]
    kept = 1.0 - lost
    return spread * spread + kept * kept * up + lost * lost * down


@both_ways
def set_margin(c: Law, w: Query, lost: float, width: float, known: float) -> None:
    """Lowest pressure of a full siphon less what lies over the crest, and the square of its half-width.

    p_m - p_c = p_A - p_c + P_A - D_m - R p_d,  R = (alpha + k_up)/(k + 1), p_d the driving pressure.
    Args: `lost`: R. `width`: by how much that may be off (95 %). `known`: as `known_of`, Pa^2.
    Source: energy balance from the upstream chamber to the crest; inputs by sensitivity, ASME V&V 20.
    """
    liquid = w[ABOVE] - lost * (w[UP_LEVEL] - w[DISCHARGE])
    part = width * w[DRIVING]
    w[MARGIN] = w[HOLDS] - lost * w[DRIVING]
    w[MARGIN_SQUARE] = known + c[OF_CREST] + c[OF_LIQUID] * liquid * liquid + part * part


@both_ways
def set_widths(c: Law, p: Pieces, w: Query, way: int) -> None:
    """Half-width of the answer over a crest, and whether it allows another regime."""
    row = int(w[FULL_ROW] + p[SIPHON][SHARES])
    lost = lost_part(p, row, w[FULL_TO_END], way)
    up = w[UP_WIDTH] * w[UP_WIDTH] + c[OF_GAS] * w[UP_GAS] * w[UP_GAS]
    down = w[DOWN_WIDTH] * w[DOWN_WIDTH]
    lower = w[RESTING] - w[MOST]
    upper = w[RESTING] - w[LEAST]
    part = 0.0
    if w[REGIME] == SEPARATED:
        gas = w[UP_GAS] - w[CAVITY]
        square = up + down + c[OF_CREST] + c[OF_DENSITY] * gas * gas + c[OF_SPEED] * w[ABOVE] * w[ABOVE]
        square = relative_square(p, w, w[HOLDS], square)
        if lower < w[HOLDS]:
            part = w[VELOCITY] - velocity_held(c, p, w, way, lower)
        if upper > w[HOLDS]:
            part = larger(part, smaller(velocity(c, p, w, way, upper), w[FULL]) - w[VELOCITY])
    else:
        w[ROOT] = w[FULL_ROOT]
        w[ROW] = w[FULL_ROW]
        w[TO_END] = w[FULL_TO_END]
        w[VALUE] = w[FULL_VALUE]
        square = full_square(c, p, w)
        if lower < lost * w[DRIVING]:
            part = larger(w[VELOCITY] - velocity_held(c, p, w, way, lower), 0.0)
    w[UNCERTAINTY] = sqrt(w[VELOCITY] * w[VELOCITY] * (square + c[TABULATION]) + part * part)
    part = larger(w[HOLDS] - lower, upper - w[HOLDS])
    set_margin(c, w, lost, lost_width(p, row, w[FULL_TO_END]), known_of(c, w, lost, part))
    if w[MARGIN] * w[MARGIN] < w[MARGIN_SQUARE]:
        w[REGIME] = UNDECIDED
        w[STATUS] = UNSURE


@both_ways
def over_crest(c: Law, p: Pieces, w: Query, way: int, widths: bool) -> None:
    """The answer of a tube with a crest, if liquid flows; `way`: row of the column up to the crest."""
    set_crest(c, w)
    w[HOLDS] = crest_margin(w)
    if w[HOLDS] <= 0.0:
        return
    w[FULL] = velocity(c, p, w, SIPHON, w[DRIVING])
    w[FULL_ROOT] = w[ROOT]
    w[FULL_ROW] = w[ROW]
    w[FULL_TO_END] = w[TO_END]
    w[FULL_VALUE] = w[VALUE]
    w[AT_FIRST] = w[HOLDS]
    w[BROKEN] = velocity(c, p, w, way, w[HOLDS])
    w[SLOWER] = w[BROKEN]
    w[SWEPT] = w[PRIMED]
    if w[PRIMED] == 0.0:
        set_swept(c, p, w, way)
    set_slower(c, w)
    if widths:
        set_widths(c, p, w, way)


@both_ways
def turn(w: Query) -> None:
    """Look from the other chamber."""
    kept = w[UP_LEVEL]
    w[UP_LEVEL] = w[DOWN_LEVEL]
    w[DOWN_LEVEL] = kept
    kept = w[UP_WIDTH]
    w[UP_WIDTH] = w[DOWN_WIDTH]
    w[DOWN_WIDTH] = kept
    kept = w[UP_GAS]
    w[UP_GAS] = w[DOWN_GAS]
    w[DOWN_GAS] = kept


@both_ways
def set_flow(c: Law, p: Pieces, w: Query, way: int, widths: bool) -> None:
    """The answer where something drives liquid out of the upstream chamber, whose port must be covered."""
    if w[UP_LEVEL] >= c[PORT]:
        if c[CREST] == 0.0:
            set_full(c, p, w, widths)
        else:
            over_crest(c, p, w, way, widths)


@both_ways
def stays_full(c: Law, w: Query) -> bool:
    """Whether a primed column that nothing drives is still there: below a level, or in exact balance."""
    if w[PRIMED] == 0.0 or w[UP_LEVEL] < c[PORT]:
        return False
    if c[CREST] == 0.0:
        return True
    set_crest(c, w)
    return w[DRIVING] == 0.0 and w[RESTING] > w[CAVITY]


@both_ways
def set_answer(c: Law, p: Pieces, w: Query, widths: bool) -> None:
    """Velocity, positive, regime and primed afterwards.

    With `widths` half-width and whether it is undecided, too.  At most one direction flows: what drives one
    holds the other.
    """
    w[VELOCITY] = 0.0
    w[REGIME] = BLOCKED
    w[PRIMED_AFTER] = 0.0
    set_drive(c, w)
    if w[DRIVING] > 0.0:
        set_flow(c, p, w, THERE, widths)
        return
    if stays_full(c, w):
        w[PRIMED_AFTER] = 1.0
    turn(w)
    set_drive(c, w)
    if w[DRIVING] > 0.0:
        set_flow(c, p, w, int(c[WAY_BACK]), widths)
        if w[REGIME] != BLOCKED:
            w[REGIME] = REVERSE


@both_ways
def fill_status(c: Law, fill: float) -> float:
    """What a fill is worth for which the nearest within the range is taken."""
    if fill != fill:
        return INVALID
    if fill < -FILL_SLACK or fill > c[LARGEST_FILL] + FILL_SLACK:
        return EXTRAPOLATED
    return OK


@both_ways
def answer(c: Law, p: Pieces, w: Query, widths: bool) -> None:
    """Velocity out of the driven chamber, m/s, regime, status, primed afterwards.

    With `widths` the velocity's half-width (95 %), m/s, too; without, the status is never undecided.
    """
    up = within(c, w[FILL])
    down = within(c, w[OPPOSITE_FILL])
    w[VELOCITY] = 0.0
    w[UNCERTAINTY] = 0.0
    w[MARGIN] = 0.0
    w[MARGIN_SQUARE] = 0.0
    w[REGIME] = BLOCKED
    w[PRIMED_AFTER] = 0.0
    w[STATUS] = OK
    if w[FILL] != up:
        w[STATUS] = fill_status(c, w[FILL])
    if w[OPPOSITE_FILL] != down:
        w[STATUS] = larger(w[STATUS], fill_status(c, w[OPPOSITE_FILL]))
    if not (w[PRESSURE] >= -c[AMBIENT] and w[PRESSURE] <= GREATEST_PRESSURE):
        w[STATUS] = INVALID
    if w[STATUS] == INVALID:
        return
    w[UP_GAS] = c[GAS_FACTOR] * w[PRESSURE]
    w[DOWN_GAS] = 0.0
    set_levels(c, p, w, up, down)
    worth = w[STATUS]
    set_answer(c, p, w, widths)
    if w[REGIME] == BLOCKED:
        w[STATUS] = STANDS
    elif w[VELOCITY] < c[LOWEST] or w[VELOCITY] > c[HIGHEST]:
        w[STATUS] = EXTRAPOLATED
    if worth == EXTRAPOLATED:
        w[STATUS] = EXTRAPOLATED
    if w[REGIME] == REVERSE:
        w[VELOCITY] = -w[VELOCITY]
