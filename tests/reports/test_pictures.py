"""The 3-D pictures are drawn, are not blank, and are told about when they cannot be drawn."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image

from ringbalance.reports.pictures.draw import PICTURE, THEMES
from ringbalance.reports.pictures.opengl import OpenGL, find_opengl
from ringbalance.reports.pictures.process import _start_drawing, _write_fields
from ringbalance.running import run_command
from ringbalance.scene import Scene, bundled_scene
from scenes import with_tables

NO_OPENGL = OpenGL(available=False, window="", text="The 3-D pictures were left out: no OpenGL here.")
OPENGL = find_opengl()
needs_opengl = pytest.mark.skipif(not OPENGL.available, reason=OPENGL.text)


@pytest.fixture(scope="module")
def plotted(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The pictures of the six-chamber disc, through the command."""
    out = tmp_path_factory.mktemp("plot") / "out"
    assert run_command("plot", scene=bundled_scene("six_chamber"), out=out) == 0
    return out


def pixels(path: Path) -> Any:
    return np.asarray(Image.open(path).convert("RGB"), dtype=np.int64)


@needs_opengl
def test_files_are_there_and_of_moderate_size(plotted: Path) -> None:
    names = {path.relative_to(plotted).as_posix() for path in plotted.rglob("*") if path.is_file()}
    assert names == {
        *(f"figures/{name}-{theme.name}.png" for name in ("disc", "pressure") for theme in THEMES),
        "fields/chamber_at_start.vtu",
        "fields/chamber_largest_fill.vtu",
    }
    assert all(path.stat().st_size < 150_000 for path in plotted.rglob("*.png"))


@needs_opengl
@pytest.mark.parametrize("theme", THEMES, ids=lambda theme: theme.name)
@pytest.mark.parametrize("name", ["disc", "pressure"])
def test_a_picture_shows_something_on_the_ground_of_its_page(plotted: Path, name: str, theme: Any) -> None:
    image = pixels(plotted / "figures" / f"{name}-{theme.name}.png")
    assert image.shape == (PICTURE[1], PICTURE[0], 3)
    ground = np.array([int(theme.ground[i : i + 2], 16) for i in (1, 3, 5)])
    assert (image[:20, :20] == ground).all()
    share = (np.abs(image - ground).sum(axis=2) > 12).mean()
    assert 0.15 < share < 0.8
    assert len(np.unique(image @ [65536, 256, 1])) > 100


@needs_opengl
def test_the_colour_bar_runs_from_end_to_end(plotted: Path) -> None:
    image = pixels(plotted / "figures" / "pressure-light.png")
    # Pale blue below, dark blue on top, as in the picture of the disc.
    bottom, top = image[round(0.82 * PICTURE[1]) - 6, 60], image[round(0.24 * PICTURE[1]) + 6, 60]
    assert bottom == pytest.approx([186, 214, 235], abs=8)
    assert top == pytest.approx([8, 48, 107], abs=8)


@needs_opengl
def test_a_drawing_that_fails_is_reported(tmp_path: Path, paper_scene: Scene) -> None:
    missing = {"pressure": tmp_path / "none.vtu", "disc": tmp_path / "none.vtu"}
    record = _start_drawing(scene=paper_scene, fields=missing, folder=tmp_path).finish()
    assert record["drawn"] is False
    assert record["files"] == []
    assert "ended with code 1" in record["text"]
    assert "none.vtu" in record["text"]


def test_without_opengl_nothing_is_started(tmp_path: Path, paper_scene: Scene) -> None:
    drawing = _start_drawing(scene=paper_scene, fields={}, folder=tmp_path, opengl=NO_OPENGL)
    assert drawing.process is None
    assert drawing.finish() == {"drawn": False, "text": NO_OPENGL.text, "files": []}
    drawing.stop()


def test_plot_without_opengl_writes_the_fields(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr("ringbalance.reports.pictures.process.find_opengl", lambda: NO_OPENGL)
    assert run_command("plot", scene=bundled_scene("liquid_ring_paper"), out=tmp_path / "out") == 1
    assert "no OpenGL here" in capsys.readouterr().err.replace("\n", " ")
    assert len(list((tmp_path / "out" / "fields").glob("*.vtu"))) == 2
    assert [path.name for path in tmp_path.iterdir()] == ["out"]


def test_fields_are_written_at_two_fills(tmp_path: Path, paper_scene: Scene) -> None:
    empty = with_tables(paper_scene, disc={"initial_fill": 0.0})
    assert set(_write_fields(scene=empty, folder=tmp_path)) == {"pressure", "disc"}
