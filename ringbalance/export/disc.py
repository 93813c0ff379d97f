"""The disc in time: fills and gas of every pair of chambers, in + - * / sqrt and comparisons alone.

Liquid moves as the law says (`point`), without mass of its own; gas fills and vents at once, or through the
scene's valve and line.  `c`, `k`, `p` and `q` are the law, with the disc's numbers behind its own, `w` the
disc's state with its inputs and outputs; the names below are indices into them.  A step is cut where a valve
moves and where a driven chamber comes to its residual fill, and then into parts of at most c[LONGEST], each
integrated by the classical Runge-Kutta method.  Source: `physics.gas` for the line, with its equations and
names.
"""

from math import sqrt

from ringbalance.reduced_model.pieces import point
from ringbalance.reduced_model.pieces.point import Cells, Law, Levels, Pieces, Query
from ringbalance.reduced_model.pieces.query import moment, set_answer

# fmt: off
# Constants from index c[point.BLOCK] on; from DIRECTIONS on, the direction of each pair's positive chamber.
PAIRS, TOTAL, PER_SECOND, VOLUME, DEAD, SUPPLY, LAG, RESIDUAL, LONGEST = 0, 1, 2, 3, 4, 5, 6, 7, 8
LINE, PASSING, CRITICAL, WARMTH, RATIO, TEMPERATURE_VARIES = 9, 10, 11, 12, 13, 14
OUTSIDE, LEAK, LEAK_IN = 15, 16, 17
START_X, START_Y, INFLUENCE_X, INFLUENCE_Y, DIRECTIONS = 18, 19, 20, 21, 22

# State of the disc; then work values of a part of a step.
MOMENT_X, MOMENT_Y, VIBRATION_X, VIBRATION_Y = 40, 41, 42, 43
STATES, RATES, BEFORE, SUM, FIRST_PAIR, PER_PAIR = 5, 44, 49, 54, 59, 18
# State of a pair: integrated states, tube, and values of both chambers.
X, GAS, CONTENT, IS_PRIMED, ASKED, LIQUID, HELD, VALVE, OPENS, CLOSES = 0, 1, 3, 5, 6, 8, 10, 12, 14, 16
# fmt: on

LAMINAR, LEAST_GAS, CLOSE, SHORTEST = 0.999, 1e-3, 1e-9, 1e-7


def gas_volume(c: Law, fill: float) -> float:
    """Volume of the gas that belongs to a chamber, m^3."""
    d = int(c[point.BLOCK])
    return point.larger(1.0 - fill, LEAST_GAS) * c[d + VOLUME] + c[d + DEAD]


def passed(c: Law, ratio: float) -> float:
    """Mass flow over its choked value by the ratio of the pressures."""
    b = c[int(c[point.BLOCK]) + CRITICAL]
    if ratio <= b:
        return 1.0
    turbulent = point.smaller(ratio, point.larger(LAMINAR, b))
    part = (turbulent - b) / (1.0 - b)
    ellipse = sqrt(point.larger(1.0 - part * part, 0.0))
    if ratio > turbulent:
        return ellipse * (1.0 - ratio) / (1.0 - turbulent)
    return ellipse


def add_gas_flow(
    c: Law, w: Query, at: int, side: int, volume: float, growth: float, passing: float, outside: float
) -> None:
    """Add the rates of a chamber's gas by the flow through one conductance to a pressure outside."""
    d = int(c[point.BLOCK])
    pressure, warmth = w[at + GAS + side], c[d + WARMTH]
    if pressure <= outside:
        flow = passing * outside * passed(c, pressure / outside)
    else:
        if c[d + TEMPERATURE_VARIES] != 0.0:
            warmth = pressure * volume / point.larger(w[at + CONTENT + side], 1e-9 * volume)
        flow = -passing * sqrt(warmth / c[d + WARMTH]) * pressure * passed(c, outside / pressure)
    w[RATES + GAS + side] += (flow - pressure * growth) * c[d + RATIO] / volume
    w[RATES + CONTENT + side] += flow / warmth


def set_gas_rates(c: Law, w: Query, at: int, side: int, fill: float, growth: float) -> None:
    """Rates of a chamber's pressure, Pa/s, and content p V/T, W/K, with the growth of its volume, m^3/s."""
    d = int(c[point.BLOCK])
    w[RATES + GAS + side] = w[RATES + CONTENT + side] = 0.0
    if c[d + LINE] == 0.0:
        return
    volume, outside, leak_in = gas_volume(c, fill), c[d + OUTSIDE], c[d + LEAK_IN]
    if w[at + VALVE + side] != 0.0:
        outside, leak_in = c[d + SUPPLY], 0.0
    add_gas_flow(c, w, at, side, volume, growth, c[d + PASSING], outside)
    if c[d + LEAK] > 0.0:
        add_gas_flow(c, w, at, side, volume, 0.0, c[d + LEAK], c[d + OUTSIDE])
    if leak_in > 0.0:
        add_gas_flow(c, w, at, side, volume, 0.0, leak_in, c[d + SUPPLY])


def set_tube(c: Law, k: Cells, p: Pieces, q: Levels, w: Query, at: int) -> None:
    """Velocity out of a pair's positive chamber, by the law."""
    point.set_levels(
        c, k, q, w, point.within(c, w[at + X]), point.within(c, c[int(c[point.BLOCK]) + TOTAL] - w[at + X])
    )
    w[point.UP_GAS] = c[point.GAS_FACTOR] * (w[at + GAS] - c[point.AMBIENT])
    w[point.DOWN_GAS] = c[point.GAS_FACTOR] * (w[at + GAS + 1] - c[point.AMBIENT])
    w[point.PRIMED] = w[at + IS_PRIMED]
    if set_answer(c, k, p, w):
        w[point.VELOCITY] = -w[point.VELOCITY]


def keep_primed(w: Query, flag: int) -> None:
    """Record if the tube holds a continuous column; unchanged while a separated column flows."""
    if w[point.PRIMED_AFTER] != 0.0:
        w[flag] = 1.0
    elif w[point.REGIME] == point.BLOCKED:
        w[flag] = 0.0


def set_rates(c: Law, k: Cells, p: Pieces, q: Levels, w: Query, at: int) -> None:
    """Rates of a pair's fill, 1/s, and of its gases."""
    d = int(c[point.BLOCK])
    set_tube(c, k, p, q, w, at)
    x, total = w[at + X], c[d + TOTAL]
    rate = -c[d + PER_SECOND] * w[point.VELOCITY]
    if rate < 0.0 and x <= point.larger(0.0, total - c[point.LARGEST_FILL]):
        rate = 0.0
    if rate > 0.0 and x >= point.smaller(total, c[point.LARGEST_FILL]):
        rate = 0.0
    w[RATES] = rate
    growth = rate * c[d + VOLUME]
    set_gas_rates(c, w, at, 0, x, -growth)
    set_gas_rates(c, w, at, 1, total - x, growth)


def take(w: Query, at: int, weight: float, time: float) -> None:
    """Add weighted rates to their sum, and set the state that they give a time after a part's beginning."""
    for i in range(STATES):
        w[SUM + i] += weight * w[RATES + i]
        w[at + i] = w[BEFORE + i] + time * w[RATES + i]


def move(c: Law, k: Cells, p: Pieces, q: Levels, w: Query, at: int, time: float) -> None:
    """One part of a step of a pair."""
    for i in range(STATES):
        w[BEFORE + i] = w[at + i]
        w[SUM + i] = 0.0
    set_rates(c, k, p, q, w, at)
    take(w, at, 1.0, time / 2.0)
    set_rates(c, k, p, q, w, at)
    take(w, at, 2.0, time / 2.0)
    set_rates(c, k, p, q, w, at)
    take(w, at, 2.0, time)
    set_rates(c, k, p, q, w, at)
    take(w, at, 1.0, time)
    for i in range(STATES):
        w[at + i] = w[BEFORE + i] + time / 6.0 * w[SUM + i]
    total, most = c[int(c[point.BLOCK]) + TOTAL], c[point.LARGEST_FILL]
    w[at + X] = point.larger(
        point.larger(0.0, total - most), point.smaller(w[at + X], point.smaller(total, most))
    )


def command(c: Law, w: Query, at: int) -> None:
    """Valves open and close a lag after their command."""
    lag = c[int(c[point.BLOCK]) + LAG]
    for side in range(2):
        if w[at + ASKED + side] > 0.0:
            if w[at + CLOSES + side] <= 0.0:
                w[at + HELD] = w[at + HELD + 1] = 0.0
                w[at + OPENS + side] = lag
                if lag <= 0.0:
                    w[at + VALVE + side] = 1.0
            w[at + CLOSES + side] = w[at + ASKED + side] + lag


def settle(c: Law, k: Cells, p: Pieces, q: Levels, w: Query, at: int) -> None:
    """Before a part: valves close at the residual fill, gas may fill at once, the tube may be primed."""
    d = int(c[point.BLOCK])
    side, fill = 0, w[at + X]
    while side < 2:
        if w[at + VALVE + side] != 0.0 and fill - c[d + RESIDUAL] < CLOSE:
            w[at + VALVE + side] = w[at + OPENS + side] = w[at + CLOSES + side] = 0.0
            w[at + HELD + side] = 1.0
        if c[d + LINE] == 0.0:
            w[at + GAS + side] = c[point.AMBIENT]
            if w[at + VALVE + side] != 0.0:
                w[at + GAS + side] = c[d + SUPPLY]
        fill = c[d + TOTAL] - w[at + X]
        side += 1
    set_tube(c, k, p, q, w, at)
    keep_primed(w, at + IS_PRIMED)


def length(c: Law, w: Query, at: int, left: float) -> float:
    """Length of the next part, s: until a valve moves, or a driven chamber comes to its residual fill."""
    d = int(c[point.BLOCK])
    part = point.smaller(left, c[d + LONGEST])
    falls = c[d + PER_SECOND] * w[point.VELOCITY]
    fill = w[at + X]
    for side in range(2):
        if w[at + OPENS + side] > 0.0:
            part = point.smaller(part, w[at + OPENS + side])
        if w[at + CLOSES + side] > 0.0:
            part = point.smaller(part, w[at + CLOSES + side])
        if w[at + VALVE + side] != 0.0 and falls > 0.0:
            part = point.smaller(part, point.larger((fill - c[d + RESIDUAL]) / falls, SHORTEST))
        fill = c[d + TOTAL] - w[at + X]
        falls = -falls
    return part


def tick(w: Query, at: int, time: float) -> None:
    """Advance the clocks of the valves."""
    for side in range(2):
        if w[at + OPENS + side] > 0.0:
            w[at + OPENS + side] -= time
            if w[at + OPENS + side] <= 0.0:
                w[at + OPENS + side] = 0.0
                w[at + VALVE + side] = 1.0
        if w[at + CLOSES + side] > 0.0:
            w[at + CLOSES + side] -= time
            if w[at + CLOSES + side] <= 0.0:
                w[at + CLOSES + side] = w[at + VALVE + side] = 0.0


def show(c: Law, k: Cells, p: Pieces, w: Query) -> None:
    """Show fills, the disc's moment, kg m, and the vibration with it, m."""
    d = int(c[point.BLOCK])
    w[MOMENT_X] = w[MOMENT_Y] = 0.0
    for pair in range(int(c[d + PAIRS])):
        at, axis = FIRST_PAIR + PER_PAIR * pair, d + DIRECTIONS + 2 * pair
        w[at + LIQUID] = w[at + X]
        w[at + LIQUID + 1] = c[d + TOTAL] - w[at + X]
        difference = moment(c, k, p, w[at + LIQUID]) - moment(c, k, p, w[at + LIQUID + 1])
        w[MOMENT_X] += difference * c[axis]
        w[MOMENT_Y] += difference * c[axis + 1]
    x = c[d + INFLUENCE_X] * w[MOMENT_X] - c[d + INFLUENCE_Y] * w[MOMENT_Y]
    y = c[d + INFLUENCE_X] * w[MOMENT_Y] + c[d + INFLUENCE_Y] * w[MOMENT_X]
    w[VIBRATION_X] = c[d + START_X] + x
    w[VIBRATION_Y] = c[d + START_Y] + y


def pass_pair(c: Law, k: Cells, p: Pieces, q: Levels, w: Query, at: int, time: float) -> None:
    """Let a time pass, s, for one pair."""
    left = time
    while left > 0.0:
        settle(c, k, p, q, w, at)
        part = length(c, w, at, left)
        move(c, k, p, q, w, at, part)
        tick(w, at, part)
        left -= part


def step(c: Law, k: Cells, p: Pieces, q: Levels, w: Query, time: float) -> None:
    """Let a time pass, s, with each valve open from its beginning on for its commanded time."""
    for pair in range(int(c[int(c[point.BLOCK]) + PAIRS])):
        at = FIRST_PAIR + PER_PAIR * pair
        command(c, w, at)
        pass_pair(c, k, p, q, w, at, time)
    show(c, k, p, w)
