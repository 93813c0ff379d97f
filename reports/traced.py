"""The evidence as templates see it, and the one filter that formats, typesets and traces what they print.

A number taken out of the evidence carries its path there, so that a template need not repeat it.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from types import MappingProxyType
from typing import Any, Final, Literal, overload

from markupsafe import Markup, escape

from ringbalance.reports.prose import typeset
from ringbalance.results import numbers
from ringbalance.results.result import Table
from ringbalance.scene.fitted import MODEL

Form = Literal["measured", "given", "percent", "change", "fixed"]

UNITS: Final = MappingProxyType(
    {
        "s_per_m": "s/m",
        "kg_m3": "kg/m^3",
        "m2_s": "m^2/s",
        "rad_s": "rad/s",
        "kg_m": "kg m",
        "m_s": "m/s",
        "m3": "m^3",
        "Pa": "Pa",
        "rad": "rad",
        "kg": "kg",
        "m": "m",
        "s": "s",
        "J": "J",
        "V": "V",
    }
)
"""Units by the endings of the evidence's keys, the longest first."""
_SYMBOL: Final = re.compile(r"(?<![\w.])([A-Za-zα-ωΑ-Ω])_([A-Za-zΩ]{1,3})(?!\w)")


def marked(text: str, value: object) -> str:
    """A value's text in an element that names the value's dotted path in the evidence, where it has one."""
    path = getattr(value, "path", "")
    return Markup('<span data-from="{}">{}</span>').format(path, text) if path else text


def evidence_at(evidence: Any, path: str) -> Any:
    """Value of the evidence at a dotted path; in a list by position, or by the `id` or `key` of an item.

    Raises: KeyError, IndexError: no such value.
    """
    for key in path.split("."):
        if not isinstance(evidence, list):
            evidence = evidence[key]
        elif key.lstrip("-").isdigit():
            evidence = evidence[int(key)]
        else:
            evidence = {item.get("id", item.get("key")): item for item in evidence}[key]
    return evidence


def budgets_of(evidence: Mapping[str, Any]) -> dict[str, Any]:
    """Quantities of the calibration that have an uncertainty budget, by key; empty without a calibration."""
    quantities = (evidence.get("calibration") or {}).get("quantities") or ()
    return {each["key"]: each for each in quantities if each["parts"]}


def inputs_of(quantity: Mapping[str, Any]) -> dict[str, float]:
    """Half-widths (95 %) of a quantity by the inputs of the scene that cause them."""
    return {path: width for path, width in quantity["causes"].items() if not path.startswith(MODEL)}


def total_of(quantity: Mapping[str, Any]) -> float:
    """Half-width (95 %) of a quantity: from its value to the farther end of its interval.

    Where the interval has no ends, the root of the sum of the squares of its parts.
    """
    value, ends = quantity["value"], (quantity.get("lower"), quantity.get("upper"))
    distances = [abs(end - value) for end in ends if end is not None and value is not None]
    return max(distances, default=math.hypot(*quantity["parts"].values()))


def states_uncertainty(evidence: Any) -> bool:
    """True if the scene file states the uncertainty of any input."""
    return bool(evidence.get("scene", {}).get("states_uncertainty"))


class Number(float):
    """A number of the evidence with its dotted path."""

    __slots__ = ("path",)
    path: str

    def __new__(cls, value: float, path: str) -> Number:
        number = super().__new__(cls, value)
        number.path = path
        return number


class Count(int):
    """A whole number of the evidence with its dotted path."""

    path: str

    def __new__(cls, value: int, path: str) -> Count:
        number = super().__new__(cls, value)
        number.path = path
        return number


class _Items(Sequence[Any]):
    """A list of the evidence; quantities of a result stand in it by `key`."""

    def __init__(self, values: Sequence[Any], path: str) -> None:
        self._values, self._path = values, path

    @overload
    def __getitem__(self, index: int) -> Any: ...
    @overload
    def __getitem__(self, index: slice) -> list[Any]: ...
    def __getitem__(self, index: int | slice) -> Any:
        if isinstance(index, slice):
            return [self[i] for i in range(*index.indices(len(self)))]
        value = self._values[index]
        key = value.get("key", "") if isinstance(value, Mapping) else ""
        return placed(value, f"{self._path}.{key if key.isidentifier() else index}")

    def __len__(self) -> int:
        return len(self._values)


class Part(Mapping[str, Any]):
    """A record of the evidence."""

    def __init__(self, record: Mapping[str, Any], path: str) -> None:
        self._record, self._path = record, path

    def __getitem__(self, key: str) -> Any:
        if "." in key:
            # A quantile's name has a dot and so cannot be in a dotted path.
            return self._record[key]
        return placed(self._record[key], f"{self._path}.{key}" if self._path else key)

    def __iter__(self) -> Iterator[str]:
        return iter(self._record)

    def __len__(self) -> int:
        return len(self._record)


def placed(value: Any, path: str = "") -> Any:
    """A value of the evidence with its dotted path, which its parts carry as well; texts are unchanged."""
    if isinstance(value, Mapping):
        return Part(value, path)
    if isinstance(value, list | tuple):
        return _Items(value, path)
    if isinstance(value, bool) or not isinstance(value, int | float):
        return value
    return Number(value, path) if isinstance(value, float) else Count(value, path)


def unit_of(path: str) -> str:
    """SI unit by the ending of a key; "1" without such an ending."""
    key = next((part for part in reversed(path.split(".")) if not part.lstrip("-").isdigit()), "")
    return next((unit for ending, unit in UNITS.items() if key.endswith(f"_{ending}")), "1")


def printed(
    value: float | None,
    width: float | None = None,
    *,
    digits: int | None = None,
    unit: str | None = None,
    form: Form = "measured",
) -> str:
    """A number as the page shows it, traced to its path in the evidence.

    Args: `width`: half-width (95 %) in SI, which decides the digits. `digits`: significant ones, without a
        width; decimals of "fixed". `unit`: SI; by default what the evidence's key says. `form`: "given" for
        prescribed numbers, "percent" for fractions, "change" for signed ones, "fixed" for decimals.
    Raises: ValueError: a number that is not finite.
    """
    if value is None:
        return numbers.MISSING
    number, unit = float(value), unit_of(getattr(value, "path", "")) if unit is None else unit
    if form == "measured":
        text = numbers.shown(number, unit, None if width is None else float(width), digits=digits or 4)
    elif form == "given":
        text = numbers.format_given(number, unit, digits=digits or 6)
    elif form == "fixed":
        text = numbers.fixed(number, digits or 0)
    else:
        text = numbers.percent(number, digits=digits or 2, signed=form == "change")
    return marked(text, value)


@dataclass(frozen=True, kw_only=True)
class _NumberColumn:
    """Numbers in one unit and with equal decimals, to the last digit of the largest."""

    symbol: str
    texts: list[str]


def column(values: _Items, digits: int = 6) -> _NumberColumn:
    """A column of the evidence in the unit that suits its largest value, which has `digits` digits."""
    numbers_of = list(values)
    display = numbers.display_unit(unit_of(numbers_of[0].path), *numbers_of)
    largest = max(abs(value) for value in numbers_of) * display.factor
    decimals = max(digits - 1 - math.floor(math.log10(largest)), 0) if largest else 0
    texts = [marked(numbers.fixed(value * display.factor, decimals), value) for value in numbers_of]
    return _NumberColumn(symbol=display.symbol, texts=texts)


def span(ends: Sequence[float] | None, unit: str | None = None, digits: int = 3) -> str:
    """Both ends of an interval in one unit; empty without one, or if `digits` do not separate the ends."""
    if ends is None:
        return ""
    low, high = ends
    display = numbers.display_unit(unit or "1", low, high)
    texts = [numbers.number(end * display.factor, digits=digits) for end in (low, high)]
    if texts[0] == texts[1]:
        return ""
    least, most = (marked(text, end) for text, end in zip(texts, (low, high), strict=True))
    both = Markup("up to {}").format(most) if low == 0 else Markup("{} to {}").format(least, most)
    return both + escape(numbers.with_unit("", display.symbol))


def table_of(texts: Sequence[str], caption: str = "", style: str = "narrow") -> Table:
    """A table with a row for each text, which has a line `Head :: cell` for each column; both stay markup.

    Columns that are empty in every row are left out.
    """
    lines = [[line.partition("::") for line in text.splitlines() if "::" in line] for text in texts]
    rows = [[(head.strip(), cell.strip()) for head, _, cell in row] for row in lines]
    heads = [head for head, _ in rows[0]] if rows else []
    columns = [i for i in range(len(heads)) if any(row[i][1] for row in rows)]
    return Table(
        caption=caption,
        heads=[heads[i] for i in columns],
        rows=[[row[i][1] for i in columns] for row in rows],
        style=style,
    )


def listing_of(text: str, heads: Sequence[str], caption: str = "", style: str = "narrow") -> Table:
    """A table of the lines `Label :: cell :: cell` of a text; an empty one is left out."""
    rows = [[cell.strip() for cell in line.split("::")] for line in text.splitlines() if "::" in line]
    filled = [row for row in rows if any(cell not in {"", numbers.MISSING} for cell in row[1:])]
    return Table(caption=caption, heads=[Markup(head) for head in heads], rows=filled, style=style)


def _part_of(part: float, budget: Mapping[str, Any], total: float | None) -> str:
    """Part of an uncertainty to the second digit of the total, in the value's unit; smaller: "< ..."."""
    if total is None:
        return numbers.MISSING
    factor = numbers.display_unit(budget["unit"], budget["value"], total).factor
    exponent = math.floor(math.log10(total * factor)) - 1
    decimals = max(-exponent, 0)
    if round(part * factor, -exponent) == 0:
        return f"< {numbers.fixed(10.0**exponent, decimals)}"
    return marked(numbers.fixed(round(part * factor, -exponent), decimals), part)


def finished(value: object) -> object:
    """Text as it goes onto the page: typeset, an index such as that of K_B below the line; counts traced.

    Markup, and text that is marked `verbatim`, is left as it is.
    Raises: TypeError: a float, which must pass through a filter.
    """
    if isinstance(value, float):
        raise TypeError(f"{getattr(value, 'path', value)} is printed without a filter")
    if isinstance(value, Count):
        return marked(str(value), value)
    if not isinstance(value, str) or isinstance(value, Markup):
        return value
    text = typeset(value)
    return Markup(_SYMBOL.sub(r"\1<sub>\2</sub>", str(escape(text)))) if _SYMBOL.search(text) else text


_FORMS: Final[tuple[Form, ...]] = ("given", "percent", "change", "fixed")
FILTERS: Final = MappingProxyType(
    {"q": printed, "total": total_of, "part_of": _part_of, "column": column, "span": span}
    | {form: partial(printed, form=form) for form in _FORMS}
)
"""Filters of the templates: each formats, and traces what it prints."""
