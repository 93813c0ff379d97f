"""The target-vector controller in time, in + - * / sqrt and comparisons alone.

`c` holds its settings, `w` its memory with its inputs and outputs; the names below are places in them.  It
samples the vibration as soon as its wait is over, answers with the time that each valve is to stay open, and
waits for the longest of these and one period more.  Source: `controller.algorithms.built_in`, whose
`TargetVector` this is; the phase enters by the components of the vibration.
"""

from math import sqrt

from ringbalance.export.valves import (
    AT_RESIDUAL,
    GREATEST,
    INSTANT,
    OPEN_TIME,
    PER_CHAMBER,
    cut_short,
    longest_open,
)
from ringbalance.reduced_model.pieces.point import Law, Query, larger, smaller

# fmt: off
# Settings; of each chamber its direction, twice, so that what follows the last is the first, and its offset.
CHAMBERS, LIMIT, GAIN, PER_TIME, DERIVATIVE, LEAST, MOST, PERIOD, RESETS = 0, 1, 2, 3, 4, 5, 6, 7, 8
LAG_COSINE, LAG_SINE, DIRECTIONS = 9, 10, 11

VIBRATION_X, VIBRATION_Y, RESTING, SAMPLES, WAIT = 0, 1, 2, 3, 4
INTEGRAL, BEFORE_X, BEFORE_Y, BEFORE, SINCE, HAS_BEFORE, WANTED, FIRST_CHAMBER = 5, 6, 7, 8, 9, 10, 11, 12
# fmt: on


def direction(c: Law, chamber: int) -> int:
    """Place of a chamber's direction; chambers are counted on, a round below zero and a round above."""
    count = int(c[CHAMBERS])
    at = chamber
    if at < 0:
        at = at + count
    if at >= count:
        at = at - count
    return DIRECTIONS + 3 * at


def set_open_time(c: Law, w: Query, chamber: int, share: float) -> None:
    """Of a chamber with its offset, unless its share is below the least."""
    at = direction(c, chamber)
    if share > 0.0 and share >= c[LEAST]:
        place = FIRST_CHAMBER + PER_CHAMBER * ((at - DIRECTIONS) // 3)
        w[place + OPEN_TIME] = smaller(share + c[at + 2], c[MOST])


def cross(c: Law, before: int, after: int) -> float:
    """Sine of the angle from one chamber to another."""
    a = direction(c, before)
    b = direction(c, after)
    return c[a] * c[b + 1] - c[a + 1] * c[b]


def emptied(c: Law, w: Query, chamber: int) -> bool:
    """Whether a chamber has no more liquid to give."""
    place = FIRST_CHAMBER + PER_CHAMBER * ((direction(c, chamber) - DIRECTIONS) // 3)
    return w[place + AT_RESIDUAL] != 0.0


def nearest(c: Law, x: float, y: float) -> int:
    """The chamber before a direction, next to which it lies."""
    found = 0
    best = -2.0
    chamber = 0
    while chamber < int(c[CHAMBERS]):
        a = direction(c, chamber)
        b = direction(c, chamber + 1)
        along = x * (c[a] + c[b]) + y * (c[a + 1] + c[b + 1])
        if along > best:
            best = along
            found = chamber
        chamber = chamber + 1
    return found


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


def set_wanted(c: Law, w: Query, amplitude: float) -> None:
    """Open time of the vector, s, by a PID on the amplitude; the integral stands still where it is cut."""
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


def sample(c: Law, w: Query) -> None:
    """React to the vibration as it is; one that is not a number changes nothing."""
    x = w[VIBRATION_X]
    y = w[VIBRATION_Y]
    amplitude = sqrt(x * x + y * y)
    w[RESTING] = 0.0
    if not amplitude <= GREATEST:
        return
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
    along = (x * c[LAG_COSINE] - y * c[LAG_SINE]) / amplitude
    across = (x * c[LAG_SINE] + y * c[LAG_COSINE]) / amplitude
    split(c, w, along, across, larger(0.0, smaller(w[WANTED], c[MOST])))


def set_wait(c: Law, w: Query) -> None:
    """Until one period after the last valve has closed."""
    w[WAIT] = longest_open(w, FIRST_CHAMBER, int(c[CHAMBERS])) + c[PERIOD]


def step(c: Law, w: Query, time: float) -> None:
    """Let a time pass, s, and sample the vibration if it is time to."""
    w[SINCE] = w[SINCE] + time
    w[WAIT] = w[WAIT] - time
    if cut_short(w, FIRST_CHAMBER, int(c[CHAMBERS]), time):
        set_wait(c, w)
    if w[WAIT] > INSTANT:
        return
    w[SAMPLES] = w[SAMPLES] + 1.0
    sample(c, w)
    set_wait(c, w)
