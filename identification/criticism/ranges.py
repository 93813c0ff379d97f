"""Columns of files whose values lie far from what the scene has: mostly a unit, or another machine."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Final

import numpy as np

from ringbalance.identification.kinds.kind import Column
from ringbalance.identification.likelihood import Problem

FAR: Final = 5.0
"""Ratio of a column's median to the nearer end of the scene's range: below the ten of the smallest mistake of
a unit, and beyond what a test rig changes."""
_FAR_VIBRATION: Final = 100.0
"""The same of vibrations, which the scene seldom knows better."""


@dataclass(frozen=True, kw_only=True)
class ComparedColumn:
    """One column of one file."""

    file: str
    column: str
    unit: str
    """Of the template; empty for a number without one."""
    ratio: float
    """Median of the column over the nearer end of the scene's range; one within it."""
    fails: bool
    """Whether it lies so far off that a unit is wrong, or the machine another one."""
    text: str


def compared_columns(problem: Problem) -> tuple[ComparedColumn, ...]:
    """Columns against what the scene has."""
    return tuple(_compared(problem))


def _compared(problem: Problem) -> Iterator[ComparedColumn]:
    for block in problem.blocks:
        observations = block.observations
        ranges = block.kind.ranges(problem.scene)
        for column in block.kind.columns:
            values, known = observations.columns.get(column.name), ranges.get(column.name)
            if values is None or known is None or not np.any(values):
                continue
            low, high = known
            middle = float(np.median(np.abs(values[values != 0])))
            ratio = middle / high if middle > high else middle / low if middle < low else 1.0
            limit = _FAR_VIBRATION if column.amplitude else FAR
            yield ComparedColumn(
                file=observations.file,
                column=column.name,
                unit=column.unit,
                ratio=ratio,
                fails=not 1 / limit <= ratio <= limit,
                text=_text(observations.file, column, middle, ratio),
            )


def _text(file: str, column: Column, middle: float, ratio: float) -> str:
    here = f"{column.head} in {Path(file).name} is {column.written(middle)} in the middle of its values"
    if ratio == 1.0:
        return f"{here}, as the scene has it"
    return f"{here}, {ratio:.2g} times the {column.written(middle / ratio)} of the scene"
