"""What a case hands to the framework: numbers with uncertainties, curves, tables; no verdict, no plot."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, Literal, Protocol, SupportsFloat

import numpy as np
import numpy.typing as npt

from ringbalance.physics.results import Status
from ringbalance.scene.arrays import FloatArray

Level = Literal["light", "heavy"]
CurveStyle = Literal["paper", "found", "reference", "points"]
COVERAGE_FACTOR = 2.0
"""Half-widths at 95 % per standard uncertainty."""


def from_half_width(half_width: float) -> float:
    """Standard uncertainty from an expanded uncertainty (95 %)."""
    return half_width / COVERAGE_FACTOR


def from_range(values: Iterable[float]) -> float:
    """Standard uncertainty of a number equally likely between the least and the largest value: GUM, 4.3.7."""
    ends = sorted(values)
    return (ends[-1] - ends[0]) / (2 * math.sqrt(3))


def from_rounding(last_digit: float) -> float:
    """Standard uncertainty of a printed number from one unit of its last digit: u = last_digit/(2 sqrt(3)).

    All within half a unit is equally likely. The expanded uncertainty, 0.58 of the last digit, covers that.
    Source: rectangular distribution, GUM (JCGM 100:2008), 4.3.7.
    """
    return last_digit / (2 * math.sqrt(3))


def input_uncertainty(contributions: Sequence[tuple[Callable[[float], float], float, float]]) -> float:
    """Standard uncertainty from independent inputs: u^2 = sum of [(f(v + u_v) - f(v - u_v))/2]^2.

    Args: `contributions`: f, v and u_v of each input; one whose uncertainty is zero is not evaluated.
    Source: GUM (JCGM 100:2008), 5.1.
    """
    effects = [
        (function(value + standard_uncertainty) - function(value - standard_uncertainty)) / 2
        for function, value, standard_uncertainty in contributions
        if standard_uncertainty > 0
    ]
    return math.hypot(*effects)


@dataclass(frozen=True, kw_only=True)
class Reference:
    """The number that a judged quantity is compared with; SI, in the unit that the case's text names."""

    value: float
    uncertainty: float = 0.0
    """u_D, standard uncertainty."""

    def __post_init__(self) -> None:
        _finite(self.value, self.uncertainty)


@dataclass(frozen=True, kw_only=True)
class Found:
    """A number that a case found; SI, in the unit that the case's text names."""

    value: float
    numerical: float = 0.0
    """u_num, standard uncertainty of the calculation."""
    input: float = 0.0
    """u_input, standard uncertainty from what the calculation was given, without `assumed`."""
    reach: tuple[float, float] = (0.0, 0.0)
    """How far down and up the number moves against its reference while all inputs that nobody gave pass
    through their ranges; what is random is in `input`."""
    corrected: float | None = None
    """The number once the correction that the case's text names is made; None where there is none."""
    conclusive: bool = True
    """False when the sequence behind the number is not asymptotic, or a solve did not succeed."""

    def __post_init__(self) -> None:
        corrected = 0.0 if self.corrected is None else self.corrected
        _finite(self.value, self.numerical, self.input, corrected, *self.reach)

    def moved(self, low: float, high: float) -> Found:
        """The number with more inputs that move it: reaches add, as an assumption is no random error."""
        return dataclasses.replace(
            self, reach=(self.reach[0] + min(low, 0.0), self.reach[1] + max(high, 0.0))
        )

    @property
    def input_standard_uncertainty(self) -> float:
        """u_input with the assumed inputs, the number equally likely within their reach (GUM, 4.3.7)."""
        return math.hypot(self.input, from_range(self.reach))

    def scaled(self, factor: float) -> Found:
        """The number times a positive constant."""
        return dataclasses.replace(
            self, value=self.value * factor, numerical=self.numerical * factor, input=self.input * factor
        )

    def with_correction(self) -> Found:
        """The number with its correction made: what a case finds once the plates are left out."""
        return Found(value=self.value if self.corrected is None else self.corrected)


def as_found(**values: SupportsFloat) -> dict[str, Found]:
    """Numbers without an uncertainty of their own, by the names of the quantities that are judged."""
    return {name: Found(value=float(value)) for name, value in values.items()}


@dataclass(frozen=True, kw_only=True)
class Axis:
    """Values along one direction of a figure."""

    name: str
    unit: str
    values: FloatArray


@dataclass(frozen=True)
class Curve:
    """One line of a figure, of the length of its x axis."""

    name: str
    unit: str
    values: FloatArray
    style: CurveStyle = "found"
    uncertainty: FloatArray | None = None
    """Expanded uncertainty (95 %)."""


@dataclass(frozen=True, kw_only=True)
class Series:
    """One figure of a case."""

    name: str
    x: Axis
    y: Sequence[Curve]
    log: bool = False
    """Both axes logarithmic."""


def figure(name: str, x: tuple[str, str, npt.ArrayLike], *curves: Curve, log: bool = False) -> Series:
    """A figure of curves over one axis, given by its name, unit and values."""
    title, unit, values = x
    axis = Axis(name=title, unit=unit, values=np.asarray(values, dtype=np.float64))
    return Series(name=name, x=axis, y=curves, log=log)


@dataclass(frozen=True, kw_only=True)
class Convergence:
    """Errors, or values, of one quantity over a sequence of levels, coarse to fine."""

    quantity: str
    unit: str
    formal_order: float
    size: Sequence[float]
    """h, relative to the coarsest, coarse to fine."""
    error: Sequence[float] | None = None
    """Against an exact value."""
    value: Sequence[float] | None = None
    """Where there is no exact value."""
    observed_order: Sequence[float] = ()
    """Of each pair of levels, or of each triplet where there is no exact value."""
    gci: float | None = None
    """Grid convergence index of the finest value, relative to it: a bound, of no stated probability."""
    geometry: str = ""
    """ "quadratic" or "straight" where it matters."""
    note: str = ""


@dataclass(frozen=True, kw_only=True)
class Table:
    """A table of a case: columns of equal length, each with its unit."""

    name: str
    columns: Mapping[str, Sequence[float | str]]
    units: Mapping[str, str] = field(default_factory=dict)


@dataclass(frozen=True, kw_only=True)
class Evidence:
    """All that one computation of a case found."""

    found: Mapping[str, Found]
    """By the names of the case's quantities."""
    reference: Mapping[str, Reference] = field(default_factory=dict)
    """What they are compared with, by the same names; a quantity that is not named has none."""
    numbers: Mapping[str, float] = field(default_factory=dict)
    """Further numbers, SI, for the placeholders of the case's text."""
    series: Sequence[Series] = ()
    convergence: Sequence[Convergence] = ()
    tables: Sequence[Table] = ()
    status: Status = field(default_factory=Status)


class CaseCode(Protocol):
    """A case's computation.

    Beside `compute` it may have `ends(scene)`: a shorter way to what is judged, or to the part that assumed
    inputs move, which is asked for at the ends of their ranges.
    """

    def compute(self, scene: Any, level: Level, defect: str | None = None) -> Evidence:
        """What the program finds on a scene, with one of the case's mutations built in by its name."""
        ...


class NotRunError(Exception):
    """Raised by a case that cannot be run on this scene, or not yet; its text says why."""


def _finite(*values: float) -> None:
    if not all(math.isfinite(value) for value in values):
        raise ValueError(f"evidence must be finite, not {values}")
