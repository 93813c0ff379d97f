"""The law-based controller in time, in + - * / sqrt and comparisons alone.

`c`, `k`, `p` and `q` are law and disc as the controller assumes them (`disc`, gas at once), with its settings
behind; `w` is the row of the disc, with the liquid as estimated, and with the controller's memory behind the
pairs.  It samples as `target_steps` does.  Source: `LawBased` of
`controller.algorithms.law_based`; a valve-open time is t = (V/S) integral dx/u(x), by Gauss's rule on equal
parts of x.
"""

from math import sqrt

from ringbalance.controller.algorithms import law_steps, valve_steps
from ringbalance.export import disc
from ringbalance.reduced_model.pieces import point
from ringbalance.reduced_model.pieces.point import Cells, Law, Levels, Pieces, Query
from ringbalance.reduced_model.pieces.query import moment, set_answer

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
    d = int(c[point.BLOCK])
    return d + disc.DIRECTIONS + 2 * int(c[d + disc.PAIRS])


def memory(c: Law) -> int:
    """Index of the first number of the algorithm's memory."""
    return disc.FIRST_PAIR + disc.PER_PAIR * int(c[int(c[point.BLOCK]) + disc.PAIRS])


def host_row(c: Law) -> int:
    """Index of the first number that a host sees besides the vibration."""
    return law_steps.change_of(memory(c), int(c[int(c[point.BLOCK]) + disc.PAIRS]))


def chamber_of(c: Law, chamber: int) -> int:
    """Index of the first of a chamber's numbers."""
    return host_row(c) + FIRST_CHAMBER + valve_steps.PER_CHAMBER * chamber


def pair_moment(c: Law, k: Cells, p: Pieces, fill: float) -> float:
    """Moment of a pair by the fill of its positive chamber, kg m."""
    return moment(c, k, p, fill) - moment(c, k, p, c[int(c[point.BLOCK]) + disc.TOTAL] - fill)


def set_moment(c: Law, k: Cells, p: Pieces, w: Query) -> None:
    """Set the disc's moment, kg m, with the liquid as estimated, and the change expected of each pair."""
    d, r = int(c[point.BLOCK]), memory(c)
    w[r + law_steps.NOW_X] = w[r + law_steps.NOW_Y] = 0.0
    for pair in range(int(c[d + disc.PAIRS])):
        value = pair_moment(c, k, p, w[disc.FIRST_PAIR + disc.PER_PAIR * pair + disc.X])
        at = law_steps.change_of(r, pair)
        law_steps.set_should(w, r, pair, value, w[at + law_steps.SHOULD] != 0.0)
        w[at + law_steps.MOMENT_NOW] = value
        w[r + law_steps.NOW_X] += value * w[law_steps.change_of(r, pair) + law_steps.AXIS_X]
        w[r + law_steps.NOW_Y] += value * w[law_steps.change_of(r, pair) + law_steps.AXIS_Y]


def fill_for(c: Law, k: Cells, p: Pieces, wanted: float, lowest: float, highest: float) -> float:
    """Fill of a pair's positive chamber at a moment, kg m; straight on beyond the bounds."""
    low, high = pair_moment(c, k, p, lowest), pair_moment(c, k, p, highest)
    if highest <= lowest:
        return lowest
    little = END_STEP * (highest - lowest)
    if wanted <= low:
        return lowest + (wanted - low) / (pair_moment(c, k, p, lowest + little) - low) * little
    if wanted >= high:
        return highest + (wanted - high) / (high - pair_moment(c, k, p, highest - little)) * little
    a, b, tried = lowest, highest, 0
    while tried < HALVINGS:
        middle = (a + b) / 2.0
        if pair_moment(c, k, p, middle) >= wanted:
            b = middle
        else:
            a = middle
        tried += 1
    return b


def falling(c: Law, k: Cells, p: Pieces, q: Levels, w: Query, fill: float) -> float:
    """Rate at which the fill of a driven chamber falls, 1/s; the tube is as the last query left it."""
    d, r = int(c[point.BLOCK]), host_row(c)
    point.set_levels(c, k, q, w, point.within(c, fill), point.within(c, c[d + disc.TOTAL] - fill))
    w[point.UP_GAS] = c[point.GAS_FACTOR] * (c[d + disc.SUPPLY] - c[point.AMBIENT])
    w[point.DOWN_GAS] = 0.0
    w[point.PRIMED] = w[r + FLOW_PRIMED]
    back = set_answer(c, k, p, w)
    disc.keep_primed(w, r + FLOW_PRIMED)
    if back:
        return -c[d + disc.PER_SECOND] * w[point.VELOCITY]
    return c[d + disc.PER_SECOND] * w[point.VELOCITY]


def try_time(c: Law, k: Cells, p: Pieces, q: Levels, w: Query, change: float) -> float:
    """Valve-open time for a fill to change where no more liquid is expected, s: as if chambers were level."""
    w[host_row(c) + FLOW_PRIMED] = 1.0
    speed = falling(c, k, p, q, w, c[int(c[point.BLOCK]) + disc.TOTAL] / 2.0)
    return point.smaller(change / point.larger(speed, SLOWEST_FALL), c[settings(c) + PERIOD])


def flow_time(
    c: Law, k: Cells, p: Pieces, q: Levels, w: Query, fill: float, target: float, longest: float
) -> float:
    """Valve-open time, s, in which a driven chamber comes from a fill to a lower one, or the flow stalls."""
    d, r = int(c[point.BLOCK]), host_row(c)
    end = point.larger(target, point.larger(0.0, c[d + disc.TOTAL] - c[point.LARGEST_FILL]))
    x, part = fill, point.larger(fill - end, 0.0) / PARTS
    # A shorter part would leave the fill as it is, and the loop without an end.
    least = point.larger(part * SHORTEST_PART, LEAST_FALL)
    if part <= LEAST_FALL:
        x = end
    time = 0.0
    while x > end and part > least and time < longest:
        primed = w[r + FLOW_PRIMED]
        dx = point.smaller(part, x - end)
        early = falling(c, k, p, q, w, x - dx * (0.5 - GAUSS))
        late = falling(c, k, p, q, w, x - dx * (0.5 + GAUSS))
        if early > 0.0 and late > 0.0:
            time += dx * (0.5 / early + 0.5 / late)
            x -= dx
        else:
            part = part / 2.0
            w[r + FLOW_PRIMED] = primed
    if x <= end and target < end:
        time += try_time(c, k, p, q, w, end - target)
    return point.smaller(time, longest)


def gas_time(c: Law, k: Cells, p: Pieces, q: Levels, w: Query, pair: int, wanted: float) -> float:
    """Valve-open time of the chamber that has to give liquid, s; one period where nothing flows."""
    e, at = settings(c), disc.FIRST_PAIR + disc.PER_PAIR * pair
    total = c[int(c[point.BLOCK]) + disc.TOTAL]
    fill, target = w[at + disc.X], wanted
    if wanted > fill:
        fill = total - fill
        target = total - wanted
    w[host_row(c) + FLOW_PRIMED] = w[at + disc.IS_PRIMED]
    first = falling(c, k, p, q, w, fill)
    if first == 0.0:
        return c[e + PERIOD]
    if first < 0.0:
        return c[e + LONGEST_TIME]
    return flow_time(c, k, p, q, w, fill, target, c[e + LONGEST_TIME])


def open_valve(c: Law, w: Query, pair: int, side: int, time: float) -> None:
    """Open a valve for a time and its chamber's offset, s, unless the time is below the least."""
    e, half = settings(c), int(c[int(c[point.BLOCK]) + disc.PAIRS])
    chamber, at = pair + side * half, disc.FIRST_PAIR + disc.PER_PAIR * pair
    if time > 0.0 and time >= c[e + LEAST_TIME]:
        opened = point.smaller(time + c[e + OFFSETS + chamber], c[e + LONGEST_TIME])
        w[chamber_of(c, chamber) + valve_steps.OPEN_TIME] = opened
        w[at + disc.ASKED + side] = point.larger(opened - c[e + OFFSETS + chamber], 0.0)
        disc.command(c, w, at)
        w[at + disc.ASKED + side] = 0.0
        w[host_row(c) + OPENED] = 1.0
        w[law_steps.change_of(memory(c), pair) + law_steps.SHOULD] = 1.0


def aim(c: Law, k: Cells, p: Pieces, q: Levels, w: Query) -> None:
    """Command the valve-open times that take the residual away."""
    d, e, r = int(c[point.BLOCK]), settings(c), memory(c)
    half = int(c[d + disc.PAIRS])
    lowest = c[e + LEAST_FILL]
    highest = c[d + disc.TOTAL] - lowest
    for pair in range(half):
        now = pair_moment(c, k, p, w[disc.FIRST_PAIR + disc.PER_PAIR * pair + disc.X])
        law_steps.set_bounds(w, r, pair, now, pair_moment(c, k, p, lowest), pair_moment(c, k, p, highest))
    kx, ky = w[r + law_steps.LEARNT_X], w[r + law_steps.LEARNT_Y]
    square = kx * kx + ky * ky
    x, y = w[r + law_steps.SEEN_X], w[r + law_steps.SEEN_Y]
    law_steps.split(w, r, half, -(x * kx + y * ky) / square, -(y * kx - x * ky) / square)
    for pair in range(half):
        change = w[law_steps.change_of(r, pair) + law_steps.CHANGE]
        if change != 0.0:
            fill = w[disc.FIRST_PAIR + disc.PER_PAIR * pair + disc.X]
            wanted = fill_for(c, k, p, pair_moment(c, k, p, fill) + change, lowest, highest)
            side = 0
            if wanted >= fill:
                side = 1
            if law_steps.is_try(w, r, pair, side):
                open_valve(
                    c, w, pair, side, try_time(c, k, p, q, w, point.larger(wanted - fill, fill - wanted))
                )
            elif wanted != fill:
                open_valve(c, w, pair, side, gas_time(c, k, p, q, w, pair, wanted))


def shut(c: Law, w: Query) -> None:
    """Close the valves of the pairs that are followed."""
    for pair in range(int(c[int(c[point.BLOCK]) + disc.PAIRS])):
        at = disc.FIRST_PAIR + disc.PER_PAIR * pair
        for side in range(2):
            w[at + disc.VALVE + side] = w[at + disc.OPENS + side] = w[at + disc.CLOSES + side] = 0.0


def sample(c: Law, k: Cells, p: Pieces, q: Levels, w: Query) -> None:
    """React to the vibration as it is; one that is not a number changes nothing."""
    e, r, b = settings(c), memory(c), host_row(c)
    amplitude = sqrt(
        w[r + law_steps.SEEN_X] * w[r + law_steps.SEEN_X] + w[r + law_steps.SEEN_Y] * w[r + law_steps.SEEN_Y]
    )
    w[b + RESTS] = 0.0
    if not amplitude <= valve_steps.GREATEST:
        return
    shut(c, w)
    set_moment(c, k, p, w)
    if w[b + OPENED] != 0.0:
        noise, by_phase = c[e + AMPLITUDE_SQUARE], c[e + PHASE_SQUARE]
        if law_steps.see_response(w, r, int(c[int(c[point.BLOCK]) + disc.PAIRS]), noise, by_phase):
            law_steps.learn(w, r, noise, by_phase, c[e + LAW_SQUARE], c[e + ASSUMED])
    w[b + OPENED] = 0.0
    w[r + law_steps.LAST_X] = w[r + law_steps.SEEN_X]
    w[r + law_steps.LAST_Y] = w[r + law_steps.SEEN_Y]
    w[r + law_steps.LAST_MOMENT_X] = w[r + law_steps.NOW_X]
    w[r + law_steps.LAST_MOMENT_Y] = w[r + law_steps.NOW_Y]
    if amplitude <= c[e + LIMIT]:
        w[b + RESTS] = 1.0
        return
    aim(c, k, p, q, w)


def control(c: Law, k: Cells, p: Pieces, q: Levels, w: Query, time: float) -> None:
    """Let a time pass, s, and sample the vibration if it is time to."""
    half = int(c[int(c[point.BLOCK]) + disc.PAIRS])
    for pair in range(half):
        disc.pass_pair(c, k, p, q, w, disc.FIRST_PAIR + disc.PER_PAIR * pair, time)
    r, first, period = host_row(c), chamber_of(c, 0), c[settings(c) + PERIOD]
    if valve_steps.waits(w, r + WAIT, first, 2 * half, period, time):
        return
    w[r + SAMPLES] += 1.0
    sample(c, k, p, q, w)
    w[r + WAIT] = valve_steps.longest_open(w, first, 2 * half) + period
