"""Tables as instruments write them, put into the columns of a kind of measurement; each change is said."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import replace
from types import MappingProxyType
from typing import Final

from ringbalance.identification.kinds.kind import Kind
from ringbalance.identification.tables import CsvTable, data_fault, split_head
from ringbalance.scene.faults import Fault
from ringbalance.scene.units import FieldError, parse_number

AMPLITUDE: Final = "amplitude"
"""Key of the first lines with the convention of amplitudes."""
_STAMP: Final = re.compile(
    r"\d{1,4}([-./])\d{1,2}\1\d{1,4}([T ]+\d{1,2}:\d{2}\S*)?|\d{1,2}:\d{2}(:\d{2}\S*)?"
)
_MARKED: Final = re.compile(r"(.+\[.+?)[ _]+(rms|peak|pk|0-p|pp|p-p|pk-pk)\]", re.IGNORECASE)
"""Head of a column whose unit says how amplitudes are counted, as in mm/s rms."""
_CONVENTIONS: Mapping[str, str] = MappingProxyType(
    {"rms": "rms", **dict.fromkeys(("pp", "p-p", "pk-pk"), "peak_to_peak")}
)
"""Convention of amplitudes by such a mark; zero to peak by any other."""
_USUAL: Mapping[str, str] = MappingProxyType(
    {
        **dict.fromkeys(("velocity", "displacement", "acceleration", "vibration", "magnitude"), AMPLITUDE),
        **dict.fromkeys(("overall", "level"), AMPLITUDE),
        **dict.fromkeys(("rpm", "rotational_speed", "rotation_speed", "shaft_speed"), "speed"),
        **dict.fromkeys(("time", "open_time", "opening_time", "duration", "pulse"), "gas_time"),
        **dict.fromkeys(("weight", "trial_mass", "trial_weight"), "mass"),
        **dict.fromkeys(("trial_angle", "weight_angle", "position"), "angle"),
        **dict.fromkeys(("pressure_drop", "differential_pressure", "dp"), "pressure_difference"),
        **dict.fromkeys(("flow", "volume_flow"), "flow_rate"),
        "phase_angle": "phase",
        "imbalance": "unbalance",
        "gas_pressure": "pressure",
        "fill": "fill_ratio",
    }
)
"""Column of a kind by a name that instruments give it; of before and after an injection by its first part."""
_TIMES: Final = ("time", "date", "timestamp", "date_time", "elapsed_time")
"""Names of columns that tell rows apart, in a kind that needs no time."""
_OF_A_PLANE: Final = re.compile(
    r"(amplitude|phase|unbalance|mass)_?(1|2|a|b|left|right|de|nde|plane\w*)|plane"
)


def two_planes(table: CsvTable) -> tuple[Fault, ...]:
    """Error of measurements in two planes."""
    heads = ", ".join(head for head in table.heads if _OF_A_PLANE.fullmatch(_name(head)))
    problem = (
        "these are data of two planes: a disc corrects one plane, so give vibration and weights in the plane "
        "of the disc alone, and the fit tells its influence coefficient"
    )
    return (data_fault(table.file, f"line {table.head_line}, {heads}", problem),) if heads else ()


def in_columns_of(table: CsvTable, kind: Kind) -> tuple[CsvTable, tuple[str, ...]]:
    """The table in the columns of a kind, and a sentence for each change."""
    usual, renamed = _usual_heads(table.heads, kind)
    header = dict(table.header)
    columns = {usual[head]: table.texts(head) for head in table.heads}
    if len(columns) < len(table.heads):
        return table, table.remarks
    said = [*table.remarks, *renamed]
    # Time stamps tell rows apart, as remarks do.
    stamps = [
        head
        for head, cells in columns.items()
        if kind.column(_name(head)) is None
        and head not in kind.texts
        and any(cells)
        and (_name(head) in _TIMES or all(not cell or _STAMP.fullmatch(cell) for cell in cells))
    ]
    if stamps:
        notes = [columns.pop(head) for head in (*stamps, "note") if head in columns]
        columns["note"] = tuple(" ".join(filter(None, cells)) for cells in zip(*notes, strict=True))
        said.append(f"times in {', '.join(stamps)} are taken as notes")
    # The convention of amplitudes by the marks of their units.
    marks = {head: match for head in columns if (match := _MARKED.fullmatch(head))}
    words = {_CONVENTIONS.get(match[2].lower(), "zero_to_peak") for match in marks.values()}
    if kind.has_amplitudes and len(words) == 1 and header.get(AMPLITUDE, *words) in words:
        (header[AMPLITUDE],) = words
        columns = {f"{marks[h][1]}]" if h in marks else h: cells for h, cells in columns.items()}
        said.append(f"amplitudes are {header[AMPLITUDE]}, as their units say")
    heads = {_name(head): head for head in columns}
    if kind.column("unbalance") and "unbalance" not in heads and {"mass", "radius"} <= heads.keys():
        units = "*".join((split_head(heads[name]) or ("", ""))[1] for name in ("mass", "radius"))
        both = zip(columns.pop(heads["mass"]), columns.pop(heads["radius"]), strict=True)
        heads["unbalance"] = f"unbalance [{units}]"
        columns[heads["unbalance"]] = tuple(_product(*cells) for cells in both)
        said.append(f"{heads['unbalance']} is {heads['mass']} times {heads['radius']}")
    # Where there is no weight, its angle may be empty.
    if {"unbalance", "angle"} <= heads.keys():
        pairs = zip(columns[heads["angle"]], columns[heads["unbalance"]], strict=True)
        columns[heads["angle"]] = tuple(a or ("0" if re.fullmatch(r"0+\.?0*", u) else "") for a, u in pairs)
    for head, cells in [*columns.items()]:
        if not any(cells) and (head in kind.texts or ((c := kind.column(_name(head))) and c.optional)):
            del columns[head]
    measured = [columns[heads[each.name]] for each in kind.measured if each.name in heads]
    rows = {
        line: row
        for line, row, *values in zip(
            table.lines, zip(*columns.values(), strict=True), *measured, strict=True
        )
        if any(values)
    }
    # A row that agrees in every column tells nothing new, or would count a copy twice.
    first: dict[tuple[str, ...], int] = {}
    copies = [line for line, row in rows.items() if first.setdefault(row, line) != line and kind.balancer]
    said += [f"line {line} is the same as line {first[rows.pop(line)]} and counts once" for line in copies]
    if left_out := [str(line) for line in table.lines if rows and line not in (*rows, *copies)]:
        said.append(f"nothing was measured in lines {', '.join(left_out)}, which are left out")
    lines, cells_of_rows = (
        (tuple(rows), rows.values()) if rows else (table.lines, zip(*columns.values(), strict=True))
    )
    return replace(table, header=header, heads=tuple(columns), lines=lines, rows=tuple(cells_of_rows)), tuple(
        said
    )


def _usual_heads(heads: Sequence[str], kind: Kind) -> tuple[dict[str, str], list[str]]:
    """Heads with the names that a kind has for columns of instruments, and a sentence for each change."""
    usual, said = {head: head for head in heads}, []
    taken = {column.name for column in kind.columns}
    taken |= ({"mass"} if kind.column("unbalance") else set()) | ({"speed"} if kind.has_amplitudes else set())
    for head in heads:
        name, unit = split_head(head) or ("", "")
        plain, names = name.replace(" ", "_"), {_name(each) for each in usual.values()}
        when = next((end for end in ("_before", "_after") if plain.endswith(end)), "")
        stem = plain.removesuffix(when)
        meant = plain if plain in taken else _USUAL.get(stem, "") + when
        if name not in taken and meant in taken and meant not in names:
            unit = unit or ("rpm" if stem == "rpm" else "")
            usual[head] = f"{meant} [{unit}]" if unit else meant
            said.append(f"{head} is taken as {usual[head]}")
    return usual, said


def _name(head: str) -> str:
    return (split_head(head) or (head, ""))[0]


def _product(mass: str, radius: str) -> str:
    """Product of two cells; of a cell that is no number itself, whose error is told where it is read."""
    try:
        return repr(weight * parse_number(radius)) if (weight := parse_number(mass)) else "0"
    except FieldError:
        return mass and radius and f"{mass} {radius}"
