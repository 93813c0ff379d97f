"""What compiled code works on: one record of what members share, and one record for each member's run.

Compiled functions take a record as a single pointer, where arrays and tuples of arrays are taken apart and
counted at every call, which costs more than the work itself.
"""

from __future__ import annotations

from typing import Any, Final

import numpy as np

from ringbalance.controller.rotor import MAX_CHAMBERS

MOMENT_NODES: Final = 4097
"""Of the table of a pair's moment."""
Record = Any
"""One element of an array with one of the types below; compiled code changes it in place."""

_REAL: Final = (
    "total",  # x_A + x_C
    "lowest",  # smallest x
    "initial_fill",
    "moment_step",  # between the nodes of the moment's table, in x
    "start_real",  # vibration with level chambers, m
    "start_imaginary",
    "limit",  # m
    "period",  # s
    "hold_time",  # s
    "time_limit",  # s
    "amplitude_noise",  # standard deviation, m
    "phase_noise",  # standard deviation, rad
    "noise_floor",  # m
    "assumed_lag",  # rad
    "integral_time",  # s, infinite for no integral part
    "derivative_time",  # s
    "minimum_gas_time",  # s
    "maximum_gas_time",  # s
)
_WHOLE: Final = (
    "floods",  # whether liquid runs through an unprimed tube with the gas off
    "chambers",
    "rises_tolerated",
    "idle_tolerated",
    "asymmetric",  # whether a pair has a moment across its axis
    "gas_points",
    "tail_points",
    "most_samples",
)
SHARED: Final = np.dtype(
    [(name, np.float64) for name in _REAL]
    + [(name, np.int64) for name in _WHOLE]
    + [(name, np.uint64) for name in ("key_0", "key_1")]
    + [
        ("moment", np.float64, (MOMENT_NODES, 4)),  # of a pair: value, slope per step; both across its axis
        ("axis", np.float64, (MAX_CHAMBERS // 2, 2)),  # directions of the pairs
        ("offset", np.float64, (MAX_CHAMBERS,)),  # added to a valve's share, s
    ]
)
"""What all members of an ensemble share."""

_RUN_REAL: Final = (
    "speed",  # factor of the flow's velocity
    "residual_fill",  # of a driven chamber, that no command goes below
    "gain_real",  # vibration per balancing moment, m/(kg m)
    "gain_imaginary",
    "proportional",  # Kc, s/m
    "time",  # s
    "since",  # s, from which on the amplitude was not above the limit; infinite while it is
    "real",  # of the true vibration, m
    "imaginary",
    "amplitude",  # true, m
    "phase",  # true, rad
    "phase_before",  # true, rad, at the sample before
    "certain",  # uniform number from which on no noise lifts the amplitude above the limit
    "seen_amplitude",  # of this sample, m
    "seen_phase",  # rad
    "first_seen",  # m, of the first sample
    "last_seen",  # m, of the last sample that was looked at
    "integral",  # what the controller remembers, m s
    "before_amplitude",  # of its last sample above the limit, m
    "before_phase",  # rad
    "before_time",  # s, infinite for none
    "duration",  # s, of the first open valve
    "other_duration",  # s, of the second
    "noise_before",  # of the phase of the last sample taken in full, in standard deviations
    "drift",  # how far liquid has run back with the gas off
    "start",  # first amplitude, m
    "real_before",  # vibration before the last command, m
    "imaginary_before",
    "settling_time",  # s, infinite when not settled
    "commanded",  # s, time for which a valve was commanded to be open before this wait
    "wait",  # s, from then to the next sample
)
_RUN_WHOLE: Final = (
    "noise_sample",  # its number in the run
    "number",  # of the member in the ensemble
    "pair",  # of the first open valve, -1 for none
    "first",  # whether it drives the positive side
    "other_pair",
    "other_first",
    "stays",  # whether an amplitude within its limit is expected to stay there
    "cut",  # whether the time limit has shortened a valve-open time or a wait
    "operated",  # whether a valve has opened since the last sample
    "stale",  # whether the vibration has changed since its phase was taken
    "calm",  # whether nothing has moved since the last sample and nothing can
    "rises",
    "idle",
    "overshoots",
    "misadjustments",
    "noted",  # instants at which the last injection and its wait were recorded
    "shortened",  # injections, to keep the residual fill
    "samples",
    "cause",
    "settled",
    "diverged",
    "drifted",
)
_RUN_PAIRS: Final = (
    "fill",  # x of the chamber on the positive side
    "wet",  # whether the tube holds a continuous column
    "fill_before",  # at the last command
    "trial",  # room for the fills at one instant
    "runs_back",  # whether liquid still ran back as the last wait ended
)
GAS_LINE: Final = ("passing", "critical_ratio", "dead_volume", "valve_lag")
"""Constants of a `PLANT` that belong to a chamber's gas line."""
RUN: Final = np.dtype(
    [(name, np.float64) for name in _RUN_REAL]
    + [(name, np.int64) for name in _RUN_WHOLE]
    + [(name, np.float64, (MAX_CHAMBERS // 2,)) for name in _RUN_PAIRS]
    + [("gas_line", np.float64, (len(GAS_LINE),)), ("at_residual", np.int64, (MAX_CHAMBERS,))]
)
"""One member's run; `gas_line`: its own values of `GAS_LINE`; `at_residual`: of every chamber, whether its
last injection was shortened to keep its residual fill, and none has filled it since."""
