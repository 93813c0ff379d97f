"""What a file states of the uncertainty of its measured columns: 95 %, absolute, SI, row by row."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from typing import Final

import numpy as np

from ringbalance.identification.data.kinds import Column, DataKind
from ringbalance.identification.data.tables import Table, data_fault
from ringbalance.scene.arrays import FloatArray
from ringbalance.scene.faults import Fault, did_you_mean, toml_text
from ringbalance.scene.keys.fields import half_width
from ringbalance.scene.units import FieldError

KEY: Final = "uncertainty"


def stated_uncertainty(
    table: Table, kind: DataKind, columns: Mapping[str, FloatArray]
) -> tuple[dict[str, FloatArray], list[Fault]]:
    """Expanded uncertainty of each measured column for which the file states one.

    A column `uncertainty_<name>` comes before a column `uncertainty`, that before the key of the first lines.
    A relative uncertainty of a vibration is that of both its components, so that its phase has it in radians.
    """
    measured = [column for column in kind.measured if column.name in columns]
    result, faults = _of_header(table, kind, columns, measured)
    if KEY in columns:
        result = {column.name: columns[KEY] * _size(kind, columns, column.name) for column in measured}
    own = {column.name: columns.get(f"{KEY}_{column.name}") for column in measured}
    result |= {name: width for name, width in own.items() if width is not None}
    return result, [*faults, *_of_zero(table, columns, result), *_partial(table, kind, result)]


def _of_header(
    table: Table, kind: DataKind, columns: Mapping[str, FloatArray], measured: Iterable[Column]
) -> tuple[dict[str, FloatArray], list[Fault]]:
    stated = table.header.get(KEY)
    if stated is None:
        return {}, []
    if isinstance(stated, Mapping):
        return _by_column(table, stated, columns, {column.name: column for column in measured})
    if isinstance(stated, bool) or not isinstance(stated, int | float) or not 0 < stated < 1:
        problem = "it must be a number above 0 and below 1: 95 %, relative to the measured values"
        allowed = 'such as 0.02, or by column: { amplitude = "0.1 um", phase = "1 deg" }; absent: estimated'
        return {}, [data_fault(table.file, KEY, problem, value=toml_text(stated), allowed=allowed)]
    return {column.name: stated * _size(kind, columns, column.name) for column in measured}, []


def _by_column(
    table: Table,
    stated: Mapping[str, object],
    columns: Mapping[str, FloatArray],
    measured: Mapping[str, Column],
) -> tuple[dict[str, FloatArray], list[Fault]]:
    result: dict[str, FloatArray] = {}
    faults = []
    for name, value in stated.items():
        try:
            if name not in measured:
                problem = f"the file measures no such column{did_you_mean(name, measured)}"
                raise FieldError(problem, ", ".join(measured))
            width, relative = half_width(measured[name].dimension).read(value)
            if relative and measured[name].dimension == "angle":
                raise FieldError("an angle has no percentage", 'an angle such as "1 deg"')
            if not width > 0:
                raise FieldError("an uncertainty is above zero", "leave it out where it is to be estimated")
        except FieldError as error:
            place = f"{KEY}.{toml_text(name).strip(chr(34))}"
            faults.append(
                data_fault(table.file, place, error.problem, value=toml_text(value), allowed=error.allowed)
            )
            continue
        result[name] = width * (np.abs(columns[name]) if relative else np.ones_like(columns[name]))
    return result, faults


def _size(kind: DataKind, columns: Mapping[str, FloatArray], name: str) -> FloatArray:
    """What a relative uncertainty refers to: the value, or one radian for the phase of a vibration."""
    of_vibration = name.startswith("phase") and kind.has_amplitudes
    return np.ones_like(columns[name]) if of_vibration else np.abs(columns[name])


def _of_zero(
    table: Table, columns: Mapping[str, FloatArray], uncertainty: Mapping[str, FloatArray]
) -> Iterator[Fault]:
    """A relative uncertainty of a value of zero says that the value is exact."""
    for name, width in uncertainty.items():
        for line, value, each in zip(table.lines, columns[name].tolist(), width.tolist(), strict=True):
            if value == 0 and each == 0:
                problem = f"{name} is 0 there, so its uncertainty cannot be relative"
                allowed = f'an absolute one, in a column "{KEY}_{name}"'
                yield data_fault(table.file, f"line {line}", problem, allowed=allowed)


def _partial(table: Table, kind: DataKind, uncertainty: Mapping[str, FloatArray]) -> Iterator[Fault]:
    """The noise of vibrations is given or estimated, all amplitudes of a file alike."""
    missing = [column.name for column in kind.measured if column.amplitude and column.name not in uncertainty]
    if uncertainty and missing:
        problem = f"stated of {', '.join(uncertainty)} and not of {', '.join(missing)}"
        yield data_fault(table.file, KEY, problem, allowed="of every amplitude, or of nothing")
