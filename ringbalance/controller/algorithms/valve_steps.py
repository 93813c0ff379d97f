"""Valves and clock of the controllers, in + - * / and comparisons alone.

`w` holds for each chamber, from index `first` on: time for which its valve stays open, s; 1 if a sensor
reports that it has no more liquid to give; its share in the last command, s; 1 if that moved nothing.  A
vibration above `GREATEST` counts as none, a time up to `INSTANT` as elapsed.
"""

from ringbalance.reduced_model.pieces.point import Query, larger
from ringbalance.scene.platform.both_ways import both_ways

PER_CHAMBER, OPEN_TIME, AT_RESIDUAL, SHARE, GAVE_NOTHING = 4, 0, 1, 2, 3

GREATEST, INSTANT = 1e6, 1e-9


@both_ways
def longest_open(w: Query, first: int, chambers: int) -> float:
    """Time until the last valve closes, s."""
    longest = 0.0
    chamber = 0
    while chamber < chambers:
        longest = larger(longest, w[first + PER_CHAMBER * chamber + OPEN_TIME])
        chamber = chamber + 1
    return longest


@both_ways
def cut_short(w: Query, first: int, chambers: int, time: float) -> bool:
    """Let a time pass, s, and close valves of chambers with no more liquid; true if there were any."""
    cut = False
    chamber = 0
    while chamber < chambers:
        at = first + PER_CHAMBER * chamber
        w[at + OPEN_TIME] = w[at + OPEN_TIME] - time
        if w[at + OPEN_TIME] > INSTANT and w[at + AT_RESIDUAL] != 0.0:
            cut = True
            w[at + OPEN_TIME] = 0.0
        if w[at + OPEN_TIME] <= INSTANT:
            w[at + OPEN_TIME] = 0.0
        chamber = chamber + 1
    return cut


@both_ways
def waits(w: Query, wait: int, first: int, chambers: int, period: float, time: float) -> bool:
    """Let a time pass, s; true if the next sample is still to come, one period after the last valve."""
    w[wait] = w[wait] - time
    if cut_short(w, first, chambers, time):
        w[wait] = longest_open(w, first, chambers) + period
    return w[wait] > INSTANT
