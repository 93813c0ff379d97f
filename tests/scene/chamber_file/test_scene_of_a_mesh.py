"""What a scene makes of a mesh: its keys, its uncertainties, its description, and where its file lies."""

from __future__ import annotations

import subprocess
import sys
from importlib.util import find_spec
from pathlib import Path

import numpy as np
import pytest
from drawn_chamber import drawn, loaded, msh_2, msh_4, scene_text

from ringbalance.scene import AnyScene, Scene, SceneError, bundled_scene, load_scene, scene_table
from ringbalance.scene.chamber_file.record import MEANINGS
from ringbalance.scene.uncertain import with_value


def scene_of(folder: Path, kind: str = "tetra10", **disc: str | int) -> Scene:
    scene = loaded(folder, msh_2(drawn(kind)), "chamber.msh", **disc)
    assert isinstance(scene, Scene)
    return scene


def edited(folder: Path, old: str, new: str, *, mesh_unit: str = "mm") -> AnyScene:
    """The scene of a folder's chamber.msh with one text in it replaced."""
    text = scene_text("chamber.msh", mesh_unit=mesh_unit).replace(old, new, 1)
    (folder / "my_disc.toml").write_text(text, encoding="utf-8")
    return load_scene(folder / "my_disc.toml")


def extents(scene: Scene) -> dict[str, float]:
    """Dimensions that the mesh of a scene has."""
    assert scene.disc.geometry is not None
    x, y, z = scene.disc.geometry.points.T
    return {
        "outer_radius": float(np.hypot(x, y).max()),
        "inner_radius": float(np.hypot(x, y).min()),
        "axial_width": float(np.ptp(z)),
        "central_angle": float(np.ptp(np.arctan2(y, x))),
    }


@pytest.mark.parametrize("quantity", ["outer_radius", "inner_radius", "axial_width", "central_angle"])
def test_a_changed_dimension_stretches_the_mesh(quantity: str, tmp_path: Path) -> None:
    scene = scene_of(tmp_path)
    value = 1.01 * getattr(scene.disc, quantity)
    changed = with_value(scene=scene, quantity=quantity, value=value)
    expected = extents(scene) | {quantity: value}
    assert extents(changed) == pytest.approx(expected, rel=2e-4)
    assert extents(changed)[quantity] == pytest.approx(value, rel=1e-5 if "inner" not in quantity else 2e-4)
    assert getattr(changed.disc, quantity) == value
    assert changed.disc.geometry != scene.disc.geometry
    again = with_value(scene=scene, quantity=quantity, value=value)
    assert again.disc.geometry == changed.disc.geometry


def test_the_liquid_must_not_cover_a_gas_inlet(tmp_path: Path) -> None:
    """At half a chamber the surface lies at 31.6 mm."""
    scene_of(tmp_path)
    assert isinstance(edited(tmp_path, "[gas]", '[gas]\ninlet_radius = "24 mm"'), Scene)
    with pytest.raises(SceneError, match="the liquid covers inlet_radius, 39 mm"):
        edited(tmp_path, "[gas]", '[gas]\ninlet_radius = "39 mm"')


def test_plates_of_a_mesh_have_no_thickness(tmp_path: Path) -> None:
    scene = scene_of(tmp_path)
    with pytest.raises(ValueError, match="no plate_thickness of its own"):
        with_value(scene=scene, quantity="plate_thickness", value=1e-3)
    with pytest.raises(SceneError, match=r"\[uncertainty\] plate_thickness .* no thickness of its own"):
        edited(tmp_path, "[run]", '[uncertainty]\nplate_thickness = "0.1 mm"\n[run]')


def test_uncertain_dimensions_are_stated_as_ever(tmp_path: Path) -> None:
    scene_of(tmp_path)
    scene = edited(tmp_path, "[run]", '[uncertainty]\nouter_radius = "0.1 mm"\n[run]')
    rows = {row["path"]: row for row in scene_table(scene)} if isinstance(scene, Scene) else {}
    assert rows["disc.outer_radius"]["uncertainty"] == "0.1 mm"
    assert rows["disc.outer_radius"]["origin"] == "derived"
    assert rows["disc.geometry"]["value"] == (
        "chamber.msh: 72 tetra10 cells, outer_wall, inner_wall, plate_left, plate_right, end_back, end_front"
    )


@pytest.mark.parametrize("key", ["outer_radius", "plate_thickness", "central_angle"])
def test_a_dimension_beside_a_mesh_is_refused(key: str, tmp_path: Path) -> None:
    value = "80 deg" if key == "central_angle" else "1 mm"
    with pytest.raises(SceneError, match=rf'\[disc\] {key} = "{value}": it follows from the mesh') as caught:
        scene_of(tmp_path, **{key: value})
    assert len(caught.value.faults) == 1


def test_a_dimension_hides_no_error_of_the_mesh(tmp_path: Path) -> None:
    drawing = drawn()
    drawing.names[2, 2] = "outside\x07wall"
    with pytest.raises(SceneError) as caught:
        loaded(tmp_path, msh_2(drawing), outer_radius="40 mm")
    assert [fault.key for fault in caught.value.faults] == ["outer_radius", "mesh"]
    assert str(caught.value).replace("\n", "").isprintable()


def test_keys_of_a_mesh_need_one(tmp_path: Path) -> None:
    text = bundled_scene("six_chamber").read_text(encoding="utf-8")
    (tmp_path / "my_disc.toml").write_text(
        text.replace("[disc]\n", '[disc]\nmesh_unit = "mm"\nmesh_axis = "y"\n'), encoding="utf-8"
    )
    with pytest.raises(SceneError) as caught:
        load_scene(tmp_path / "my_disc.toml")
    assert [fault.key for fault in caught.value.faults] == ["mesh_unit", "mesh_axis"]
    assert all("no meaning without mesh" in fault.problem for fault in caught.value.faults)


def test_the_number_of_chambers_is_given_or_follows(tmp_path: Path) -> None:
    drawing = drawn()
    assert scene_of(tmp_path).disc.chambers == 4
    with pytest.raises(SceneError, match="chambers is needed: the mesh takes 80 deg"):
        edited(tmp_path, "chambers = 4", "")
    for number, (x, y, z) in drawing.points.items():
        angle = np.arctan2(y, x) * 90 / 80
        radius = np.hypot(x, y)
        drawing.points[number] = (float(radius * np.cos(angle)), float(radius * np.sin(angle)), z)
    (tmp_path / "chamber.msh").write_bytes(msh_4(drawing))
    scene = load_scene(tmp_path / "my_disc.toml")
    assert isinstance(scene, Scene)
    assert scene.disc.chambers == 4


def test_a_named_port(tmp_path: Path) -> None:
    """It gives the tube's port its radius, and a radius given beside it lies on it."""
    drawing = drawn()
    drawing.names[2, 40] = "port"
    for number in drawing.facets("outer_wall")[:2]:
        drawing.elements[number].group = 40
    ported = loaded(tmp_path, msh_2(drawing))
    assert isinstance(ported, Scene)
    assert ported.tube.port_radius == pytest.approx(0.0385, rel=0.02)
    assert ported.origin_of("tube.port_radius") == "derived"
    with pytest.raises(SceneError, match='port_radius is 30 mm, but the boundary "port" lies from'):
        edited(tmp_path, "[tube]\n", '[tube]\nport_radius = "30 mm"\n')


@pytest.mark.parametrize(
    ("drawing", "declared", "lengths", "reason"),
    [
        (1.0, "in", "", 'length = "120 mm": the tube cannot reach'),
        (1.0, "cm", 'port_radius = "40 mm"', 'port_radius = "40 mm": the port lies outside'),
        (1 / 25.4, "mm", 'hump_radius = "25 mm"', 'hump_radius = "25 mm": the siphon crest lies outside'),
        (1 / 25.4, "mm", "", 'bore = "1.5 mm": no wall of the chamber is large enough'),
    ],
)
def test_another_unit_is_named(
    tmp_path: Path, drawing: float, declared: str, lengths: str, reason: str
) -> None:
    """A disc drawn in mm, or in inches, whose scene says another unit: by what, and which one would fit."""
    mesh = drawn()
    mesh.points = {n: (drawing * x, drawing * y, drawing * z) for n, (x, y, z) in mesh.points.items()}
    (tmp_path / "chamber.msh").write_bytes(msh_4(mesh))
    with pytest.raises(SceneError) as caught:
        edited(tmp_path, "[tube]\n", f"[tube]\n{lengths}\n", mesh_unit=declared)
    message = str(caught.value)
    assert message.count("\n") == 0
    assert f'in "{declared}" the chamber reaches' in message
    assert f"wrong scale; [tube] {reason}" in message
    assert f'mesh_unit = "{"mm" if drawing == 1.0 else "in"}"' in message.partition("; allowed: ")[2]


def test_a_length_that_fits_no_unit_is_its_own_error(tmp_path: Path) -> None:
    (tmp_path / "chamber.msh").write_bytes(msh_4(drawn()))
    with pytest.raises(SceneError, match="the tube cannot reach the opposite port") as caught:
        edited(tmp_path, 'length = "120 mm"', 'length = "50 mm"')
    assert "scale" not in str(caught.value)


@pytest.mark.skipif(find_spec("gmsh") is not None, reason="the extra cad is installed")
def test_a_solid_needs_the_extra(tmp_path: Path) -> None:
    with pytest.raises(SceneError, match=r'needs the extra cad.*pip install "ringbalance\[cad\]"'):
        loaded(tmp_path, b"ISO-10303-21;\n", "chamber.step", mesh_unit="")


def test_a_solid_has_its_own_unit(tmp_path: Path) -> None:
    with pytest.raises(SceneError, match='mesh_unit = "mm": a STEP file has its own unit'):
        loaded(tmp_path, b"ISO-10303-21;\n", "chamber.step")


def test_the_page_has_the_names() -> None:
    page = (Path(__file__).resolve().parents[3] / "docs" / "imported-geometry.md").read_text(encoding="utf-8")
    rows = [f"| `{name}` | {meaning} |" for name, meaning in MEANINGS.items()]
    assert "\n".join(rows) in page


@pytest.mark.skipif(find_spec("gmsh") is None, reason="the extra cad is not installed")
def test_a_solid_is_meshed(tmp_path: Path) -> None:
    """Drawn by Gmsh in another process, as its settings are those of a whole process."""
    code = (
        "import gmsh, math; gmsh.initialize(); gmsh.option.setNumber('General.Terminal', 0)\n"
        "occ, angle = gmsh.model.occ, math.radians(80)\n"
        "both = [occ.addCylinder(0, 0, 0, 0, 0, 30, radius, angle=angle) for radius in (40, 20)]\n"
        "occ.cut([(3, both[0])], [(3, both[1])]); occ.synchronize(); gmsh.write('chamber.step')"
    )
    subprocess.run([sys.executable, "-c", code], check=True, cwd=tmp_path, capture_output=True)
    content = (tmp_path / "chamber.step").read_bytes()
    scene = loaded(tmp_path, content, "chamber.step", mesh_unit="")
    assert isinstance(scene, Scene)
    assert scene.disc.geometry is not None
    assert set(scene.disc.geometry.boundaries) == {
        "outer_wall",
        "inner_wall",
        "end_back",
        "end_front",
        "walls",
    }
    assert scene.disc.outer_radius == pytest.approx(0.04)
    assert scene.disc.inner_radius == pytest.approx(0.02, rel=1e-3)
    assert np.degrees(scene.disc.central_angle) == pytest.approx(80)
    with pytest.raises(SceneError, match="Gmsh cannot mesh the solid"):
        loaded(tmp_path, content[: len(content) // 3], "chamber.step", mesh_unit="")


@pytest.mark.parametrize("name", ["a\u3000b", "a\u00a0b", "\u00e4 b", "a\nb"])
def test_a_mesh_is_found_in_a_folder_of_any_name(name: str, tmp_path: Path) -> None:
    folder = tmp_path / name
    folder.mkdir()
    assert scene_of(folder).disc.geometry is not None
