"""Column, gas lines and valves, which move the liquid of a pair, as a record for compiled code."""

from __future__ import annotations

import math
import mmap
from dataclasses import dataclass
from enum import StrEnum
from functools import cached_property
from typing import Any, Final

import numpy as np
import numpy.typing as npt
from scipy.interpolate import PchipInterpolator

from ringbalance.physics.gas import (
    HEAT_CAPACITY_RATIO,
    REFERENCE_PRESSURE_PA,
    REFERENCE_TEMPERATURE_K,
    VENTED,
    GasLine,
    applied_pressure,
    chamber_pressures,
    leaking,
)
from ringbalance.reduced_model.injection.moment import MOMENT_NODES
from ringbalance.reduced_model.law.calibrated_law import CalibratedLaw
from ringbalance.reduced_model.law.flow_law import BalancerModel, FlowLaw
from ringbalance.reduced_model.law.paper_law import PaperLaw
from ringbalance.reduced_model.pieces import point
from ringbalance.reduced_model.pieces.compiled_point import set_all_roots
from ringbalance.reduced_model.pieces.inverse import ROOT_PLACES, WIDTH_OF_ROOT
from ringbalance.reduced_model.pieces.rows import WIDTH_OF_ROW, LawRows
from ringbalance.reduced_model.pieces.table import Table
from ringbalance.reduced_model.tube.heads import entrance_fraction
from ringbalance.reduced_model.tube.path import crest_span
from ringbalance.scene.arrays import FloatArray, Records, plain
from ringbalance.scene.models import Scene, Tube


class Event(StrEnum):
    """Event that ended a flow early."""

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
    """The bound on the number of steps was reached; all later fills repeat the last one."""


Record = Any
"""One element of an array with one of the types below; compiled code changes it in place."""

FLOWS: Final = ((True, True), (True, False), (False, True), (False, False))
"""Gas on or off and tube primed or not, in the order of the tables of a law that gives velocities alone."""
PIECES: Final = 4096
"""Number of pieces of the table for each of `FLOWS`."""
NUMBERS: Final = 4352
"""Room for the numbers of a law, fixed, so that compiled code serves every law."""
WAYS: Final = 3
ROWS: Final = len(FLOWS) * PIECES
"""Room for the pieces of a law."""

_PLANT_REAL: Final = (
    "density",  # kg/m^3
    "length",  # L, m
    "crest_end",  # fraction of the path to the end of the crest's arc, flow out of chamber 0
    "return_crest_end",  # its counterpart for flow out of chamber 1
    "port_pressure",  # D_p, Pa
    "column_pressure",  # D_m, Pa; of a one-way law the level above which liquid leaves a vented chamber
    "vapour_pressure",  # gauge, Pa
    "released",  # of `TubePath`
    "froude_velocity",  # m/s
    "lift_straight",  # of `Lift`
    "lift_entrance",
    "hold_up",  # S L/V, fill ratio that the whole tube takes
    "gas_off",  # gauge, Pa, at or below which a chamber counts as without gas under a one-way law
    "gas_factor",  # gas pressure on the liquid over the one at the place of measurement
    "valve_lag",  # s
    "gas_pressure",  # of a chamber with its valve open, over that of a vented one, Pa
    "ambient_pressure",  # of a vented chamber, absolute, Pa
    "supply_pressure",  # absolute, Pa, where a chamber leaks
    "outside_pressure",  # of the surroundings, absolute, Pa, where a chamber leaks
    "leak_to_ambient",  # of `Dynamics`
    "leak_from_supply",
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
    "lowest_fill",  # at which `rows` and `moment` begin
    "cells_per_fill",
    "moment_step",  # between the nodes of the moment, in x
)
_PLANT_WHOLE: Final = (
    "crest",  # whether the tube has one
    "trapped",
    "one_way",  # whether liquid leaves only a chamber with gas or a high level, as under the paper's Eq. 19
    "inertia",
    "tabled",  # whether the law gives velocities alone, which `rows` then hold by fill
    "lifts",  # whether an unprimed tube is filled up to the crest before liquid passes
    "line",  # whether valve and line take time to pass gas
    "leaks",  # whether leaks change the pressures of the chambers
    "most_steps",
)
PLANT: Final = np.dtype(
    [(name, np.float64) for name in _PLANT_REAL]
    + [(name, np.int64) for name in _PLANT_WHOLE]
    + [
        ("moment", np.complex128, (MOMENT_NODES, 2)),  # of a pair, along and across: value, slope per step
        ("numbers", np.float64, (NUMBERS,)),  # of the law, as `point` reads it
        ("root_cells", np.float64, (WAYS, ROOT_PLACES)),  # search cells for the root of a velocity
        ("roots", np.float64, (ROWS, WIDTH_OF_ROOT)),  # starting values of such roots, row by row as `rows`
        ("rows", np.float64, (ROWS, WIDTH_OF_ROW)),  # pieces of the law, or of its tables
    ]
)
"""Constants of a plant, common to its pairs: liquid column, gas line, valve lag and moment."""


def empty_plants(count: int) -> Records:
    """Records of type `PLANT`, of zeros.

    Few laws fill the room for their pieces.  Memory that is not written to costs nothing here; NumPy's
    arrays would lie on huge pages, which the system fills with zeros as a whole.
    """
    return np.frombuffer(mmap.mmap(-1, count * PLANT.itemsize), dtype=PLANT)


X: Final = 0
U: Final = 1
P: Final = 2
WORK: Final = 6
_MOTION_REAL: Final = (
    "opens",  # s from now until the valve of `chamber` opens, infinite for never
    "closes",
    "log_speed",  # ln of the factor on the law's velocity
    "length",  # of the next step, s
    "now",  # s since the interval began
    "started",  # x at the last start
    "ran_back",  # change of x by flow out of the chamber not driven last, both valves closed
    "fill_before",  # of the driven chamber at the command
    "least_fill",  # of the driven chamber since
    "residual",  # smallest fill to which a command may empty a driven chamber
    "closing_pressure",  # of the driven chamber's gas when its valve closed, gauge, Pa
    "ended",  # s since the interval began, at which the flow out of the driven chamber last ended
    "filled",  # s since the interval began, at which the tube was first primed; below zero for not yet
    "run_dry",  # time for which the valve stays open to the empty chamber, s
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
    "lifting",  # whether moving liquid is still short of the end of the crest
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


@dataclass(frozen=True, kw_only=True)
class Lift:
    """The tube from a port to the crest, as liquid fills it."""

    straight: float
    """c of D_m - D = (D_m - D_p)(c o + (1 - c) o^2) with o from 0 at the crest to 1 at the port."""
    entrance: float
    """Fraction of the loss up to the crest's end that is lost at the entrance."""

    @classmethod
    def of(cls, scene: Scene, *, law: FlowLaw) -> Lift | None:
        """Tube up to the crest, by the flow at equal fills; None without a crest or the calibrated law."""
        tube = scene.tube
        if tube.hump_radius is None or not isinstance(law, CalibratedLaw):
            return None
        half = law.max_fill_ratio / 2
        flow = law.evaluate(fill_ratio=half, gas_pressure=applied_pressure(scene.gas), primed=True)
        return cls.at(scene, np.asarray(flow.velocity))

    @classmethod
    def at(cls, scene: Scene, velocity: FloatArray) -> Lift:
        """Tube up to the crest. Args: `velocity`: in the full tube at equal fills, m/s; or of designs."""
        tube = scene.tube
        crest = 0.0 if tube.hump_radius is None else tube.hump_radius
        straight = 0.0 if tube.hump_shape == "arc" else 2 * crest / (tube.port_radius + crest)
        entrance = entrance_fraction(scene, np.where(velocity > 0, velocity, 1.0))
        return cls(straight=plain(straight), entrance=plain(entrance))


def gives_forces(law: FlowLaw) -> bool:
    """True if a law gives the forces on the column, which inertia and a slow gas need."""
    return isinstance(law, CalibratedLaw | PaperLaw)


RELATIVE_ERROR: Final = 1e-9
"""Relative error of each state, allowed to one step of a single run."""
MOST_STEPS: Final = 200_000
"""Largest number of steps within one interval of time."""
_FIRST_STEP_S: Final = 1e-4
"""Longest step after a jump of the rates, s, at `RELATIVE_ERROR`; proportional to the error's fourth root."""
_NO_HEADS: Final = np.array([1e-12, 2e-12])
"""Knots, eighth roots of heads, of a table with a single ratio, which continues above them."""
_OF_PATH: Final = (
    "density",
    "port_pressure",
    "column_pressure",
    "vapour_pressure",
    "trapped",
    "released",
    "froude_velocity",
    "crest",
)
_OF_DYNAMICS: Final = (
    "gas_off",
    "inertia",
    "valve_lag",
    "gas_pressure",
    "ambient_pressure",
    "dead_volume",
    "tube_area",
    "chamber_volume",
    "max_fill_ratio",
    "residual",
    "leak_to_ambient",
    "leak_from_supply",
)


@dataclass(frozen=True, kw_only=True, eq=False)
class Dynamics:
    """Flow law of a pair, and the terms that the law leaves out."""

    law: FlowLaw
    tube: Tube
    inertia: bool
    """True if the liquid in the tube has inertia."""
    line: GasLine | None
    """Valve and line of each chamber; None: gas fills and vents at once."""
    valve_lag: float
    """Time from a command to the valve's movement, s."""
    gas_pressure: float
    """Pressure of a chamber with its valve open over that of a vented one, Pa."""
    ambient_pressure: float
    """Pressure of a vented chamber, absolute, Pa."""
    dead_volume: float
    """Between each valve and its chamber, m^3."""
    tube_area: float
    """S, m^2."""
    chamber_volume: float
    """V, m^3."""
    max_fill_ratio: float
    """Largest x of a chamber."""
    leak_to_ambient: float = 0.0
    """C p_0 sqrt(T/T_0) of the leak from a chamber to the surroundings, m^3/s."""
    leak_from_supply: float = 0.0
    """C p_0 sqrt(T/T_0) of the leak from the supply into a chamber whose valve is closed, m^3/s."""
    residual: float = 0.0
    """Smallest fill ratio to which a command may empty a driven chamber."""
    lift: Lift | None = None
    """Filling of the tube up to the crest; None: liquid passes at once when the gas can hold it there."""
    gas_off: float = 0.0
    """Gauge, Pa, at or below which a chamber counts as without gas under a one-way law."""
    relative_error: float = RELATIVE_ERROR
    """Relative error of each state, allowed to one step."""

    @classmethod
    def of(
        cls,
        scene: Scene,
        model: BalancerModel,
        *,
        inertia: bool = False,
        line: GasLine | None = None,
        valve_lag: float = 0.0,
        lifts: bool = False,
        residual: float = 0.0,
    ) -> Dynamics:
        """Flow law alone, or with more terms; `lifts`: an unprimed tube is first filled up to its crest."""
        return cls(
            law=model.flow,
            tube=scene.tube,
            gas_off=0.0 if line is None else VENTED * scene.gas.ambient_pressure,
            inertia=inertia,
            line=line,
            valve_lag=valve_lag,
            gas_pressure=applied_pressure(scene.gas),
            ambient_pressure=chamber_pressures(scene.gas)[1],
            leak_to_ambient=leaking(scene.gas, "leak_to_ambient"),
            leak_from_supply=leaking(scene.gas, "leak_from_supply"),
            dead_volume=scene.gas.dead_volume or 0.0,
            tube_area=model.tube_area,
            chamber_volume=model.chamber_volume,
            max_fill_ratio=model.flow.max_fill_ratio,
            residual=residual,
            lift=Lift.of(scene, law=model.flow) if lifts else None,
        )

    @property
    def quasi_steady(self) -> bool:
        """True if the flow law alone moves the liquid."""
        return not self.inertia and self.line is None and self.valve_lag == 0 and self.lift is None

    def plant(self, *, total: float, relative_error: float | None = None) -> npt.NDArray[np.void]:
        """Record of type `PLANT`, shape (1,), of a pair with a sum of fill ratios."""
        plant = empty_plants(1)
        self.fill(plant, total=total, relative_error=relative_error)
        return plant

    def fill(self, plant: npt.NDArray[np.void], *, total: float, relative_error: float | None = None) -> None:
        """Write the plant into a record of zeros, shape (1,)."""
        error = self.relative_error if relative_error is None else relative_error
        for name in _OF_DYNAMICS:
            plant[name] = getattr(self, name)
        plant["total"], plant["relative_error"], plant["most_steps"] = total, error, MOST_STEPS
        plant["first_step"] = _FIRST_STEP_S * (error / RELATIVE_ERROR) ** 0.25
        law, length, line = self.law, self.tube.length, self.line
        plant["length"], plant["hold_up"] = length, self.tube_area * length / self.chamber_volume
        plant["temperature"], plant["heat_capacity_ratio"] = 1.0, 1.0
        if line is not None:
            plant["line"], plant["temperature"] = True, line.temperature
            warm = math.sqrt(line.temperature / REFERENCE_TEMPERATURE_K)
            plant["critical_ratio"] = line.critical_ratio
            plant["passing"] = line.conductance * REFERENCE_PRESSURE_PA * warm
            plant["heat_capacity_ratio"] = 1.0 if line.process == "isothermal" else HEAT_CAPACITY_RATIO
            plant["supply_pressure"], plant["outside_pressure"] = line.supply_pressure, line.ambient_pressure
            plant["leaks"] = self.leak_to_ambient + self.leak_from_supply > 0
        # Without a path of the law's own: no crest, and the port always covered.
        plant["density"], plant["gas_factor"], plant["column_pressure"] = 1.0, 1.0, math.inf
        plant["crest_end"], plant["return_crest_end"] = 1.0, 1.0
        if isinstance(law, CalibratedLaw):
            for name in _OF_PATH:
                plant[name] = getattr(law.path, name)
            if not law.path.crest:
                plant["column_pressure"] = math.inf
            plant["gas_factor"] = law.gas_factor
            start, end = crest_span(self.tube)
            plant["crest_end"], plant["return_crest_end"] = end, 1 - start
            _fill_rows(plant, len(law.heads.tables), *law.constants)
        elif isinstance(law, PaperLaw):
            _fill_paper(plant, law)
        else:
            _fill_velocities(plant, law)
        if self.lift is not None and plant["crest"]:
            plant["lifts"] = True
            plant["lift_straight"], plant["lift_entrance"] = self.lift.straight, self.lift.entrance

    @cached_property
    def _plants(self) -> dict[float, npt.NDArray[np.void]]:
        return {}

    def kept_plant(self, *, total: float) -> npt.NDArray[np.void]:
        """Cached `plant` for a sum of fill ratios."""
        if total not in self._plants:
            self._plants[total] = self.plant(total=total)
        return self._plants[total]


def _fill_paper(plant: npt.NDArray[np.void], law: PaperLaw) -> None:
    """Write the paper's law: liquid leaves only a chamber with gas or with a level above the crest."""
    plant["density"], plant["one_way"] = law.density, True
    if law.return_pressure is not None:
        plant["column_pressure"] = law.return_pressure
    rise, ratio = law.pressure_per_fill_difference, math.sqrt(2 / (law.drag_coefficient + 1))
    level = Table(knots=np.array([0.0, 1.0]), columns=np.array([0.0, rise, rise, rise, 0.0, 0.0, 0.0, 0.0]))
    head = Table(knots=_NO_HEADS, columns=np.repeat([ratio, 0.0, 0.0, 0.0], 2))
    rows = LawRows.of(1)
    rows.add_levels(level)
    rows.add_way(point.SIPHON, head, law.density, more=())
    _fill_rows(plant, 1, *rows.arrays({point.LARGEST_FILL: law.max_fill_ratio}))


def _fill_rows(plant: npt.NDArray[np.void], ways: int, numbers: FloatArray, rows: FloatArray) -> None:
    if numbers.size > NUMBERS or len(rows) > ROWS:
        raise ValueError(f"the law has {len(rows)} pieces, at most {ROWS} can be compiled")
    plant["numbers"][0, : numbers.size], plant["rows"][0, : len(rows)] = numbers, rows
    set_all_roots(numbers, rows, ways, plant["root_cells"][0], plant["roots"][0])


def _fill_velocities(plant: npt.NDArray[np.void], law: FlowLaw) -> None:
    """Write the tables of a law of velocities, for each of `FLOWS`: u|u| as a cubic, primed, regime.

    u|u| is linear in a piece that holds a stall or a reversal.  A change of regime within a piece takes
    effect at its end.
    """
    total, largest = float(plant["total"][0]), law.max_fill_ratio
    lowest, highest = max(0.0, total - largest), min(total, largest)
    x = np.linspace(lowest, highest, PIECES + 1)
    plant["tabled"] = True
    plant["lowest_fill"], plant["cells_per_fill"] = lowest, PIECES / (highest - lowest)
    for which, (gas, primed) in enumerate(FLOWS):
        flow = law.evaluate(
            fill_ratio=x,
            opposite_fill_ratio=np.clip(total - x, 0.0, largest),
            gas_pressure=float(plant["gas_pressure"][0]) if gas else 0.0,
            primed=primed,
        )
        square = flow.velocity * np.abs(flow.velocity)
        powers = PchipInterpolator(np.arange(PIECES + 1.0), square).c[::-1]
        ends = square[:-1] * square[1:] <= 0
        powers[:, ends] = 0.0
        powers[0, ends], powers[1, ends] = square[:-1][ends], np.diff(square)[ends]
        inside = slice(which * PIECES, (which + 1) * PIECES)
        plant["rows"][0, inside, :6] = np.stack([*powers, flow.primed[:-1], flow.regime[:-1]], axis=1)
