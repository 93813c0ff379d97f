"""The law-based controller in time, in + - * / sqrt and comparisons alone.

`c`, `k`, `p` and `q` are law and disc as the controller assumes them (`disc`, gas at once), with its settings
behind; `w` is the row of the disc, with the liquid as estimated, and with the controller's memory behind the
pairs.  It samples as `target_steps` does.  Source: `LawBased` of
`controller.algorithms.law_based`; a valve-open time is t = (V/S) integral dx/u(x), by Gauss's rule on equal
parts of x.
"""

from math import sqrt

from ringbalance.controller.algorithms.law_steps import (
    AXIS_X,
    AXIS_Y,
    CHANGE,
    LAST_MOMENT_X,
    LAST_MOMENT_Y,
    LAST_X,
    LAST_Y,
    LEARNT_X,
    LEARNT_Y,
    MOMENT_NOW,
    NOW_X,
    NOW_Y,
    SEEN_X,
    SEEN_Y,
    SHOULD,
    change_of,
    is_try,
    learn,
    see_response,
    set_bounds,
    set_should,
    split,
)
from ringbalance.controller.algorithms.valve_steps import (
    GREATEST,
    OPEN_TIME,
    PER_CHAMBER,
    longest_open,
    waits,
)
from ringbalance.export.chamber import moment
from ringbalance.export.disc import (
    ASKED,
    CLOSES,
    DIRECTIONS,
    FIRST_PAIR,
    IS_PRIMED,
    OPENS,
    PAIRS,
    PER_PAIR,
    PER_SECOND,
    SUPPLY,
    TOTAL,
    VALVE,
    X,
    command,
    keep_primed,
    pass_pair,
)
from ringbalance.reduced_model.pieces.point import (
    AMBIENT,
    BLOCK,
    DOWN_GAS,
    GAS_FACTOR,
    LARGEST_FILL,
    PRIMED,
    UP_GAS,
    VELOCITY,
    Cells,
    Law,
    Levels,
    Pieces,
    Query,
    larger,
    set_levels,
    smaller,
    within,
)
from ringbalance.reduced_model.pieces.query import set_answer

# fmt: off
# Settings behind the disc's numbers; the offsets of the chambers come last.
LIMIT, LEAST_TIME, LONGEST_TIME, PERIOD, LEAST_FILL, ASSUMED = 0, 1, 2, 3, 4, 5
LAW_SQUARE, AMPLITUDE_SQUARE, PHASE_SQUARE, OFFSETS = 6, 7, 8, 9

# Row behind the pairs: the algorithm's memory (`law_steps`), further values for a host, and the chambers'.
RESTS, SAMPLES, WAIT, OPENED, FLOW_PRIMED, FIRST_CHAMBER = 0, 1, 2, 3, 4, 5
# fmt: on

HALVINGS, PARTS, GAUSS, END_STEP = 60, 64.0, 0.28867513459481287, 1e-3
SHORTEST_PART, LEAST_FALL, SLOWEST_FALL = 1e-9, 1e-15, 1e-12


def settings(c: Law) -> int:
    """Index of the first setting."""
    d = int(c[BLOCK])
    return d + DIRECTIONS + 2 * int(c[d + PAIRS])


def memory(c: Law) -> int:
    """Index of the first number of the algorithm's memory."""
    return FIRST_PAIR + PER_PAIR * int(c[int(c[BLOCK]) + PAIRS])


def host_row(c: Law) -> int:
    """Index of the first number that a host sees besides the vibration."""
    return change_of(memory(c), int(c[int(c[BLOCK]) + PAIRS]))


def chamber_of(c: Law, chamber: int) -> int:
    """Index of the first of a chamber's numbers."""
    return host_row(c) + FIRST_CHAMBER + PER_CHAMBER * chamber


def pair_moment(c: Law, k: Cells, p: Pieces, fill: float) -> float:
    """Moment of a pair by the fill of its positive chamber, kg m."""
    return moment(c, k, p, fill) - moment(c, k, p, c[int(c[BLOCK]) + TOTAL] - fill)


def set_moment(c: Law, k: Cells, p: Pieces, w: Query) -> None:
    """Set the disc's moment, kg m, with the liquid as estimated, and the change expected of each pair."""
    d = int(c[BLOCK])
    r = memory(c)
    w[r + NOW_X] = 0.0
    w[r + NOW_Y] = 0.0
    pair = 0
    while pair < int(c[d + PAIRS]):
        value = pair_moment(c, k, p, w[FIRST_PAIR + PER_PAIR * pair + X])
        at = change_of(r, pair)
        set_should(w, r, pair, value, w[at + SHOULD] != 0.0)
        w[at + MOMENT_NOW] = value
        w[r + NOW_X] = w[r + NOW_X] + value * w[change_of(r, pair) + AXIS_X]
        w[r + NOW_Y] = w[r + NOW_Y] + value * w[change_of(r, pair) + AXIS_Y]
        pair = pair + 1


def fill_for(c: Law, k: Cells, p: Pieces, wanted: float, lowest: float, highest: float) -> float:
    """Fill of a pair's positive chamber at a moment, kg m; straight on beyond the bounds."""
    low = pair_moment(c, k, p, lowest)
    high = pair_moment(c, k, p, highest)
    if highest <= lowest:
        return lowest
    little = END_STEP * (highest - lowest)
    if wanted <= low:
        return lowest + (wanted - low) / (pair_moment(c, k, p, lowest + little) - low) * little
    if wanted >= high:
        return highest + (wanted - high) / (high - pair_moment(c, k, p, highest - little)) * little
    a = lowest
    b = highest
    tried = 0
    while tried < HALVINGS:
        middle = (a + b) / 2.0
        if pair_moment(c, k, p, middle) >= wanted:
            b = middle
        else:
            a = middle
        tried = tried + 1
    return b


def falling(c: Law, k: Cells, p: Pieces, q: Levels, w: Query, fill: float) -> float:
    """Rate at which the fill of a driven chamber falls, 1/s; the tube is as the last query left it."""
    d = int(c[BLOCK])
    r = host_row(c)
    set_levels(c, k, q, w, within(c, fill), within(c, c[d + TOTAL] - fill))
    w[UP_GAS] = c[GAS_FACTOR] * (c[d + SUPPLY] - c[AMBIENT])
    w[DOWN_GAS] = 0.0
    w[PRIMED] = w[r + FLOW_PRIMED]
    back = set_answer(c, k, p, w)
    keep_primed(w, r + FLOW_PRIMED)
    if back:
        return -c[d + PER_SECOND] * w[VELOCITY]
    return c[d + PER_SECOND] * w[VELOCITY]


def try_time(c: Law, k: Cells, p: Pieces, q: Levels, w: Query, change: float) -> float:
    """Valve-open time for a fill to change where no more liquid is expected, s: as if chambers were level."""
    w[host_row(c) + FLOW_PRIMED] = 1.0
    speed = falling(c, k, p, q, w, c[int(c[BLOCK]) + TOTAL] / 2.0)
    return smaller(change / larger(speed, SLOWEST_FALL), c[settings(c) + PERIOD])


def flow_time(
    c: Law, k: Cells, p: Pieces, q: Levels, w: Query, fill: float, target: float, longest: float
) -> float:
    """Valve-open time, s, in which a driven chamber comes from a fill to a lower one, or the flow stalls."""
    d = int(c[BLOCK])
    r = host_row(c)
    end = larger(target, larger(0.0, c[d + TOTAL] - c[LARGEST_FILL]))
    x = fill
    part = larger(fill - end, 0.0) / PARTS
    # A shorter part would leave the fill as it is, and the loop without an end.
    least = larger(part * SHORTEST_PART, LEAST_FALL)
    if part <= LEAST_FALL:
        x = end
    time = 0.0
    while x > end and part > least and time < longest:
        primed = w[r + FLOW_PRIMED]
        dx = smaller(part, x - end)
        early = falling(c, k, p, q, w, x - dx * (0.5 - GAUSS))
        late = falling(c, k, p, q, w, x - dx * (0.5 + GAUSS))
        if early > 0.0 and late > 0.0:
            time = time + dx * (0.5 / early + 0.5 / late)
            x = x - dx
        else:
            part = part / 2.0
            w[r + FLOW_PRIMED] = primed
    if x <= end and target < end:
        time = time + try_time(c, k, p, q, w, end - target)
    return smaller(time, longest)


def gas_time(c: Law, k: Cells, p: Pieces, q: Levels, w: Query, pair: int, wanted: float) -> float:
    """Valve-open time of the chamber that has to give liquid, s; one period where nothing flows."""
    e = settings(c)
    at = FIRST_PAIR + PER_PAIR * pair
    total = c[int(c[BLOCK]) + TOTAL]
    fill = w[at + X]
    target = wanted
    if wanted > fill:
        fill = total - fill
        target = total - wanted
    w[host_row(c) + FLOW_PRIMED] = w[at + IS_PRIMED]
    first = falling(c, k, p, q, w, fill)
    if first == 0.0:
        return c[e + PERIOD]
    if first < 0.0:
        return c[e + LONGEST_TIME]
    return flow_time(c, k, p, q, w, fill, target, c[e + LONGEST_TIME])


def open_valve(c: Law, w: Query, pair: int, side: int, time: float) -> None:
    """Open a valve for a time and its chamber's offset, s, unless the time is below the least."""
    e = settings(c)
    half = int(c[int(c[BLOCK]) + PAIRS])
    chamber = pair + side * half
    at = FIRST_PAIR + PER_PAIR * pair
    if time > 0.0 and time >= c[e + LEAST_TIME]:
        opened = smaller(time + c[e + OFFSETS + chamber], c[e + LONGEST_TIME])
        w[chamber_of(c, chamber) + OPEN_TIME] = opened
        w[at + ASKED + side] = larger(opened - c[e + OFFSETS + chamber], 0.0)
        command(c, w, at)
        w[at + ASKED + side] = 0.0
        w[host_row(c) + OPENED] = 1.0
        w[change_of(memory(c), pair) + SHOULD] = 1.0


def aim(c: Law, k: Cells, p: Pieces, q: Levels, w: Query) -> None:
    """Command the valve-open times that take the residual away."""
    d = int(c[BLOCK])
    e = settings(c)
    r = memory(c)
    half = int(c[d + PAIRS])
    lowest = c[e + LEAST_FILL]
    highest = c[d + TOTAL] - lowest
    pair = 0
    while pair < half:
        now = pair_moment(c, k, p, w[FIRST_PAIR + PER_PAIR * pair + X])
        set_bounds(w, r, pair, now, pair_moment(c, k, p, lowest), pair_moment(c, k, p, highest))
        pair = pair + 1
    kx = w[r + LEARNT_X]
    ky = w[r + LEARNT_Y]
    square = kx * kx + ky * ky
    x = w[r + SEEN_X]
    y = w[r + SEEN_Y]
    split(w, r, half, -(x * kx + y * ky) / square, -(y * kx - x * ky) / square)
    pair = 0
    while pair < half:
        change = w[change_of(r, pair) + CHANGE]
        if change != 0.0:
            fill = w[FIRST_PAIR + PER_PAIR * pair + X]
            wanted = fill_for(c, k, p, pair_moment(c, k, p, fill) + change, lowest, highest)
            side = 0
            if wanted >= fill:
                side = 1
            if is_try(w, r, pair, side):
                open_valve(c, w, pair, side, try_time(c, k, p, q, w, larger(wanted - fill, fill - wanted)))
            elif wanted != fill:
                open_valve(c, w, pair, side, gas_time(c, k, p, q, w, pair, wanted))
        pair = pair + 1


def shut(c: Law, w: Query) -> None:
    """Close the valves of the pairs that are followed."""
    pair = 0
    while pair < int(c[int(c[BLOCK]) + PAIRS]):
        at = FIRST_PAIR + PER_PAIR * pair
        side = 0
        while side < 2:
            w[at + VALVE + side] = 0.0
            w[at + OPENS + side] = 0.0
            w[at + CLOSES + side] = 0.0
            side = side + 1
        pair = pair + 1


def sample(c: Law, k: Cells, p: Pieces, q: Levels, w: Query) -> None:
    """React to the vibration as it is; one that is not a number changes nothing."""
    e = settings(c)
    r = memory(c)
    b = host_row(c)
    amplitude = sqrt(w[r + SEEN_X] * w[r + SEEN_X] + w[r + SEEN_Y] * w[r + SEEN_Y])
    w[b + RESTS] = 0.0
    if not amplitude <= GREATEST:
        return
    shut(c, w)
    set_moment(c, k, p, w)
    if w[b + OPENED] != 0.0:
        noise = c[e + AMPLITUDE_SQUARE]
        by_phase = c[e + PHASE_SQUARE]
        if see_response(w, r, int(c[int(c[BLOCK]) + PAIRS]), noise, by_phase):
            learn(w, r, noise, by_phase, c[e + LAW_SQUARE], c[e + ASSUMED])
    w[b + OPENED] = 0.0
    w[r + LAST_X] = w[r + SEEN_X]
    w[r + LAST_Y] = w[r + SEEN_Y]
    w[r + LAST_MOMENT_X] = w[r + NOW_X]
    w[r + LAST_MOMENT_Y] = w[r + NOW_Y]
    if amplitude <= c[e + LIMIT]:
        w[b + RESTS] = 1.0
        return
    aim(c, k, p, q, w)


def control(c: Law, k: Cells, p: Pieces, q: Levels, w: Query, time: float) -> None:
    """Let a time pass, s, and sample the vibration if it is time to."""
    half = int(c[int(c[BLOCK]) + PAIRS])
    pair = 0
    while pair < half:
        pass_pair(c, k, p, q, w, FIRST_PAIR + PER_PAIR * pair, time)
        pair = pair + 1
    r = host_row(c)
    first = chamber_of(c, 0)
    period = c[settings(c) + PERIOD]
    if waits(w, r + WAIT, first, 2 * half, period, time):
        return
    w[r + SAMPLES] = w[r + SAMPLES] + 1.0
    sample(c, k, p, q, w)
    w[r + WAIT] = longest_open(w, first, 2 * half) + period
