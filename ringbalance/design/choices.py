"""Alternatives such as valves, from a CSV file: one row each, columns are keys of a scene's table."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

from ringbalance.identification.tables import (
    decoded,
    file_name,
    in_order,
    parse_table,
    read_content,
    split_head,
)
from ringbalance.scene.faults import Fault, SceneError, did_you_mean
from ringbalance.scene.keys.declaration import Key, keys_of
from ringbalance.scene.keys.fields import ValueReader
from ringbalance.scene.keys.schema import ORIGIN
from ringbalance.scene.narrowing import AnyScene, liquid_ring_scene
from ringbalance.scene.platform.display import LOG
from ringbalance.scene.units import FieldError
from ringbalance.scene.valves import FLOWS, Valve, assumed_lag, taken_ratio

NAME: Final = "name"
"""Column with the names of rows, unless the scene's table has a key of this name."""
MAX_ROWS: Final = 1_000_000
_REMARK: Final = re.compile(r"^#.*$", re.MULTILINE)


@dataclass(frozen=True, kw_only=True)
class Choices:
    """Rows of a CSV file, in the file's order."""

    names: tuple[str, ...]
    """Names of the rows; empty without such a column."""
    rows: tuple[Mapping[str, Any], ...]
    """Values by key: a number in SI, a word, or None for an empty cell, which removes the key."""


def read_choices(file: Path, *, table: str, keys: Mapping[str, Key]) -> Choices:
    """Read a CSV file as spreadsheets write it, with commas, semicolons or tabs.

    Lines that begin with # are comments.
    A column head is a key, or a key with the unit of the numbers below, such as "conductance [l/(s*bar)]".
    Args: `table`: name of a table of the scene. `keys`: its keys by name.
    Raises: SceneError: every error of the file, with line and column.
    """
    shown = file_name(file)
    raw, problems = read_content(file, what="file of choices")
    text, undecoded = ("", problems) if problems else decoded(raw, file=shown)
    if undecoded:
        raise SceneError(undecoded)
    content, problems = parse_table(_REMARK.sub("", text), file=shown, most=MAX_ROWS)
    if content is None or problems:
        raise SceneError(in_order(problems))
    faults: list[Fault] = []
    columns: dict[str, list[Any]] = {}
    # The heads of a table are in small letters, as keys are but for a few.
    spelled = {each.lower(): each for each in keys}
    for head in content.heads:
        name, unit = split_head(head) or (head, "")
        name = spelled.get(name, name)
        key = keys.get(name)
        if name == NAME and key is None:
            continue
        if key is None or name == ORIGIN or not isinstance(key.takes, ValueReader):
            allowed = [each for each, other in keys.items() if isinstance(other.takes, ValueReader)]
            problem = f"[{table}] of a scene has no such key{did_you_mean(name, allowed)}"
            faults.append(content.head_fault(head, problem, ", ".join((*allowed, NAME))))
        elif name in columns:
            faults.append(content.head_fault(head, "this column stands twice"))
        else:
            columns[name] = []
            for line, cell in zip(content.lines, content.texts(head), strict=True):
                text = f"{cell} {unit}".strip() if cell else ""
                try:
                    value = key.takes.read(as_toml(text, key.takes)) if text else None
                    number = isinstance(value, int | float | tuple)
                    columns[name].append(value if number or not text else text)
                except FieldError as error:
                    faults.append(content.fault(line, head, cell, error.problem, error.allowed))
    if not columns and not faults:
        faults.append(
            content.head_fault(content.heads[0], f"no column is a key of [{table}]", ", ".join(keys))
        )
    if faults:
        raise SceneError(in_order(faults))
    rows = tuple(dict(zip(columns, row, strict=True)) for row in zip(*columns.values(), strict=True))
    names = content.texts(NAME) if NAME in content.heads and NAME not in keys else ()
    named = zip(rows, names or [f"line {line}" for line in content.lines], strict=True)
    taken = [n for row, n in named if any(row.get(key) for key in FLOWS) and not row.get("critical_ratio")]
    if taken and table == "gas":
        LOG.warning("%s: %s", shown, taken_ratio(taken))
    return Choices(names=names, rows=rows)


def with_valves(scene: AnyScene, file: Path) -> AnyScene:
    """The scene with the valves at hand of a CSV file, in place of those of its table [design].

    Raises: SceneError: every error of the file; or a scene without a liquid ring.
    """
    changed = with_choices(liquid_ring_scene(scene), file, Valve, among="design.valves", table="gas")
    if slow := [each for each in liquid_ring_scene(changed).design.valves if each.assumes_lag]:
        LOG.warning("%s: %s", file_name(file), assumed_lag(slow))
    return changed


def with_choices(scene: AnyScene, file: Path, kind: type, *, among: str, table: str = "") -> AnyScene:
    """The scene with the parts of a CSV file in place of its own, such as among="design.valves".

    Args: `kind`: record of a part. `table`: table of the scene that has its keys; default `among`.
    Raises: SceneError: every error of the file.
    """
    part, keys = among.rpartition(".")[2].removesuffix("s"), keys_of(kind)
    content = read_choices(
        file, table=table or among, keys={name: keys[name] for name in keys if name != NAME}
    )
    names = content.names or tuple(f"{part} {number}" for number in range(1, len(content.rows) + 1))
    parts = [
        {NAME: name, **{key: value for key, value in row.items() if value is not None}}
        for name, row in zip(names, content.rows, strict=True)
    ]
    return scene.with_values({among: parts, f"design.{part}_file": None})


def as_toml(text: str, reader: ValueReader) -> Any:
    """Value as in a scene file: a list in brackets, a number for a key without unit, or the text."""
    if text.startswith("[") and text.endswith("]"):
        return [as_toml(part.strip(" '\""), reader) for part in text[1:-1].split(",")]
    if reader.dimension is None:
        for number in (int, float):
            try:
                return number(text)
            except ValueError:
                continue
    return text
