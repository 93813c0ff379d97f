"""What both exported controllers do with valves, in + - * / and comparisons alone.

`w` holds of each chamber how long its valve stays open and whether it has no more liquid to give, from the
place `first` on.  A vibration above `GREATEST` is none, a time up to `INSTANT` is over.
"""

from ringbalance.reduced_model.pieces.point import Query, larger

PER_CHAMBER, OPEN_TIME, AT_RESIDUAL = 2, 0, 1

GREATEST, INSTANT = 1e6, 1e-9


def longest_open(w: Query, first: int, chambers: int) -> float:
    """How long the last valve stays open, s."""
    longest = 0.0
    chamber = 0
    while chamber < chambers:
        longest = larger(longest, w[first + PER_CHAMBER * chamber + OPEN_TIME])
        chamber = chamber + 1
    return longest


def cut_short(w: Query, first: int, chambers: int, time: float) -> bool:
    """Let a time pass, s, and close valves of chambers with no more liquid; whether there were any."""
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
