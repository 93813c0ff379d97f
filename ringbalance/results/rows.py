"""A quantity and a finding, each as one record: the parts of every output.

A finding is a code with its severity, numbers, sentence, and the change of the scene that corrects it.  A
sentence stands in `sentences.toml` under its code, with its numbers in braces: {limit:m} is the value "limit"
in the unit of length that suits it, {share:%} a fraction as a percentage, {chamber} a text or a number.
"""

from __future__ import annotations

import math
import tomllib
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass, field
from functools import cache
from importlib.resources import files
from string import Formatter
from typing import Any, Literal, TypeVar

from ringbalance.results.numbers import MISSING, Width, believed, format_given, plain, short, shown, with_unit
from ringbalance.results.requirements import Proportion
from ringbalance.scene.registry import registered
from ringbalance.scene.uncertain import NORMAL_95

Made = TypeVar("Made")


@dataclass(frozen=True, kw_only=True)
class Parts:
    """Expanded uncertainties (95 %) of a quantity by cause, in its SI unit."""

    numerical: float = 0.0
    input: float = 0.0
    model: float = 0.0

    @property
    def total(self) -> float:
        """Root of the sum of their squares (ASME V&V 20-2009)."""
        return math.hypot(self.numerical, self.input, self.model)


@dataclass(frozen=True, kw_only=True)
class Quantity:
    """A number with its name, unit and interval; SI throughout."""

    key: str
    """Stable key, such as "stall_pressure"."""
    name: str
    """Name for readers, such as "pressure to empty a chamber"."""
    value: float | None
    """Value, SI; None: no value, for the reason in `status`."""
    unit: str = "1"
    """SI unit."""
    symbol: str = ""
    lower: float | None = None
    upper: float | None = None
    """Ends of the 95 % interval; None: unknown, or unbounded on this side."""
    parts: Parts | None = None
    causes: Mapping[str, float] = field(default_factory=dict)
    """Expanded uncertainties (95 %) of the parts `input` and `model` by cause, SI: path in the scene file,
    "fitted" for all inputs that were fitted together, or error of a model such as "model: ends"."""
    origin: str = "computed"
    """ "computed", "simulated", "fitted", "given", "inferred", "assumed", "measured" or "default"."""
    status: str = "ok"
    """ "ok" or the code of the finding that limits it."""
    digits: int = 4
    """Significant digits of the value in texts where it has no uncertainty."""

    @classmethod
    def of_fraction(cls, fraction: Proportion, *, key: str, name: str) -> Quantity:
        """Fraction of simulated devices with its 95 % interval."""
        low, high = fraction.low, fraction.high
        return cls(key=key, name=name, value=fraction.value, lower=low, upper=high, origin="simulated")

    @classmethod
    def simulated(cls, key: str, name: str, value: float | None, unit: str, status: str = "ok") -> Quantity:
        """Result of runs, with three digits."""
        return cls(key=key, name=name, value=value, unit=unit, origin="simulated", status=status, digits=3)

    @property
    def width(self) -> Width:
        """Distances of both ends from the value; None without an interval."""
        if self.value is None or (self.lower is None and self.upper is None):
            return None
        below = math.inf if self.lower is None else self.value - self.lower
        above = math.inf if self.upper is None else self.upper - self.value
        return max(below, 0.0), max(above, 0.0)

    @property
    def text(self) -> str:
        """Value and interval in the unit that suits them, such as (72.043 ± 0.032) mm."""
        if self.width is not None:
            return shown(self.value, self.unit, self.width)
        return format_given(self.value, self.unit, digits=self.digits)

    def with_unit(self, make: Callable[[float | None, str], Made]) -> Made:
        """The value with its unit, such as `with_unit(pint.UnitRegistry().Quantity)`."""
        return make(self.value, self.unit)

    def with_deviation(self, make: Callable[[float | None, float], Made]) -> Made:
        """The value with its standard deviation, such as `with_deviation(uncertainties.ufloat)`.

        The standard deviation is that of a normal distribution with a 95 % interval of this width; zero
        unless both ends are known.
        """
        if self.lower is None or self.upper is None:
            return make(self.value, 0.0)
        return make(self.value, (self.upper - self.lower) / 2.0 / NORMAL_95)

    def document(self) -> dict[str, Any]:
        """For JSON."""
        document = asdict(self)
        del document["digits"]
        if self.parts is None:
            del document["causes"]
        return document


def around(value: float, total: float | None, *, stated: bool = True) -> tuple[float | None, float | None]:
    """Ends of a symmetric 95 % interval, cut at zero where the value is not negative, as no size, time,
    pressure or moment is; (None, None) where `believed` gives no uncertainty.
    """
    width = believed(value, total, stated=stated)
    if not width:
        return None, None
    return max(value - width, 0.0 if value >= 0 else -math.inf), value + width


Severity = Literal["info", "warning", "error"]
Value = float | str | Quantity | Sequence[str] | None
Mark = Callable[[str, str], str]
"""Function of a value's name and text: the text for the sentence, such as one with its trace."""


@dataclass(frozen=True, kw_only=True)
class Finding:
    """A statement about a result; its code is stable and documented, its sentence is not."""

    code: str
    values: Mapping[str, Value] = field(default_factory=dict)
    """Values, SI, by the names in the sentence."""
    change: Mapping[str, float | str] = field(default_factory=dict)
    """New values, SI, by path of a key of the scene; they replace the general ones of the code."""

    @property
    def severity(self) -> Severity:
        """Severity of the code."""
        return sentence_of(self.code).severity

    @property
    def changes(self) -> dict[str, float | str]:
        """Changes by path of a key in the scene: "raise", "lower", "set", or the value, SI."""
        return {**sentence_of(self.code).change, **self.change}

    @property
    def text(self) -> str:
        """The sentence, for a terminal."""
        return plain(self.sentence())

    def sentence(self, mark: Mark = lambda _name, text: text) -> str:
        """The sentence with typographic signs; each number goes through `mark`."""
        values = {name: _Filled(name, value, mark) for name, value in self.values.items()}
        return Formatter().vformat(sentence_of(self.code).text, (), values)

    def document(self) -> dict[str, Any]:
        """Record for JSON; a quantity is written as its value."""
        values = {name: v.value if isinstance(v, Quantity) else v for name, v in self.values.items()}
        return {
            "code": self.code,
            "severity": self.severity,
            "values": values,
            "change": self.changes,
            "text": self.text,
        }


def text_of(code: str, **values: Value) -> str:
    """The sentence of a code, for a terminal."""
    return Finding(code=code, values=values).text


@dataclass(frozen=True, kw_only=True)
class _Sentence:
    """Entry of `sentences.toml` under a code."""

    severity: Severity
    text: str
    change: Mapping[str, float | str] = field(default_factory=dict)

    @property
    def values(self) -> tuple[str, ...]:
        """Names of the values in the text."""
        return tuple(dict.fromkeys(name for _, name, _, _ in Formatter().parse(self.text) if name))


@cache
def sentences() -> Mapping[str, _Sentence]:
    """All codes with their sentences, in the order of the file."""
    content = (files("ringbalance.results") / "sentences.toml").read_text(encoding="utf-8")
    return {code: _Sentence(**entry) for code, entry in tomllib.loads(content).items()}


def sentence_of(code: str) -> _Sentence:
    """Sentence of a code; "name.code" is one of a balancer, which brings its own (`registry.register`)."""
    balancer, dot, rest = code.partition(".")
    return _Sentence(**registered("sentences", balancer)[rest]) if dot else sentences()[code]


def series(names: Sequence[str]) -> str:
    """Names joined for a sentence: "a, b and c"."""
    return f"{', '.join(names[:-1])} and {names[-1]}" if len(names) > 1 else "".join(names)


@dataclass(frozen=True)
class _Filled:
    """A value in a sentence; the format after its name is a unit, perhaps with digits: {gain:s/m;3}.

    A quantity has its own unit and as many digits as its uncertainty supports; another number is as short as
    its significant digits (four by default) allow, in the unit that suits it; names become "a, b and c".
    """

    name: str
    value: Value
    mark: Mark

    def __format__(self, spec: str) -> str:
        value, (unit, _, digits) = self.value, spec.partition(";")
        if value is None:
            text = MISSING
        elif isinstance(value, Quantity):
            text = value.text
        elif isinstance(value, str):
            text = value
        elif isinstance(value, Sequence):
            text = series(value)
        elif unit == "%":
            text = with_unit(short(100 * value, digits=int(digits or 4)), unit)
        else:
            exact = len(str(value)) if isinstance(value, int) else 0
            text = format_given(value, unit or "1", digits=max(int(digits or 4), exact))
        return self.mark(self.name, text)
