"""Records of the closed loop: a record of settings, one for each run, rows of a trace.

A compiled function takes a record as a single pointer; arrays and tuples of arrays would be unpacked and
counted at every call, which costs more than the work itself.
"""

from __future__ import annotations

from typing import Final

import numpy as np

from ringbalance.controller.algorithms.law_steps import FIRST_CHANGE, PER_CHANGE
from ringbalance.controller.algorithms.target_steps import DIRECTIONS, FIRST_CHAMBER
from ringbalance.controller.algorithms.valve_steps import PER_CHAMBER
from ringbalance.controller.rotor import MAX_CHAMBERS

GAS_POINTS: Final = 8
"""Instants recorded within one command's valve-open time, besides the closing of each valve."""
TAIL_POINTS: Final = 12
"""Instants recorded within a wait, in which an operation continues after its valve has closed."""
PAIRS: Final = MAX_CHAMBERS // 2
MEMORY: Final = max(FIRST_CHANGE + PER_CHANGE * PAIRS, FIRST_CHAMBER + PER_CHAMBER * MAX_CHAMBERS)
"""Length of an algorithm's memory."""
TARGET_VECTOR: Final = 0
TRIAL: Final = 1
LAW_BASED: Final = 2
OWN: Final = 3
"""Algorithms by number; the last is the caller's, whose command is written into the run."""
NO_PHASE: Final = 1
USABLE: Final = 2
"""Content of a sample: nothing (0), an amplitude, or a phase as well."""
UNUSABLE: Final = 1
TOO_SHORT: Final = 2
"""Reasons for which no valve opens although the algorithm does not rest."""
NOTICEABLE_CHANGE: Final = 1e-12
"""Change of a fill ratio that counts as movement."""
NONE, RISING, IDLE, AT_REST, TIME, SAMPLES, HELD = range(7)
"""Causes for which a loop stopped cycling; it continues, or

    the amplitude rose after more operations in a row than the algorithm can explain,
    the time is up, and the longest injections of the last commands moved no liquid,
    the controller rests, the sensor is exact and no liquid can move: nothing will change,
    the time is up,
    there are as many samples as a run may have,
    the amplitude has been within its limit for the hold time and, but for few samples, for the watch time.
"""

_LOOP_REALS: Final = (
    "limit",  # m
    "period",  # s
    "hold_time",  # s
    "time_limit",  # s, by which the amplitude must have come within its limit
    "watch_time",  # s, for which it is watched after the hold time
    "allowed",  # samples above the limit in that time
    "amplitude_noise",  # standard deviation, m
    "phase_noise",  # standard deviation, rad
    "rest_limit",  # algorithm: amplitude at which it rests, m
    "minimum_gas_time",  # s
    "maximum_gas_time",  # s
    "probe",  # law-based: valve-open time where the law says that nothing flows, s
    "least_fill",  # to which a pair is driven
    "assumed_amplitude_noise",  # standard deviation, m
    "assumed_phase_noise",  # standard deviation, rad
    "law_deviation",  # standard deviation of the law's velocity, relative
)
_LOOP_INTEGERS: Final = (
    "algorithm",
    "sensed",  # 1 if the caller's sensor writes its sample into the run
    "exact",  # 1 if the sensor is without noise
    "to_time_limit",  # 1 if a settled run continues
    "chambers",
    "rises_tolerated",
    "idle_tolerated",
    "most_samples",
)
LOOP: Final = np.dtype(
    [(name, np.float64) for name in _LOOP_REALS]
    + [(name, np.int64) for name in _LOOP_INTEGERS]
    + [
        ("influence", np.complex128),  # that is assumed, m/(kg m)
        ("settings", np.float64, (DIRECTIONS + 3 * MAX_CHAMBERS,)),  # of `target_steps` or `trial_steps`
        ("offset", np.float64, (MAX_CHAMBERS,)),  # that the algorithm adds to a valve's share, s
        ("axis", np.complex128, (PAIRS,)),  # directions of the pairs
    ]
)
"""Settings of a scene's loop, which its devices share."""

_RUN_REALS: Final = (
    "noise_floor",  # rise of the amplitude that noise alone does not explain, m
    "speed",  # factor of the flow's velocity
    "residual_fill",  # of a driven chamber, that no command goes below
    "proportional",  # Kc, s/m
    "time",  # s
    "since",  # s, from which on the amplitude was not above the limit; infinite while it is
    "held_since",  # s, start of the hold that is watched or has settled; infinite for none
    "held",  # s, end of the hold time of that hold
    "above",  # samples above the limit since then
    "amplitude",  # true, m
    "initial_amplitude",  # m
    "drift",  # largest fill that has run back with the gas off
    "on",  # s, from the last command to the closing of its last valve
    "off",  # s, from then to the next sample
    "noted",  # s, of the last instant of the trace
    "seen_amplitude",  # of this sample, m
    "seen_phase",  # rad
    "first_seen",  # m, of the first sample; not a number where that showed none
    "last_seen",  # m, of the last sample that showed one
    "last_phase",  # rad, of the last one with a phase
    "before_time",  # s, of the last sample; target vector: of the last above the limit, infinite for none
    "before_amplitude",  # m
    "before_phase",  # law-based: rad
    "least_driven",  # least fill of a chamber whose valve opened; infinite where none did
    "gas",  # p V above ambient that vented chambers have released, and that leaked to ambient, Pa m^3
    "leaked",  # part of it that leaked, which passes no chamber
)
_RUN_INTEGERS: Final = (
    "loop",  # index of its settings
    "plant",  # index of its device
    "settled",  # 1 if a hold was followed by the watch time
    "lost",  # holds that were lost in the watch time
    "usable",
    "resting",  # 1 if the algorithm rests
    "reason",
    "floods",  # 1 if liquid runs through an empty tube with the gas off
    "cut",  # 1 if the time limit has shortened a valve-open time or a wait
    "operated",  # 1 if a valve has opened since the last sample with an amplitude
    "rises",
    "idle",
    "overshoots",
    "misadjustments",
    "shortened",  # injections ended by gas in the port before their valves closed
    "samples",
    "cause",
    "drains",  # 1 if liquid that still runs back would take the vibration above the limit
    "on_points",  # instants recorded within the valve-open time
    "off_points",  # instants recorded within the wait
    "instants",  # rows of the trace in use
    "injections",
)
_RUN_PAIRS: Final = (
    "fill",  # x of the chamber on the positive side
    "asked",  # valve-open time of the command, s, zero for none
    "drives",  # part of it in which gas drives liquid, s: until gas enters the port
    "lowest",  # least fill of the driven chamber after it, tail included
    "given",  # law-based: valve-open time of the last command, s
)
_RUN_FLAGS: Final = (
    "side",  # which chamber is driven: 0 the positive one, 1 the other
    "given_side",
    "runs_back",  # 1 if liquid still ran back as the last wait ended
)
RUN: Final = np.dtype(
    [(name, np.float64) for name in _RUN_REALS]
    + [(name, np.int64) for name in _RUN_INTEGERS]
    + [(name, np.complex128) for name in ("start", "gain", "vibration")]
    + [(name, np.float64, (PAIRS,)) for name in _RUN_PAIRS]
    + [(name, np.int64, (PAIRS,)) for name in _RUN_FLAGS]
    + [(name, np.int64, (MAX_CHAMBERS,)) for name in ("at_residual", "refused")]
    + [("memory", np.float64, (MEMORY,))]
)
"""One run: what differs between runs, its state and its algorithm's memory.

`start`: vibration with level chambers, m; `gain`: vibration per balancing moment, m/(kg m).
`at_residual`: 1 for every chamber that a sensor of the caller's reports to have no more liquid to give;
`refused`: 1 for every chamber whose port gas has entered in the last command. `memory`: of `target_steps`,
`trial_steps` or `law_steps`.
"""
INJECTION: Final = np.dtype(
    [
        (name, np.float64)
        for name in (
            "time",  # s, of the command
            "duration",  # s
            "fill_before",  # of the driven chamber
            "fill_after",
            "energy",  # J
            "closing_pressure",  # gauge, Pa
            "run_dry",  # s
        )
    ]
    + [(name, np.int64) for name in ("chamber", "regime_start", "regime_end", "event")]
)
SAMPLE: Final = np.dtype(
    [(name, np.float64) for name in ("time", "amplitude", "phase")]
    + [(name, np.int64) for name in ("resting", "reason")]
    + [("asked", np.float64, (PAIRS,)), ("side", np.int64, (PAIRS,))]
)
"""Rows of a trace; those of its instants are the time and every pair's fill."""
NOTES: Final = 2, 1 + PAIRS, PAIRS + GAS_POINTS + TAIL_POINTS
"""Shape of the notes between two samples, with the gas on and off."""
