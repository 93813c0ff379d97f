"""The trial controller in time, in + - * / sqrt and comparisons alone; used as `target_steps` is.

`c` holds its settings, `w` its memory with its inputs and outputs; the names below are indices into them.  It
reads the amplitude of the vibration alone.
"""

from math import sqrt

from ringbalance.controller.algorithms.valve_steps import (
    GREATEST,
    OPEN_TIME,
    PER_CHAMBER,
    longest_open,
    waits,
)
from ringbalance.reduced_model.pieces.point import Law, Query, smaller
from ringbalance.scene.platform.both_ways import both_ways

# fmt: off
# Settings; the chambers of the sequence come last.
CHAMBERS, LIMIT, LEAST, MOST, PERIOD, FIRST_TRIAL, LONG_STEP, SHORT_STEP = 0, 1, 2, 3, 4, 5, 6, 7
FINE_BELOW, TRIALS, SEQUENCE = 8, 9, 10

VIBRATION_X, VIBRATION_Y, RESTING, SAMPLES, WAIT = 0, 1, 2, 3, 4
POSITION, TRIED, BEFORE, FIRST_CHAMBER = 5, 6, 7, 8
# fmt: on


@both_ways
def sample(c: Law, w: Query) -> None:
    """React to the vibration as it is; one that is not a number changes nothing."""
    amplitude = sqrt(w[VIBRATION_X] * w[VIBRATION_X] + w[VIBRATION_Y] * w[VIBRATION_Y])
    w[RESTING] = 0.0
    if not amplitude <= GREATEST:
        return
    if amplitude <= c[LIMIT]:
        w[RESTING] = 1.0
        w[TRIED] = 0.0
        return
    fell = w[TRIED] != 0.0 and amplitude < w[BEFORE]
    if w[TRIED] != 0.0 and not fell:
        w[POSITION] = w[POSITION] + 1.0
        if w[POSITION] >= c[TRIALS]:
            w[POSITION] = 0.0
    opened = c[FIRST_TRIAL]
    if amplitude < c[FINE_BELOW]:
        opened = smaller(opened, c[SHORT_STEP])
    if fell:
        opened = c[LONG_STEP]
        if amplitude < c[FINE_BELOW]:
            opened = c[SHORT_STEP]
    w[TRIED] = 1.0
    w[BEFORE] = amplitude
    if opened > 0.0 and opened >= c[LEAST]:
        at = SEQUENCE + int(w[POSITION])
        w[FIRST_CHAMBER + PER_CHAMBER * int(c[at]) + OPEN_TIME] = smaller(opened, c[MOST])


@both_ways
def step(c: Law, w: Query, time: float) -> None:
    """Let a time pass, s, and sample the vibration if it is time to."""
    count = int(c[CHAMBERS])
    if waits(w, WAIT, FIRST_CHAMBER, count, c[PERIOD], time):
        return
    w[SAMPLES] = w[SAMPLES] + 1.0
    sample(c, w)
    w[WAIT] = longest_open(w, FIRST_CHAMBER, count) + c[PERIOD]
