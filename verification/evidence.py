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


@dataclass(frozen=True, kw_only=True)
class Comparison:
    """A found number against a reference."""

    error: float
    """E = S - D."""
    validation_uncertainty: float
    """u_val, standard."""

    @property
    def half_width(self) -> float:
        """2 u_val, the expanded uncertainty (95 %) that |E| is compared with."""
        return COVERAGE_FACTOR * self.validation_uncertainty

    @property
    def consistent(self) -> bool:
        """Whether |E| <= 2 u_val: the comparison sees no difference."""
        return abs(self.error) <= self.half_width


def compare(
    *,
    found: float,
    reference: float,
    numerical: float = 0.0,
    input_: float = 0.0,
    reference_uncertainty: float = 0.0,
) -> Comparison:
    """Compare a found number S with a reference D: E = S - D, u_val = sqrt(u_num^2 + u_input^2 + u_D^2).

    A few units in the last place of the larger number are added for round-off.
    Args: `numerical`, `input_` and `reference_uncertainty` are standard uncertainties in the unit of S.
    Raises: ValueError: a number that is not finite, or a negative uncertainty.
    Source: ASME V&V 20-2009, sections 1 and 6; independent uncertainties.
    """
    parts = (numerical, input_, reference_uncertainty)
    if not all(math.isfinite(value) for value in (found, reference, *parts)) or min(parts) < 0:
        raise ValueError("a comparison needs finite numbers and uncertainties that are not negative")
    round_off = 4 * math.ulp(max(abs(found), abs(reference)))
    return Comparison(error=found - reference, validation_uncertainty=math.hypot(*parts, round_off))


def judge_quantity(
    *, kind: Kind, metric: Metric, limit: float, found: Found, reference: Reference | None
) -> tuple[Verdict, Comparison]:
    """Judge one quantity by its metric and limit, compared with its reference, or with the limit as a bound.

    `validation` (claims) and `within_uncertainty`: E = S - D against 2 u_val, without what assumed inputs
    add. It holds when |E| <= 2 u_val <= limit |D| (limit alone where D is zero) and no assumed input takes
    |E| beyond limit |D|; it does not when no assumed input brings |E| within 2 u_val.  `relative`,
    `absolute`: |E| against limit |D| or limit.  `at_most`, `at_least`: S against the limit, inconclusive in a
    claim when the limit lies inside S's own 95 % interval or within the reach of the assumed inputs.
    Raises: ValueError: a metric that needs a reference, without one.
    """
    bound = metric in ("at_most", "at_least")
    if reference is None and not bound:
        raise ValueError(f'metric "{metric}" needs a reference')
    against = Reference(value=limit) if bound or reference is None else reference
    comparison = compare(
        found=found.value,
        reference=against.value,
        numerical=found.numerical,
        input_=found.input,
        reference_uncertainty=against.uncertainty,
    )
    if not found.conclusive:
        return Verdict.INCONCLUSIVE, comparison
    if bound:
        verdict = _by_bound(kind, metric, found, comparison)
    elif metric in ("relative", "absolute"):
        scale = abs(against.value) if metric == "relative" else 1.0
        verdict = _yes_or_no(kind, abs(comparison.error) <= limit * scale)
    else:
        verdict = _by_uncertainty(kind, limit, found, against, comparison)
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
