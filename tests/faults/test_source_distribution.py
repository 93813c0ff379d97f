"""The source distribution holds what git holds and its tests run from it; built twice, nothing differs."""

from __future__ import annotations

import shutil
import subprocess
import sys
import tarfile
import zipfile
from pathlib import Path

import pytest
from make_dist import build

pytestmark = pytest.mark.faults

ROOT = Path(__file__).resolve().parents[2]
ADDED = {"PKG-INFO", "setup.cfg"}
"""What setuptools writes itself, beside the egg-info folder."""


@pytest.fixture(scope="module")
def files(tracked_files: tuple[Path, ...]) -> list[Path]:
    """Files that git tracks or would track, relative to the root; links to folders are left out."""
    return [path.relative_to(ROOT) for path in tracked_files]


@pytest.fixture(scope="module")
def archives(files: list[Path], tmp_path_factory: pytest.TempPathFactory) -> list[list[Path]]:
    """Distributions of two copies of the checkout, which no earlier build has touched.

    The first has no links; in the second they are small files, as git writes them on Windows.
    """
    made = []
    for name in ("first", "second"):
        folder = tmp_path_factory.mktemp(name)
        for path in files:
            (folder / path).parent.mkdir(parents=True, exist_ok=True)
            shutil.copy(ROOT / path, folder / path)
        if name == "second":
            for link in (path for path in (ROOT / "ringbalance").iterdir() if path.is_symlink()):
                (folder / "ringbalance" / link.name).write_text(str(link.readlink()))
        made.append(build(folder, target=tmp_path_factory.mktemp("built"), epoch=1_700_000_000))
    return made


@pytest.fixture(scope="module")
def unpacked(archives: list[list[Path]], tmp_path_factory: pytest.TempPathFactory) -> Path:
    archive, folder = archives[0][0], tmp_path_factory.mktemp("unpacked")
    with tarfile.open(archive) as tar:
        tar.extractall(folder, filter="data")
    return folder / archive.name.removesuffix(".tar.gz")


def test_built_twice_they_are_the_same(archives: list[list[Path]]) -> None:
    for first, second in zip(*archives, strict=True):
        assert first.name == second.name
        assert first.read_bytes() == second.read_bytes()


def test_it_holds_what_git_holds(files: list[Path], unpacked: Path) -> None:
    held = {path.relative_to(unpacked) for path in unpacked.rglob("*") if path.is_file()}
    own = {path for path in held if path.parts[0] in ADDED or path.parts[0].endswith(".egg-info")}
    assert sorted(held - own) == files


def test_a_wheel_from_a_clone_without_links_runs(archives: list[list[Path]], tmp_path: Path) -> None:
    with zipfile.ZipFile(archives[1][1]) as wheel:
        wheel.extractall(tmp_path)
    code = f"""
import sys
sys.path.insert(0, {str(tmp_path)!r})
import ringbalance
from ringbalance.cli import main
assert ringbalance.__file__.startswith({str(tmp_path)!r}), ringbalance.__file__
sys.exit(main(["calibrate", str(ringbalance.bundled_scene("six_chamber")), "--brief", "--quiet"]))
"""
    command = [sys.executable, "-P", "-c", code]
    result = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, check=False)
    assert (result.returncode, result.stderr) == (0, "")
    assert "lambda per transferred mass" in result.stdout


def test_its_tests_run(unpacked: Path) -> None:
    tests = ("test_packaging.py", "test_rooms.py")
    command = [sys.executable, "-m", "pytest", "-q", *(f"tests/architecture/{name}" for name in tests)]
    result = subprocess.run(command, cwd=unpacked, capture_output=True, text=True, check=False)
    assert result.returncode == 0, result.stdout
