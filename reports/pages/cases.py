"""A verification result as the page shows it: every number already text, nothing judged again."""

from __future__ import annotations

from typing import Any, Final

from ringbalance.reports.equations import equation_svg
from ringbalance.reports.figures.cases import order_plot, series_plots
from ringbalance.reports.numbers import (
    MISSING,
    PLUS_MINUS,
    THIN_SPACE,
    display_unit,
    given,
    number,
    percent,
    short,
    shown,
    with_unit,
)
from ringbalance.reports.prose import typeset
from ringbalance.verification.catalogue import load_cases

Record = dict[str, Any]

_FACTS: Final = (
    ("claim", "Claim"),
    ("explanation", "Finding"),
    ("consequence", "Consequence"),
    ("protects", "Protects"),
    ("assumes", "Assumes"),
    ("does_not_cover", "Does not cover"),
)
_RELATIVE_METRICS: Final = ("relative", "validation", "within_uncertainty")


def anchor(case: Record) -> str:
    """Place of a case on the page."""
    return f"case-{str(case['id']).replace('_', '-')}"


def typeset_equations() -> None:
    """Set the equations of every case once, which takes seconds, before a page asks for them."""
    for definition in load_cases():
        _equations({"id": definition.id, "equations": definition.equations})


def _sentence(value: Any) -> str:
    return "; ".join(str(item) for item in value) if isinstance(value, list) else str(value)


def _facts(case: Record) -> list[Record]:
    pairs = [(label, typeset(_sentence(case[key]))) for key, label in _FACTS if case.get(key)]
    reference = case.get("reference") or {}
    told = [str(reference[key]) for key in ("kind", "source", "uncertainty") if reference.get(key)]
    if told:
        pairs.append(("Reference", typeset("; ".join(told))))
    pairs.append(("Run", _how_run(case)))
    return [{"label": label, "text": text} for label, text in pairs]


def _how_run(case: Record) -> str:
    parts = [str(case[key]) for key in ("level", "status") if case.get(key)]
    judged = {"paper": "judged on the paper’s disc", "scene": "judged on this scene"}.get(
        case.get("judged_on", "")
    )
    digest = case.get("scene_sha256")
    return "; ".join([*parts, *([judged] if judged else []), *([f"scene {digest[:12]}"] if digest else [])])


def _criterion(quantity: Record) -> str:
    metric, limit = quantity.get("metric") or "", quantity.get("limit")
    if limit is None:
        return MISSING
    unit = quantity.get("unit") or "1"
    bound = {"at_most": "at most", "at_least": "at least"}.get(metric)
    if bound:
        return f"{bound} {given(limit, unit)}"
    if metric in _RELATIVE_METRICS:
        share = f"{short(100 * limit)}{THIN_SPACE}%"
        return f"within {share}" if metric == "relative" else f"within ±, and ± ≤ {share}"
    return f"within {given(limit, unit)}"


def quantity_row(quantity: Record) -> Record:
    """One judged quantity, every number in the unit that suits its size."""
    unit = quantity.get("unit") or "1"
    own = quantity.get("value_uncertainty")
    half_width = quantity.get("uncertainty") if own is None else own
    return {
        "name": typeset(quantity.get("title") or quantity["name"]),
        "why": typeset(quantity.get("why") or ""),
        "value": _value(quantity, half_width),
        "reference": shown(quantity.get("reference"), unit, quantity.get("reference_uncertainty"), digits=4),
        "error": shown(quantity.get("error"), unit, quantity.get("uncertainty"), digits=2),
        "limit": _criterion(quantity),
        "verdict": quantity.get("verdict") or "not run",
    }


def _value(quantity: Record, half_width: float | None) -> str:
    """What was found; a count has no digits behind the point."""
    unit, value = quantity.get("unit") or "1", quantity.get("value")
    if value is None or quantity.get("basis") != "count":
        return shown(value, unit, half_width)
    return short(value, digits=6 if float(value).is_integer() else 3)


def sequence_view(sequence: Record) -> Record:
    """One convergence table."""
    orders = list(sequence.get("observed_order") or [])
    levels = len(sequence["h"])
    padded = [None] * (levels - len(orders)) + orders
    unit = sequence.get("unit") or "1"
    columns = {key: sequence.get(key) or [None] * levels for key in ("unknowns", "value", "error")}
    rows = [
        {
            "h": short(sequence["h"][i], digits=3),
            "unknowns": short(columns["unknowns"][i]),
            "value": shown(columns["value"][i], unit, digits=8),
            "error": shown(columns["error"][i], unit, digits=3),
            "order": number(padded[i], digits=3),
        }
        for i in range(levels)
    ]
    return {
        "label": sequence_label(sequence),
        "note": "; ".join(_notes(sequence)),
        "formal_order": short(sequence["formal_order"], digits=3) if sequence.get("formal_order") else "",
        "rows": rows,
        **{
            f"has_{name}": bool(sequence.get(key))
            for name, key in (("unknowns", "unknowns"), ("values", "value"), ("errors", "error"))
        },
    }


def sequence_label(sequence: Record) -> str:
    """What a convergence sequence is of."""
    geometry = f", {sequence['geometry']} geometry" if sequence.get("geometry") else ""
    return typeset(f"{sequence['quantity']}{geometry}")


def _notes(sequence: Record) -> list[str]:
    gci = sequence.get("gci")
    told = [] if gci is None else [f"Expanded uncertainty (95 %) of the finest value {percent(gci)}"]
    return [*told, typeset(sequence["note"])] if sequence.get("note") else told


def _equations(case: Record) -> list[Record]:
    return [
        {"svg": equation_svg(latex, f"Equation in LaTeX: {latex}", f"{anchor(case)}-{index}"), "source": ""}
        for index, latex in enumerate(case.get("equations") or [])
    ]


def table_view(table: Record) -> Record:
    """One data table of a case, each column in one unit."""
    columns = [
        _column(name, values, table["units"].get(name, "1")) for name, values in table["columns"].items()
    ]
    heads = [{"text": typeset(head), "num": numeric} for head, _, numeric in columns]
    rows = [
        [{"text": text, "num": numeric} for text, (_, _, numeric) in zip(row, columns, strict=True)]
        for row in zip(*(texts for _, texts, _ in columns), strict=True)
    ]
    return {"name": typeset(table["name"]), "heads": heads, "rows": rows}


def _column(name: str, values: list[Any], unit: str) -> tuple[str, list[str], bool]:
    numbers = [value for value in values if not isinstance(value, str)]
    display = display_unit(unit, *numbers)
    texts = [
        typeset(v) if isinstance(v, str) else short(None if v is None else v * display.factor, digits=5)
        for v in values
    ]
    return f"{name} in {display.symbol}" if display.symbol else name, texts, bool(numbers)


def _mutations(case: Record) -> list[str]:
    run = {item["id"]: item for item in case.get("mutations") or []}
    told = []
    for item in case.get("declared_mutations") or []:
        found = run.get(item["id"])
        end = f"must come out as {item['expect']}"
        if found:
            end = f"came out as {found['verdict']}, {'as it must' if found['failed'] else 'and was missed'}"
        told.append(typeset(f"{item['what']}: {end}"))
    return told


def deciding_quantity(case: Record) -> Record | None:
    """The judged quantity that a case's verdict rests on: the first that has the case's own verdict.

    Returns: The quantity; None when there is none.
    """
    quantities = case.get("quantities") or []
    own = [quantity for quantity in quantities if quantity.get("verdict") == case["verdict"]]
    return next(iter([*own, *quantities]), None)


def _in_brief(case: Record) -> Record:
    """The deciding quantity in one line: what the paper has, what was found, the comparison's half-width."""
    quantity = deciding_quantity(case)
    if quantity is None:
        return dict.fromkeys(("paper", "found", "half_width"), MISSING) | {"what": ""}
    unit, reference = quantity.get("unit") or "1", quantity.get("reference")
    value, half_width = quantity.get("value"), quantity.get("uncertainty")
    display = display_unit(unit, value)
    width = number(None if not half_width else half_width * display.factor, digits=2)
    return {
        "paper": _criterion(quantity) if reference is None else given(reference, unit, digits=4),
        "found": _without_half_width(_value(quantity, quantity.get("value_uncertainty"))),
        "half_width": with_unit(width, display.symbol),
        "what": typeset(quantity.get("title") or ""),
    }


def _without_half_width(text: str) -> str:
    """A value's text with the digits that its own half-width leaves standing, but without that half-width."""
    value, sign, rest = text.partition(PLUS_MINUS)
    if not sign:
        return text
    unit = rest.partition(")")[2] if text.startswith("(") else ""
    return f"{value.removeprefix('(')}{unit}"


def case_view(case: Record) -> Record:
    """Everything that the page shows of one case."""
    sequences = [{**item, "label": sequence_label(item)} for item in case.get("convergence") or []]
    return {
        "id": case["id"],
        "anchor": anchor(case),
        "title": typeset(case.get("title") or case["id"]),
        "number": case.get("number"),
        "verdict": case["verdict"],
        "claim": typeset(case.get("claim") or ""),
        "why_not_run": typeset(case.get("status") or "") if case["verdict"] == "not run" else "",
        "brief": _in_brief(case),
        "consequence": typeset(case.get("consequence") or ""),
        "facts": _facts(case),
        "equations": _equations(case),
        "rows": [quantity_row(quantity) for quantity in case.get("quantities") or []],
        "order_plot": order_plot({**case, "convergence": sequences}),
        "drawings": series_plots(case),
        "sequences": [sequence_view(sequence) for sequence in case.get("convergence") or []],
        "tables": [table_view(table) for table in case.get("tables") or []],
        "mutations": _mutations(case),
        "doubts": [typeset(doubt) for doubt in case.get("doubts") or []],
    }
