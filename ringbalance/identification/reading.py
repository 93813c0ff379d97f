"""Files of measurements read into observations of a kind, with all errors of a file reported together.

Uncertainties of measured columns are converted to 95 %, absolute, SI, row by row. `KINDS` has every kind by
its name in the data, for `fit` and `verify --data`; `template` makes an empty file of one. A new kind is one
entry in the module of its balancer, or of test benches.
"""

from __future__ import annotations

import hashlib
from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path
from types import MappingProxyType
from typing import Final

import numpy as np

from ringbalance.identification.instrument import AMPLITUDE, in_columns_of, two_planes
from ringbalance.identification.kinds.bench import BENCH
from ringbalance.identification.kinds.eccentric_mass import ECCENTRIC_MASS
from ringbalance.identification.kinds.kind import DataColumn, Kind, Observations
from ringbalance.identification.kinds.liquid_ring import LIQUID_RING
from ringbalance.identification.tables import (
    WINDOWS,
    CsvTable,
    data_fault,
    decoded,
    dimension_of,
    encoding_of,
    file_name,
    in_order,
    parse_table,
    read_content,
    split_head,
)
from ringbalance.scene.arrays import FloatArray
from ringbalance.scene.faults import Fault, SceneError, did_you_mean
from ringbalance.scene.keys.fields import LETTERS, Bounds, half_width, share
from ringbalance.scene.narrowing import AnyScene, liquid_ring_scene
from ringbalance.scene.toml import toml_text
from ringbalance.scene.units import FieldError, format_quantity, parse_quantity, unit_of

_UNCERTAINTY: Final = "uncertainty"
_SPEED: Final = "speed"
_DERIVATIVES: Final[Mapping[str, int]] = MappingProxyType({"velocity": 1, "acceleration": 2})
_GRAVITY: Final[Mapping[str, str]] = MappingProxyType({"g": "gn"})
"""Unit of acceleration in scene files, where g is a gram, by that of instruments."""
_RELATIVE: Final = share(Bounds(above=0, below=1), example=0.02)
_TEXTS: Final = (
    *("kind", "source", "uncertainty_from", "where", "doi", "licence", "read", "conditions"),
    *("supports", "does_not_support"),
)
"""Keys of the first lines that hold text."""
_ROUNDED: Final = 0.01
"""Relative rounding error allowed in the fill of a chamber that holds all the liquid of its pair."""


def read_observations(paths: Iterable[Path], *, scene: AnyScene | None = None) -> tuple[Observations, ...]:
    """Observations of each file, for a scene; without a scene, those of test benches.

    Raises: SceneError: all errors of all files, each with line and column.
    """
    faults: list[Fault] = []
    files: list[Observations] = []
    for path in paths:
        content, wrong = read_content(path)
        if not wrong:
            observations, wrong = observations_of(content, file=file_name(path), scene=scene)
            files += [observations] if observations else []
        faults += in_order(wrong)
    first: dict[str, str] = {}
    for each in files:
        if each.sha256 in first:
            problem = f"it has the same content as {first[each.sha256]}; give it once"
            faults.append(data_fault(each.file, "", problem))
        first.setdefault(each.sha256, each.file)
    # The [uncertainty] of a scene that was fitted to a file already contains its information.
    fitted = set() if scene is None else {file.sha256 for file in scene.measured.files}
    for each in files:
        if scene is not None and each.sha256 in fitted:
            problem = f"{scene.file} was fitted to this file already, so that it would count twice"
            allowed = "the scene as it was before, with all files together"
            faults.append(data_fault(each.file, "", problem, allowed=allowed))
    if faults:
        raise SceneError(faults)
    return tuple(files)


def observations_of(
    content: bytes, *, file: str, scene: AnyScene | None = None
) -> tuple[Observations | None, tuple[Fault, ...]]:
    """Observations from the bytes of a file, or None, and all its errors."""
    text, undecoded = decoded(content, file=file)
    if undecoded:
        return None, undecoded
    table, faults = parse_table(text, file=file)
    if table is None:
        return None, faults
    wrong = [*faults, *_kind_faults(table, scene)]
    if len(wrong) > len(faults):
        return None, tuple(wrong)
    kind = KINDS[str(table.header["kind"])]
    table, remarks = in_columns_of(table, kind)
    if encoding_of(content) == WINDOWS:
        remarks += ("the text is read as Windows-1252, as it is not UTF-8",)
    wrong += _header_faults(table, kind)
    heads = [*two_planes(table)] or [*_head_faults(table, kind)]
    if heads:
        return None, (*wrong, *heads)
    speed, speed_faults = _speed(table, kind, scene)
    if speed_faults:
        return None, (*wrong, *speed_faults)
    columns, cell_faults = _columns(table, kind, speed)
    leads: dict[str, float] = {}
    for head in table.heads:
        remarks += _turned(head, kind, columns, speed, leads)
    uncertainty, stated_faults = _stated_uncertainty(table, kind, columns, speed)
    # A cell with an error has no value that a relative uncertainty could be of.
    bad = {fault.key.split(",")[0] for fault in cell_faults}
    stated_faults = [fault for fault in stated_faults if fault.key not in bad]
    by_columns = [each.name for each in kind.uncertainties() if each.name in columns]
    if by_columns and _UNCERTAINTY in table.header:
        remarks += (f"of the key uncertainty and the column {', '.join(by_columns)}, the column is taken",)
    wrong += [*cell_faults, *_faults_of_scene(table, kind, scene, columns), *stated_faults]
    if wrong:
        return None, tuple(wrong)
    # From the file's convention of amplitudes to zero to peak.
    factor = AMPLITUDES[str(table.header.get(AMPLITUDE, "zero_to_peak")).lower()]
    letters = table.texts("chamber") if kind.has_chamber else ("",) * len(table.rows)
    used = {column.name: columns[column.name] for column in kind.columns if column.name in columns}
    return Observations(
        kind=str(table.header["kind"]),
        file=table.file,
        source=str(table.header["source"]),
        sha256=hashlib.sha256(content).hexdigest(),
        lines=np.array(table.lines, dtype=np.int64),
        series=table.series,
        chamber=np.array(letters, dtype=np.str_),
        columns=_zero_to_peak(used, kind, factor),
        remarks=remarks,
        leads=leads,
        uncertainty=_zero_to_peak(uncertainty, kind, factor),
    ), ()


def _kind_faults(table: CsvTable, scene: AnyScene | None) -> Iterator[Fault]:
    word, allowed = table.header.get("kind"), kinds_of("" if scene is None else scene.balancer)
    if word is None:
        problem = 'the key "kind" is missing in the first lines, marked #'
        yield data_fault(table.file, "", problem, allowed=f'kind = "..." of {", ".join(allowed)}')
    elif word not in allowed:
        problem = f"there is no such kind of data{did_you_mean(str(word), allowed)}"
        if str(word) in KINDS and scene is None:
            problem = "a scene predicts data of this kind: ringbalance fit"
        elif str(word) in KINDS and scene is not None:
            problem = f'the balancer of {scene.file} is "{scene.balancer}", which these data tell nothing of'
        yield data_fault(table.file, "kind", problem, value=toml_text(word), allowed=", ".join(allowed))


def _header_faults(table: CsvTable, kind: Kind) -> Iterator[Fault]:
    allowed_keys = (*_TEXTS, _UNCERTAINTY, *([AMPLITUDE, _SPEED] if kind.has_amplitudes else []))
    for key, value in table.header.items():
        if key not in allowed_keys:
            problem = f"this key of the first lines is not known{did_you_mean(key, allowed_keys)}"
            yield data_fault(table.file, toml_text(key), problem, allowed=", ".join(allowed_keys))
        elif key in _TEXTS and not isinstance(value, str):
            yield data_fault(table.file, key, "it is not text", value=toml_text(value), allowed='"..."')
    names = {(split_head(head) or ("",))[0] for head in table.heads}
    in_rows = not names.isdisjoint(column.name for column in kind.uncertainties())
    for key in ("source", *([] if kind.balancer or in_rows else [_UNCERTAINTY])):
        if key not in table.header:
            problem = f'the key "{key}" is missing in the first lines, marked #'
            problem += ", and no column has it" * (key == _UNCERTAINTY)
            yield data_fault(table.file, "", problem)
    if not str(table.header.get("source", "-")).strip():
        yield data_fault(table.file, "source", "it is empty", allowed="rig, run and date")
    stated = table.header.get(AMPLITUDE)
    if kind.has_amplitudes and not (isinstance(stated, str) and stated.lower() in AMPLITUDES):
        allowed = " or ".join(f'amplitude = "{word}"' for word in AMPLITUDES)
        problem = "the first lines must say how amplitudes are counted"
        value = "missing" if stated is None else toml_text(stated)
        yield data_fault(table.file, AMPLITUDE, problem, value=value, allowed=allowed)


def _head_faults(table: CsvTable, kind: Kind) -> Iterator[Fault]:
    allowed_names = [column.name for column in (*kind.columns, *kind.uncertainties())] + [*kind.texts]
    yield from table.name_faults(allowed_names)
    names = set()
    for head in table.heads:
        name, unit = split_head(head) or ("", "")
        names.add(name)
        column = kind.column(name)
        try:
            if column is None and name in kind.texts and unit:
                raise FieldError("a column of text has no unit", name)
            if name == _SPEED and kind.has_amplitudes:
                continue
            if column is None and name not in kind.texts and name.replace("_", "").islower():
                problem = f"a file of this kind has no such column{did_you_mean(name, allowed_names)}"
                raise FieldError(problem, ", ".join(allowed_names))
            unit, dimension, _ = _motion(column, unit)
            if dimension is not None:
                parse_quantity(f"1 {unit}", dimension)
            elif column is not None and unit and unit != "%":
                raise FieldError("this column has no unit", f"{name}, or {name} [%]")
        except FieldError as error:
            yield table.head_fault(head, error.problem, error.allowed)
    line = f"line {table.head_line}"
    needed = [column for column in kind.columns if not column.optional and column.name not in kind.one_of]
    for column in needed:
        if column.name not in names:
            yield data_fault(table.file, line, f'the column "{column.head}" is missing: {column.meaning}')
    if kind.has_chamber and "chamber" not in names:
        yield data_fault(table.file, line, 'the column "chamber" is missing: letter of the driven chamber')
    present = [name for name in kind.one_of if name in names]
    if kind.one_of and len(present) != 1:
        choice = " or ".join(f'"{c.head}"' for c in kind.columns if c.name in kind.one_of)
        yield data_fault(table.file, line, f"{len(present)} of the columns {choice}, and one is needed")


def _motion(column: DataColumn | None, unit: str) -> tuple[str, str | None, int]:
    """Unit and dimension of a column, and its order as a derivative: 1 velocity, 2 acceleration."""
    if column is None or not column.amplitude:
        return unit, None if column is None else column.dimension, 0
    unit = _GRAVITY.get(unit, unit)
    order = _DERIVATIVES.get(dimension_of(unit) or "", 0)
    return unit, dimension_of(unit) if order else column.dimension, order


def _speed(table: CsvTable, kind: Kind, scene: AnyScene | None) -> tuple[FloatArray, list[Fault]]:
    """Speed of the rotor in each row, rad/s, where amplitudes are velocities or accelerations, else 1."""
    split = [(head, *(split_head(head) or ("", ""))) for head in table.heads]
    if not any(_motion(kind.column(name), unit)[2] for _, name, unit in split):
        return np.ones(len(table.rows)), []
    for head, name, unit in split:
        if name == _SPEED:
            speeds, faults = table.values(head, unit, "speed")
            return np.maximum(speeds, 1.0), faults
    try:
        stated = table.header.get(_SPEED)
        value = parse_quantity(stated, "speed") if stated else getattr(getattr(scene, "rotor", 0), _SPEED, 0)
        if not value > 0:
            raise FieldError("amplitudes are displacements at a known speed alone", 'speed = "3000 rpm"')
    except FieldError as error:
        return np.ones(0), [data_fault(table.file, _SPEED, error.problem, allowed=error.allowed)]
    return np.full(len(table.rows), value), []


def _turned(
    head: str, kind: Kind, columns: dict[str, FloatArray], speed: FloatArray, leads: dict[str, float]
) -> tuple[str, ...]:
    """Turn the phase of a velocity or an acceleration back to that of the displacement, and say so."""
    name, unit = split_head(head) or ("", "")
    order = _motion(kind.column(name), unit)[2]
    phase = name.replace(AMPLITUDE, "phase", 1)
    if not order or not name.startswith(AMPLITUDE):
        return ()
    shown = format_quantity(float(speed[0]), "speed", "rpm") if np.ptp(speed) == 0 else "that of its row"
    text = f"{head} is divided by the speed{' squared' if order > 1 else ''}, {shown}"
    if phase in columns:
        leads[phase] = order * np.pi / 2
        columns[phase] = columns[phase] - leads[phase]
        text += f"; its phase is turned back by {90 * order} deg"
    return (text,)


def _columns(table: CsvTable, kind: Kind, speed: FloatArray) -> tuple[dict[str, FloatArray], list[Fault]]:
    """Every column of numbers, SI, and the errors of the cells."""
    columns: dict[str, FloatArray] = {}
    faults: list[Fault] = []
    for head in table.heads:
        name, unit = split_head(head) or ("", "")
        column = kind.column(name)
        if column is None:
            continue
        unit, dimension, order = _motion(column, unit)
        dimension = "share" if unit == "%" and dimension is None else dimension
        columns[name], wrong = table.values(head, unit, dimension)
        columns[name] = columns[name] / speed**order
        faults += wrong
        bad, rows = {fault.key for fault in wrong}, zip(table.lines, table.texts(head), strict=True)
        for (line, cell), value in zip(rows, columns[name].tolist(), strict=True):
            try:
                column.check(value)
            except FieldError as error:
                fault = table.fault(line, head, cell, error.problem, error.allowed)
                faults += [] if fault.key in bad else [fault]
    return columns, faults


def _faults_of_scene(
    table: CsvTable, kind: Kind, scene: AnyScene | None, columns: Mapping[str, FloatArray]
) -> Iterator[Fault]:
    """Yield errors: chambers that the disc does not have, and fills beyond the liquid of the pair."""
    if scene is None or not (kind.has_chamber or kind.column("gas_time")):
        return
    disc = liquid_ring_scene(scene).disc
    letters, total = LETTERS[: disc.chambers], 2 * disc.initial_fill
    for line, cell in zip(table.lines, table.texts("chamber"), strict=True) if kind.has_chamber else ():
        if len(cell) != 1 or cell not in letters:
            problem = f"the disc has no chamber of that name{did_you_mean(cell, letters)}"
            yield table.fault(line, "chamber", cell, problem, ", ".join(letters))
    for head in table.heads:
        if (split_head(head) or ("",))[0] == "fill_ratio":
            rows = zip(table.lines, table.texts(head), columns["fill_ratio"].tolist(), strict=True)
            for line, cell, fill in rows:
                if total * (1 + _ROUNDED) < fill <= 1:
                    problem = f"the chambers of a pair hold {total:.4g} together, twice disc.initial_fill"
                    yield table.fault(line, head, cell, problem, f"from 0 to {total:.4g}")


def _zero_to_peak(columns: Mapping[str, FloatArray], kind: Kind, factor: float) -> dict[str, FloatArray]:
    counted = {column.name for column in kind.columns if column.amplitude}
    return {name: values * (factor if name in counted else 1.0) for name, values in columns.items()}


def _stated_uncertainty(
    table: CsvTable, kind: Kind, columns: Mapping[str, FloatArray], speed: FloatArray
) -> tuple[dict[str, FloatArray], list[Fault]]:
    """Stated expanded uncertainty of each measured column, and errors.

    A column `uncertainty_<name>` takes precedence over a column `uncertainty`, and that over the key in the
    first lines. A relative uncertainty of a vibration applies to both components, to its phase in radians.
    """
    measured = {column.name: column for column in kind.measured if column.name in columns}
    stated, result, faults = table.header.get(_UNCERTAINTY), {}, []
    for name, value in stated.items() if isinstance(stated, Mapping) else ():
        try:
            if name not in measured:
                problem = f"the file measures no such column{did_you_mean(name, measured)}"
                raise FieldError(problem, ", ".join(measured))
            _, dimension, order = _motion(measured[name], unit_of(value) if isinstance(value, str) else "")
            width, relative = half_width(dimension).read(value)
            if relative and measured[name].dimension == "angle":
                raise FieldError("an angle has no percentage", 'an angle such as "1 deg"')
            if not width > 0:
                raise FieldError("an uncertainty is above zero", "leave it out where it is to be estimated")
        except FieldError as error:
            key, text = f"{_UNCERTAINTY}.{toml_text(name).strip(chr(34))}", toml_text(value)
            faults.append(data_fault(table.file, key, error.problem, value=text, allowed=error.allowed))
            continue
        result[name] = width * (np.abs(columns[name]) if relative else speed**-order)
    if stated is not None and not isinstance(stated, Mapping):
        try:
            share_of_all = _RELATIVE.read(stated)
            result = {name: share_of_all * _size(kind, columns, name) for name in measured}
        except FieldError as error:
            allowed = 'a share of the measured values such as "2 %" or 0.02 (95 %)'
            if kind.balancer:
                allowed += ', or by column: { amplitude = "0.1 um", phase = "1 deg" }; absent: estimated'
            value = toml_text(stated)
            faults.append(data_fault(table.file, _UNCERTAINTY, error.problem, value=value, allowed=allowed))
    if _UNCERTAINTY in columns:
        result = {name: columns[_UNCERTAINTY] * _size(kind, columns, name) for name in measured}
    by_column = {name: columns.get(f"{_UNCERTAINTY}_{name}") for name in measured}
    result |= {name: width for name, width in by_column.items() if width is not None}
    # Relative to a value of zero, the uncertainty would be zero and the value exact.
    for name, width in result.items():
        for line, value, each in zip(table.lines, columns[name].tolist(), width.tolist(), strict=True):
            if value == 0 and each == 0:
                problem = f"{name} is 0 there, so its uncertainty cannot be relative"
                allowed = f'an absolute one, in a column "{_UNCERTAINTY}_{name}"'
                faults.append(data_fault(table.file, f"line {line}", problem, allowed=allowed))
    # The noise of vibrations is stated for all amplitudes of a file or for none.
    missing = [column.name for column in kind.measured if column.amplitude and column.name not in result]
    if result and missing:
        problem = f"stated of {', '.join(result)} and not of {', '.join(missing)}"
        allowed = "of every amplitude, or of nothing"
        faults.append(data_fault(table.file, _UNCERTAINTY, problem, allowed=allowed))
    return result, faults


def _size(kind: Kind, columns: Mapping[str, FloatArray], name: str) -> FloatArray:
    """Reference of a relative uncertainty: the value, or one radian for the phase of a vibration."""
    of_vibration = name.startswith("phase") and kind.has_amplitudes
    return np.ones_like(columns[name]) if of_vibration else np.abs(columns[name])


AMPLITUDES: Final[Mapping[str, float]] = MappingProxyType(
    {"zero_to_peak": 1.0, "peak_to_peak": 0.5, "rms": 2**0.5}
)
"""Factor to zero to peak, by convention of amplitude, for a harmonic vibration."""
KINDS: Final[Mapping[str, Kind]] = MappingProxyType({**LIQUID_RING, **ECCENTRIC_MASS, **BENCH})


def kinds_of(balancer: str) -> tuple[str, ...]:
    """Names of the kinds that scenes of a balancer predict; for an empty name, those of test benches."""
    names = tuple(name for name, kind in KINDS.items() if balancer == kind.balancer)
    return names or tuple(name for name, kind in KINDS.items() if kind.any_rotor)


def preview(data: Observations) -> str:
    """Text of what was understood of a file: kind, rows, changes, and ranges of the columns."""
    kind = KINDS[data.kind]
    count = len(set(data.series.tolist()))
    lines = [f"{data.file}: {kind.title} ({data.kind})", f"  {len(data)} rows, {count} series; {data.source}"]
    for column in (each for each in kind.columns if each.name in data.columns):
        values = data.columns[column.name]
        ends = " to ".join(column.written(float(end)) for end in (values.min(), values.max()))
        lines.append(f"  {column.name}: {ends}{', zero to peak' if column.amplitude else ''}")
    return "\n".join([*lines, *(f"  {remark}" for remark in data.remarks)])


def template(name: str) -> str:
    """Text of a file of one kind without rows; lines that begin with ## explain the columns.

    Raises: SceneError: no such kind.
    """
    if name not in KINDS:
        problem, allowed = f"there is no such kind of data{did_you_mean(name, KINDS)}", ", ".join(KINDS)
        raise SceneError.of_option(option="--template", value=name, problem=problem, allowed=allowed)
    kind = KINDS[name]
    # The template has the first of alternative columns.
    others = kind.one_of[1:]
    lines = [f'# kind = "{name}"  # {kind.title}', '# source = ""  # rig, run and date']
    amplitudes = [column for column in kind.measured if column.amplitude]
    if not kind.balancer:
        lines.append("# uncertainty = 0.02  # expanded (95 %), relative to the measured values")
    else:
        if amplitudes:
            words = ", ".join(AMPLITUDES)
            lines.append(f'# amplitude = ""  # {words}: how every amplitude in the file is counted')
        measured = amplitudes or [column for column in kind.measured if column.name not in others]
        stated = ", ".join(f'{column.name} = "1 {column.unit}"' for column in measured)
        meaning = "expanded (95 %), or relative such as 0.02; absent: estimated"
        lines.append(f"## uncertainty = {{ {stated} }}  # {meaning}")
    lines.append("##")
    if kind.has_chamber:
        lines.append("## chamber: letter of the driven chamber, A for the first")
    for column in kind.columns:
        word = "or " if column.name in others else "optional " if column.optional else ""
        lines.append(f"## {word}{column.head}: {column.meaning}")
    widths = ", ".join(column.name for column in kind.uncertainties() if column.dimension)
    needed = [column for column in kind.columns if not column.optional and column.name not in others]
    heads = [*(["chamber"] if kind.has_chamber else []), *(column.head for column in needed), "series"]
    lines += [
        f"## optional {widths or 'uncertainty'}: expanded uncertainty (95 %) of each row",
        "## series: run, rig or day that a row belongs to; rows in the order in which they were measured",
        "## optional note: any remark; tells apart rows that are otherwise the same",
        ",".join(heads),
    ]
    return "\n".join(lines) + "\n"
