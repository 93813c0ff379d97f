"""A block as a functional mock-up unit (FMI 2.0 or 3.0, co-simulation), with the source inside.

A host that has a compiler builds it from `sources/`; where this machine has one, the unit also runs as it is
on machines like this one, and with a cross-compiler on all.  Two exports of one law are equal to the byte,
apart from compiled libraries.
"""

from __future__ import annotations

import hashlib
from io import BytesIO
from itertools import chain
from typing import Final
from xml.etree import ElementTree as ET
from zipfile import ZIP_DEFLATED, ZipFile, ZipInfo

from ringbalance.export.blocks import Block, declared
from ringbalance.export.hosts import block_c_files, filled
from ringbalance.export.libraries import Version, every_library, local_library
from ringbalance.export.reference import reference_files
from ringbalance.export.translate import number_text

_DATE: Final = (1980, 1, 1, 0, 0, 0)
"""Date of every file inside, so that two exports are equal."""
_KINDS: Final = {"Real": "Float64", "Integer": "Int32", "Boolean": "Boolean"}
"""Names of types in FMI 3.0 by those in FMI 2.0."""
_ABLE: Final = ("canHandleVariableCommunicationStepSize", "canGetAndSetFMU{}tate", "canSerializeFMU{}tate")


def fmu_bytes(block: Block, name: str, version: Version, *, all_systems: bool = False) -> tuple[bytes, bool]:
    """The unit, and true if it has a library.

    It holds the model description, the sources, reference results, and the library for machines like this one
    if there is a compiler, or, with `all_systems`, those for all machines that the standard names.

    Raises: OSError: no cross-compiler for all systems.
    """
    # Counts and indices of the variables, and code that reads one: a block without time is evaluated first.
    of = {kind: [each for each in block.variables if each.kind == kind] for kind in _KINDS}
    shown = "return s->block.w[PLACES[reference]];"
    if not block.timed:
        answer = f"state seen = *s;\n    {name}_step(&seen.block, 0.0);"
        shown = f"{answer}\n    return seen.block.w[PLACES[reference]];"
    words = {
        "guid": guid_of(block),
        "reals": str(len(of["Real"])),
        "integers": str(len(of["Integer"])),
        "booleans": str(len(of["Boolean"])),
        "real_inputs": str(sum(each.input for each in of["Real"])),
        "boolean_inputs": str(sum(each.input for each in of["Boolean"])),
        "all_places": ", ".join(str(each.index) for each in block.variables),
        "shown": shown,
    }
    core = filled("unit", block, name, **words)
    sources = {**block_c_files(block, name), f"{version}.c": filled(version, block, name, core=core, **words)}
    parts = {
        "modelDescription.xml": _description(block, name, second=version == "fmi2"),
        **{f"sources/{file}": text.encode() for file, text in sources.items()},
        **reference_files(block, name),
    }
    if version == "fmi3":
        root = ET.Element("fmiBuildDescription", fmiVersion="3.0")
        configuration = ET.SubElement(root, "BuildConfiguration", modelIdentifier=name)
        listed = ET.SubElement(configuration, "SourceFileSet", language="C99")
        for file in (f"{name}.c", "fmi3.c"):
            ET.SubElement(listed, "SourceFile", name=file)
        parts["sources/buildDescription.xml"] = _xml(root)
    libraries = (every_library if all_systems else local_library)(sources, name, version)

    stream = BytesIO()
    with ZipFile(stream, "w", ZIP_DEFLATED, compresslevel=9) as archive:
        for file, content in sorted({**parts, **libraries}.items()):
            entry = ZipInfo(file, _DATE)
            entry.compress_type = ZIP_DEFLATED
            entry.external_attr = 0o644 << 16
            archive.writestr(entry, content)
    return stream.getvalue(), bool(libraries)


def _description(block: Block, name: str, *, second: bool) -> bytes:
    """The model description of FMI 2.0 if `second`, else of FMI 3.0."""
    guid = guid_of(block)
    identity = {"guid": guid, "variableNamingConvention": "flat"} if second else {"instantiationToken": guid}
    heads = {"fmiVersion": "2.0" if second else "3.0", "modelName": name, **identity}
    words = {"license": "BSD-3-Clause", "generationTool": "ringbalance"}
    title = f"{block.title}, from {block.scene.rpartition('/')[2]}"
    root = ET.Element("fmiModelDescription", {**heads, "description": title, **words})
    abilities = (*_ABLE, "canNotUseMemoryManagementFunctions") if second else _ABLE
    able = {each.format("s" if second else "S"): "true" for each in abilities}
    unit = ET.SubElement(root, "CoSimulation", {"modelIdentifier": name, **able})
    if second:
        listed = ET.SubElement(unit, "SourceFiles")
        for file in (f"{name}.c", "fmi2.c"):
            ET.SubElement(listed, "File", name=file)
    units = ET.SubElement(root, "UnitDefinitions")
    used = {each.range.get("unit") for each in block.variables}
    for unit_name, base in declared()["units"].items():
        if unit_name in used:
            ET.SubElement(ET.SubElement(units, "Unit", name=unit_name), "BaseUnit", dict(base))
    ET.SubElement(root, "DefaultExperiment", startTime="0", stopTime="1", stepSize=f"{block.period:g}")
    variables, structure = (ET.SubElement(root, each) for each in ("ModelVariables", "ModelStructure"))
    for number, each in enumerate(block.variables):
        heads = {
            "name": each.name,
            "valueReference": str(number),
            "causality": "input" if each.input else "output",
            "variability": "continuous" if each.kind == "Real" else "discrete",
            "description": each.description,
        }
        # Unit and range, and for an input its value at the start.
        start = block.start[each.index]
        text = number_text(start) if each.kind == "Real" else str(bool(start)).lower()
        span = {**each.range, **({"start": text} if each.input else {})}
        if second:
            ET.SubElement(ET.SubElement(variables, "ScalarVariable", heads), each.kind, span)
        else:
            ET.SubElement(variables, _KINDS[each.kind], {**heads, **span})
    outputs = [number for number, each in enumerate(block.variables) if not each.input]
    if second:
        for group in ("Outputs", "InitialUnknowns"):
            listed = ET.SubElement(structure, group)
            for number in outputs:
                ET.SubElement(listed, "Unknown", index=str(number + 1))
        return _xml(root)
    time = {"name": "time", "valueReference": str(len(block.variables)), "description": "of the host"}
    ET.SubElement(variables, "Float64", {**time, "causality": "independent", "variability": "continuous"})
    for group in ("Output", "InitialUnknown"):
        for number in outputs:
            ET.SubElement(structure, group, valueReference=str(number))
    return _xml(root)


def _xml(root: ET.Element) -> bytes:
    ET.indent(root)
    text: bytes = ET.tostring(root, encoding="UTF-8", xml_declaration=True)
    return text


def guid_of(block: Block) -> str:
    """Identifier of a block's unit, which changes with any of its numbers."""
    tables = () if block.tables is None else (block.tables.cells, *block.tables.pieces, *block.tables.levels)
    text = ",".join(number_text(value) for value in (*block.constants, *chain(*tables), *block.start))
    return hashlib.sha256(f"{block.kind},{text}".encode()).hexdigest()[:32]
