"""What a case hands to the framework: numbers with uncertainties, curves and tables.

And verdicts, from limits that stood before the result: first of each quantity, then of the whole case.

An assumed input can only weaken a verdict. A quantity is confirmed or refuted when it is so at every value
that its assumed inputs may have; where that is not so it is inconclusive, however well the assumed values
agree.

A found number S is compared with a reference D (ASME V&V 20): the error E = S - D with the validation
uncertainty u_val = sqrt(u_num^2 + u_input^2 + u_D^2).  All u are standard uncertainties; the half-width
2 u_val covers 95 %.  An error inside it cannot be distinguished from none; one outside it can.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from enum import StrEnum
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
"""Relative errors below this say nothing about an order."""


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
        _check(self.value, uncertainties=(self.uncertainty,))


def printed(value: float, *, last_digit: float) -> Reference:
    """A printed number with the uncertainty of its rounding, from one unit of its last digit."""
    return Reference(value=value, uncertainty=from_rounding(last_digit))


@dataclass(frozen=True, kw_only=True)
class Comparison:
    """A found number S against a reference D."""

    error: float
    """E = S - D."""
    half_width: float
    """2 u_val, the expanded uncertainty (95 %) that |E| is compared with."""

    @property
    def consistent(self) -> bool:
        """Whether |E| <= 2 u_val: the comparison sees no difference."""
        return abs(self.error) <= self.half_width


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
    reference: Reference | None = None
    """What it is compared with; None where a limit alone judges it."""

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
        """E = S - D, the number itself where it is compared with nothing."""
        return self.value - (0.0 if self.reference is None else self.reference.value)

    def against(self, reference: Reference | SupportsFloat) -> Found:
        """The number beside what it is compared with; a plain number is exact."""
        exact = reference if isinstance(reference, Reference) else Reference(value=float(reference))
        return dataclasses.replace(self, reference=exact)

    def compared(self, reference: Reference) -> Comparison:
        """E = S - D with u_val = sqrt(u_num^2 + u_input^2 + u_D^2).

        A few units in the last place of the larger number are added for round-off.
        Source: ASME V&V 20-2009, sections 1 and 6; independent uncertainties.
        """
        round_off = 4 * math.ulp(max(abs(self.value), abs(reference.value)))
        u_val = math.hypot(self.numerical, self.input, reference.uncertainty, round_off)
        return Comparison(error=self.value - reference.value, half_width=COVERAGE_FACTOR * u_val)

    def moved(self, low: float, high: float) -> Found:
        """The number with more inputs that move it: reaches add, as an assumption is no random error."""
        return dataclasses.replace(
            self, reach=(self.reach[0] + min(low, 0.0), self.reach[1] + max(high, 0.0))
        )

    def scaled(self, factor: float) -> Found:
        """The number times a positive constant."""
        return dataclasses.replace(
            self, value=self.value * factor, numerical=self.numerical * factor, input=self.input * factor
        )

    def with_correction(self) -> Found:
        """The number with its correction made: what a case finds once the plates are left out."""
        corrected = self.value if self.corrected is None else self.corrected
        return Found(value=corrected, reference=self.reference)


def as_found(**values: Found | SupportsFloat) -> dict[str, Found]:
    """Judged quantities by name; a plain number has no uncertainty of its own."""
    return {
        name: value if isinstance(value, Found) else Found(value=float(value))
        for name, value in values.items()
    }


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
    unit: str = "1"
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
    curves = (Curve(name, "1", np.array(study.error)) for name, study in studies.items())
    return figure("error against mesh size", ("relative mesh size", "1", size), *curves, log=True)


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
    numbers: Mapping[str, Any] = field(default_factory=dict)
    """Further numbers, SI, for the placeholders of the case's text; kept as floats."""
    series: Sequence[Series] = ()
    convergence: Sequence[Convergence] = ()
    tables: Sequence[Table] = ()
    status: Status = field(default_factory=Status)

    def __post_init__(self) -> None:
        numbers = {name: float(value) for name, value in self.numbers.items()}
        object.__setattr__(self, "numbers", numbers)


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


def _check(*values: float, uncertainties: Sequence[float]) -> None:
    if not all(map(math.isfinite, (*values, *uncertainties))) or min(uncertainties) < 0:
        raise ValueError(
            f"evidence must be finite, with uncertainties of zero or more, not {values}, {uncertainties}"
        )


Kind = Literal["validation", "code_verification", "solution_verification", "claim"]
Metric = Literal["validation", "within_uncertainty", "relative", "absolute", "at_most", "at_least"]
Role = Literal["number", "idea", "reading"]
"""What a quantity of a claim decides: a number of the paper's, the idea behind it, or one of several
readings."""


class Verdict(StrEnum):
    """What is said of a quantity or a case."""

    PASSED = "passed"
    FAILED = "failed"
    CONFIRMED = "confirmed"
    CORRECTED = "confirmed with correction"
    REFUTED = "refuted"
    INCONCLUSIVE = "inconclusive"
    NOT_RUN = "not run"


_OF_A_CHECK = (Verdict.FAILED, Verdict.INCONCLUSIVE, Verdict.PASSED, Verdict.NOT_RUN)
_OF_A_MODEL = (Verdict.REFUTED, Verdict.INCONCLUSIVE, Verdict.CONFIRMED, Verdict.NOT_RUN)
VOCABULARY: dict[Kind, tuple[Verdict, ...]] = {
    "claim": (*_OF_A_MODEL[:2], Verdict.CORRECTED, *_OF_A_MODEL[2:]),
    "validation": _OF_A_MODEL,
    "code_verification": _OF_A_CHECK,
    "solution_verification": _OF_A_CHECK,
}
"""Verdicts of each kind of case, the one that decides the case first."""


def judge_quantity(*, kind: Kind, metric: Metric, limit: float, found: Found) -> tuple[Verdict, Comparison]:
    """Judge one quantity by its metric and limit, compared with its reference, or with the limit as a bound.

    `validation` (claims) and `within_uncertainty`: E = S - D against 2 u_val, without what assumed inputs
    add. It holds when |E| <= 2 u_val <= limit |D| (limit alone where D is zero) and no assumed input takes
    |E| beyond limit |D|; it does not when no assumed input brings |E| within 2 u_val.  `relative`,
    `absolute`: |E| against limit |D| or limit.  `at_most`, `at_least`: S against the limit, inconclusive in a
    claim when the limit lies inside S's own 95 % interval or within the reach of the assumed inputs.
    Raises: ValueError: a metric that needs a reference, without one.
    """
    bound = metric in ("at_most", "at_least")
    reference = Reference(value=limit) if bound else found.reference
    if reference is None:
        raise ValueError(f'metric "{metric}" needs a reference')
    comparison = found.compared(reference)
    if not found.conclusive:
        return Verdict.INCONCLUSIVE, comparison
    if bound:
        verdict = _by_bound(kind, metric, found, comparison)
    elif metric in ("relative", "absolute"):
        scale = abs(reference.value) if metric == "relative" else 1.0
        verdict = _yes_or_no(kind, abs(comparison.error) <= limit * scale)
    else:
        verdict = _by_uncertainty(kind, limit, found, reference, comparison)
    return verdict, comparison


def _yes_or_no(kind: Kind, holds: bool) -> Verdict:
    if kind in ("claim", "validation"):
        return Verdict.CONFIRMED if holds else Verdict.REFUTED
    return Verdict.PASSED if holds else Verdict.FAILED


def _by_uncertainty(
    kind: Kind, limit: float, found: Found, reference: Reference, comparison: Comparison
) -> Verdict:
    widest = limit * (abs(reference.value) or 1.0)
    low, high = (comparison.error + reach for reach in found.reach)
    if comparison.consistent:
        decided = comparison.half_width <= widest and max(-low, high) <= widest
        return _yes_or_no(kind, True) if decided else Verdict.INCONCLUSIVE
    if low <= comparison.half_width and high >= -comparison.half_width:
        return Verdict.INCONCLUSIVE
    if kind == "claim" and found.corrected is not None:
        departure = abs(found.corrected - reference.value)
        return Verdict.CORRECTED if departure <= comparison.half_width else Verdict.REFUTED
    return _yes_or_no(kind, False)


def _by_bound(kind: Kind, metric: Metric, found: Found, comparison: Comparison) -> Verdict:
    """By the error against the limit; what is exact may lie on the limit."""
    low, high = found.reach
    uncertain = found.numerical > 0 or found.input > 0 or low < 0 or high > 0
    half_width = comparison.half_width
    if (
        kind in ("claim", "validation")
        and uncertain
        and low - half_width <= -comparison.error <= high + half_width
    ):
        return Verdict.INCONCLUSIVE
    holds = comparison.error <= 0 if metric == "at_most" else comparison.error >= 0
    if kind == "claim" and not holds and found.corrected is not None:
        corrected = found.corrected - found.value + comparison.error
        explained = corrected <= half_width if metric == "at_most" else corrected >= -half_width
        return Verdict.CORRECTED if explained else Verdict.REFUTED
    return _yes_or_no(kind, holds)


def combine(*, kind: Kind, verdicts: Sequence[Verdict], roles: Sequence[Role] = ()) -> Verdict:
    """Verdict of a case: that of its quantity that decides; not run when there are none.

    Readings of one claim count together, as the one that speaks most for it. A number that holds after a
    correction leaves a claim confirmed with correction where its idea was judged and confirmed; otherwise it
    is refuted. Args: `roles`: of each verdict, default "number".
    Raises: ValueError: a verdict that this kind of case does not know.
    """
    order = VOCABULARY[kind]
    strange = [verdict for verdict in verdicts if verdict not in order]
    if strange:
        raise ValueError(f'a {kind} case knows no "{strange[0]}"')
    if not verdicts:
        return Verdict.NOT_RUN
    pairs = list(zip(verdicts, roles or ("number",) * len(verdicts), strict=True))
    counted = [verdict for verdict, role in pairs if role != "reading"]
    readings = [verdict for verdict, role in pairs if role == "reading"]
    if readings:
        counted.append(max(readings, key=order.index))
    worst = min(counted, key=order.index)
    if worst is Verdict.CORRECTED and (Verdict.CONFIRMED, "idea") not in pairs:
        return Verdict.REFUTED
    return worst
