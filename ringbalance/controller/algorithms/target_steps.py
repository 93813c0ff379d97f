"""The target-vector controller in time, in + - * / sqrt and comparisons alone.

`c` holds its settings, `w` its memory with its inputs and outputs; the names below are indices into them.  It
samples the vibration as soon as its wait is over, answers with the time that each valve is to stay open, and
waits for the longest of these and one period more.  The program's loop compiles `sample`, an export
translates all, see `reduced_model.pieces.point`; the phase enters by the components of the vibration.
"""

from math import sqrt

from ringbalance.controller.algorithms.valve_steps import (
    AT_RESIDUAL,
    GAVE_NOTHING,
    GREATEST,
    OPEN_TIME,
    PER_CHAMBER,
    SHARE,
    longest_open,
    waits,
)
from ringbalance.reduced_model.pieces.point import Law, Query, larger, smaller
from ringbalance.scene.platform.both_ways import both_ways

# fmt: off
# Settings; from DIRECTIONS on, for each chamber both components of its direction, and its offset.
CHAMBERS, LIMIT, GAIN, PER_TIME, DERIVATIVE, LEAST, MOST, PERIOD, RESETS = 0, 1, 2, 3, 4, 5, 6, 7, 8
LAG_COSINE, LAG_SINE, AMPLITUDE_SQUARE, PHASE_SQUARE, DIRECTIONS = 9, 10, 11, 12, 13

VIBRATION_X, VIBRATION_Y, RESTING, SAMPLES, WAIT = 0, 1, 2, 3, 4
INTEGRAL, BEFORE_X, BEFORE_Y, BEFORE, SINCE, HAS_BEFORE, WANTED = 5, 6, 7, 8, 9, 10, 11
RESPONSE, FIRST_CHAMBER = 12, 13
# fmt: on

# A chamber is judged if its share is at least this fraction of the longest one, and its expected response at
# least this multiple of the noise; it gave nothing if less than this fraction of that response came.
OF_LONGEST, OF_NOISE, OF_EXPECTED = 0.5, 12.0, 0.1


@both_ways
def direction(c: Law, chamber: int) -> int:
    """Index of a chamber's direction; chamber numbers wrap, at most one round below or above."""
    count = int(c[CHAMBERS])
    at = chamber
    if at < 0:
        at = at + count
    if at >= count:
        at = at - count
    return DIRECTIONS + 3 * at


@both_ways
def place_of(c: Law, chamber: int) -> int:
    """Index of a chamber's memory, counted as for `direction`."""
    return FIRST_CHAMBER + PER_CHAMBER * ((direction(c, chamber) - DIRECTIONS) // 3)


@both_ways
def set_open_time(c: Law, w: Query, chamber: int, share: float) -> None:
    """Set a chamber's open time with its offset, unless its share is below the least.

    A chamber that gives nothing is tried for a period; the opposite one then has liquid again.
    """
    at = direction(c, chamber)
    row = place_of(c, chamber)
    time = share
    if w[row + GAVE_NOTHING] != 0.0:
        time = smaller(share, c[PERIOD])
    if time > 0.0 and time >= c[LEAST]:
        w[row + SHARE] = time
        w[row + OPEN_TIME] = smaller(time + c[at + 2], c[MOST])
        w[place_of(c, chamber + int(c[CHAMBERS]) // 2) + GAVE_NOTHING] = 0.0


@both_ways
def cross(c: Law, before: int, after: int) -> float:
    """Sine of the angle from one chamber to another."""
    a = direction(c, before)
    b = direction(c, after)
    return c[a] * c[b + 1] - c[a + 1] * c[b]


@both_ways
def emptied(c: Law, w: Query, chamber: int) -> bool:
    """True if a chamber has no more liquid to give, by a sensor or by its last response."""
    row = place_of(c, chamber)
    return w[row + AT_RESIDUAL] != 0.0 or w[row + GAVE_NOTHING] != 0.0


@both_ways
def judge(c: Law, w: Query, chamber: int, moved: float, longest: float, noise: float) -> None:
    """Judge if a chamber gave what its share calls for by the gain, or by the best response if less.

    Args: `moved`: vibration that it took away, m. `noise`: standard deviation of that, m.
    """
    row = place_of(c, chamber)
    time = w[row + SHARE]
    usual = 1.0
    if w[RESPONSE] > 0.0:
        usual = w[RESPONSE]
    if time >= OF_LONGEST * longest and usual * time > OF_NOISE * noise * c[GAIN]:
        w[row + GAVE_NOTHING] = 1.0
        if moved * c[GAIN] >= OF_EXPECTED * usual * time:
            w[row + GAVE_NOTHING] = 0.0
            w[RESPONSE] = smaller(1.0, larger(w[RESPONSE], moved * c[GAIN] / time))


@both_ways
def see_response(c: Law, w: Query) -> None:
    """Judge the chambers of the last command by the change of the vibration, and forget the command."""
    count = int(c[CHAMBERS])
    before = count
    after = count
    longest = 0.0
    chamber = 0
    while chamber < count:
        share = w[place_of(c, chamber) + SHARE]
        longest = larger(longest, share)
        if share > 0.0 and before < count:
            after = chamber
        if share > 0.0 and before == count:
            before = chamber
        chamber = chamber + 1
    if before == count:
        return
    x = w[VIBRATION_X]
    y = w[VIBRATION_Y]
    squares = x * x + y * y + w[BEFORE] * w[BEFORE]
    noise = sqrt(2.0 * c[AMPLITUDE_SQUARE] + squares * c[PHASE_SQUARE])
    x = w[BEFORE_X] - x
    y = w[BEFORE_Y] - y
    gas_x = x * c[LAG_COSINE] - y * c[LAG_SINE]
    gas_y = x * c[LAG_SINE] + y * c[LAG_COSINE]
    a = direction(c, before)
    if after == count:
        judge(c, w, before, gas_x * c[a] + gas_y * c[a + 1], longest, noise)
    else:
        b = direction(c, after)
        between = cross(c, before, after)
        noise = noise / larger(between, -between)
        judge(c, w, before, (gas_x * c[b + 1] - gas_y * c[b]) / between, longest, noise)
        judge(c, w, after, (gas_y * c[a] - gas_x * c[a + 1]) / between, longest, noise)
    chamber = 0
    while chamber < count:
        w[place_of(c, chamber) + SHARE] = 0.0
        chamber = chamber + 1


@both_ways
def nearest(c: Law, x: float, y: float) -> int:
    """First of the two neighbouring chambers between which a direction lies."""
    next_before = 0
    best = -2.0
    chamber = 0
    while chamber < int(c[CHAMBERS]):
        a = direction(c, chamber)
        b = direction(c, chamber + 1)
        projection = x * (c[a] + c[b]) + y * (c[a + 1] + c[b + 1])
        if projection > best:
            best = projection
            next_before = chamber
        chamber = chamber + 1
    return next_before


@both_ways
def split(c: Law, w: Query, x: float, y: float, time: float) -> None:
    """Open times of the two chambers on either side of a direction, each by its component."""
    if int(c[CHAMBERS]) == 2:
        set_open_time(c, w, 0, time * x)
        set_open_time(c, w, 1, -time * x)
        return
    count = int(c[CHAMBERS])
    middle = nearest(c, x, y)
    before = middle
    after = middle + 1
    while after - before < count and emptied(c, w, before):
        before = before - 1
    while after - before < count and emptied(c, w, after):
        after = after + 1
    if 2 * (after - before) >= count:
        before = middle
        after = middle + 1
    a = direction(c, before)
    b = direction(c, after)
    between = cross(c, before, after)
    set_open_time(c, w, before, time * larger(x * c[b + 1] - y * c[b], 0.0) / between)
    set_open_time(c, w, after, time * larger(y * c[a] - x * c[a + 1], 0.0) / between)


@both_ways
def set_wanted(c: Law, w: Query, amplitude: float) -> None:
    """Open time of the vector, s, by a PID on the amplitude; a limited time holds the integral."""
    w[WANTED] = c[GAIN] * amplitude
    if w[HAS_BEFORE] == 0.0 or not w[SINCE] > 0.0:
        return
    turned = w[VIBRATION_X] * w[BEFORE_X] + w[VIBRATION_Y] * w[BEFORE_Y] < 0.0 and c[RESETS] != 0.0
    summed = w[INTEGRAL] + (amplitude + w[BEFORE]) / 2.0 * w[SINCE]
    if turned:
        summed = 0.0
    slope = c[DERIVATIVE] * (amplitude - w[BEFORE]) / w[SINCE]
    w[WANTED] = c[GAIN] * (amplitude + summed * c[PER_TIME] + slope)
    if turned or w[WANTED] <= c[MOST]:
        w[INTEGRAL] = summed


@both_ways
def sample(c: Law, w: Query) -> None:
    """React to the vibration as it is; one that is not a number changes nothing."""
    x = w[VIBRATION_X]
    y = w[VIBRATION_Y]
    amplitude = sqrt(x * x + y * y)
    w[RESTING] = 0.0
    if not amplitude <= GREATEST:
        return
    see_response(c, w)
    if amplitude <= c[LIMIT]:
        w[RESTING] = 1.0
        w[INTEGRAL] = 0.0
        w[HAS_BEFORE] = 0.0
        return
    set_wanted(c, w, amplitude)
    w[BEFORE_X] = x
    w[BEFORE_Y] = y
    w[BEFORE] = amplitude
    w[SINCE] = 0.0
    w[HAS_BEFORE] = 1.0
    gas_x = (x * c[LAG_COSINE] - y * c[LAG_SINE]) / amplitude
    gas_y = (x * c[LAG_SINE] + y * c[LAG_COSINE]) / amplitude
    split(c, w, gas_x, gas_y, larger(0.0, smaller(w[WANTED], c[MOST])))


@both_ways
def step(c: Law, w: Query, time: float) -> None:
    """Let a time pass, s, and sample the vibration if it is time to."""
    w[SINCE] = w[SINCE] + time
    count = int(c[CHAMBERS])
    if waits(w, WAIT, FIRST_CHAMBER, count, c[PERIOD], time):
        return
    w[SAMPLES] = w[SAMPLES] + 1.0
    sample(c, w)
    w[WAIT] = longest_open(w, FIRST_CHAMBER, count) + c[PERIOD]
