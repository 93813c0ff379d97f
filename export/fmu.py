"""The compact law as a functional mock-up unit (FMI 2.0 or 3.0, co-simulation), with the source inside.

A host that has a compiler builds it from `sources/`; where this machine has one, the unit also runs as it is
on machines like this one, and with a cross-compiler on all.  Two exports of one law are equal to the byte but
for what the compiler makes.
"""

from __future__ import annotations

import hashlib
import tomllib
from importlib.resources import files
from io import BytesIO
from typing import Any, Final
from xml.etree import ElementTree as ET
from zipfile import ZIP_DEFLATED, ZipFile, ZipInfo

from ringbalance.export.compact import CompactLaw
from ringbalance.export.hosts import c_files, filled
from ringbalance.export.libraries import Version, every_library, local_library
from ringbalance.export.translate import number_text
from ringbalance.results.result import csv_text

_DATE: Final = (1980, 1, 1, 0, 0, 0)
"""Of every file inside, so that two exports are equal."""
_PRESSURES: Final = (0.0, 1e5, 2e5, 4e5, 8e5)
"""Pa, of the reference results."""
_KINDS: Final = {"Real": "Float64", "Integer": "Int32", "Boolean": "Boolean"}
"""Names of types in FMI 3.0 by those in FMI 2.0."""
_ABLE: Final = ("canHandleVariableCommunicationStepSize", "canGetAndSetFMU{}tate", "canSerializeFMU{}tate")


def fmu_bytes(
    law: CompactLaw, name: str, version: Version, *, all_systems: bool = False
) -> tuple[bytes, bool]:
    """The unit, and whether it has a library.

    It holds the model description, the sources, reference results, and the library for machines like this one
    where a compiler is, or, with `all_systems`, those for all that the standard names.

    Raises: OSError: no cross-compiler for all systems.
    """
    words = {
        "flow": f"{name}_flow",
        "answer": f"{name}_answer",
        "guid": guid_of(law),
        "start_fill": number_text(law.max_fill_ratio / 2),
    }
    core = filled("unit", law, name, **words)
    sources = {**c_files(law, name), f"{version}.c": filled(version, law, name, core=core, **words)}
    described = _model_2(law, name) if version == "fmi2" else _model_3(law, name)
    parts = {
        "modelDescription.xml": described,
        **{f"sources/{file}": text.encode() for file, text in sources.items()},
        "documentation/reference.csv": _reference(law).encode(),
    }
    if version == "fmi3":
        parts["sources/buildDescription.xml"] = _build(name)
    libraries = (every_library if all_systems else local_library)(sources, name, version)
    return _zipped({**parts, **libraries}), bool(libraries)


def _declared(law: CompactLaw) -> dict[str, Any]:
    """Variables and units, with the law's largest fill ratio."""
    most = law.max_fill_ratio
    text = files("ringbalance.export").joinpath("templates/unit.toml").read_text(encoding="utf-8")
    return tomllib.loads(text.replace("MOST", number_text(most)).replace("HALF", number_text(most / 2)))


def _model_2(law: CompactLaw, name: str) -> bytes:
    declared = _declared(law)
    root = _root("2.0", law, name, guid=guid_of(law), variableNamingConvention="flat")
    able = {each.format("s"): "true" for each in (*_ABLE, "canNotUseMemoryManagementFunctions")}
    unit = ET.SubElement(root, "CoSimulation", {"modelIdentifier": name, **able})
    listed = ET.SubElement(unit, "SourceFiles")
    for file in (f"{name}.c", "fmi2.c"):
        ET.SubElement(listed, "File", name=file)
    _add_units(root, declared)
    ET.SubElement(root, "DefaultExperiment", startTime="0", stopTime="1", stepSize="0.01")
    variables = ET.SubElement(root, "ModelVariables")
    structure = ET.SubElement(root, "ModelStructure")
    groups = [ET.SubElement(structure, group) for group in ("Outputs", "InitialUnknowns")]
    for place, each in enumerate(declared["variable"]):
        variable = ET.SubElement(variables, "ScalarVariable", _heads(each, place))
        ET.SubElement(variable, each["kind"], each["range"])
        for group in groups if each["causality"] == "output" else ():
            ET.SubElement(group, "Unknown", index=str(place + 1))
    return _xml(root)


def _model_3(law: CompactLaw, name: str) -> bytes:
    declared = _declared(law)
    root = _root("3.0", law, name, instantiationToken=guid_of(law))
    able = {each.format("S"): "true" for each in _ABLE}
    ET.SubElement(root, "CoSimulation", {"modelIdentifier": name, **able})
    _add_units(root, declared)
    ET.SubElement(root, "DefaultExperiment", startTime="0", stopTime="1", stepSize="0.01")
    variables = ET.SubElement(root, "ModelVariables")
    structure = ET.SubElement(root, "ModelStructure")
    for place, each in enumerate(declared["variable"]):
        ET.SubElement(variables, _KINDS[each["kind"]], {**_heads(each, place), **each["range"]})
    heads = {"name": "time", "valueReference": str(len(declared["variable"])), "description": "of the host"}
    ET.SubElement(variables, "Float64", {**heads, "causality": "independent", "variability": "continuous"})
    for group in ("Output", "InitialUnknown"):
        for place, each in enumerate(declared["variable"]):
            if each["causality"] == "output":
                ET.SubElement(structure, group, valueReference=str(place))
    return _xml(root)


def _root(version: str, law: CompactLaw, name: str, **further: str) -> ET.Element:
    heads = {"fmiVersion": version, "modelName": name, **further}
    words = {"license": "BSD-3-Clause", "generationTool": "ringbalance"}
    title = f"Flow law of a liquid-ring balancer, calibrated from {law.scene.rpartition('/')[2]}"
    return ET.Element("fmiModelDescription", {**heads, "description": title, **words})


def _heads(variable: dict[str, Any], place: int) -> dict[str, str]:
    return {
        "name": variable["name"],
        "valueReference": str(place),
        "causality": variable["causality"],
        "variability": "continuous" if variable["kind"] == "Real" else "discrete",
        "description": variable["description"],
    }


def _add_units(root: ET.Element, declared: dict[str, Any]) -> None:
    units = ET.SubElement(root, "UnitDefinitions")
    for name, base in declared["units"].items():
        ET.SubElement(ET.SubElement(units, "Unit", name=name), "BaseUnit", base)


def _build(name: str) -> bytes:
    root = ET.Element("fmiBuildDescription", fmiVersion="3.0")
    sources = ET.SubElement(
        ET.SubElement(root, "BuildConfiguration", modelIdentifier=name), "SourceFileSet", language="C99"
    )
    for file in (f"{name}.c", "fmi3.c"):
        ET.SubElement(sources, "SourceFile", name=file)
    return _xml(root)


def _xml(root: ET.Element) -> bytes:
    ET.indent(root)
    text: bytes = ET.tostring(root, encoding="UTF-8", xml_declaration=True)
    return text


def guid_of(law: CompactLaw) -> str:
    """One for each law: another one makes another unit."""
    text = ",".join(number_text(value) for value in law.constants)
    return hashlib.sha256(text.encode()).hexdigest()[:32]


def _reference(law: CompactLaw) -> str:
    """Answers that a host can compare its own with."""
    most = law.max_fill_ratio
    queries = [
        (share * most, (1 - share) * most, pressure, primed)
        for share in (0.1, 0.3, 0.5, 0.8)
        for pressure in _PRESSURES
        for primed in (False, True)
    ]
    answers = [
        law.answer(fill_ratio=x, opposite_fill_ratio=y, gas_pressure=p, primed=primed)
        for x, y, p, primed in queries
    ]
    heads = ("fill_ratio", "opposite_fill_ratio", "gas_pressure", "primed")
    columns = dict(
        zip(heads, zip(*((*map(repr, each[:3]), int(each[3])) for each in queries), strict=True), strict=True)
    )
    return csv_text(
        {
            **columns,
            "velocity": [repr(each.velocity) for each in answers],
            "velocity_uncertainty": [repr(each.uncertainty) for each in answers],
            "regime": [each.regime for each in answers],
            "status": [each.status for each in answers],
            "primed_after": [int(each.primed) for each in answers],
        }
    )


def _zipped(parts: dict[str, bytes]) -> bytes:
    stream = BytesIO()
    with ZipFile(stream, "w", ZIP_DEFLATED, compresslevel=9) as archive:
        for file, content in sorted(parts.items()):
            entry = ZipInfo(file, _DATE)
            entry.compress_type = ZIP_DEFLATED
            entry.external_attr = 0o644 << 16
            archive.writestr(entry, content)
    return stream.getvalue()
