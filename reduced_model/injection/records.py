"""Records that compiled code works on: a plant's constants, and one pair of chambers in motion."""

from __future__ import annotations

from enum import StrEnum
from typing import Any, Final

import numpy as np


class Event(StrEnum):
    """What ended the flow before its time."""

    NONE = "none"
    BLOCKED = "blocked"
    """Nothing flowed from the start."""
    STALLED = "stalled"
    """The velocity fell to zero."""
    EMPTY = "empty"
    """The giving chamber ran empty."""
    FULL = "full"
    """The receiving chamber reached its largest fill."""
    UNFINISHED = "unfinished"
    """The bound on the number of steps was reached; the fills after that are the last ones found."""


Record = Any
"""One element of an array with one of the types below; compiled code changes it in place."""

HYDROSTATIC: Final = 0
"""P(x), Pa."""
HEAD: Final = 1
"""ln((k + 1) u^2/2) over ln u."""
TO_CREST: Final = 2
"""ln((alpha + k_up) u^2/2) over ln u, flow out of chamber 0."""
RETURN_CREST: Final = 3
"""The same for flow out of chamber 1."""
FLOWS: Final = ((True, True), (True, False), (False, True), (False, False))
"""Whether gas is on and the tube primed, in the tables of a law that gives velocities alone."""
PIECES: Final = 4096
"""Room for the pieces of a table, fixed, so that compiled code serves every law."""

_PLANT_REAL: Final = (
    "density",  # kg/m^3
    "length",  # L, m
    "crest_end",  # fraction of the path to the end of the crest's arc, flow out of chamber 0
    "return_crest_end",  # the same for flow out of chamber 1
    "port_pressure",  # D_p, Pa
    "column_pressure",  # D_m, Pa; of a one-way law the level above which liquid leaves a vented chamber
    "vapour_pressure",  # gauge, Pa
    "released",  # as in `SiphonCrest`
    "froude_velocity",  # m/s
    "lift_straight",  # of `Lift`
    "lift_entrance",
    "hold_up",  # S L/V, fill ratio that the whole tube takes
    "gas_off",  # gauge, Pa, at or below which a chamber counts as without gas under a one-way law
    "gas_factor",  # gas pressure on the liquid over the one at the place of measurement
    "valve_lag",  # s
    "gas_pressure",  # of the supply, gauge, Pa
    "ambient_pressure",  # absolute, Pa
    "temperature",  # of supply and surroundings, K
    "passing",  # C p_0 sqrt(T/T_0) of the line with gas of that temperature, m^3/s
    "critical_ratio",
    "heat_capacity_ratio",  # exponent of the gas: 1 isothermal, gamma adiabatic
    "dead_volume",  # m^3
    "tube_area",  # S, m^2
    "chamber_volume",  # V, m^3
    "max_fill_ratio",
    "total",  # x_A + x_C
    "residual",  # of a single run, as below
    "relative_error",  # allowed to one step
    "first_step",  # s, after a jump of the rates
)
_PLANT_WHOLE: Final = (
    "crest",  # whether there is one
    "trapped",
    "one_way",  # whether liquid leaves only a chamber with gas or a high level, as under the paper's Eq. 19
    "inertia",
    "tabled",  # whether the law gives velocities alone, which `cells` then hold by fill
    "lifts",  # whether an unprimed tube is filled up to the crest before liquid passes
    "line",  # whether valve and line take time to pass gas
    "most_steps",
)
PLANT: Final = np.dtype(
    [(name, np.float64) for name in _PLANT_REAL]
    + [(name, np.int64) for name in _PLANT_WHOLE]
    + [
        ("table_start", np.float64, (4,)),
        ("nodes_per", np.float64, (4,)),  # unit of the argument
        ("pieces", np.int64, (4,)),
        ("cells", np.float64, (4, PIECES, 6)),
    ]
)
"""Constants of a plant with moving liquid, filling gas and late valves."""

X: Final = 0
U: Final = 1
P: Final = 2
Q: Final = 3
WORK: Final = 6
_MOTION_REAL: Final = (
    "opens",  # s from now until the valve of `chamber` opens, infinite for never
    "closes",
    "log_speed",  # of the factor on the law's velocity
    "length",  # of the next step, s
    "now",  # s since the interval began
    "started",  # x at the last start
    "ran_back",  # change of x by flow out of the chamber not driven last, both valves closed
    "fill_before",  # of the driven chamber at the command
    "least_fill",  # of the driven chamber since
    "residual",  # fill of a driven chamber that no command goes below
    "closing_pressure",  # of the driven chamber's gas when its valve closed, gauge, Pa
    "ended",  # s since the interval began, at which the flow out of the driven chamber last ended
    "filled",  # s since the interval began, at which the tube was first primed; below zero for not yet
    "run_dry",  # time for which its valve stays open to the empty chamber, s
    "front",  # fraction of the path up to which liquid stood in the tube at `started`, from chamber `side`
)
_MOTION_WHOLE: Final = (
    "primed",
    "valve_0",  # whether open
    "valve_1",
    "direction",  # +1 out of chamber 0, -1 out of chamber 1, 0 at rest
    "balanced",  # whether a further start would be round-off
    "stopped",  # direction of the last flow that ended
    "steps",
    "noted",  # instants of the interval that are over
    "chamber",  # 0 or 1: the one driven last
    "regime_start",  # values of `Regime`
    "regime_end",
    "event",  # index into `EVENTS`
    "lifting",  # whether the liquid that moves has not reached the end of the crest yet
    "side",  # direction in which `front` counts; 0: the legs stand at their chambers' levels
)
MOTION: Final = np.dtype(
    [("state", np.float64, (8,))]  # x, u, p, q (absolute), m R of both gases, work of both gases
    + [(name, np.float64) for name in _MOTION_REAL]
    + [(name, np.int64) for name in _MOTION_WHOLE]
)
"""One pair of chambers; x of chamber 1 is total - x, here as everywhere, so liquid is conserved."""
EVENTS: Final = tuple(Event)
"""Events by number."""
WORKSPACE: Final = (13, 8)
"""Shape of the array that a step of a pair works in."""
