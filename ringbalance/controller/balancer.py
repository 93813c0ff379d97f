"""Interface of every balancer, and the balancer of a scene.

`simulate`, `tune`, `compare` and the first half of `fit` are written against `Balancer` alone.  A further one
is a sub-package with its scene's keys and a subclass, and one line that registers it
(`ringbalance.scene.registry`).
"""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections import Counter
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, Final, Protocol, Self

import numpy as np

from ringbalance.controller.rotor import CommonRotor, Rotors
from ringbalance.controller.trials import DrawnInput, Information, Trials, drawn_key
from ringbalance.reduced_model.law.flow_law import CALIBRATED, UNCHECKED
from ringbalance.results.requirements import AT_LEAST, AT_MOST
from ringbalance.results.result import Rows
from ringbalance.results.rows import Finding, Quantity
from ringbalance.scene.arrays import BoolArray, FloatArray
from ringbalance.scene.faults import SceneError
from ringbalance.scene.kinds import scene_kind
from ringbalance.scene.origins import SceneFile
from ringbalance.scene.registry import registered
from ringbalance.scene.units import DIMENSIONS

WATCH_TIME_S: Final = 60.0
"""s, for which a run that has held its limit is watched."""
REQUIRED_FRACTION: Final = 0.9
"""Fraction of the devices that must meet every demand where a scene states none."""
Settings = Mapping[str, Any]
"""Values of a controller's or designer's choice by path in a scene file, SI; those of text as they are."""
Progress = Callable[[float, float], None]
"""Called with the simulated time and the time limit, s."""


@dataclass(frozen=True, kw_only=True)
class Input:
    """A quantity of a balancer that is not known exactly."""

    path: str
    """In a scene file, such as "tube.bore"."""
    value: float
    """SI."""
    half_width: float
    """Expanded uncertainty (95 %), SI; zero: the scene states none."""
    unit: str
    """Unit in which it is written, "1" for a number without unit."""


@dataclass(frozen=True, kw_only=True)
class Setting:
    """Value that a controller or a designer may change without building another machine."""

    path: str
    value: float
    """SI, of the scene."""
    lowest: float
    highest: float


@dataclass(frozen=True, kw_only=True)
class Draws:
    """Which devices a balancer is run as; a number is the same device and noise under every setting.

    `ringbalance.scene.draws` says where in its distribution each input of a numbered device lies.
    """

    numbers: tuple[int, ...]
    devices: bool = True
    """True if the inputs are drawn; False: each is as in the scene, and the noise alone differs."""
    complete: bool = True
    """True if every run is carried out; False: one that is known not to settle ends with the least vibration
    that the device can come to."""
    deadline: float = math.inf
    """s, at which a run that is above its limit may end undecided; where runs are watched to their end, none
    does."""

    @classmethod
    def first(cls, count: int, *, devices: bool = True) -> Draws:
        """The first `count` of them."""
        return cls(numbers=tuple(range(count)), devices=devices)

    @classmethod
    def block(cls, start: int, count: int, *, complete: bool = True, deadline: float = math.inf) -> Draws:
        """Devices `start` to `start + count - 1`."""
        return cls(numbers=tuple(range(start, start + count)), complete=complete, deadline=deadline)


AS_GIVEN: Final = Draws.first(1, devices=False)
"""The scene as it says, with its own seed."""


class Run(Protocol):
    """One traced run: what `simulate` answers with."""

    @property
    def status(self) -> str:
        """Sentence on how the run ended and what to do next."""
        ...

    @property
    def settled(self) -> bool:
        """True if the vibration came below the limit and stayed."""
        ...

    def to_dict(self) -> dict[str, Any]:
        """The run as a JSON document in SI."""
        ...


@dataclass(frozen=True, kw_only=True)
class RunResult:
    """Result of one run."""

    settling_time: float
    """s, from the start of balancing; infinite where not settled."""
    final_amplitude: float
    """m zero-to-peak."""
    energy: float
    """Energy that the run took, J."""
    usable_moment: float
    """Largest unbalance that the device cancels where its own lies, kg m."""
    unbalance: float
    """Unbalance of its rotor, kg m."""
    ended: str
    """Code of the finding on what ended the run."""
    run: Any = None
    """A `Run`; None: it left no trace."""
    worst_amplitude: float = math.nan
    """Largest while balancing, m zero-to-peak, of a run with a trace."""

    @property
    def settled(self) -> bool:
        """True if it has settled."""
        return math.isfinite(self.settling_time)


@dataclass(frozen=True, kw_only=True, eq=False)
class Outcomes:
    """Results of runs in the order of the draws: the numbers of `RunResult` as arrays of shape (n,)."""

    settling_time: FloatArray
    final_amplitude: FloatArray
    energy: FloatArray
    usable_moment: FloatArray
    unbalance: FloatArray
    ended: tuple[str, ...]
    numbers: tuple[int, ...] = ()
    """Numbers of the draws."""
    inputs: Mapping[str, FloatArray] = field(default_factory=dict)
    """Place of every drawn input in its distribution, in (0, 1); empty where no device is drawn."""
    clipped: Mapping[str, int] = field(default_factory=dict)
    """Number of devices by input that cannot have it as drawn."""
    traced: tuple[RunResult, ...] = ()

    @property
    def settled(self) -> BoolArray:
        """True for each run that has settled, shape (n,)."""
        return np.isfinite(self.settling_time)

    @classmethod
    def of(
        cls,
        results: Sequence[RunResult],
        *,
        numbers: tuple[int, ...] = (),
        inputs: Sequence[Mapping[str, float]] = ({},),
        clipped: Iterable[str] = (),
        trace: bool = False,
    ) -> Outcomes:
        """Join runs that were made one by one.

        Args: `inputs`: place of every drawn input, by device. `clipped`: inputs that some device cannot have
            as drawn, for each. `trace`: whether the runs are kept.
        """
        return cls(
            **{name: np.array([getattr(each, name) for each in results]) for name in ARRAYS},
            ended=tuple(each.ended for each in results),
            numbers=numbers,
            inputs={name: np.array([each[name] for each in inputs]) for name in inputs[0]},
            clipped=Counter(clipped),
            traced=tuple(results) if trace else (),
        )

    def joined(self, more: Outcomes) -> Outcomes:
        """Join the outcomes of these and of further draws."""
        return Outcomes(
            **{name: np.concatenate([getattr(self, name), getattr(more, name)]) for name in ARRAYS},
            ended=self.ended + more.ended,
            numbers=self.numbers + more.numbers,
            inputs={name: np.concatenate([at, more.inputs[name]]) for name, at in self.inputs.items()},
            clipped=Counter(self.clipped) + Counter(more.clipped),
            traced=self.traced + more.traced,
        )


ARRAYS: Final = ("settling_time", "final_amplitude", "energy", "usable_moment", "unbalance")
"""Names of the arrays of `Outcomes`."""


@dataclass(frozen=True, kw_only=True)
class Demand:
    """Demand on every device, as a function of the outcome of its run."""

    code: str
    """Code of the finding on it, such as "settling_time"."""
    outcome: str
    """Name of the number of `Outcomes` that it is about."""
    sense: str
    """`AT_LEAST` or `AT_MOST`."""
    required: float
    """SI."""
    unit: str
    stated: bool
    """True if the scene states it; else it holds for every run."""
    amplitude: float | None = None
    """Vibration at or below which a device counts as settled, m zero-to-peak, where [requirement] says so."""

    def met(self, outcomes: Outcomes) -> BoolArray:
        """By each device."""
        reached = getattr(outcomes, self.outcome)
        return np.asarray(reached >= self.required if self.sense == AT_LEAST else reached <= self.required)


@dataclass(frozen=True, kw_only=True)
class Remedy:
    """A change of the scene that may mend what its devices do not meet."""

    code: str
    """Code of the sentence that names it, such as "bore"."""
    changes: Settings
    """By path, SI, as `SceneFile.with_values` takes them."""
    name: str = ""
    """Name of a thing that can be bought; else empty."""
    continuous: bool = False
    """True if a value between this and another of its kind can be had as well."""


class Balancer(ABC):
    """A balancer on its rotor, as a scene describes both: the interface that every command uses.

    Made by `balancer_of`; immutable, so that the same balancer gives the same rows in every process.  What is
    not abstract here suits a balancer whose runs are watched to their end and whose scene states nothing
    else.
    """

    scene: Any
    """Scene that it was made of, of the type of its kind."""
    options: frozenset[str] = frozenset()
    """Arguments besides the scene that it can be made with, such as "flow_law"."""
    verdict_draws: tuple[int, int] = (16, 64)
    """Devices of a verdict, at first and at the most."""
    energy_kind: str
    """Code of the sentence that says what its runs count as energy."""
    watched_to_end: bool = True
    """True if every run is watched to its time limit, whatever the arguments say."""

    @property
    def models_used(self) -> tuple[Any, ...]:
        """Every physical term, with its model and its estimated contribution; empty: one model has all."""
        return ()

    def inputs(self) -> tuple[Input, ...]:
        """Every quantity that may be uncertain."""
        return inputs_of(self.scene)

    @abstractmethod
    def settings(self) -> tuple[Setting, ...]:
        """Settings that `run` takes, each at the scene's value and within its bounds."""

    @abstractmethod
    def run(
        self,
        settings: Settings,
        draws: Draws,
        *,
        trace: bool = False,
        progress: Progress | None = None,
    ) -> Outcomes:
        """Closed-loop runs, one a draw. Args: `settings`: by path, SI; the scene's where none is given.

        `trace`: whether the runs themselves are kept; what they come to is the same.
        """

    def run_all(
        self,
        settings: Sequence[Settings],
        draws: Draws,
        *,
        watch_time: float = WATCH_TIME_S,  # noqa: ARG002
    ) -> tuple[Outcomes, ...]:
        """Run several settings, without traces.

        Args: `watch_time`: s, for which a run is watched after it has held its limit, unless to its end.
        """
        return tuple(self.run(each, draws) for each in settings)

    def required_fraction(self) -> float:
        """Fraction of the devices that must meet every demand."""
        return REQUIRED_FRACTION

    def demands(self) -> tuple[Demand, ...]:
        """Demands on every device: first that it settles in time, then what else the scene states."""
        return (settles_within(self.span(), stated=False),)

    def trials(self) -> tuple[Trials, ...]:
        """Settings to try, of the scene's kind of controller first; empty: there are none."""
        return ()

    def remedies(self) -> tuple[Remedy, ...]:
        """Changes of the scene to try where too few devices meet its demands, each by itself.

        Those of one kind follow each other with the smallest change first.
        """
        return ()

    def choices(self) -> tuple[Remedy, ...]:
        """Parts that can be bought where the scene leaves them open; results do without them."""
        return ()

    def information(self, scene: SceneFile) -> Information:  # noqa: ARG002
        """Information on its loop without a run, under a scene with other settings."""
        return Information()

    def beyond_capacity(self, scene: SceneFile, ended: Sequence[str], settings: str) -> tuple[Finding, ...]:  # noqa: ARG002
        """Findings on devices whose runs ended for want of capacity, under a scene with other settings.

        Args: `settings`: what to call these.
        """
        return ()

    def drawn_input(self, name: str) -> DrawnInput:
        """Kind of an input of `Outcomes.inputs`."""
        return drawn_key(self.scene, name)

    @abstractmethod
    def on_scene(self, scene: SceneFile) -> Self:
        """Balancer of another scene of its kind, with the same options."""

    @abstractmethod
    def rotor(self, number: int | None = None) -> CommonRotor:
        """The rotor alone. Args: `number`: of a drawn device; default as the scene says.

        Raises: SceneError: it stands still, or never vibrates steadily.
        """

    @abstractmethod
    def on_rotor(self, rotor: CommonRotor, rotors: Rotors | None = None) -> Self:
        """This balancer on a rotor at constant speed in its steady vibration, with nothing required but to
        come below that rotor's limit.

        Args: `rotors`: of the drawn devices; default its own. Raises: SceneError: the rotor cannot be this
            balancer's.
        """

    @abstractmethod
    def sampling_time(self) -> float:
        """Time from one sample of the vibration to the next, s."""

    def span(self) -> float:
        """Time from the start of balancing to the end of a run, s."""
        return float(self.scene.run.time_limit)

    @abstractmethod
    def lasting(self, span: float) -> Self:
        """Balancer with runs that balance for `span`, s, and go on when they have settled."""

    @abstractmethod
    def quantities(self) -> tuple[Quantity, ...]:
        """Quantities known without a run; among them "reach", the largest unbalance, kg m, that it cancels
        wherever that lies."""

    @abstractmethod
    def rows(self, run: Any) -> Rows:
        """One of its traced runs as `simulate` prints it.

        A finding has the changes of the scene that would mend it (`Finding.changes`).
        """

    @abstractmethod
    def history(self, run: Any) -> Mapping[str, Sequence[Any]]:
        """Every instant of one of its traced runs by name of its column, with the unit in the name."""


def balancer_of(scene: SceneFile, **options: Any) -> Balancer:
    """The balancer of a scene.

    Args: `options`: of its class, such as `flow_law` of a liquid ring; None counts as not given.
    Raises: ValueError: an option that this balancer does not have.
    """
    balancer_class = registered("balancer", scene.balancer)
    stated = {name: value for name, value in options.items() if value is not None}
    if foreign := sorted(set(stated) - balancer_class.options):
        raise ValueError(f"the balancer {scene.balancer} has no {', '.join(foreign)}: leave that out")
    balancer: Balancer = balancer_class(scene, **stated)
    return balancer


def takes(scene: SceneFile, option: str) -> bool:
    """True if the balancer of a scene has an option, such as "flow_law"."""
    return option in registered("balancer", scene.balancer).options


def quick_balancer(scene: SceneFile) -> Balancer:
    """Balancer for runs of many designs: under a law that nothing else has checked, where it has one."""
    return balancer_of(scene, flow_law=UNCHECKED) if takes(scene, "flow_law") else balancer_of(scene)


def balancer_under(law: str, scene: SceneFile) -> Balancer:
    """The balancer of a scene under the law of the option `--law`.

    Raises: SceneError: a law for a balancer that has none.
    """
    if law == CALIBRATED:
        return balancer_of(scene)
    if not takes(scene, "flow_law"):
        problem = f"the balancer of {scene.source} has no flow law"
        raise SceneError.of_option(
            option="--law", value=law, problem=problem, allowed="this option with a liquid ring alone"
        )
    return balancer_of(scene, flow_law=law)


def inputs_of(scene: SceneFile, width: Callable[[str, float], float] | None = None) -> tuple[Input, ...]:
    """Every value of a scene that its schema lets be uncertain.

    Args: `width`: half-width, SI, by path and value; default what the scene states by path.
    """
    stated = {each.quantity: each for each in scene.uncertainty}

    def of_scene(path: str, value: float) -> float:
        uncertain = stated.get(path.split("[")[0])
        return 0.0 if uncertain is None else uncertain.absolute(value)

    inputs = []
    for table, content in scene_kind(scene.balancer).schema.tables.items():
        for key, declared in content.keys.items():
            value = getattr(getattr(scene, table), key) if declared.uncertain else None
            dimension = declared.takes.dimension
            unit = DIMENSIONS[dimension].si_unit if dimension else "1"
            several = enumerate(value) if isinstance(value, tuple) else ((None, value),)
            for entry, each in several:
                path = f"{table}.{key}" if entry is None else f"{table}.{key}[{entry}]"
                if each is not None:
                    half = (width or of_scene)(path, float(each))
                    inputs.append(Input(path=path, value=float(each), half_width=half, unit=unit))
    return tuple(inputs)


def settles_within(time: float, *, stated: bool, amplitude: float | None = None) -> Demand:
    """Demand that a device settles within a time, s. Args: `amplitude`: see `Demand`."""
    return Demand(
        code="settling_time",
        outcome="settling_time",
        sense=AT_MOST,
        required=time,
        unit="s",
        stated=stated,
        amplitude=amplitude,
    )
