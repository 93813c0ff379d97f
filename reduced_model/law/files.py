"""Reader of a law's file; its errors are reported together, in the form of a scene's."""

from __future__ import annotations

import json
import sys
from collections.abc import Mapping
from dataclasses import MISSING, fields, replace
from pathlib import Path
from types import MappingProxyType
from typing import Any, Final, cast

import numpy as np

from ringbalance.reduced_model.law import version_4
from ringbalance.reduced_model.law.calibrated_law import CalibratedLaw, CalibratedMoment
from ringbalance.reduced_model.law.flow_law import FORMAT, VERSION, CompleteLaw
from ringbalance.reduced_model.law.half_widths import HalfWidths
from ringbalance.reduced_model.law.paper_law import PaperLaw, PaperMoment
from ringbalance.reduced_model.pieces.table import Table
from ringbalance.reduced_model.tube.heads import TubeHeads
from ringbalance.reduced_model.tube.regime import TubePath
from ringbalance.scene.faults import Fault, SceneError
from ringbalance.scene.platform.files import NOT_TEXT

_LAWS: Final = (CalibratedLaw, PaperLaw)
_RECORDS: Final[Mapping[str, type]] = MappingProxyType(
    {
        record.__name__: record
        for record in (*_LAWS, CalibratedMoment, HalfWidths, PaperMoment, Table, TubeHeads, TubePath)
    }
)
_POSITIVE: Final = frozenset(
    ["density", "chamber_volume", "tube_area", "max_fill_ratio", "axial_width", "central_angle", "gas_factor"]
)
_NOT_NEGATIVE: Final = frozenset(
    ["ambient_pressure", "drag_coefficient", "interpolation_error", "released", "froude_velocity"]
)
_LONGEST_VALUE: Final = 40


class _Reader:
    """Reader of one file that collects its errors while it builds the records."""

    def __init__(self, file: str) -> None:
        self.file = file
        self.faults: list[Fault] = []

    def fault(self, where: str, value: str, problem: str, allowed: str) -> None:
        table, _, key = where.rpartition(".")
        short = value if len(value) <= _LONGEST_VALUE else value[: _LONGEST_VALUE - 3] + "..."
        self.faults.append(
            Fault(file=self.file, table=table, key=key, value=short, problem=problem, allowed=allowed)
        )

    def record(self, data: object, expected: tuple[type, ...], where: str) -> Any:
        """Build a record, or note why it cannot be built and return None."""
        names = [kind.__name__ for kind in expected]
        if not isinstance(data, dict) or data.get("type") not in names:
            type_name = data.get("type") if isinstance(data, dict) else data
            self.fault(f"{where}.type", _shown(type_name), "this is no such record", ", ".join(names))
            return None
        kind, before = _RECORDS[data["type"]], len(self.faults)
        declared = {field.name: field for field in fields(kind)}
        for key in sorted(set(data) - set(declared) - {"type"}):
            self.fault(f"{where}.{key}", _shown(data[key]), "unknown key", ", ".join(declared))
        values = {}
        for name, field in declared.items():
            if name in data:
                values[name] = self.value(data[name], str(field.type), name, f"{where}.{name}")
            elif field.default is MISSING:
                self.fault(f"{where}.{name}", "missing", "the key is missing", str(field.type))
        if len(self.faults) > before:
            return None
        try:
            return kind(**values)
        except ValueError as error:
            self.fault(f"{where}.type", data["type"], str(error), "values that fit together")
            return None

    def law(self, content: Mapping[str, Any]) -> Any:
        """Read the law of a file, or note why it cannot be read."""
        data = content.get("law")
        if content["version"] == VERSION or not isinstance(data, dict) or data.get("type") != "CalibratedLaw":
            return self.record(data, _LAWS, "law")
        try:
            document, held = version_4.split(data)
            both = [version_4.split(each)[0] for each in held["variants"]]
        except (KeyError, TypeError, ValueError, IndexError, AttributeError):
            self.fault("law.type", data["type"], "this is no whole law of version 4", "calibrate again")
            return None
        law, *variants = (self.record(each, (CalibratedLaw,), "law") for each in (document, *both))
        if self.faults:
            return None
        return replace(law, half_widths=version_4.half_widths(law, held, variants))

    def value(self, value: object, kind: str, name: str, where: str) -> Any:
        """A value of a field's type, or a note on what is wrong with it."""
        if value is None and kind.endswith("| None"):
            return None
        kind = kind.removesuffix(" | None")
        if kind in _RECORDS:
            return self.record(value, (_RECORDS[kind],), where)
        if kind == "FloatArray":
            fits, allowed = (
                isinstance(value, list) and all(map(_is_number, value)),
                "a list of finite numbers",
            )
        elif kind == "float":
            fits, allowed = _is_number(value), "a finite number"
            if name in _POSITIVE:
                fits, allowed = fits and value > 0, "a number above 0"  # type: ignore[operator]
            elif name in _NOT_NEGATIVE:
                fits, allowed = fits and value >= 0, "a number of at least 0"  # type: ignore[operator]
        else:
            fits, allowed = isinstance(value, str), "a text"
            if kind == "bool":
                fits, allowed = isinstance(value, bool), "true or false"
        if not fits:
            self.fault(where, _shown(value), f"it is not {allowed}", allowed)
            return None
        if kind == "FloatArray":
            return np.array(value, dtype=np.float64)
        return float(cast(float, value)) if kind == "float" else value


def _is_number(value: object) -> bool:
    """True for a finite number that is a float without overflow."""
    return type(value) in (int, float) and abs(cast(float, value)) <= sys.float_info.max


def _shown(value: object) -> str:
    return json.dumps(value, default=str)


def load_law(path: Path | str) -> CompleteLaw:
    """Read a law that a law's `save` wrote, also one of version 4.

    Returns: The law, equal to the saved one bit for bit; it carries its moment, volumes and density.  Of
        version 4 all but half-widths, and whether a regime is undecided, are equal.
    Raises: SceneError: a file that cannot be read or is no law; every fault names key, value and what is
        allowed.

    Example:
        >>> scene = rb.load_scene(rb.bundled_scene("liquid_ring_paper"))
        >>> law = rb.calibrate(scene).flow_law
        >>> path = law.save("law.json")
        >>> again = rb.load_law(path)
        >>> conditions = {"fill_ratio": 0.25, "gas_pressure": 0.7e6}
        >>> bool(again.evaluate(**conditions) == law.evaluate(**conditions))
        True
    """
    file = Path(path)
    reader, law = _Reader(str(file)), None
    wanted = f'a file written by "ringbalance calibrate SCENE --save {file.name}"'
    try:
        content = json.loads(file.read_text(encoding="utf-8"))
    except OSError as error:
        reader.fault("", "", f"the file cannot be read: {error.strerror or error}", wanted)
    except UnicodeDecodeError:
        reader.fault("", "", NOT_TEXT, wanted)
    except (ValueError, RecursionError) as error:
        reader.fault("", "", f"the file is not JSON: {error}", wanted)
    else:
        if not isinstance(content, dict) or content.get("format") != FORMAT:
            file_format = content.get("format") if isinstance(content, dict) else None
            reader.fault(
                "format", _shown(file_format), "the file is not a saved law", f'"{FORMAT}", {wanted}'
            )
        elif content.get("version") not in (VERSION, 4):
            reader.fault(
                "version",
                _shown(content.get("version")),
                "written by another release, whose law lacks what this one needs: calibrate again",
                f"{VERSION}, or 4",
            )
        else:
            law = reader.law(content)
    if reader.faults:
        raise SceneError(reader.faults)
    return cast(CompleteLaw, law)
