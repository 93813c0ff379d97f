"""Files written for OpenFOAM and read from it; the stored comparison.  OpenFOAM itself is not needed."""

from __future__ import annotations

import importlib
import json
from dataclasses import replace
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest

FOLDER = Path(__file__).resolve().parents[2] / "benchmarks"


@pytest.fixture
def modules(monkeypatch: pytest.MonkeyPatch) -> dict[str, ModuleType]:
    """The benchmark's modules, by the last word of their names."""
    monkeypatch.syspath_prepend(str(FOLDER))
    names = ("case", "tubes", "waves", "jets", "page")
    return {name: importlib.import_module(f"openfoam_{name}") for name in names}


def numbers(path: Path) -> np.ndarray:
    """Rows of a list in OpenFOAM's format."""
    text = path.read_text(encoding="ascii")
    body = text[text.index("\n(\n") + 3 : text.rindex("\n)")]
    rows = [line.rpartition("(")[2].strip(")").split() for line in body.splitlines()]
    return np.array(rows, dtype=np.float64)


def test_a_written_mesh_is_closed_and_has_the_tubes_volume(
    modules: dict[str, ModuleType], tmp_path: Path
) -> None:
    stations = np.array([[x, 0.0, 1.0, 0.0] for x in (0.0, 0.5, 2.0)])
    ends = {"inlet": {"type": "patch"}, "outlet": {"type": "patch"}}
    mesh = modules["tubes"].swept_mesh(cells=(4, 6, 3.0), stations=stations, ends=ends)
    modules["case"].write_mesh(folder=tmp_path, mesh=mesh)
    parts = {name: numbers(tmp_path / "constant/polyMesh" / name) for name in ("points", "faces")}
    owner, neighbour = (
        numbers(tmp_path / "constant/polyMesh" / name)[:, 0].astype(int) for name in ("owner", "neighbour")
    )
    corner = parts["points"][parts["faces"].astype(int)]
    area = np.cross(corner[:, 2] - corner[:, 0], corner[:, 3] - corner[:, 1]) / 2
    total = np.zeros((len(mesh.cells), 3))
    np.add.at(total, owner, area)
    np.add.at(total, neighbour, -area[: len(neighbour)])
    assert np.abs(total).max() < 1e-14
    assert np.all(owner[: len(neighbour)] < neighbour)
    volume = np.sum(corner.mean(axis=1) * area, axis=1)
    # Outer faces only: the divergence theorem; straight sides lose 1.3 % of a circle by thirty-two.
    assert volume[len(neighbour) :].sum() / 3 == pytest.approx(np.pi / 8 * 2.0, rel=0.01)


def test_a_face_between_two_cells_is_no_boundary(modules: dict[str, ModuleType], tmp_path: Path) -> None:
    stations = np.array([[x, 0.0, 1.0, 0.0] for x in (0.0, 0.5, 2.0)])
    ends = {"inlet": {"type": "patch"}, "outlet": {"type": "patch"}}
    mesh = modules["tubes"].swept_mesh(cells=(2, 2, 3.0), stations=stations, ends=ends)
    quads = mesh.patches["inlet"][0] + mesh.points.shape[0] // 3
    mesh = replace(mesh, patches={**mesh.patches, "inlet": (quads, {"type": "patch"})})
    with pytest.raises(ValueError, match="between two cells"):
        modules["case"].write_mesh(folder=tmp_path, mesh=mesh)


def test_the_bath_below_a_jet_is_closed_and_its_level_lies_between_cells(
    modules: dict[str, ModuleType], tmp_path: Path
) -> None:
    jets = modules["jets"]
    bath = jets.Bath(pressure=0.5, distance=3.0, cells=3)
    x, z = bath.nodes()
    assert (x[-1], z[-1]) == pytest.approx((8.5, bath.depth + 3.0))
    # Half the slot has cells of its own, as wide as those about the level.
    assert x[3] == pytest.approx(0.5)
    level = int(np.searchsorted(z, bath.depth))
    assert np.diff(z)[level - 2 : level + 1] == pytest.approx(x[1], rel=0.2)
    mesh = jets._mesh(x, z)
    modules["case"].write_mesh(folder=tmp_path, mesh=mesh)
    corner = mesh.points[mesh.cells]
    edges = [corner[:, i] - corner[:, 0] for i in (1, 3, 4)]
    volumes = np.einsum("ij,ij->i", np.cross(edges[0], edges[1]), edges[2])
    assert volumes.min() > 0
    assert volumes.sum() == pytest.approx(8.5 * z[-1] * 0.1 * jets.WIDTH_M**3)


def test_free_frequencies_are_found_again(modules: dict[str, ModuleType]) -> None:
    time = np.arange(0, 10 * 2 * np.pi, 2 * np.pi / 150)
    values = 3 + np.cos(0.62 * time + 0.3) + 0.3 * np.cos(1.22 * time) * np.exp(-0.005 * time)
    result = modules["waves"].frequencies(time, values, after=0.4, count=2)
    assert result == pytest.approx([0.62, 1.22], rel=1e-3)


def test_the_quasi_static_swing_is_that_of_a_level_surface(modules: dict[str, ModuleType]) -> None:
    waves = modules["waves"]
    chamber = waves.Chamber(central_angle=1.3, surface_radius=0.8, cells=(1, 1))
    angle = np.linspace(-0.65, 0.65, 20001)
    step = float(angle[1] - angle[0])

    def swung(direction: float) -> complex:
        """Moment of the layer between a ring and the surface that gravity along a direction levels."""
        pull = 0.005 * 0.8 * np.cos(angle - direction)
        layer = (pull - pull.mean()) / 0.8 * 0.8**2 * np.exp(1j * angle)
        return complex(np.sum((layer[1:] + layer[:-1]) / 2) * step)

    moment, pressure = waves.quasi_static(chamber)
    assert moment == pytest.approx(np.hypot(abs(swung(0.0)), abs(swung(np.pi / 2))), rel=1e-4)
    assert pressure == pytest.approx(0.005 * np.cos(angle).mean() * 0.2, rel=1e-4)


def test_a_swing_is_told_from_mean_and_drift(modules: dict[str, ModuleType]) -> None:
    time = np.arange(0, 6 * 2 * np.pi, 0.05)
    result = modules["waves"].swing(time, 1 + 0.01 * time + 0.2 * np.cos(time - 0.4), turns=3)
    assert abs(result) == pytest.approx(0.2, rel=1e-6)


def test_the_page_shows_what_was_kept(modules: dict[str, ModuleType]) -> None:
    document = json.loads((FOLDER / "openfoam.json").read_text(encoding="utf-8"))
    shown = (FOLDER.parent / "docs/beside-openfoam.md").read_text(encoding="utf-8")
    assert shown == modules["page"].page(document)
    for row in (row for rows in document["rows"].values() for row in rows):
        both = np.hypot(row["openfoam_half_width"], row["ringbalance_half_width"])
        assert row["agrees"] == (abs(row["openfoam"] - row["ringbalance"]) <= both)


def test_a_machine_without_openfoam_is_told_what_to_install(
    modules: dict[str, ModuleType], monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setenv("PATH", str(tmp_path))
    assert "Debian's package openfoam" in modules["case"].missing()
    for program in modules["case"].PROGRAMS:
        (tmp_path / program).touch(mode=0o755)
    assert modules["case"].missing() == ""
