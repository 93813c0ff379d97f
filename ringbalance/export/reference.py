"""Reference results inside a unit, for comparison with a host's own run of it.

Their folder is that of the layered standard FMI-LS-REF (1.0.0-alpha.1), their form that of the Reference
FMUs: CSV with the time first, numbers in full; inputs hold from their row to the next.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Final
from xml.etree import ElementTree as ET

from ringbalance.export.blocks import Block
from ringbalance.results.result import csv_text

_FOLDER: Final = "extra/org.fmi-standard.fmi-ls-ref"
_MANIFEST: Final = "http://fmi-standard.org/fmi-ls-manifest"
_PRESSURES_PA: Final = (0.0, 1e5, 2e5, 4e5, 8e5)
_OPEN_TIMES_S: Final = (0.06, 0.02, 0.03)
"""Commands to the disc's first chambers one after the other, five rows apart at least."""
_VIBRATIONS_M: Final = (3e-6, 0.0), (3e-6, 2e-6), (-1e-6, 1e-6), (-1e-9, 0.0)
"""Vibrations that the controller sees, 60 rows each."""


def reference_files(block: Block, name: str) -> dict[str, bytes]:
    """Inputs, outputs and the manifest that names them, by path in the unit."""
    row = list(block.start)
    inputs: list[Mapping[str, float]] = []
    outputs: list[Mapping[str, float]] = []
    for stimulus in _stimuli(block):
        inputs.append(stimulus)
        outputs.append(block.run(row, block.period, stimulus))

    ET.register_namespace("fmi-ls", _MANIFEST)
    standard = {"name": "org.fmi-standard.fmi-ls-ref", "version": "1.0.0-alpha.1"}
    standard["description"] = "Inputs and outputs to compare a host with"
    heads = {f"{{{_MANIFEST}}}fmi-ls-{key}": text for key, text in standard.items()}
    root = ET.Element("fmiReferences", heads)
    for source, role in ((f"{name}_in.csv", "stimulus"), (f"{name}_out.csv", "result")):
        ET.SubElement(root, "Related", type="text/csv", source=source, role=role)
    ET.indent(root)
    manifest: bytes = ET.tostring(root, encoding="UTF-8", xml_declaration=True)
    return {
        f"{_FOLDER}/{name}_in.csv": _csv(inputs, 0, block),
        f"{_FOLDER}/{name}_out.csv": _csv(outputs, 1, block),
        f"{_FOLDER}/fmi-ls-manifest.xml": manifest,
    }


def _csv(rows: list[Mapping[str, float]], later: int, block: Block) -> bytes:
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
