"""The compact law as a functional mock-up unit (FMI 2.0, co-simulation): one file with the source inside.

A host that has a compiler builds it from `sources/`; where this machine has one, the unit also runs as it is
on machines like this one.  Two exports of one law are equal to the byte but for what the compiler makes.
"""

from __future__ import annotations

import hashlib
import shutil
import subprocess
import sys
import tempfile
from io import BytesIO
from pathlib import Path
from typing import Final
from zipfile import ZIP_DEFLATED, ZipFile, ZipInfo

from ringbalance.export.compact import CompactLaw
from ringbalance.export.hosts import c_files, filled
from ringbalance.export.translate import number_text
from ringbalance.results.result import csv_text

_OPTIONS: Final = ("-std=c99", "-O2", "-ffp-contract=off", "-fvisibility=hidden", "-fPIC", "-shared")
_PLATFORMS: Final = {"linux": ("linux64", ".so"), "darwin": ("darwin64", ".dylib")}
_DATE: Final = (1980, 1, 1, 0, 0, 0)
"""Of every file inside, so that two exports are equal."""
_OUTPUTS: Final = range(5, 12)
"""Places of the outputs among the variables of the model description, from 1 on."""
_PRESSURES: Final = (0.0, 1e5, 2e5, 4e5, 8e5)
"""Pa, of the reference results."""


def fmu_bytes(law: CompactLaw, name: str) -> tuple[bytes, bool]:
    """The unit, and whether it has a library for machines like this one.

    It holds the model description, the sources, reference results, and the library where a compiler is.
    """
    guid = guid_of(law)
    words = {
        "flow": f"{name}_flow",
        "answer": f"{name}_answer",
        "guid": guid,
        "start_fill": number_text(law.max_fill_ratio / 2),
        "outputs": "\n".join(f'      <Unknown index="{place}"/>' for place in _OUTPUTS),
    }
    sources = {**c_files(law, name), "fmi2.c": filled("fmi2", law, name, **words)}
    parts = {
        "modelDescription.xml": filled("fmi2_model", law, name, **words).encode(),
        **{f"sources/{file}": text.encode() for file, text in sources.items()},
        "documentation/reference.csv": _reference(law).encode(),
    }
    library = _library(sources, name)
    return _zipped({**parts, **library}), bool(library)


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


def _library(sources: dict[str, str], name: str) -> dict[str, bytes]:
    """By place in the unit; nothing where no compiler is, or it fails."""
    compiler = next((path for each in ("cc", "gcc", "clang") if (path := shutil.which(each))), None)
    if compiler is None or sys.platform not in _PLATFORMS or sys.maxsize < 2**32:
        return {}
    folder, suffix = _PLATFORMS[sys.platform]
    with tempfile.TemporaryDirectory() as made:
        for file, text in sources.items():
            Path(made, file).write_text(text, encoding="utf-8")
        files = [file for file in sources if file.endswith(".c")]
        command = [compiler, *_OPTIONS, *files, "-lm", "-o", f"{name}{suffix}"]
        if subprocess.run(command, cwd=made, capture_output=True, check=False).returncode:
            return {}
        return {f"binaries/{folder}/{name}{suffix}": Path(made, f"{name}{suffix}").read_bytes()}


def _zipped(parts: dict[str, bytes]) -> bytes:
    stream = BytesIO()
    with ZipFile(stream, "w", ZIP_DEFLATED, compresslevel=9) as archive:
        for file, content in sorted(parts.items()):
            entry = ZipInfo(file, _DATE)
            entry.compress_type = ZIP_DEFLATED
            entry.external_attr = 0o644 << 16
            archive.writestr(entry, content)
    return stream.getvalue()
