"""A unit for co-simulation, run by `ctypes` from its model description, with no code of the program's."""

from __future__ import annotations

import ctypes
import xml.etree.ElementTree as ET
from collections.abc import Mapping
from pathlib import Path
from typing import Any, Final

_C_TYPES: Final[dict[str, dict[str, Any]]] = {
    "fmi2": {"Real": ctypes.c_double, "Integer": ctypes.c_int, "Boolean": ctypes.c_int},
    "fmi3": {"Float64": ctypes.c_double, "Int32": ctypes.c_int32, "Boolean": ctypes.c_bool},
}


class ImportedUnit:
    """An instance of an unpacked unit with a library for this machine; a context that frees it."""

    def __init__(self, folder: Path, version: str) -> None:
        model = ET.parse(folder / "modelDescription.xml").getroot()
        self.version, self.time, self.variables = version, 0.0, list[tuple[str, str, int, str]]()
        for each in model.iterfind("ModelVariables/*"):
            kind = each[0].tag if len(each) else each.tag
            place, cause = int(each.get("valueReference", "")), each.get("causality", "")
            self.variables.append((each.get("name", ""), kind, place, cause))
        (library,) = (path for path in (folder / "binaries").rglob("*") if path.is_file())
        self.library = ctypes.CDLL(str(library))
        token = (model.get("guid") or model.get("instantiationToken") or "").encode()
        makes = "fmi2Instantiate" if version == "fmi2" else "fmi3InstantiateCoSimulation"
        make = getattr(self.library, makes)
        make.restype = ctypes.c_void_p
        if version == "fmi2":
            made = make(b"x", 1, token, b"", None, 0, 0)
        else:
            off = ctypes.c_bool(False)
            none = None
            made = make(b"x", token, b"", off, off, off, off, none, ctypes.c_size_t(0), none, none, none)
        assert made
        self.instance = ctypes.c_void_p(made)

    def __enter__(self) -> ImportedUnit:
        return self

    def __exit__(self, *_: object) -> None:
        getattr(self.library, f"{self.version}FreeInstance")(self.instance)

    def _call(self, does: str, kind: str, place: int, value: float | bool) -> Any:
        c_type = _C_TYPES[self.version][kind]
        places, values = (ctypes.c_uint * 1)(place), (c_type * 1)(value)
        more = () if self.version == "fmi2" else (ctypes.c_size_t(1),)
        function = getattr(self.library, f"{self.version}{does}{kind}")
        assert function(self.instance, places, ctypes.c_size_t(1), values, *more) == 0
        return values[0]

    def step(self, inputs: Mapping[str, float], time: float) -> dict[str, float]:
        """Set inputs by name, let a time pass, s. Returns: all outputs by name."""
        for name, kind, place, cause in self.variables:
            if cause == "input":
                value = inputs[name]
                self._call("Set", kind, place, value if kind in ("Real", "Float64") else bool(value))
        now, h = ctypes.c_double(self.time), ctypes.c_double(time)
        if self.version == "fmi2":
            assert self.library.fmi2DoStep(self.instance, now, h, 1) == 0
        else:
            told = [ctypes.byref(ctypes.c_bool()) for _ in range(3)] + [ctypes.byref(ctypes.c_double())]
            assert self.library.fmi3DoStep(self.instance, now, h, ctypes.c_bool(False), *told) == 0
        self.time += time
        return {
            name: float(self._call("Get", kind, place, 0))
            for name, kind, place, cause in self.variables
            if cause == "output"
        }
