"""Interface of every balancer, and the balancer of a scene.

`simulate`, `tune`, `compare` and the first half of `fit` use `Balancer` alone.  A further balancer is a
sub-package with its scene's keys and a subclass, and one line that registers it
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
from ringbalance.controller.trials import MEASURE_INPUT, DrawnInput, Information, Trials
from ringbalance.reduced_model.law.flow_law import UNCHECKED
from ringbalance.results.requirements import AT_LEAST, AT_MOST
from ringbalance.results.result import Rows
from ringbalance.results.rows import Finding, Quantity
from ringbalance.scene.arrays import BoolArray, FloatArray
from ringbalance.scene.kinds import scene_kind
from ringbalance.scene.narrowing import scene_as
from ringbalance.scene.origins import SceneFile
from ringbalance.scene.registry import registered, unusable
from ringbalance.scene.units import DIMENSIONS

WATCH_TIME_S: Final = 60.0
"""Time for which a run is watched after it has held its limit, s."""
REQUIRED_FRACTION: Final = 0.9
"""Fraction of the devices that must meet every demand, unless the scene states another."""
ENERGY_NONE: Final = "energy_none"
"""Energy kind of a balancer that states no energy."""
ROTOR_AMPLITUDE: Final = "rotor_amplitude"
"""Code of the demand of `rotor_within`."""
Settings = Mapping[str, Any]
"""Values that a controller or designer may choose, by path in a scene file; numbers in SI."""
Progress = Callable[[float, float], None]
"""Called with the simulated time and the time limit, s."""


@dataclass(frozen=True, kw_only=True)
class Input:
    """A quantity of a balancer that is not known exactly."""

    path: str
    """Path in a scene file, such as "tube.bore"."""
    value: float
    """SI."""
    half_width: float
    """Expanded uncertainty (95 %), SI; zero: the scene states none."""
    unit: str
    """SI unit; "1" for a number without unit."""


@dataclass(frozen=True, kw_only=True)
class Setting:
    """Value that a controller or a designer may change without building another machine."""

    path: str
    value: float
    """Value of the scene, SI."""
    lowest: float
    highest: float

    @classmethod
    def about(cls, path: str, value: float, *, factor: float) -> Setting:
        """Setting that may change by a factor, up and down."""
        return cls(path=path, value=value, lowest=value / factor, highest=value * factor)


@dataclass(frozen=True, kw_only=True)
class Draws:
    """Numbers of the devices to run; a number stands for the same device and noise under every setting.

    `ringbalance.scene.draws` gives the quantile of each input of a numbered device.
    """

    numbers: tuple[int, ...]
    devices: bool = True
    """True if the inputs are drawn; False: each is as in the scene, and the noise alone differs."""
    complete: bool = True
    """True if every run is carried out; False, in a search: the result of a run that is known not to settle
    is the least vibration that the device can reach, and a run may end soon after it should have settled."""
    deadline: float = math.inf
    """Time at which a run above its limit may end undecided, s; without effect where every run is watched to
    its end."""

    @classmethod
    def first(cls, count: int, *, devices: bool = True) -> Draws:
        """Devices 0 to `count - 1`."""
        return cls(numbers=tuple(range(count)), devices=devices)

    @classmethod
    def block(cls, start: int, count: int, *, complete: bool = True, deadline: float = math.inf) -> Draws:
        """Devices `start` to `start + count - 1`."""
        return cls(numbers=tuple(range(start, start + count)), complete=complete, deadline=deadline)


AS_GIVEN: Final = Draws.first(1, devices=False)
"""The scene as stated, with its own seed."""


class Run(Protocol):
    """One traced run, the result of `simulate`."""

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
    """Vibration of the rotor itself, m zero-to-peak."""
    energy: float
    """Energy that the run took, J."""
    usable_moment: float
    """Largest unbalance that the device cancels in the direction of its own, kg m."""
    unbalance: float
    """Unbalance of its rotor, kg m."""
    ended: str
    """Code of the finding on the end of the run."""
    crater: float = math.nan
    """Deepest crater of the gas jet at an injection, over the ring's depth there; NaN: no gas hole."""
    lost: float = math.nan
    """Part of its working liquid that the run has lost, at most; NaN: not known, or not required."""
    run: Any = None
    """The `Run`; None: it was not traced."""
    worst_amplitude: float = math.nan
    """Largest amplitude while balancing, m zero-to-peak; NaN if not traced."""

    @property
    def settled(self) -> bool:
        """True if it has settled."""
        return math.isfinite(self.settling_time)


@dataclass(frozen=True, kw_only=True, eq=False)
class Outcomes:
    """Results of runs in the order of the draws: the numbers of `RunResult` as arrays of shape (n,), empty
    where they are NaN for all."""

    settling_time: FloatArray
    final_amplitude: FloatArray
    energy: FloatArray
    usable_moment: FloatArray
    unbalance: FloatArray
    ended: tuple[str, ...]
    numbers: tuple[int, ...] = ()
    inputs: Mapping[str, FloatArray] = field(default_factory=dict)
    """Quantiles of every drawn input by its name, in (0, 1); empty where no device is drawn."""
    clipped: Mapping[str, int] = field(default_factory=dict)
    """Number of devices, by input, that cannot have its drawn value."""
    traced: tuple[RunResult, ...] = ()
    crater: FloatArray = field(default_factory=lambda: np.empty(0))
    lost: FloatArray = field(default_factory=lambda: np.empty(0))

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

        Args: `inputs`: quantile of every drawn input, by device. `clipped`: name of an input for each device
            that cannot have its drawn value. `trace`: true if the runs are kept.
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
        """Add the outcomes of further draws."""
        return Outcomes(
            **{name: np.concatenate([getattr(self, name), getattr(more, name)]) for name in ARRAYS},
            ended=self.ended + more.ended,
            numbers=self.numbers + more.numbers,
            inputs={name: np.concatenate([at, more.inputs[name]]) for name, at in self.inputs.items()},
            clipped=Counter(self.clipped) + Counter(more.clipped),
            traced=self.traced + more.traced,
        )


ARRAYS: Final = ("settling_time", "final_amplitude", "energy", "usable_moment", "unbalance", "crater", "lost")


@dataclass(frozen=True, kw_only=True)
class Demand:
    """Demand on every device, as a function of the outcome of its run."""

    code: str
    """Code of the finding on it, such as "settling_time"."""
    outcome: str
    """Name of the array of `Outcomes` that is compared with `required`."""
    sense: str
    """`AT_LEAST` or `AT_MOST`."""
    required: float
    """SI."""
    unit: str
    stated: bool
    """True if the scene states it; else it holds for every run."""
    amplitude: float | None = None
    """Vibration at or below which a device counts as settled, m zero-to-peak, if [requirement] has it."""

    def met(self, outcomes: Outcomes) -> BoolArray:
        """True for each device that meets the demand, shape (n,)."""
        reached = getattr(outcomes, self.outcome)
        return np.asarray(reached >= self.required if self.sense == AT_LEAST else reached <= self.required)


@dataclass(frozen=True, kw_only=True)
class Remedy:
    """A change of the scene by which more devices may meet its demands."""

    code: str
    """Code of the sentence that names it, such as "bore"."""
    changes: Settings
    """New values by path, SI, as in `SceneFile.with_values`."""
    name: str = ""
    """Name of a part that can be bought; else empty."""
    continuous: bool = False
    """True if values between this and another of its kind are possible as well."""
    assumed: tuple[str, ...] = ()
    """Paths of the changes that neither the scene nor a data sheet states: the program assumes them."""


class Balancer(ABC):
    """A balancer on its rotor, as a scene describes both: the interface that every command uses.

    Made by `balancer_of`; immutable, so that a balancer gives the same rows in every process.  Methods that
    are not abstract suit a balancer whose runs are watched to their end and whose scene states no more than
    that they settle.
    """

    scene: Any
    options: frozenset[str] = frozenset()
    """Names of further arguments besides the scene, such as "flow_law"."""
    verdict_draws: tuple[int, int] = (16, 64)
    """Numbers of devices of a verdict, first and largest."""
    energy_kind: str
    """Code of the sentence that names the energy that runs count."""
    watched_to_end: bool = True
    """True if every run is watched to its time limit, whatever the arguments."""

    def __init__(self, scene: Any, rotors: Rotors | None = None) -> None:
        self.scene, self._rotors = scene, rotors

    @property
    def models_used(self) -> tuple[Any, ...]:
        """Every physical term, with its model and its estimated contribution; empty: one model covers all."""
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
        """Closed-loop runs, one for each draw. Args: `settings`: by path, SI; default the scene's.

        `trace`: true if the runs themselves are kept; their results are the same.
        """

    def run_all(
        self,
        settings: Sequence[Settings],
        draws: Draws,
        *,
        watch_time: float = WATCH_TIME_S,  # noqa: ARG002
    ) -> tuple[Outcomes, ...]:
        """Run several settings, without traces.

        Args: `watch_time`: time for which a run is watched after it has held its limit, s, unless every run
            is watched to its end.
        """
        return tuple(self.run(each, draws) for each in settings)

    def required_fraction(self) -> float:
        """Fraction of the devices that must meet every demand."""
        return REQUIRED_FRACTION

    def demands(self) -> tuple[Demand, ...]:
        """Demands on every device: first that it settles in time, then any others of the scene."""
        return (settles_within(self.span(), stated=False),)

    def reported(self) -> tuple[Demand, ...]:
        """Quantities of every device that are reported beside the demands, and decide no verdict."""
        return ()

    def trials(self) -> tuple[Trials, ...]:
        """Settings to try, of the scene's kind of controller first; empty: there are none."""
        return ()

    def remedies(self) -> tuple[Remedy, ...]:
        """Changes of the scene to try where too few devices meet its demands, each by itself.

        Changes of one kind follow each other, the smallest first.
        """
        return ()

    def choices(self) -> tuple[Remedy, ...]:
        """Parts that can be bought for what the scene leaves open; results do not include them."""
        return ()

    def information(self, scene: SceneFile) -> Information:  # noqa: ARG002
        """Information on the loop that needs no run, for the scene with other settings."""
        return Information()

    def beyond_capacity(self, scene: SceneFile, ended: Sequence[str], settings: str) -> tuple[Finding, ...]:  # noqa: ARG002
        """Findings on devices whose runs ended for lack of capacity, for the scene with other settings.

        Args: `settings`: name of these settings in the findings.
        """
        return ()

    def drawn_input(self, name: str) -> DrawnInput:
        """Kind of an input of `Outcomes.inputs`: a key of the scene can be measured itself."""
        table, _, key = name.split("[")[0].partition(".")
        declared = scene_kind(self.scene.balancer).schema.key_at((table, key))
        return DrawnInput(common=declared.common, measure=MEASURE_INPUT, path=name)

    def after_loss(self, part: float) -> Self:  # noqa: ARG002
        """This balancer without a part of its working liquid, of which its controller does not know."""
        return self

    def on_scene(self, scene: SceneFile) -> Self:
        """Balancer of another scene of its kind, with the same options."""
        return type(self)(scene_as(type(self.scene), scene), self._rotors)

    @abstractmethod
    def rotor(self, number: int | None = None) -> CommonRotor:
        """The rotor alone. Args: `number`: of a drawn device; default the scene's rotor.

        Raises: SceneError: the rotor stands still, or never vibrates steadily.
        """

    @abstractmethod
    def on_rotor(self, rotor: CommonRotor, rotors: Rotors | None = None) -> Self:
        """This balancer on a rotor at constant speed in steady vibration, with one requirement: to come below
        that rotor's limit, in the time that it leaves.

        Args: `rotors`: of the drawn devices; default the balancer's own. Raises: SceneError: the balancer
            cannot work on the rotor.
        """

    @abstractmethod
    def sampling_time(self) -> float:
        """Time from one sample of the vibration to the next, s."""

    def span(self) -> float:
        """Time from the start of balancing to the end of a run, s."""
        return float(self.scene.run.time_limit)

    @abstractmethod
    def lasting(self, span: float) -> Self:
        """Balancer whose runs balance for `span`, s, and continue when they have settled."""

    @abstractmethod
    def quantities(self) -> tuple[Quantity, ...]:
        """Quantities known without a run; among them "reach", the largest unbalance that the balancer cancels
        in every direction, kg m."""

    @abstractmethod
    def rows(self, run: Any) -> Rows:
        """Rows of a traced run, as `simulate` prints them.

        A finding has the changes of the scene that would remedy it (`Finding.changes`).
        """

    @abstractmethod
    def history(self, run: Any) -> Mapping[str, Sequence[Any]]:
        """Histories of a traced run by the name of their column, with the unit in the name."""


def balancer_class_of(name: str) -> Any:
    """Class of a registered balancer. Raises: SceneError: none, or one that lacks methods."""
    kind = registered("balancer", name)
    if not (isinstance(kind, type) and issubclass(kind, Balancer)):
        raise unusable(name, f"{kind!r} is no subclass of ringbalance.controller.balancer.Balancer")
    if missing := sorted(getattr(kind, "__abstractmethods__", ())):
        raise unusable(name, f"{kind.__name__} has no {', '.join(missing)}")
    return kind


def balancer_of(scene: SceneFile, **options: Any) -> Balancer:
    """The balancer of a scene.

    Args: `options`: of its class, such as `flow_law` of a liquid ring; None counts as not given.
    Raises: ValueError: an option that this balancer does not have.
    """
    balancer_class = balancer_class_of(scene.balancer)
    stated = {name: value for name, value in options.items() if value is not None}
    if foreign := sorted(set(stated) - balancer_class.options):
        raise ValueError(f"the balancer {scene.balancer} has no {', '.join(foreign)}: leave that out")
    balancer: Balancer = balancer_class(scene, **stated)
    return balancer


def takes(scene: SceneFile, option: str) -> bool:
    """True if the balancer of a scene has an option, such as "flow_law"."""
    return option in balancer_class_of(scene.balancer).options


def quick_balancer(scene: SceneFile) -> Balancer:
    """Balancer for runs of many designs; under the unchecked flow law if it has a flow law."""
    return balancer_of(scene, flow_law=UNCHECKED) if takes(scene, "flow_law") else balancer_of(scene)


def inputs_of(scene: SceneFile, width: Callable[[str, float], float] | None = None) -> tuple[Input, ...]:
    """Every value of a scene that may be uncertain by its schema.

    Args: `width`: half-width, SI, by path and value; default that of the scene.
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


def rotor_within(amplitude: float, *, code: str = ROTOR_AMPLITUDE, stated: bool) -> Demand:
    """Demand on the vibration of the rotor at the end of its run, m, which a sensor's runout hides."""
    return Demand(
        code=code,
        outcome="final_amplitude",
        sense=AT_MOST,
        required=amplitude,
        unit="m",
        stated=stated,
    )


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
