"""One query of the compact law, in + - * / sqrt and comparisons, which IEEE 754 fixes to the last bit.

The one source of every host: Python runs it as it stands, `translate` writes it in other languages, so it
keeps to numbers, rows of numbers, `if`, `while` and functions.  `c` is the law, `w` a query with its answer
and all between; the names below are places in them.  A table in `c` has its knots first and behind them each
column, of as many numbers.  Gauge pressures in Pa, velocities in m/s, heads in m^2/s^2; upstream is the
chamber that gives liquid.  Source: `tube.regime` and `tube.directed_flow`, whose conditions and half-widths
these are.
"""

from collections.abc import Sequence
from math import sqrt

Law = Sequence[float]
Query = list[float]

# fmt: off
# Of the law.
LARGEST_FILL, AMBIENT, GAS_FACTOR, DENSITY, PORT, CREST, COLUMN, TRAPPED = 0, 1, 2, 3, 4, 5, 6, 7
VAPOUR, RELEASED, CAVITY_KNOWN, FROUDE, STAYS, CLEARS = 8, 9, 10, 11, 12, 13
OF_DENSITY, OF_SPEED, OF_GAS, OF_CREST, TABULATION, LOWEST, HIGHEST = 14, 15, 16, 17, 18, 19, 20
# Where a table begins, and behind it the number of its knots.
FILLS, CHAMBER, SIPHON, THERE, BACK = 21, 23, 25, 27, 29
# Column of the way back in the table of the siphon; where a block that builds on the law has its own numbers.
BACK_SHARE, BLOCK, PLACES = 31, 32, 33
# Columns: value, slope and curvature, or values that are straight between knots.
LEVEL_WIDTH_COLUMN, MOMENT_COLUMN, MOMENT_WIDTH_COLUMN = 4, 3, 5
LOSS_COLUMN, SHARE_WIDTH_COLUMN, SHARE_COLUMN = 3, 4, 5

# Of a query, and of its answer.
FILL, OPPOSITE_FILL, PRESSURE, PRIMED = 0, 1, 2, 3
VELOCITY, UNCERTAINTY, REGIME, STATUS, PRIMED_AFTER = 4, 5, 6, 7, 8
# In one direction: pressures at the tube's ends, half-widths of levels, and what lies over the crest.
UP_GAS, DOWN_GAS, UP_LEVEL, UP_WIDTH, DOWN_LEVEL, DOWN_WIDTH = 9, 10, 11, 12, 13, 14
DISCHARGE, DRIVING, RESTING, CAVITY, LEAST, MOST, GAS_THERE = 15, 16, 17, 18, 19, 20, 21
# Velocities with d ln(velocity)/d ln(head), half-width of the loss, knot before, and place behind it.
FULL, BROKEN, OTHER = 22, 27, 32
# Of the driven chamber, where these are asked for too.
RADIUS, MOMENT, PLACES_OF_QUERY = 37, 38, 39
EXPONENT, LOSS, KNOT, BEHIND = 1, 2, 3, 4

BLOCKED, SIPHONING, SEPARATED, REVERSE, UNDECIDED = 0.0, 1.0, 2.0, 3.0, 4.0
OK, EXTRAPOLATED, STANDS, UNSURE, INVALID = 0.0, 1.0, 2.0, 3.0, 4.0

GREATEST_PRESSURE, FILL_SLACK, NO_PRESSURE = 1e12, 1e-9, 1e-100
GAS_STAYS, GAS_GOES = 0.6, 1.1
# fmt: on


def larger(a: float, b: float) -> float:
    """Of two numbers."""
    if a > b:
        return a
    return b


def smaller(a: float, b: float) -> float:
    """Of two numbers."""
    if a < b:
        return a
    return b


def knot_before(c: Law, table: int, x: float) -> int:
    """Place of the first knot of the piece that holds x, or of the nearest piece."""
    low = int(c[table])
    count = int(c[table + 1]) - 1
    while count > 1:
        half = count // 2
        # Without a branch to guess wrong, where a compiler moves by condition.
        if x >= c[low + half]:
            low = low + half
        count = count - half
    return low


def place_behind(c: Law, knot: int, x: float) -> float:
    """How far x lies in the piece behind a knot, from 0 to 1."""
    return larger(0.0, smaller((x - c[knot]) / (c[knot + 1] - c[knot]), 1.0))


def straight(c: Law, at: int, t: float) -> float:
    """Between two numbers of a column."""
    return c[at] + t * (c[at + 1] - c[at])


def cubic(c: Law, table: int, column: int, knot: int, t: float) -> float:
    """A Hermite piece from values and slopes at both ends."""
    at = knot + column * int(c[table + 1])
    slope = at + int(c[table + 1])
    width = c[knot + 1] - c[knot]
    rise = c[at + 1] - c[at]
    first = width * c[slope]
    bend = 3.0 * rise - 2.0 * first - width * c[slope + 1]
    return c[at] + t * (first + t * (bend + t * (rise - first - bend)))


def growth(c: Law, table: int, column: int, knot: int, t: float) -> float:
    """Its slope."""
    at = knot + column * int(c[table + 1])
    slope = at + int(c[table + 1])
    width = c[knot + 1] - c[knot]
    rise = c[at + 1] - c[at]
    first = width * c[slope]
    bend = 3.0 * rise - 2.0 * first - width * c[slope + 1]
    return (first + t * (2.0 * bend + t * 3.0 * (rise - first - bend))) / width


def quintic(c: Law, table: int, knot: int, t: float) -> float:
    """A piece from values, slopes and curvatures in the first three columns."""
    count = int(c[table + 1])
    at = knot + count
    width = c[knot + 1] - c[knot]
    first = width * c[at + count]
    second = width * width * c[at + 2 * count] / 2.0
    rise = c[at + 1] - c[at] - first - second
    turn = width * c[at + count + 1] - first - 2.0 * second
    bend = width * width * c[at + 2 * count + 1] / 2.0 - second
    third = 10.0 * rise - 4.0 * turn + bend
    fourth = 7.0 * turn - 15.0 * rise - 2.0 * bend
    fifth = 6.0 * rise - 3.0 * turn + bend
    return c[at] + t * (first + t * (second + t * (third + t * (fourth + t * fifth))))


def surface_radius(c: Law, fill: float) -> float:
    """Radius of a chamber's concentric free surface, m."""
    knot = knot_before(c, CHAMBER, fill)
    return sqrt(larger(cubic(c, CHAMBER, 1, knot, place_behind(c, knot, fill)), 0.0))


def moment(c: Law, fill: float) -> float:
    """Balancing moment of one chamber, kg m; a pair's is the difference of two."""
    knot = knot_before(c, CHAMBER, fill)
    return cubic(c, CHAMBER, MOMENT_COLUMN, knot, place_behind(c, knot, fill))


def moment_uncertainty(c: Law, fill: float) -> float:
    """Expanded uncertainty (95 %) of `moment`, kg m."""
    knot = knot_before(c, CHAMBER, fill)
    at = knot + MOMENT_WIDTH_COLUMN * int(c[CHAMBER + 1])
    return straight(c, at, place_behind(c, knot, fill))


def set_level(c: Law, w: Query, fill: float, at: int) -> None:
    """Hydrostatic pressure of a chamber's liquid and its half-width."""
    knot = knot_before(c, FILLS, fill)
    t = place_behind(c, knot, fill)
    w[at] = larger(quintic(c, FILLS, knot, t), 0.0)
    w[at + 1] = straight(c, knot + LEVEL_WIDTH_COLUMN * int(c[FILLS + 1]), t)


def set_velocity(c: Law, w: Query, table: int, pressure: float, at: int) -> None:
    """Velocity that a pressure drives: root of its head times a tabulated ratio; creeping below the table."""
    s = sqrt(sqrt(sqrt(larger(pressure, 0.0) / c[DENSITY])))
    knot = knot_before(c, table, s)
    t = place_behind(c, knot, s)
    ratio = cubic(c, table, 1, knot, t)
    w[at] = s * s * s * s * ratio
    w[at + EXPONENT] = 0.5
    w[at + LOSS] = straight(c, knot + LOSS_COLUMN * int(c[table + 1]), t)
    w[at + KNOT] = float(knot)
    w[at + BEHIND] = t
    first = int(c[table])
    if s < c[first]:
        less = (s / c[first]) * (s / c[first])
        w[at] = w[at] * (less * less)
        w[at + EXPONENT] = 1.0
    elif s < c[first + int(c[table + 1]) - 1]:
        w[at + EXPONENT] = 0.5 + 0.125 * s * growth(c, table, 1, knot, t) / ratio


def set_pressures(c: Law, w: Query) -> None:
    """What drives the tube, and what the crest's pressure at rest stands against."""
    w[DISCHARGE] = larger(w[DOWN_LEVEL], c[PORT])
    w[DRIVING] = w[UP_GAS] - w[DOWN_GAS] + w[UP_LEVEL] - w[DISCHARGE]
    w[RESTING] = w[UP_GAS] + w[UP_LEVEL] - c[COLUMN]
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


def crest_margin(w: Query) -> float:
    """Crest pressure at rest less that of a primed tube's cavity, or of gas there."""
    if w[PRIMED] != 0.0:
        return w[RESTING] - w[CAVITY]
    return w[RESTING] - larger(w[GAS_THERE], w[CAVITY])


def flows(c: Law, w: Query) -> bool:
    """Whether liquid flows: port covered, driving pressure positive, crest passed."""
    if w[UP_LEVEL] < c[PORT] or w[DRIVING] <= 0.0:
        return False
    return c[CREST] == 0.0 or crest_margin(w) > 0.0


def stays_full(c: Law, w: Query) -> bool:
    """Whether a primed column in which nothing flows is still there: below a level, or in exact balance."""
    if w[PRIMED] == 0.0 or w[UP_LEVEL] < c[PORT]:
        return False
    return c[CREST] == 0.0 or (w[DRIVING] == 0.0 and w[RESTING] - w[CAVITY] > 0.0)


def cleared(c: Law, velocity: float) -> float:
    """How far the flow has carried gas out from over the crest, from 0 to 1."""
    if c[FROUDE] == 0.0:
        return 1.0
    part = (velocity / c[FROUDE] - GAS_STAYS) / (GAS_GOES - GAS_STAYS)
    part = larger(0.0, smaller(part, 1.0))
    return part * part * (3.0 - 2.0 * part)


def width_of(c: Law, w: Query, at: int, driven: float, gas: float, levels: float, crest: float) -> float:
    """Half-width of a velocity by its loss and by what drives it.

    Args: `driven`: its pressure. `gas`: what the density matters for. `levels`: what grows as the square of
        the speed. `crest`: half-width of the pressure at the crest.
    """
    pressure = larger(driven, NO_PRESSURE)
    blown = w[UP_GAS] - w[DOWN_GAS]
    if at == BROKEN:
        blown = w[UP_GAS]
    square = w[UP_WIDTH] * w[UP_WIDTH] + w[DOWN_WIDTH] * w[DOWN_WIDTH] + crest * crest
    part = c[OF_DENSITY] * gas
    square = square + part * part
    part = c[OF_SPEED] * 2.0 * levels
    square = square + part * part
    part = c[OF_GAS] * blown
    square = square + part * part
    loss = w[at + LOSS]
    return w[at] * w[at + EXPONENT] * sqrt(loss * loss + square / (pressure * pressure))


def undecided(c: Law, w: Query, share_at: int, held: float, spread: float) -> bool:
    """Whether what is known of the crest's pressure allows both a siphon and a separated column.

    Args: `share_at`: column of what part of the driving pressure is lost up to the crest. `held`: pressure
        that holds the column together. `spread`: by how much it may be off.
    """
    knot = int(w[FULL + KNOT])
    count = int(c[SIPHON + 1])
    share = cubic(c, SIPHON, share_at, knot, w[FULL + BEHIND])
    liquid = w[UP_LEVEL] - c[COLUMN] + share * (w[DISCHARGE] - w[UP_LEVEL])
    part = straight(c, knot + SHARE_WIDTH_COLUMN * count, w[FULL + BEHIND]) * w[DRIVING]
    square = part * part + spread * spread + c[OF_CREST] * c[OF_CREST]
    part = (1.0 - share) * w[UP_WIDTH]
    square = square + part * part
    part = share * w[DOWN_WIDTH]
    square = square + part * part
    part = (1.0 - share) * c[OF_GAS] * w[UP_GAS]
    square = square + part * part
    part = c[OF_DENSITY] * liquid
    square = square + part * part
    part = 2.0 * c[OF_SPEED] * liquid
    square = square + part * part
    margin = held - share * w[DRIVING]
    return margin * margin < square


def over_crest(c: Law, w: Query, way: int, share_at: int) -> None:
    """The answer of a tube with a crest in which liquid flows; `way`: table of the column up to the crest."""
    held = crest_margin(w)
    low = w[LEAST]
    high = w[MOST]
    carried = 0.0
    set_velocity(c, w, way, held, BROKEN)
    if w[PRIMED] == 0.0:
        carried = cleared(c, w[BROKEN])
        gas = larger(w[GAS_THERE], high)
        if w[BROKEN] < c[CLEARS]:
            high = gas
        if w[BROKEN] < c[STAYS]:
            low = gas
        held = held + carried * larger(w[RESTING] - w[CAVITY] - held, 0.0)
        set_velocity(c, w, way, held, BROKEN)
    full = w[FULL]
    if w[BROKEN] < full:
        above = w[UP_LEVEL] - c[COLUMN]
        w[UNCERTAINTY] = width_of(c, w, BROKEN, held, w[UP_GAS] - w[CAVITY], above, c[OF_CREST])
        w[VELOCITY] = w[BROKEN]
        w[REGIME] = SEPARATED
    set_velocity(c, w, way, w[RESTING] - high, OTHER)
    off = larger(w[VELOCITY] - smaller(w[OTHER], full), 0.0)
    set_velocity(c, w, way, w[RESTING] - low, OTHER)
    off = larger(off, smaller(w[OTHER], full) - w[VELOCITY])
    w[UNCERTAINTY] = sqrt(w[UNCERTAINTY] * w[UNCERTAINTY] + off * off)
    spread = larger(held - (w[RESTING] - high), w[RESTING] - low - held)
    if undecided(c, w, share_at, held, spread):
        w[REGIME] = UNDECIDED
        w[STATUS] = UNSURE
    w[PRIMED_AFTER] = 0.0
    swept = carried > 0.5 and cleared(c, full) > 0.5
    if (w[PRIMED] != 0.0 or swept) and (w[BROKEN] >= full or w[DOWN_LEVEL] >= c[PORT]):
        w[PRIMED_AFTER] = 1.0


def set_flow(c: Law, w: Query) -> None:
    """The answer where liquid flows, seen from the chamber that gives it, but for `over_crest`."""
    gas = w[UP_GAS] - w[DOWN_GAS]
    set_velocity(c, w, SIPHON, w[DRIVING], FULL)
    w[VELOCITY] = w[FULL]
    w[UNCERTAINTY] = width_of(c, w, FULL, w[DRIVING], gas, w[UP_LEVEL] - w[DISCHARGE], 0.0)
    w[REGIME] = SIPHONING
    w[STATUS] = OK
    w[PRIMED_AFTER] = 1.0


def turn(c: Law, w: Query) -> None:
    """Look from the other chamber."""
    at = UP_LEVEL
    while at < DOWN_LEVEL:
        kept = w[at]
        w[at] = w[at + 2]
        w[at + 2] = kept
        at = at + 1
    kept = w[UP_GAS]
    w[UP_GAS] = w[DOWN_GAS]
    w[DOWN_GAS] = kept
    set_pressures(c, w)


def set_answer(c: Law, w: Query) -> None:
    """The answer to a valid query, velocities positive and status of the range apart."""
    w[PRIMED_AFTER] = 0.0
    set_pressures(c, w)
    if stays_full(c, w):
        w[PRIMED_AFTER] = 1.0
    if flows(c, w):
        set_flow(c, w)
        if c[CREST] != 0.0:
            over_crest(c, w, THERE, SHARE_COLUMN)
        return
    turn(c, w)
    if flows(c, w):
        set_flow(c, w)
        if c[CREST] != 0.0:
            over_crest(c, w, BACK, int(c[BACK_SHARE]))
        w[REGIME] = REVERSE


def answer(c: Law, w: Query) -> None:
    """Velocity out of the driven chamber, its half-width (95 %), m/s, regime, status, primed afterwards."""
    w[VELOCITY] = 0.0
    w[UNCERTAINTY] = 0.0
    w[REGIME] = BLOCKED
    w[STATUS] = INVALID
    w[PRIMED_AFTER] = 0.0
    x = w[FILL]
    y = w[OPPOSITE_FILL]
    p = w[PRESSURE]
    if not (p >= -c[AMBIENT] and p <= GREATEST_PRESSURE and x == x and y == y):
        return
    w[STATUS] = STANDS
    most = c[LARGEST_FILL]
    set_level(c, w, larger(0.0, smaller(x, most)), UP_LEVEL)
    set_level(c, w, larger(0.0, smaller(y, most)), DOWN_LEVEL)
    w[UP_GAS] = c[GAS_FACTOR] * p
    w[DOWN_GAS] = 0.0
    set_answer(c, w)
    if w[REGIME] != BLOCKED and (w[VELOCITY] < c[LOWEST] or w[VELOCITY] > c[HIGHEST]):
        w[STATUS] = EXTRAPOLATED
    if smaller(x, y) < -FILL_SLACK or larger(x, y) > most + FILL_SLACK:
        w[STATUS] = EXTRAPOLATED
    part = c[TABULATION] * w[VELOCITY]
    w[UNCERTAINTY] = sqrt(w[UNCERTAINTY] * w[UNCERTAINTY] + part * part)
    if w[REGIME] == REVERSE:
        w[VELOCITY] = -w[VELOCITY]


def answer_all(c: Law, w: Query) -> None:
    """The answer, and surface radius, m, and moment, kg m, of the driven chamber."""
    answer(c, w)
    w[RADIUS] = surface_radius(c, w[FILL])
    w[MOMENT] = moment(c, w[FILL])
