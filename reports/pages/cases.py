"""Verification cases on the page, with numbers as texts, and two studies of a scene: limits of validity, and
speed against accuracy.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from functools import lru_cache
from itertools import count
from types import MappingProxyType
from typing import Any, Final

import numpy as np
from matplotlib.axes import Axes

from ringbalance.reports.figure import (
    AS_PAPER,
    FOUND,
    INK,
    THIRD,
    Drawing,
    Paint,
    curve,
    draw,
    line,
    logarithmic,
)
from ringbalance.reports.prose import equation_svg, opening, typeset
from ringbalance.reports.section import Record, Section, Work
from ringbalance.reports.traced import marked, printed
from ringbalance.results.numbers import (
    MISSING,
    THIN_SPACE,
    display_unit,
    format_given,
    last_place,
    number,
    short,
    with_unit,
)
from ringbalance.results.result import Table
from ringbalance.verification.extremes.study import axis_rows
from ringbalance.verification.trade import error_text, models_table, trade_study

JudgedQuantity = Mapping[str, Any]
"""A judged quantity of a case, whose numbers carry their paths in the evidence."""
_ZERO_FRACTION: Final = 1e-3
"""Fraction of a range below which one of its ends is zero."""
_BOX_KEYS: Final = (
    *("explanation", "judgement", "protects", "assumes", "does_not_cover", "rests_on", "reference"),
    *("declared_mutations", "doubts", "level", "status", "judged_on", "scene_sha256"),
)
"""Keys of a case's record that its box on the page shows."""
_NO_SEQUENCE: Final = dict.fromkeys(
    ("unit", "unknowns", "value", "error", "formal_order", "observed_order", "gci", "note")
)
_LOPSIDED_RATIO: Final = 1.2
"""Ratio of the two sides of an interval from which on both ends are shown."""
_FINE_RATIO: Final = 0.01
"""Half-width over error below which two digits of the error suffice."""
_MAX_DIGITS: Final = 4
"""Digits of a number in brief: the uncertainty of the inputs justifies no more, even in fine comparisons."""
_MAX_LABEL_CHARACTERS: Final = 28
_CURVES: Final[dict[str, Record]] = {
    "paper": AS_PAPER,
    "found": {"color": FOUND},
    "reference": {"color": THIRD, "linestyle": (0, (1, 1.5))},
    "points": {"color": INK, "linestyle": "", "marker": "o", "markersize": 2.5},
}
"""Line properties of a curve, by its style."""
_SPARE: Final = (*(line(index) for index in (2, 3, 5)), {"color": INK})
"""Line properties of further curves with a style already in use."""


TABLES: Final = "tables"
"""Folder of the tables that are files."""
MAX_PAGE_ROWS: Final = 14
"""Rows above which a case's table is a file instead of a part of the page."""


def is_long(table: Record) -> bool:
    """True if a case's table is a file instead of a part of the page."""
    return any(len(values) > MAX_PAGE_ROWS for values in table["columns"].values())


def table_file(case: Record, table: Record) -> str:
    """Name of the file of a case's table."""
    stem = "".join(sign if sign.isalnum() else "_" for sign in table["name"].lower())
    return f"{case['id']}_{stem[:60].strip('_')}.csv"


def anchor(case: Record) -> str:
    """Id of a case's element on the page."""
    return f"case-{str(case['id']).replace('_', '-')}"


def _found(quantity: JudgedQuantity) -> str:
    """Value of the program with its uncertainty or, where lopsided, its range; a count without decimals."""
    unit, value, ends = quantity.get("unit") or "1", quantity.get("value"), _range(quantity)
    if ends:
        return printed(value, digits=2, unit=unit, form="given") + f" ({ends})"
    width = quantity.get("value_uncertainty")
    return printed(value, quantity.get("uncertainty") if width is None else width, **_form(quantity))


def _form(quantity: JudgedQuantity) -> Record:
    """Unit, form and digits of a quantity's value."""
    value, count = quantity.get("value"), quantity.get("basis") == "count"
    if value is None or not count:
        return {"unit": quantity.get("unit") or "1"}
    return {"unit": "1", "form": "given", "digits": 6 if float(value).is_integer() else 3}


def _error(quantity: JudgedQuantity) -> str:
    """Error to the second digit of its half-width, or to two significant digits where those are fewer."""
    error, width = quantity.get("error"), quantity.get("uncertainty")
    fine = error and width and (width < _FINE_RATIO * abs(error) or _range(quantity))
    return printed(error, None if fine else width, digits=2, unit=quantity.get("unit") or "1")


def deciding(quantities: Sequence[JudgedQuantity], verdict: str) -> JudgedQuantity | None:
    """The judged quantity that a case's verdict rests on: the first that has the case's own verdict."""
    deciding = [quantity for quantity in quantities if quantity.get("verdict") == verdict]
    return next(iter([*deciding, *quantities]), None)


def _in_brief(quantity: JudgedQuantity) -> str:
    """Value of the program with the digits that the comparison supports, at least two."""
    value, unit = quantity.get("value"), quantity.get("unit") or "1"
    width = max(quantity.get("value_uncertainty") or 0.0, quantity.get("uncertainty") or 0.0)
    if value and width > abs(value) / 2:
        return printed(value, unit=unit, digits=2, form="given")
    if value and 0 < width < _last_digit(value) / 2:
        return printed(value, unit=unit, digits=_MAX_DIGITS)
    if not value or not width or quantity.get("basis") == "count":
        return printed(value, **_form(quantity))
    display = display_unit(unit, value, width)
    shown_value, shown_width = value * display.factor, width * display.factor
    digits = math.floor(math.log10(abs(shown_value))) - last_place(shown_width) + 1
    text = number(shown_value, digits=min(digits, _MAX_DIGITS))
    return marked(with_unit(text, display.symbol), value)


def _width(quantity: JudgedQuantity) -> str:
    """Half-width of the comparison; a range where assumed inputs make it lopsided."""
    value, half_width = quantity.get("value"), quantity.get("uncertainty")
    if value and half_width and half_width < (digit := _last_digit(value)) / 2:
        return f"<{THIN_SPACE}{format_given(digit, quantity.get('unit') or '1', digits=1)}"
    if ends := _range(quantity):
        return ends
    if not half_width:
        return MISSING
    display = display_unit(quantity.get("unit") or "1", value)
    return marked(with_unit(number(half_width * display.factor, digits=2), display.symbol), half_width)


def _range(quantity: JudgedQuantity) -> str:
    """Both ends of a number's interval in its unit; empty where it is about as wide on both sides."""
    value, low, high = (quantity.get(key) for key in ("value", "value_low", "value_high"))
    if value is None or low is None or high is None:
        return ""
    sides = sorted((value - low, high - value))
    if sides[1] <= _LOPSIDED_RATIO * sides[0] or sides[1] <= 0.1 * abs(value):
        return ""
    display = display_unit(quantity.get("unit") or "1", value or max(map(abs, (low, high))))
    # An end this close to zero is zero but for numerical uncertainty.
    least = _ZERO_FRACTION * (high - low)
    ends = (end * display.factor if abs(end) > least else 0.0 for end in (low, high))
    return with_unit(" to ".join(number(end, digits=2) for end in ends), display.symbol)


def _last_digit(value: float) -> float:
    """One unit of the last of the digits that a number in brief has."""
    return float(10.0 ** (math.floor(math.log10(abs(value))) - _MAX_DIGITS + 1))


def _series_plot(name: str, series: Record) -> Drawing:
    x, curves, title = series["x"], series["y"], typeset(series["name"])
    spare, used, paints = count(), list[Record](), list[Paint]()

    def with_gaps(values: list[float | None]) -> Any:
        return np.array([np.nan if value is None else value for value in values])

    for each in curves:
        look = _CURVES[each.get("style") or "found"]
        look = _SPARE[next(spare) % len(_SPARE)] if look in used else look
        used.append(look)
        width, values = each.get("uncertainty"), with_gaps(each["values"])
        band = with_gaps(width) if width else None
        paints.append(curve(with_gaps(x["values"]), values, typeset(each["name"]), band=band, **look))

    def log_axes(axes: Axes) -> None:
        # Decades alone would be too few labels within one or two of them.
        (left, right), (low, high) = axes.get_xlim(), axes.get_ylim()
        logarithmic("x", within=(left, right) if 0 < left < right < 50 * left else None)(axes)
        logarithmic("y", within=(low, high) if 0 < low < high < 50 * low else None)(axes)

    paints += [log_axes] if series.get("log") else []
    return draw(
        name,
        *paints,
        x=(typeset(x["name"]), x["unit"].replace("*", " ")),
        y=(opening(title) if len(title) < _MAX_LABEL_CHARACTERS else "", curves[0]["unit"]),
    )


def case_view(case: Record) -> Record:
    """Whole content of the page on one case."""
    stem = case["id"].replace("_", "-")
    sequences = []
    for each in case.get("convergence") or []:
        geometry = f", {each['geometry']} geometry" if each.get("geometry") else ""
        sequences.append({**_NO_SEQUENCE, **each, "label": f"{each['quantity']}{geometry}"})
    falling = [s for s in sequences if s["error"] and all(e is not None and e > 0 for e in s["error"])]
    tables: list[Table] = []
    files: list[tuple[str, str]] = []
    for table in case.get("tables") or []:
        if is_long(table):
            files.append((table["name"], f"{TABLES}/{table_file(case, table)}"))
            continue
        heads, columns = [], []
        for name, values in table["columns"].items():
            unit = table["units"].get(name, "1")
            display = display_unit(unit, *(value for value in values if not isinstance(value, str)))
            heads.append(f"{name} in {display.symbol}" if display.symbol else name)
            scaled = [v if v is None or isinstance(v, str) else v * display.factor for v in values]
            columns.append([v if isinstance(v, str) else short(v, digits=5) for v in scaled])
        tables.append(Table(caption=table["name"], heads=tuple(heads), rows=list(zip(*columns, strict=True))))
    return {
        "id": case["id"],
        "anchor": anchor(case),
        "title": case.get("title") or case["id"],
        "number": case.get("number"),
        "verdict": case["verdict"],
        "claim": case.get("claim") or "",
        "why_not_run": case.get("status") or "" if case["verdict"] == "not run" else "",
        "consequence": case.get("consequence") or "",
        "cause": case.get("cause") or "",
        "rests_on": bool(case.get("rests_on")),
        "box": {key: case.get(key) for key in _BOX_KEYS},
        "mutations": {each["id"]: each for each in case.get("mutations") or []},
        "equations": [
            {"svg": equation_svg(latex, f"Equation in LaTeX: {latex}", f"{anchor(case)}-{n}"), "source": ""}
            for n, latex in enumerate(case.get("equations") or [])
        ],
        "order_plot": _order_plot(f"order-{stem}", falling) if falling else None,
        # Errors that change their sign from mesh to mesh, or are rounding, have no order.
        "orders": [max(s["observed_order"][-1], 0.0) for s in falling if s["observed_order"]],
        "drawings": [
            _series_plot(f"case-{stem}-{n}", series) for n, series in enumerate(case.get("series") or [])
        ],
        "series": [series["name"] for series in case.get("series") or []],
        "sequences": sequences,
        "tables": tables,
        "files": files,
    }


def _order_plot(name: str, sequences: list[Record]) -> Drawing:
    """Error against mesh size, a line per sequence, dotted the formal order as a slope to compare."""
    paints: list[Paint] = []
    for index, sequence in enumerate(sequences):
        size, error, look = np.asarray(sequence["h"]), np.asarray(sequence["error"]), line(index, size=4)
        paints.append(curve(size, error, sequence["label"], **look))
        if order := sequence["formal_order"]:
            slope = 0.6 * error[-1] * (size / size[-1]) ** order
            paints.append(curve(size, slope, color=look["color"], linewidth=0.8, linestyle=":"))
    return draw(
        name,
        *paints,
        logarithmic("x", ticks=sorted({float(f"{size:.3g}") for size in sequences[0]["h"]})),
        logarithmic("y"),
        x=("relative mesh or step size", "1"),
        y=("error", "1"),
        columns=1,
        height=2.7 + 0.175 * len(sequences),
    )


FILTERS: Final[Mapping[str, Callable[[JudgedQuantity], str]]] = MappingProxyType(
    {"found": _found, "error": _error, "brief": _in_brief, "half_width": _width}
)
"""Filters of the templates, for a judged quantity."""


def _extremes(_own: Record, evidence: Record) -> Record:
    """Sentences and the table of axes."""
    case = next((c for c in evidence.get("verification", []) if c["id"] == "extremes"), None)
    if case is None or not case.get("tables"):
        return {"ran": False}
    tables = {table["name"]: table["columns"] for table in case["tables"]}
    return {
        "ran": True,
        "text": case.get("explanation", ""),
        "date": case.get("date", ""),
        "table": Table(
            caption="Each input alone over its range, all else as in the paper’s scene: parts of the range "
            "with one kind of answer, and the message there.",
            heads=("Input", "Range", "Answer", "Loop", "Message"),
            rows=axis_rows(tables["axes"]),
            style="",
        ),
    }


EXTREMES: Final = Section(name="extremes", title="At the extremes", show=_extremes)
"""Section that without a run gives the command for one."""


_trade_study = lru_cache(maxsize=4)(trade_study)
"""Trade study, measured once per scene and process."""


def _collect(work: Work) -> Record | None:
    """Trade study of the scene at the light level: without meshes in three dimensions."""
    return _trade_study(work.ring, level="light").to_dict()


def _trade(trade: Record, evidence: Record) -> Record:
    times = evidence["times"].get("trade") or {}
    terms = [(row["term"], row["group"], error_text(row["estimated_contribution"])) for row in trade["terms"]]
    quantities = []
    for each in trade["quantities"]:
        if each["models"]:
            table = models_table(each, times)
            quantities.append({"title": opening(each["title"]), "status": table.note, "models": table})
    return {
        "terms": Table(
            caption="What leaving a term out would change, by the dimensionless group that it grows with.",
            heads=("Term", "Group", "Estimated contribution"),
            rows=terms,
        ),
        "quantities": quantities,
    }


TRADE: Final = Section(name="trade", title="Speed against accuracy", collect=_collect, show=_trade)
