"""The unit for co-simulation: its parts agree, and hosts that share no code with it run it."""

from __future__ import annotations

import csv
import re
import shutil
import subprocess
import sys
import xml.etree.ElementTree as ET
from io import BytesIO
from pathlib import Path
from zipfile import ZipFile

import numpy as np
import pytest
from imported_unit import ImportedUnit
from law_queries import answers, queries

from ringbalance.export.blocks import Block, law_block
from ringbalance.export.compact import CompactLaw
from ringbalance.export.fmu import fmu_bytes, guid_of
from ringbalance.export.libraries import Version
from ringbalance.reduced_model.law.calibrated_law import CalibratedLaw
from ringbalance.scene.arrays import FloatArray

Both = tuple[CalibratedLaw, CompactLaw]
HERE = Path(__file__).parent
MOST = 60_000
MOST_LAW_BASED = 80_000
"""Law, disc and controller in one, for six systems: a third more than one of them."""
KINDS = ("law", "disc", "controller", "law_based")
SANITIZERS = ("-fsanitize=address,undefined,float-cast-overflow", "-fno-sanitize-recover=all")
WARNINGS = ("-std=c99", "-Wall", "-Wextra", "-Wconversion", "-Wdouble-promotion", "-Wshadow", "-Werror")
STARTS = {
    "law": {"fill_ratio": 0.3, "opposite_fill_ratio": 0.2, "gas_pressure": 4e5, "primed": 1.0},
    "disc": {"open_time_a": 0.03, "open_time_b": 0.05},
    "controller": {"vibration_x": 3e-6, "vibration_y": -2e-6},
}
needs_compiler = pytest.mark.skipif(shutil.which("gcc") is None, reason="no C compiler")


@pytest.fixture(scope="module", params=["fmi2", "fmi3"])
def version(request: pytest.FixtureRequest) -> Version:
    chosen: Version = request.param
    return chosen


@pytest.fixture(scope="module")
def content(six: Both, version: Version) -> bytes:
    return fmu_bytes(law_block(six[1]), "disc", version)[0]


@pytest.fixture(scope="module")
def unit(content: bytes) -> ZipFile:
    return ZipFile(BytesIO(content))


def test_two_exports_of_a_law_are_equal_and_small(content: bytes, six: Both, version: Version) -> None:
    assert fmu_bytes(law_block(six[1]), "disc", version)[0] == content
    assert len(content) <= MOST


def test_every_variable_has_what_a_host_shows(unit: ZipFile, six: Both, version: Version) -> None:
    model = ET.fromstring(unit.read("modelDescription.xml"))
    units = {each.get("name") for each in model.iter("Unit")}
    variables = list(model.iter("ScalarVariable")) or list(model.iterfind("ModelVariables/*"))
    causes = {}
    for each in variables:
        kind = each[0] if len(each) else each
        causes[each.get("valueReference", "")] = each.get("causality")
        assert each.get("description")
        assert (each.get("causality") == "input") == (kind.get("start") is not None)
        if kind.tag in ("Real", "Float64") and each.get("causality") != "independent":
            assert kind.get("unit") in units
            assert float(kind.get("min", "")) < float(kind.get("nominal", "")) <= float(kind.get("max", ""))
    outputs = {place for place, cause in causes.items() if cause == "output"}
    if version == "fmi2":
        told = {str(int(each.get("index", "0")) - 1) for each in model.iter("Unknown")}
    else:
        told = {each.get("valueReference", "") for each in model.iter("Output")}
    assert told == outputs
    assert guid_of(law_block(six[1])) in (model.get("guid"), model.get("instantiationToken"))
    described = model if version == "fmi2" else ET.fromstring(unit.read("sources/buildDescription.xml"))
    sources = [each.get("name") for tag in ("File", "SourceFile") for each in described.iter(tag)]
    assert [f"sources/{name}" in unit.namelist() for name in sources] == [True, True]


@needs_compiler
def test_an_importer_in_c_has_the_bits_of_python(
    tmp_path: Path, unit: ZipFile, six: Both, version: Version
) -> None:
    """Under sanitizers; with wrong references, NaN, reset, two instances and states freed in any order."""
    law, compact = six
    unit.extractall(tmp_path)
    sources = [str(path) for path in sorted((tmp_path / "sources").glob("*.c"))]
    command = ["gcc", *WARNINGS, *SANITIZERS, *sources, str(HERE / f"{version}_host.c"), "-o", "host", "-lm"]
    subprocess.run(command, cwd=tmp_path, check=True)
    asked = queries(law, 4000, outside=True)
    asked = asked[:, np.isfinite(asked).all(axis=0)]
    result = ran(tmp_path / "host", compact, asked)
    right = np.array(list(answers(compact, asked)))
    assert result[:, 0].tobytes() == np.ascontiguousarray(right[:, 0]).tobytes()
    assert np.array_equal(result[:, 1:], right[:, 1:])


def ran(host: Path, law: CompactLaw, asked: FloatArray) -> FloatArray:
    lines = "".join(f"{x!r},{y!r},{p!r},{int(on)}\n" for x, y, p, on in asked.T.tolist())
    done = subprocess.run(
        [host, guid_of(law_block(law))], input=lines, capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stdout[-500:] + done.stderr[-2000:]
    return np.array([[float(cell) for cell in line.split(",")] for line in done.stdout.splitlines()])


@needs_compiler
@pytest.mark.parametrize("kind", KINDS)
def test_an_importer_in_python_has_the_reference_results(
    tmp_path: Path, blocks: dict[str, Block], version: Version, kind: str
) -> None:
    """By `ctypes`, from what the unit itself says of its variables."""
    content, runs = fmu_bytes(blocks[kind], "disc", version)
    assert runs
    assert len(content) <= MOST
    unit = ZipFile(BytesIO(content))
    unit.extractall(tmp_path)
    folder = tmp_path / "extra" / "org.fmi-standard.fmi-ls-ref"
    manifest = ET.parse(folder / "fmi-ls-manifest.xml").getroot()
    inputs, right = (_table(folder / each.get("source", "")) for each in manifest)
    with ImportedUnit(tmp_path, version) as imported:
        for row, told in zip(inputs, right, strict=True):
            assert {"time": told["time"], **imported.step(row, 0.01)} == told
    assert len({tuple(told.values())[1:] for told in right}) > 3


def _table(file: Path) -> list[dict[str, float]]:
    with file.open() as lines:
        return [{name: float(cell) for name, cell in row.items()} for row in csv.DictReader(lines)]


@needs_compiler
@pytest.mark.parametrize("kind", KINDS)
def test_fmpy_finds_no_fault_and_simulates_it(
    tmp_path: Path, blocks: dict[str, Block], version: Version, kind: str
) -> None:
    """`make test-units` has it, and the next two."""
    fmpy = pytest.importorskip("fmpy")
    validation = pytest.importorskip("fmpy.validation")
    block, file = blocks[kind], tmp_path / "disc.fmu"
    file.write_bytes(fmu_bytes(block, "disc", version)[0])
    assert validation.validate_fmu(str(file)) == []
    values = dict.fromkeys((each.name for each in block.variables if each.input), 0.0)
    values |= STARTS["controller" if kind == "law_based" else kind]
    row, flags = list(block.start), {each.name for each in block.variables if each.kind == "Boolean"}
    start = {name: bool(value) if name in flags else value for name, value in values.items()}
    rows = fmpy.simulate_fmu(str(file), start_values=start, stop_time=0.1, output_interval=0.01)
    for seen in rows[1:]:
        right = block.run(row, 0.01, values)
        told = {name: float(seen[name]) for name in rows.dtype.names if name in right}
        # Steps of FMPy are differences of times.
        assert told == pytest.approx(right, rel=1e-12)


def test_fmutool_finds_no_fault(tmp_path: Path, blocks: dict[str, Block], version: Version) -> None:
    pytest.importorskip("fmu_manipulation_toolbox")
    for kind in KINDS:
        file = tmp_path / f"{kind}.fmu"
        file.write_bytes(fmu_bytes(blocks[kind], "disc", version)[0])
        command = [sys.executable, "-m", "fmu_manipulation_toolbox", "-input", str(file), "-check"]
        done = subprocess.run(command, capture_output=True, text=True, check=True)
        told = done.stdout + done.stderr
        assert f"compliant with FMI-{version[3]}.0" in told
        assert f"No semantic error against the FMI-{version[3]} standard" in told


@pytest.mark.parametrize("kind", KINDS)
def test_with_a_cross_compiler_it_has_libraries_for_all_systems(
    blocks: dict[str, Block], version: Version, kind: str
) -> None:
    """Where `ziglang` is installed: each begins as its system's libraries do."""
    pytest.importorskip("ziglang")
    content = fmu_bytes(blocks[kind], "disc", version, all_systems=True)[0]
    assert len(content) <= (MOST_LAW_BASED if kind == "law_based" else MOST)
    unit = ZipFile(BytesIO(content))
    heads = {name: unit.read(name)[:4] for name in unit.namelist() if name.startswith("binaries/")}
    begins = {".so": b"\x7fELF", ".dll": b"MZ", ".dylib": b"\xcf\xfa\xed\xfe"}
    assert len(heads) == (3 if version == "fmi2" else 6)
    assert all(head.startswith(begins[Path(name).suffix]) for name, head in heads.items())
    for name in heads:
        if name.endswith(".dll"):
            # No library but Windows' own.
            assert re.findall(rb"[\w.-]+\.dll", unit.read(name), re.IGNORECASE) == [
                b"disc.dll",
                b"KERNEL32.dll",
            ]
        assert unit.getinfo(name).compress_size < 12000
