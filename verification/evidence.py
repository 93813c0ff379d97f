"""Evidence of a case for the framework: numbers with uncertainties, curves and tables.

A computed number S is compared with a reference D (ASME V&V 20): the error E = S - D with the validation
uncertainty u_val = sqrt(u_num^2 + u_input^2 + u_D^2).  All u are standard uncertainties; the half-width
2 u_val covers 95 %.  An error inside it cannot be distinguished from none; one outside it can.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, Literal, Protocol, Self, SupportsFloat

import numpy as np
import numpy.typing as npt

from ringbalance.physics.results import Status
from ringbalance.scene.arrays import FloatArray

Level = Literal["light", "heavy"]
CurveStyle = Literal["paper", "found", "reference", "points"]
COVERAGE_FACTOR = 2.0
"""Half-widths at 95 % per standard uncertainty."""
ROUND_OFF = 1e-13
"""Relative error below which no order of convergence can be observed."""


def from_half_width(half_width: float) -> float:
    """Standard uncertainty from an expanded uncertainty (95 %)."""
    return half_width / COVERAGE_FACTOR


def from_range(values: Iterable[float]) -> float:
    """Standard uncertainty of a number equally likely between the least and the largest value: GUM, 4.3.7."""
    ends = sorted(values)
    return (ends[-1] - ends[0]) / (2 * math.sqrt(3))


def from_rounding(last_digit: float) -> float:
    """Standard uncertainty of a printed number from one unit of its last digit: u = last_digit/(2 sqrt(3)).

    Every value within half a unit is equally likely; the expanded uncertainty, 0.58 of the last digit, covers
    them all.
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
        _check(self.value, uncertainties=(self.uncertainty,))


def printed(value: float, *, last_digit: float) -> Reference:
    """A printed number with the uncertainty of its rounding, from one unit of its last digit."""
    return Reference(value=value, uncertainty=from_rounding(last_digit))


@dataclass(frozen=True, kw_only=True)
class Deviation:
    """Departure of a computed number S from a reference D."""

    error: float
    """E = S - D."""
    half_width: float
    """2 u_val, the expanded uncertainty (95 %) that |E| is compared with."""

    @property
    def consistent(self) -> bool:
        """True if |E| <= 2 u_val: the comparison sees no difference."""
        return abs(self.error) <= self.half_width


@dataclass(frozen=True, kw_only=True)
class Found:
    """A number that a case computed; SI, in the unit that the case's text names."""

    value: float
    numerical: float = 0.0
    """u_num, standard uncertainty of the calculation."""
    input: float = 0.0
    """u_input, standard uncertainty from the given and measured inputs of the calculation."""
    reach: tuple[float, float] = (0.0, 0.0)
    """Lowest and highest change of the error S - D over the ranges of all assumed inputs; random effects are
    in `input`."""
    corrected: float | None = None
    """The number with the correction that the case's text names; None: no correction."""
    conclusive: bool = True
    """False if the sequence behind the number is not asymptotic, or a solve did not succeed."""
    reference: Reference | None = None
    """Number to compare with; None: judged by a limit alone."""

    def __post_init__(self) -> None:
        corrected = 0.0 if self.corrected is None else self.corrected
        _check(self.value, corrected, *self.reach, uncertainties=(self.numerical, self.input))

    @classmethod
    def within(cls, value: SupportsFloat, half_width: SupportsFloat, *, conclusive: bool = True) -> Self:
        """A calculated number with its expanded uncertainty (95 %)."""
        numerical = from_half_width(float(half_width))
        return cls(value=float(value), numerical=numerical, conclusive=conclusive)

    @property
    def error(self) -> float:
        """E = S - D; without a reference the number itself."""
        return self.value - (0.0 if self.reference is None else self.reference.value)

    def against(self, reference: Reference | SupportsFloat) -> Found:
        """The number with its reference; a plain number is an exact one."""
        exact = reference if isinstance(reference, Reference) else Reference(value=float(reference))
        return dataclasses.replace(self, reference=exact)

    def compared(self, reference: Reference) -> Deviation:
        """E = S - D with u_val = sqrt(u_num^2 + u_input^2 + u_D^2).

        A few units in the last place of the larger number are added for round-off.
        Source: ASME V&V 20-2009, sections 1 and 6; independent uncertainties.
        """
        round_off = 4 * math.ulp(max(abs(self.value), abs(reference.value)))
        u_val = math.hypot(self.numerical, self.input, reference.uncertainty, round_off)
        return Deviation(error=self.value - reference.value, half_width=COVERAGE_FACTOR * u_val)

    def moved(self, low: float, high: float) -> Found:
        """The number with a wider reach; reaches add linearly, since an assumption is no random error."""
        return dataclasses.replace(
            self, reach=(self.reach[0] + min(low, 0.0), self.reach[1] + max(high, 0.0))
        )

    def scaled(self, factor: float) -> Found:
        """The number times a positive constant."""
        return dataclasses.replace(
            self, value=self.value * factor, numerical=self.numerical * factor, input=self.input * factor
        )

    def with_correction(self) -> Found:
        """The corrected number in place of the number, such as the one without plates."""
        corrected = self.value if self.corrected is None else self.corrected
        return Found(value=corrected, reference=self.reference)


def as_found(**values: Found | SupportsFloat) -> dict[str, Found]:
    """Judged quantities by name; a plain number has no uncertainty of its own."""
    return {
        name: value if isinstance(value, Found) else Found(value=float(value))
        for name, value in values.items()
    }


@dataclass(frozen=True, kw_only=True)
class FigureAxis:
    """Values along one direction of a figure."""

    name: str
    unit: str
    values: FloatArray


@dataclass(frozen=True)
class FigureCurve:
    """One curve of a figure, with a value at each point of the x axis."""

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
    x: FigureAxis
    y: Sequence[FigureCurve]
    log: bool = False
    """True if both axes are logarithmic."""


def figure(name: str, x: tuple[str, str, npt.ArrayLike], *curves: FigureCurve, log: bool = False) -> Series:
    """A figure of curves over one axis: its name, unit and values."""
    title, unit, values = x
    axis = FigureAxis(name=title, unit=unit, values=np.asarray(values, dtype=np.float64))
    return Series(name=name, x=axis, y=curves, log=log)


@dataclass(frozen=True, kw_only=True)
class Convergence:
    """Errors, or values, of one quantity over a sequence of levels, coarse to fine."""

    quantity: str
    unit: str = "1"
    formal_order: float
    size: Sequence[float]
    """h, relative to the coarsest, coarse to fine."""
    error: Sequence[float] | None = None
    """Errors against an exact value."""
    value: Sequence[float] | None = None
    """Values of the quantity, where no exact one is known."""
    observed_order: Sequence[float] = ()
    """Order of each pair of levels, or of each triplet where no exact value is known."""
    gci: float | None = None
    """Grid convergence index of the finest value, relative to it: a bound, of no stated probability."""
    geometry: str = ""
    """ "quadratic" or "straight" where it matters."""
    note: str = ""

    @classmethod
    def of_errors(
        cls,
        quantity: str,
        formal_order: float,
        *,
        size: Sequence[float],
        error: Sequence[float],
        geometry: str = "",
        note: str = "",
    ) -> Self:
        """Observed orders p = ln(e_i/e_(i+1))/ln(h_i/h_(i+1)) of relative errors, coarse to fine.

        Raises: ValueError: lengths that differ, sizes that do not fall, errors that are negative, not finite
            or at round-off, where no order can be seen.
        """
        h, e = np.asarray(size, dtype=np.float64), np.asarray(error, dtype=np.float64)
        if h.shape != e.shape or h.size < 2:
            raise ValueError("an order study needs at least two levels, with one error each")
        if not (np.all(np.isfinite(h)) and np.all(h > 0) and np.all(np.diff(h) < 0)):
            raise ValueError("sizes must be positive and fall from level to level")
        if not (np.all(np.isfinite(e)) and np.all(e > ROUND_OFF)):
            raise ValueError("errors must be finite and above round-off for an order to be seen")
        return cls(
            quantity=quantity,
            formal_order=formal_order,
            size=h.tolist(),
            error=e.tolist(),
            observed_order=(np.log(e[:-1] / e[1:]) / np.log(h[:-1] / h[1:])).tolist(),
            geometry=geometry,
            note=note,
        )

    @property
    def finest_error(self) -> float:
        """Error on the finest level."""
        return (self.error or ())[-1]

    @property
    def settled_order(self) -> float:
        """The lowest order among the two finest pairs: earlier ones are not yet asymptotic."""
        return min(self.observed_order[-2:])


def orders_found(studies: Mapping[str, Convergence]) -> dict[str, Found]:
    """The settled order and the finest error of each study as judged quantities, by its name."""
    orders = {f"{name}_order": study.settled_order for name, study in studies.items()}
    return as_found(**orders, **{f"{name}_error": study.finest_error for name, study in studies.items()})


def order_figure(studies: Mapping[str, Convergence]) -> Series:
    """Errors of several studies on the same meshes, by the name of their curve."""
    size = next(iter(studies.values())).size
    curves = (FigureCurve(name, "1", np.array(study.error)) for name, study in studies.items())
    return figure("error against mesh size", ("relative mesh size", "1", size), *curves, log=True)


@dataclass(frozen=True, kw_only=True)
class CaseTable:
    """A table of a case: columns of equal length, each with its unit."""

    name: str
    columns: Mapping[str, Sequence[float | str]]
    units: Mapping[str, str] = field(default_factory=dict)


@dataclass(frozen=True, kw_only=True)
class Evidence:
    """All results of one computation of a case."""

    quantities: Mapping[str, Found]
    """Judged numbers by the names of the case's quantities."""
    numbers: Mapping[str, Any] = field(default_factory=dict)
    """Further numbers, SI, for the placeholders of the case's text; kept as floats."""
    series: Sequence[Series] = ()
    convergence: Sequence[Convergence] = ()
    tables: Sequence[CaseTable] = ()
    status: Status = field(default_factory=Status)

    def __post_init__(self) -> None:
        numbers = {name: float(value) for name, value in self.numbers.items()}
        object.__setattr__(self, "numbers", numbers)


class CaseCode(Protocol):
    """A case's computation.

    Beside `compute` it may have `ends(scene)`, called at the ends of the ranges of assumed inputs: a shorter
    calculation of the judged numbers, or of those that depend on these inputs.
    """

    def compute(self, scene: Any, level: Level, defect: str | None = None) -> Evidence:
        """Evidence from a scene, with one of the case's mutations built in by its name."""
        ...


class NotRunError(Exception):
    """A case that cannot be run on this scene, or not yet; the text is the reason."""


def _check(*values: float, uncertainties: Sequence[float]) -> None:
    if not all(map(math.isfinite, (*values, *uncertainties))) or min(uncertainties) < 0:
        raise ValueError(
            f"evidence must be finite, with uncertainties of zero or more, not {values}, {uncertainties}"
        )
