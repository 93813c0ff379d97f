"""Learning and splitting of a correction by the law-based algorithm, in + - * / sqrt and comparisons alone.

The program's loop compiles these functions and an export translates them, see `reduced_model.pieces.point`.
`m` is a row of numbers with the algorithm's memory from index `r` on; the names below are indices into that
memory, all SI.
"""

from math import sqrt

from ringbalance.reduced_model.pieces.point import Query, larger, smaller
from ringbalance.scene.platform.both_ways import both_ways

# fmt: off
# Vibration of this sample and the one before, the disc's moment at both, and the influence coefficient
# with the mean square of its error, of both components together.
SEEN_X, SEEN_Y, LAST_X, LAST_Y, NOW_X, NOW_Y, LAST_MOMENT_X, LAST_MOMENT_Y = 0, 1, 2, 3, 4, 5, 6, 7
LEARNT_X, LEARNT_Y, VARIANCE, FIRST_CHANGE, PER_CHANGE = 8, 9, 10, 11, 9
# For each pair: requested change of its moment, bounds of this change, sign of the bound that it is at, and
# direction; then moment, change expected of the last operation, and sense in which the pair gave nothing.
CHANGE, LOWEST_CHANGE, HIGHEST_CHANGE, FIXED, AXIS_X, AXIS_Y = 0, 1, 2, 3, 4, 5
MOMENT_NOW, SHOULD, GAVE_NOTHING = 6, 7, 8
# fmt: on

MAGNITUDE_RANGE, NEARLY = 10.0, 1e-12
# Ratios of squares: a response is not the expected one where it deviates by more than this many variances; a
# pair gave nothing where the deviation from the response without that pair is smaller by this factor.
DEVIATIONS, NEARER = 9.0, 9.0


@both_ways
def change_of(r: int, pair: int) -> int:
    """Index of a pair's numbers."""
    return r + FIRST_CHANGE + PER_CHANGE * pair


@both_ways
def set_should(m: Query, r: int, pair: int, moment: float, opened: bool) -> None:
    """Set the expected change of a pair's moment, kg m: by the estimated liquid, or as requested of a try."""
    at = change_of(r, pair)
    m[at + SHOULD] = 0.0
    if opened:
        m[at + SHOULD] = moment - m[at + MOMENT_NOW]
        if m[at + GAVE_NOTHING] != 0.0:
            m[at + SHOULD] = m[at + CHANGE]


@both_ways
def distance(m: Query, r: int, ux: float, uy: float) -> float:
    """Squared difference of the vibration's change from that expected of a change of the moment, m^2."""
    x = m[r + SEEN_X] - m[r + LAST_X] - (m[r + LEARNT_X] * ux - m[r + LEARNT_Y] * uy)
    y = m[r + SEEN_Y] - m[r + LAST_Y] - (m[r + LEARNT_X] * uy + m[r + LEARNT_Y] * ux)
    return x * x + y * y


@both_ways
def see_response(m: Query, r: int, half: int, amplitude_square: float, phase_square: float) -> bool:
    """Judge if the vibration has not moved as it should, and if one pair that gave nothing explains it.

    Differences that noise or the present error of the influence coefficient can make do not count. Any other
    pair whose command would show above the noise gives liquid.
    Returns: false if an opened pair gives nothing, so that its estimated liquid has not moved.
    """
    x = m[r + SEEN_X]
    y = m[r + SEEN_Y]
    seen = x * x + y * y + m[r + LAST_X] * m[r + LAST_X] + m[r + LAST_Y] * m[r + LAST_Y]
    noise = 2.0 * amplitude_square + phase_square * seen
    square = m[r + LEARNT_X] * m[r + LEARNT_X] + m[r + LEARNT_Y] * m[r + LEARNT_Y]
    ux = 0.0
    uy = 0.0
    followed = True
    pair = 0
    while pair < half:
        at = change_of(r, pair)
        ux = ux + m[at + SHOULD] * m[at + AXIS_X]
        uy = uy + m[at + SHOULD] * m[at + AXIS_Y]
        if m[at + SHOULD] != 0.0 and m[at + GAVE_NOTHING] != 0.0:
            followed = False
        pair = pair + 1
    off = distance(m, r, ux, uy)
    best = 0.0
    if off > DEVIATIONS * (noise + m[r + VARIANCE] * (ux * ux + uy * uy)):
        best = off / NEARER
    nothing = half
    pair = 0
    while pair < half:
        at = change_of(r, pair)
        should = m[at + SHOULD]
        if should * should * square > DEVIATIONS * noise:
            m[at + GAVE_NOTHING] = 0.0
            without = distance(m, r, ux - should * m[at + AXIS_X], uy - should * m[at + AXIS_Y])
            if without < best:
                best = without
                nothing = pair
        pair = pair + 1
    if nothing < half:
        at = change_of(r, nothing)
        m[at + GAVE_NOTHING] = 1.0
        if m[at + SHOULD] < 0.0:
            m[at + GAVE_NOTHING] = -1.0
        followed = False
    return followed


@both_ways
def set_bounds(m: Query, r: int, pair: int, now: float, least: float, most: float) -> None:
    """Set the bounds of a pair's change by its moments, kg m; zero in the sense in which it gave nothing."""
    at = change_of(r, pair)
    m[at + LOWEST_CHANGE] = least - now
    m[at + HIGHEST_CHANGE] = most - now
    if m[at + GAVE_NOTHING] < 0.0:
        m[at + LOWEST_CHANGE] = 0.0
    if m[at + GAVE_NOTHING] > 0.0:
        m[at + HIGHEST_CHANGE] = 0.0


@both_ways
def is_try(m: Query, r: int, pair: int, side: int) -> bool:
    """True if a chamber gave nothing before; opening the opposite one gives it liquid again."""
    at = change_of(r, pair)
    sense = 1.0
    if side == 0:
        sense = -1.0
    if m[at + GAVE_NOTHING] * sense <= 0.0:
        m[at + GAVE_NOTHING] = 0.0
    return m[at + GAVE_NOTHING] != 0.0


@both_ways
def learn(
    m: Query, r: int, amplitude_square: float, phase_square: float, law_square: float, assumed: float
) -> None:
    """Learn K from one operation, dV = K dU + noise, by a Kalman filter of one complex number.

    gain = P dU* / (P |dU|^2 + R), K <- K + gain (dV - K dU), P <- P R/(P |dU|^2 + R), with R the variance of
    the noise and of (s |K dU|)^2: a response that noise could have made moves K little, and no moment counts
    as better known than by s, the relative standard deviation of the law.  P never falls below (s |K|)^2, so
    the estimate keeps following; |K| stays within `MAGNITUDE_RANGE` of the assumed one, for no response
    proves no coefficient.  Variances of amplitude, phase and s are given.
    Source: Kalman, "A New Approach to Linear Filtering and Prediction Problems", J. Basic Eng. 82 (1960).
    """
    x = m[r + SEEN_X]
    y = m[r + SEEN_Y]
    ux = m[r + NOW_X] - m[r + LAST_MOMENT_X]
    uy = m[r + NOW_Y] - m[r + LAST_MOMENT_Y]
    kx = m[r + LEARNT_X]
    ky = m[r + LEARNT_Y]
    expected = (ux * ux + uy * uy) * m[r + VARIANCE]
    if expected == 0.0:
        return
    seen = x * x + y * y + m[r + LAST_X] * m[r + LAST_X] + m[r + LAST_Y] * m[r + LAST_Y]
    px = kx * ux - ky * uy
    py = kx * uy + ky * ux
    rest = 2.0 * amplitude_square + phase_square * seen + law_square * (px * px + py * py)
    gain = m[r + VARIANCE] / (expected + rest)
    dx = x - m[r + LAST_X] - px
    dy = y - m[r + LAST_Y] - py
    vx = kx + gain * (ux * dx + uy * dy)
    vy = ky + gain * (ux * dy - uy * dx)
    magnitude = sqrt(vx * vx + vy * vy)
    bounded = smaller(larger(magnitude, assumed / MAGNITUDE_RANGE), assumed * MAGNITUDE_RANGE)
    if magnitude == 0.0:
        vx = kx
        vy = ky
        magnitude = sqrt(kx * kx + ky * ky)
    m[r + LEARNT_X] = vx * (bounded / magnitude)
    m[r + LEARNT_Y] = vy * (bounded / magnitude)
    m[r + VARIANCE] = larger(m[r + VARIANCE] * rest / (expected + rest), law_square * bounded * bounded)


@both_ways
def shared(m: Query, before: int, sign: float, after: int, after_sign: float, x: float, y: float) -> bool:
    """Split a vector over two pairs if it lies between their signed directions; true if it does."""
    ax = sign * m[before + AXIS_X]
    ay = sign * m[before + AXIS_Y]
    bx = after_sign * m[after + AXIS_X]
    by = after_sign * m[after + AXIS_Y]
    between = ax * by - ay * bx
    part_before = (x * by - y * bx) / between
    part_after = (ax * y - ay * x) / between
    slack = -NEARLY * sqrt(x * x + y * y)
    if part_before < slack or part_after < slack:
        return False
    m[before + CHANGE] = sign * larger(part_before, 0.0)
    m[after + CHANGE] = after_sign * larger(part_after, 0.0)
    return True


@both_ways
def share(m: Query, r: int, half: int, x: float, y: float) -> None:
    """Components along the two free neighbouring directions; along the axis when only one is free."""
    free = 0
    last = r
    pair = 0
    while pair < half:
        at = change_of(r, pair)
        if m[at + FIXED] == 0.0:
            free = free + 1
            last = at
        pair = pair + 1
    if free == 1:
        m[last + CHANGE] = x * m[last + AXIS_X] + y * m[last + AXIS_Y]
    if free < 2:
        return
    # One round over the free axes in both senses, from the negative last one to the first and onwards.
    sign = -1.0
    turn = 0
    while turn < 2 * half:
        pair = turn
        pair_sign = 1.0
        if turn >= half:
            pair = turn - half
            pair_sign = -1.0
        at = change_of(r, pair)
        if m[at + FIXED] == 0.0:
            if shared(m, last, sign, at, pair_sign, x, y):
                return
            last = at
            sign = pair_sign
        turn = turn + 1


@both_ways
def stopped(m: Query, at: int) -> bool:
    """Take the change of a free pair to the bound that it exceeds; true if it exceeds one."""
    bounded = smaller(larger(m[at + CHANGE], m[at + LOWEST_CHANGE]), m[at + HIGHEST_CHANGE])
    if m[at + FIXED] != 0.0 or bounded == m[at + CHANGE]:
        return False
    m[at + FIXED] = -1.0
    if m[at + CHANGE] > bounded:
        m[at + FIXED] = 1.0
    m[at + CHANGE] = bounded
    return True


@both_ways
def left_of(m: Query, r: int, half: int, value: float, axis: int) -> float:
    """Component of a vector that is left behind the changes of all pairs."""
    left = value
    pair = 0
    while pair < half:
        left = left - m[change_of(r, pair) + CHANGE] * m[change_of(r, pair) + axis]
        pair = pair + 1
    return left


@both_ways
def split(m: Query, r: int, half: int, x: float, y: float) -> None:
    """Split a change of the disc's moment over its pairs, kg m, each within its bounds.

    The change goes to the two directions on either side of it; what a pair cannot give goes to the pairs that
    are left; what no pair can give is asked, by its component, of those already at their ends, for the fills
    are only assumed.
    Source: section 4.2 of the liquid-ring paper, by oblique components for other numbers of chambers.
    """
    pair = 0
    while pair < half:
        m[change_of(r, pair) + FIXED] = 0.0
        pair = pair + 1
    rounds = 0
    over = True
    while over and rounds < half:
        pair = 0
        while pair < half:
            if m[change_of(r, pair) + FIXED] == 0.0:
                m[change_of(r, pair) + CHANGE] = 0.0
            pair = pair + 1
        share(m, r, half, left_of(m, r, half, x, AXIS_X), left_of(m, r, half, y, AXIS_Y))
        over = False
        pair = 0
        while pair < half:
            if stopped(m, change_of(r, pair)):
                over = True
            pair = pair + 1
        rounds = rounds + 1
    left_x = left_of(m, r, half, x, AXIS_X)
    left_y = left_of(m, r, half, y, AXIS_Y)
    pair = 0
    while pair < half:
        at = change_of(r, pair)
        more = left_x * m[at + AXIS_X] + left_y * m[at + AXIS_Y]
        # Only in the sense in which the pair was asked for more than it has.
        if m[at + FIXED] * more > 0.0:
            m[at + CHANGE] = m[at + CHANGE] + more
        pair = pair + 1
