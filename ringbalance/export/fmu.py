"""A block as a functional mock-up unit (FMI 2.0 or 3.0, co-simulation), with the source inside.

A host that has a compiler builds it from `sources/`; where this machine has one, the unit also runs as it is
on machines like this one, and with a cross-compiler on all.  Two exports of one law are equal to the byte,
apart from compiled libraries.

Reference results inside are for comparison with a host's own run of the unit.  Their folder is that of the
layered standard FMI-LS-REF (1.0.0-alpha.1), their form that of the Reference FMUs: CSV with the time first,
numbers in full; inputs hold from their row to the next.
"""

from __future__ import annotations

import hashlib
from collections.abc import Iterator, Mapping, Sequence
from io import BytesIO
from itertools import chain
from typing import Final
from xml.etree import ElementTree as ET
from zipfile import ZIP_DEFLATED, ZipFile, ZipInfo

from ringbalance.export.blocks import Block, declared
from ringbalance.export.hosts import block_c_files, filled
from ringbalance.export.libraries import Version, every_library, local_library
from ringbalance.export.translate import number_text
from ringbalance.results.result import csv_text

_DATE: Final = (1980, 1, 1, 0, 0, 0)
"""Date of every file inside, so that two exports are equal."""
_KINDS: Final = {"Real": "Float64", "Integer": "Int32", "Boolean": "Boolean"}
"""Names of types in FMI 3.0 by those in FMI 2.0."""
_FOLDER: Final = "extra/org.fmi-standard.fmi-ls-ref"
_MANIFEST: Final = "http://fmi-standard.org/fmi-ls-manifest"
_PRESSURES_PA: Final = (0.0, 1e5, 2e5, 4e5, 8e5)
_OPEN_TIMES_S: Final = (0.06, 0.02, 0.03)
"""Commands to the disc's first chambers one after the other, five rows apart at least."""
_VIBRATIONS_M: Final = (3e-6, 0.0), (3e-6, 2e-6), (-1e-6, 1e-6), (-1e-9, 0.0)
"""Vibrations that the controller sees, 60 rows each."""
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


def reference_files(block: Block, name: str) -> dict[str, bytes]:
    """Inputs, outputs and the manifest that names them, by path in the unit."""
    row, inputs = list(block.start), list(_stimuli(block))
    outputs = [block.run(row, block.period, each) for each in inputs]

    ET.register_namespace("fmi-ls", _MANIFEST)
    standard = {"name": "org.fmi-standard.fmi-ls-ref", "version": "1.0.0-alpha.1"}
    standard["description"] = "Inputs and outputs to compare a host with"
    heads = {f"{{{_MANIFEST}}}fmi-ls-{key}": text for key, text in standard.items()}
    root = ET.Element("fmiReferences", heads)
    for source, role in ((f"{name}_in.csv", "stimulus"), (f"{name}_out.csv", "result")):
        ET.SubElement(root, "Related", type="text/csv", source=source, role=role)
    return {
        f"{_FOLDER}/{name}_in.csv": _csv(inputs, 0, block),
        f"{_FOLDER}/{name}_out.csv": _csv(outputs, 1, block),
        f"{_FOLDER}/fmi-ls-manifest.xml": _xml(root),
    }


def _csv(rows: Sequence[Mapping[str, float]], later: int, block: Block) -> bytes:
    """CSV file of rows. Args: `later`: steps from the beginning to the first row."""
    integers = {each.name for each in block.variables if each.kind != "Real"}
    times = [repr((row + later) * block.period) for row in range(len(rows))]
    columns = {
        name: [str(int(row[name])) if name in integers else repr(row[name]) for row in rows]
        for name in rows[0]
    }
    return csv_text({"time": times, **columns}).encode()


def _stimuli(block: Block) -> Iterator[Mapping[str, float]]:
    """All inputs of each step."""
    zeros = {each.name: 0.0 for each in block.variables if each.input}
    if block.kind == "law":
        most = sum(block.start[:2])
        for share in (0.1, 0.3, 0.5, 0.8):
            for pressure in _PRESSURES_PA:
                for primed in (0.0, 1.0):
                    fills = share * most, (1 - share) * most
                    yield dict(zip(zeros, (*fills, pressure, primed), strict=True))
    elif block.kind == "disc":
        for name, open_time in zip(zeros, _OPEN_TIMES_S, strict=False):
            for step in range(8):
                yield {**zeros, name: max(open_time - step * block.period, 0.0)}
    elif block.kind == "strategy":
        # A rotor that whirls by 0.1 mm, and masses at rest.
        for step in range(240):
            turn, still = 10.0 * block.period * step, {"speed": 10.0, "angle_1": 1.0, "angle_2": -1.0}
            whirl = {"position_x": 1e-4, "velocity_y": 1e-3} if step % 2 else {"position_x": 1.1e-4}
            yield {**zeros, **still, **whirl, "rotor_angle": turn}
    elif block.kind == "plant":
        for step in range(240):
            yield {**zeros, "voltage_1": 1.0 if step < 120 else -2.0}
    else:
        for x, y in _VIBRATIONS_M:
            for _ in range(60):
                yield {**zeros, "vibration_x": x, "vibration_y": y}
