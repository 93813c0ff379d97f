"""Blocks that a host can run, of liquid rings and eccentric masses: constants, and one row of numbers.

A block's functions read the constants and change the row, in which each variable has its index; the source is
the same for every host.
"""

from __future__ import annotations

import math
import tomllib
from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from importlib.resources import files
from types import ModuleType
from typing import Any, Final, Literal, cast

import numpy as np

from ringbalance.controller.algorithms import law_steps, target_steps, trial_steps, valve_steps
from ringbalance.controller.algorithms.built_in import TargetVector, Trial
from ringbalance.controller.algorithms.law_based import LawBased
from ringbalance.controller.loop_records import LOOP, RUN
from ringbalance.controller.rotor import chamber_directions, chamber_letters
from ringbalance.controller.terms import dynamics_of
from ringbalance.export import disc, law_based
from ringbalance.export.compact import VELOCITIES, CompactLaw, Tables, compact_law
from ringbalance.export.translate import Source, number_text, python_functions
from ringbalance.reduced_model.law.calibrated_law import CalibratedLaw
from ringbalance.reduced_model.law.flow_law import BalancerModel
from ringbalance.reduced_model.pieces import point, query
from ringbalance.reduced_model.residual_liquid import residual_fill_ratio
from ringbalance.reduced_model.terms import FILLING, LAG
from ringbalance.scene.faults import SceneError
from ringbalance.scene.models import Scene

Kind = Literal["law", "disc", "controller", "strategy", "plant"]
Numbers = tuple[float, ...]
_LONGEST_PART_S: Final = 1e-3
"""Longest part of a step of the disc, s."""
_LONGEST_FOLLOWED_PART_S: Final = 5e-3
"""Longest part of a step of the liquid that a controller estimates, s."""
_SHORTEST_PART_S: Final = 1e-6
"""Least value of the longest part, s: below it a host's step of 10 ms would take more than 10,000 parts."""
PART_OF_TIME_CONSTANT: Final = 0.04
"""Longest part over the line's time constant: near the end of a filling a pressure changes some fifty times
as fast, and the method is stable for parts up to 2.8 over that rate."""
_LAW_FUNCTIONS: Final = ("answer", "surface_radius", "moment", "moment_uncertainty")
"""Functions of a law, which a caller may ask for by themselves."""
RANGE: Final = "{:g} to {:g} m/s".format(*VELOCITIES)


@dataclass(frozen=True, kw_only=True)
class Variable:
    """Variable that a host sees."""

    name: str
    kind: str
    """ "Real", "Integer" or "Boolean"."""
    input: bool
    index: int
    """Index in the block's row."""
    description: str
    range: Mapping[str, str]
    """Unit, minimum, maximum and nominal value, as far as its kind has them."""

    @property
    def bounds(self) -> str:
        """Least and greatest value."""
        if self.kind == "Boolean":
            return "0 or 1"
        return f"{float(self.range['min']):g} to {float(self.range['max']):g}"

    @property
    def explained(self) -> str:
        """Direction (in or out), unit, bounds and meaning, in one line."""
        unit = self.range.get("unit", "1")
        of_unit = "" if unit == "1" else f"{unit}, "
        return f"{'in' if self.input else 'out'}, {of_unit}{self.bounds}: {self.description}"


@dataclass(frozen=True, kw_only=True)
class Block:
    """Law, disc, controller or plant for a host."""

    kind: Kind
    title: str
    scene: str
    """File of the scene that the block was made from."""
    facts: str
    """Contents and accuracy, in sentences."""
    constants: Numbers
    start: Numbers
    """The row before the first step."""
    steps: str
    """Name of the function that advances by a time and updates the outputs; that of the law only updates."""
    variables: tuple[Variable, ...]
    tables: Tables | None = None
    """Tables of its law, if it has one."""
    modules: tuple[ModuleType, ...] = ()
    period: float = 0.01
    """Time of a step where a host is given none, s."""
    flat: Source | None = None
    """The source in place of that of `modules`; it uses sin, cos, atan, acos, exp and log of the host."""
    legend: tuple[str, ...] = ()
    """Lines that say what stands where in the constants `c` and the row `w`, for a reader of the source."""

    def source(self, entries: Sequence[str] = ()) -> Source:
        """Source of some functions and all that they call; default of those that a caller may ask for."""
        return self.flat or Source.of_modules(
            self.modules, entries or (_LAW_FUNCTIONS if self.kind == "law" else (self.steps,))
        )

    @property
    def timed(self) -> bool:
        """True if a step advances by a time."""
        return self.kind != "law"

    @property
    def size(self) -> int:
        """Size of constants and tables, bytes."""
        return 8 * len(self.constants) + (0 if self.tables is None else self.tables.size)

    def outputs(self, row: list[float]) -> dict[str, float]:
        """Outputs by name, of a row that is up to date."""
        return {each.name: row[each.index] for each in self.variables if not each.input}

    def run(self, row: list[float], time: float, inputs: Mapping[str, float]) -> dict[str, float]:
        """Set inputs and advance by a time, s, as a host does. Returns: the outputs."""
        indices = {each.name: each.index for each in self.variables if each.input}
        for name, value in inputs.items():
            row[indices[name]] = float(value)
        self._step(self.constants, *(self.tables or ()), row, *((time,) if self.timed else ()))
        return self.outputs(row)

    @cached_property
    def _step(self) -> Callable[..., None]:
        if self.flat is None:
            step: Callable[..., None] = getattr(self.modules[-1], self.steps)
            return step
        names: dict[str, Any] = {"Law": list, "Query": list, **vars(math)}
        exec(python_functions(self.flat), names)
        return cast(Callable[..., None], names[self.steps])


def law_block(law: CompactLaw) -> Block:
    """The law alone: its outputs follow from its inputs."""
    most = law.max_fill_ratio
    return Block(
        kind="law",
        title="Flow law of a liquid-ring balancer",
        scene=law.scene,
        facts=tabulation(law),
        constants=law.constants,
        tables=law.tables,
        start=(most / 2, most / 2, *(0.0,) * (point.PLACES_OF_QUERY - 2)),
        modules=(point, query),
        steps="answer_all",
        variables=variables_of("law", lambda offset, _: int(getattr(point, offset)), most=most),
    )


def tabulation(law: CompactLaw) -> str:
    """Contents and accuracy of a law, in sentences."""
    return (
        f"Constants of {law.size} bytes; velocities {RANGE}, beyond\n"
        f"   extrapolated. Largest error of tabulation: {law.departure:.1e} of a velocity,\n"
        f"   {law.level_error:.1e} Pa of a chamber's level."
    )


def disc_block(scene: Scene, law: CalibratedLaw, *, compact: CompactLaw | None = None) -> Block:
    """Fills and gas of all chambers in time, and the vibration of the scene's rotor.

    Args: `compact`: the law's compact form; None: it is made.
    Raises: SceneError: chambers that are not symmetric, whose moment across their middle the numbers lack, or
        a gas line that fills a chamber too fast for a host's steps.
    """
    gas, half = scene.gas, scene.disc.chambers // 2
    terms = {FILLING: gas.conductance, LAG: gas.valve_lag}
    modelled = [term for term, value in terms.items() if value is not None]
    compact, constants, row = _disc(scene, law, modelled, compact)
    disc.show(constants, compact.tables.cells, compact.tables.pieces, row)

    def index_of(offset: str, chamber: int | None) -> int:
        value = int(getattr(disc, offset))
        if chamber is None:
            return value
        return disc.FIRST_PAIR + disc.PER_PAIR * (chamber % half) + value + chamber // half

    return Block(
        kind="disc",
        title="Disc of a liquid-ring balancer on its rotor",
        scene=scene.file,
        facts=tabulation(compact)
        + "\n   Liquid without mass: its velocity is the law's at every instant."
        + ("" if scene.sensor.runout_amplitude is None else "\n   Vibration as read: with sensor.runout."),
        constants=tuple(constants),
        tables=compact.tables,
        start=tuple(row),
        modules=(point, query, disc),
        steps="step",
        variables=variables_of("disc", index_of, most=law.max_fill_ratio, chambers=scene.disc.chambers),
    )


def _disc(
    scene: Scene, law: CalibratedLaw, modelled: Collection[str], compact: CompactLaw | None
) -> tuple[CompactLaw, list[float], list[float]]:
    """Law of a disc, the numbers of both, and its row at the start."""
    if law.moment.across is not None:
        problem = "the chambers are asymmetric: the disc's moment would miss a part"
        raise SceneError.of_file(scene.file, problem, "--block law")
    gas, rotor, half, fill = scene.gas, scene.rotor_as_read, scene.disc.chambers // 2, scene.disc.initial_fill
    compact = compact or compact_law(scene=scene, law=law)
    dynamics = dynamics_of(scene=scene, model=BalancerModel.of(law), modelled=modelled)
    longest = _LONGEST_PART_S
    if dynamics.line is not None:
        least = (1 - law.max_fill_ratio) * law.chamber_volume + dynamics.dead_volume
        constant = dynamics.line.time_constant(volume=least)
        longest = min(longest, PART_OF_TIME_CONSTANT * constant)
        if longest < _SHORTEST_PART_S:
            took = f"gas fills a chamber with a time constant of {constant:.2g} s"
            shortest = _SHORTEST_PART_S / PART_OF_TIME_CONSTANT
            allowed = f"at least {shortest:.2g} s, no gas.conductance, or --block law"
            raise SceneError.of_file(scene.file, f"{took}, too short for a host's steps", allowed)

    plant, vented = dynamics.plant(total=2 * fill)[0], dynamics.ambient_pressure
    supply = gas.ambient_pressure + gas.pressure
    ratio = float(plant["heat_capacity_ratio"])
    complex_numbers = [rotor.initial_vibration, rotor.influence]
    complex_numbers += chamber_directions(scene.disc.chambers)[:half].tolist()
    constants = [
        *compact.constants,
        float(half),
        2 * fill,
        law.tube_area / law.chamber_volume,
        law.chamber_volume,
        dynamics.dead_volume,
        supply if dynamics.line is not None else vented + dynamics.gas_pressure,
        dynamics.valve_lag,
        residual_fill_ratio(scene, law=law),
        longest,
        float(dynamics.line is not None),
        float(plant["passing"]),
        float(plant["critical_ratio"]),
        gas.temperature,
        ratio,
        float(ratio > 1.0),
        gas.ambient_pressure,
        float(plant["leak_to_ambient"]),
        float(plant["leak_from_supply"]),
        *(part for number in complex_numbers for part in (number.real, number.imag)),
    ]
    constants[point.BLOCK] = float(len(compact.constants))
    row = [0.0] * (disc.FIRST_PAIR + disc.PER_PAIR * half)
    content = vented * disc.gas_volume(constants, fill) / gas.temperature
    for pair in range(half):
        at = disc.FIRST_PAIR + disc.PER_PAIR * pair
        row[at : at + disc.STATES] = [fill, vented, vented, content, content]
    return compact, constants, row


def controller_block(
    scene: Scene, law: CalibratedLaw | None = None, *, compact: CompactLaw | None = None
) -> Block:
    """The control algorithm with the scene's settings.

    Args: `law`: calibrated, for the law-based one. `compact`: as in `disc_block`.

    Raises: SceneError: as `disc_block`, for the law-based one.
    """
    if scene.controller.kind == "law_based":
        if law is None:
            raise ValueError("the law-based controller needs the calibrated law")
        return _law_based_block(scene, law, compact)
    tries, chambers = scene.controller.kind == "trial", scene.disc.chambers
    steps: ModuleType = trial_steps if tries else target_steps

    def index_of(offset: str, chamber: int | None) -> int:
        if chamber is None:
            return int(getattr(steps, offset))
        first = int(steps.FIRST_CHAMBER) + valve_steps.PER_CHAMBER * chamber
        return first + int(getattr(valve_steps, offset))

    return Block(
        kind="controller",
        title=f"{'Trial' if tries else 'Target-vector'} controller of a liquid-ring balancer",
        scene=scene.file,
        facts="Settings of the scene; the vibration enters by its components.",
        constants=(Trial if tries else TargetVector)(scene=scene).constants,
        start=(0.0,) * (steps.FIRST_CHAMBER + valve_steps.PER_CHAMBER * chambers),
        modules=(point, valve_steps, steps),
        steps="step",
        variables=variables_of("controller", index_of, chambers=chambers),
    )


def _law_based_block(scene: Scene, law: CalibratedLaw, compact: CompactLaw | None) -> Block:
    compact, constants, row = _disc(scene, law, (), compact)
    half, chambers = scene.disc.chambers // 2, scene.disc.chambers
    d, r = len(compact.constants), len(row)
    # The controller estimates whole injections: none is cut, and parts may be long.
    constants[d + disc.RESIDUAL], constants[d + disc.LONGEST] = -1.0, _LONGEST_FOLLOWED_PART_S
    loop, run = np.zeros(1, dtype=LOOP)[0], np.zeros(1, dtype=RUN)[0]
    LawBased(scene=scene, model=BalancerModel.of(law)).fill(loop, run)
    deviations = loop[["law_deviation", "assumed_amplitude_noise", "assumed_phase_noise"]]
    constants += (
        *map(float, loop[["rest_limit", "minimum_gas_time", "maximum_gas_time", "probe", "least_fill"]]),
        abs(complex(loop["influence"])),
        *(float(each) ** 2 for each in deviations),
        *loop["offset"][:chambers].tolist(),
    )
    host = law_steps.change_of(r, half)
    row += [*run["memory"][: host - r].tolist(), *[0.0] * law_based.FIRST_CHAMBER]
    first_chamber = len(row)
    row += [0.0] * (valve_steps.PER_CHAMBER * chambers)
    places = {"VIBRATION_X": r + law_steps.SEEN_X, "VIBRATION_Y": r + law_steps.SEEN_Y}
    places |= {"RESTING": host + law_based.RESTS, "SAMPLES": host + law_based.SAMPLES}
    places["WAIT"] = host + law_based.WAIT

    def index_of(offset: str, chamber: int | None) -> int:
        if chamber is None:
            return places[offset]
        return first_chamber + valve_steps.PER_CHAMBER * chamber + int(getattr(valve_steps, offset))

    return Block(
        kind="controller",
        title="Law-based controller of a liquid-ring balancer",
        scene=scene.file,
        facts="Settings of the scene; the vibration enters by its components.\n   " + tabulation(compact),
        constants=tuple(constants),
        tables=compact.tables,
        start=tuple(row),
        modules=(point, query, disc, valve_steps, law_steps, law_based),
        steps="control",
        variables=variables_of("controller", index_of, chambers=chambers),
    )


def declared() -> dict[str, Any]:
    """Variables of each kind of block, `MOST` for the largest fill ratio and `#` for a letter, and units."""
    file = files("ringbalance.export").joinpath("templates/variables.toml")
    return tomllib.loads(file.read_text(encoding="utf-8"))


def variables_of(
    kind: Kind | Literal["measured"],
    index_of: Callable[[str, int | None], int],
    *,
    most: float = 0.0,
    chambers: int = 2,
    inputs: bool = False,
) -> tuple[Variable, ...]:
    """Variables as declared.

    Args: `index_of`: index by name of the offset and, if any, chamber. `inputs`: default of their `input`.
    """
    variables = []
    for each in declared()[kind]:
        limits = {key: text.replace("MOST", number_text(most)) for key, text in each["range"].items()}
        description = each["description"].replace("MOST", number_text(most))
        letters = each.get("letters") or (chamber_letters(chambers) if "#" in each["name"] else (None,))
        for number, letter in enumerate(letters):
            variables.append(
                Variable(
                    name=each["name"].replace("#", letter or "").lower(),
                    kind=each["kind"],
                    input=each.get("input", inputs),
                    index=index_of(each["place"], number if letter else None),
                    description=description.replace("#", letter or ""),
                    range=limits,
                )
            )
    return tuple(variables)
