"""Files damaged at random: either a scene or its errors come out, never anything else."""

from __future__ import annotations

import base64
import struct
import sys
import tracemalloc
import zlib
from collections.abc import Callable
from pathlib import Path

import meshio
import numpy as np
import pytest
from drawn_chamber import drawn, inp, loaded, msh_2, msh_4, scene_text, vtu

from ringbalance.scene import Scene, SceneError, load_scene
from ringbalance.scene.platform import memory


def _binary(folder: Path, version: str) -> bytes:
    (folder / "own.msh").write_bytes(msh_4(drawn()) if version == "gmsh" else msh_2(drawn()))
    meshio.write(folder / "binary.msh", meshio.read(folder / "own.msh"), file_format=version, binary=True)
    return (folder / "binary.msh").read_bytes()


FILES: dict[str, tuple[str, Callable[[Path], bytes]]] = {
    "text 2.2": ("chamber.msh", lambda _: msh_2(drawn())),
    "text 4.1": ("chamber.msh", lambda _: msh_4(drawn("tetra10"))),
    "binary 2.2": ("chamber.msh", lambda folder: _binary(folder, "gmsh22")),
    "binary 4.1": ("chamber.msh", lambda folder: _binary(folder, "gmsh")),
    "abaqus": ("chamber.inp", lambda _: inp(drawn("hexahedron20"))),
    "vtu text": ("chamber.vtu", lambda folder: vtu(drawn(), folder, binary=False)),
    "vtu binary": ("chamber.vtu", lambda folder: vtu(drawn(), folder, binary=True)),
}


def damaged(content: bytes, chance: np.random.Generator) -> bytes:
    """Some bytes replaced, left out, repeated, or the end cut off."""
    spoilt = bytearray(content)
    for _ in range(int(chance.integers(1, 6))):
        at, length = int(chance.integers(len(spoilt))), int(chance.integers(1, 40))
        way = chance.integers(5)
        if way == 0:
            spoilt[at] = int(chance.integers(256))
        elif way == 1:
            del spoilt[at : at + length]
        elif way == 2:
            spoilt[at:at] = spoilt[at : at + length]
        elif way == 3:
            spoilt[at : at + 1] = bytes([int(chance.choice(list(b'0123456789-. \n$<>*,eE"')))])
        else:
            del spoilt[max(at, len(spoilt) // 4) :]
    return bytes(spoilt)


@pytest.mark.parametrize("name", FILES)
def test_damage_is_an_error_of_the_scene(name: str, tmp_path: Path) -> None:
    file, write = FILES[name]
    content = write(tmp_path)
    assert isinstance(loaded(tmp_path, content, file), Scene)
    chance = np.random.default_rng(5)
    refused = 0
    for _ in range(60):
        try:
            loaded(tmp_path, damaged(content, chance), file)
        except SceneError as error:
            refused += "mesh" in str(error)
    assert refused > 20


@pytest.mark.skipif(sys.platform != "linux", reason="memory is bounded on Linux alone")
def test_a_damaged_count_does_not_take_all_memory(tmp_path: Path) -> None:
    file, write = FILES["binary 4.1"]
    content = bytearray(write(tmp_path))
    at = content.index(b"$Elements\n") + len(b"$Elements\n")
    content[at : at + 8] = struct.pack("<Q", 2**31)
    with pytest.raises(SceneError, match=r"it is damaged or cut off \(MemoryError"):
        loaded(tmp_path, bytes(content), file)


@pytest.mark.skipif(sys.platform != "linux", reason="memory is bounded on Linux alone")
def test_a_sound_mesh_is_read_where_the_system_does_not_tell_its_memory(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A Linux without /proc."""
    monkeypatch.setattr(memory, "_STATM", tmp_path / "statm")
    assert isinstance(loaded(tmp_path, msh_4(drawn())), Scene)


@pytest.mark.skipif(sys.platform != "linux", reason="memory is bounded on Linux alone")
def test_what_fails_beside_the_reader_is_no_damage(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "statm").write_text("nothing\n", encoding="ascii")
    monkeypatch.setattr(memory, "_STATM", tmp_path / "statm")
    with pytest.raises(ValueError, match="nothing"):
        loaded(tmp_path, msh_4(drawn()))


def test_a_pipe_a_folder_and_no_file(tmp_path: Path) -> None:
    (tmp_path / "chamber.msh").mkdir()
    with pytest.raises(SceneError, match="a folder or a device"):
        loaded_again(tmp_path, "chamber.msh")
    with pytest.raises(SceneError, match="there is no such file"):
        loaded_again(tmp_path, "chambers.msh")


def loaded_again(folder: Path, name: str) -> object:
    (folder / "my_disc.toml").write_text(scene_text(name, mesh_unit="mm"), encoding="utf-8")
    return load_scene(folder / "my_disc.toml")


def _packed(kind: str, block: bytes, count: int) -> str:
    """An array of equal blocks as compressed text, which grows a thousand times."""
    packed = zlib.compress(block, 9)
    head = np.array([count, len(block), 0, *[len(packed)] * count], dtype="<u4").tobytes()
    text = (base64.b64encode(head) + base64.b64encode(packed * count)).decode()
    return f'type="{kind}" format="binary">{text}</DataArray>'


def test_a_small_file_that_would_unpack_to_gigabytes_is_refused_before_it_does(tmp_path: Path) -> None:
    """256 MiB of numbers of one byte each, which take eight when they are read; a file may have 256 MiB."""
    huge = _packed("Int8", bytes(2**20), 256)
    cells = "".join(f'<DataArray Name="{name}" {huge}' for name in ("connectivity", "offsets", "types"))
    content = (
        '<VTKFile type="UnstructuredGrid" compressor="vtkZLibDataCompressor"><UnstructuredGrid><Piece>'
        f"<Points><DataArray {huge}</Points><Cells>{cells}</Cells></Piece></UnstructuredGrid></VTKFile>"
    ).encode()
    assert len(content) < 2**21
    tracemalloc.start()
    try:
        with pytest.raises(SceneError, match="mesh"):
            loaded(tmp_path, content, "chamber.vtu")
        assert tracemalloc.get_traced_memory()[1] < 2**29
    finally:
        tracemalloc.stop()
