"""An empty file of measurements with explanations, for each kind of data."""

from __future__ import annotations

from collections.abc import Iterator

from ringbalance.identification.data.kinds import AMPLITUDES, KINDS, Column, unknown_kind
from ringbalance.scene.faults import SceneError


def template(kind: str) -> str:
    """Text of a file of one kind that lacks only its rows; lines that begin with ## explain the columns.

    Raises: SceneError: no such kind.
    """
    if kind not in KINDS:
        problem, allowed = unknown_kind(kind), ", ".join(KINDS)
        raise SceneError.of_option(option="--template", value=kind, problem=problem, allowed=allowed)
    needed = [column for column in KINDS[kind].columns if not column.optional and not _is_other(column, kind)]
    heads = [*(["chamber"] if KINDS[kind].has_chamber else []), *(column.head for column in needed)]
    lines = [*_first_lines(kind), "##", *_explained(kind), ",".join([*heads, "series"])]
    return "\n".join(lines) + "\n"


def _is_other(column: Column, kind: str) -> bool:
    """Whether it may stand in place of a column that the template has."""
    return column.name in KINDS[kind].one_of[1:]


def _first_lines(kind: str) -> Iterator[str]:
    yield f'# kind = "{kind}"  # {KINDS[kind].title}'
    yield '# source = ""  # rig, run and date'
    amplitudes = [column for column in KINDS[kind].measured if column.amplitude]
    measured = amplitudes or [column for column in KINDS[kind].measured if not _is_other(column, kind)]
    if amplitudes:
        yield f'# amplitude = ""  # {", ".join(AMPLITUDES)}: how every amplitude in the file is counted'
    stated = ", ".join(f'{column.name} = "1 {column.unit}"' for column in measured)
    yield f"## uncertainty = {{ {stated} }}  # expanded (95 %), or relative such as 0.02; absent: estimated"


def _explained(kind: str) -> Iterator[str]:
    """A line for each column that the file may have."""
    if KINDS[kind].has_chamber:
        yield "## chamber: letter of the driven chamber, A for the first"
    for column in KINDS[kind].columns:
        word = "or " if _is_other(column, kind) else "optional " if column.optional else ""
        yield f"## {word}{column.head}: {column.meaning}"
    widths = ", ".join(column.name for column in KINDS[kind].uncertainties() if column.dimension)
    yield f"## optional {widths}: expanded uncertainty (95 %) of each row"
    yield "## series: run, rig or day that a row belongs to; rows in the order in which they were measured"
    yield "## optional note: any remark; tells apart rows that are otherwise the same"
