"""Outputs on mount points, and beside folders that are not one's own."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from ringbalance.scene import bundled_scene

pytestmark = pytest.mark.faults

PAPER = str(bundled_scene("liquid_ring_paper"))
LAUNCH = [sys.executable, "-c", "import sys; from ringbalance.cli import main; sys.exit(main())"]
# Drawing takes long, and these tests are about where files go.
NOBODY = ["setpriv", "--reuid", "65534", "--regid", "65534", "--clear-groups"]
WRITE = """
import sys
from pathlib import Path
from ringbalance.scene.platform.files import staged
with staged(Path(sys.argv[1]), files=("page",), folders=("figures",)) as stage:
    (stage / "figures").mkdir()
    (stage / "figures" / "one").write_text("1")
    (stage / "page").write_text("page")
"""
Mount = Callable[..., Path]


@pytest.fixture
def mount() -> Iterator[Mount]:
    """Mounts something on a folder; skips where that is not permitted."""
    mounted: list[Path] = []

    def do(folder: Path, *options: str) -> Path:
        folder.mkdir(parents=True, exist_ok=True)
        command = ["mount", *options, str(folder)]
        if shutil.which("mount") is None:
            pytest.skip("no mount here")
        done = subprocess.run(command, capture_output=True, text=True, check=False)
        if done.returncode != 0:
            pytest.skip(f"no mount is permitted here: {done.stderr.strip()}")
        mounted.append(folder)
        return folder

    yield do
    for folder in reversed(mounted):
        subprocess.run(["umount", "--lazy", str(folder)], check=True)


def write(out: Path, *before: str) -> subprocess.CompletedProcess[str]:
    command = [*before, sys.executable, "-c", WRITE, str(out)]
    return subprocess.run(command, capture_output=True, text=True, check=False, timeout=60)


def names(folder: Path) -> set[str]:
    return {path.relative_to(folder).as_posix() for path in folder.rglob("*") if path.is_file()}


@pytest.mark.parametrize("kind", ["tmpfs", "bind"])
def test_a_mount_point_is_written(kind: str, mount: Mount, tmp_path: Path) -> None:
    (tmp_path / "source").mkdir()
    options = ("-t", "tmpfs", "none") if kind == "tmpfs" else ("--bind", str(tmp_path / "source"))
    out = mount(tmp_path / "m", *options)
    done = write(out)
    assert done.returncode == 0, done.stderr
    assert names(out) == {"figures/one", "page"}
    assert {path.name for path in out.iterdir()} == {"figures", "page"}


def test_a_sub_folder_on_another_device_is_written(mount: Mount, tmp_path: Path) -> None:
    mount(tmp_path / "out" / "figures", "-t", "tmpfs", "none")
    done = write(tmp_path / "out")
    assert done.returncode == 0, done.stderr
    assert names(tmp_path / "out") == {"figures/one", "page"}


def test_a_read_only_output_is_refused_before_the_work(mount: Mount, tmp_path: Path) -> None:
    out = mount(tmp_path / "m", "-t", "tmpfs", "-o", "ro", "none")
    for words in (["plot", PAPER, "--out", str(out)], ["calibrate", PAPER, "--save", str(out / "law.json")]):
        done = subprocess.run([*LAUNCH, *words], capture_output=True, text=True, check=False, timeout=120)
        assert done.returncode == 2
        assert done.stdout == ""
        assert done.stderr.startswith(f"ringbalance: {out}")
        assert "Read-only file system" in done.stderr
        assert "pressure fields" not in done.stderr


@pytest.fixture
def open_folder() -> Iterator[Path]:
    """A folder that everybody can enter, outside the tests' own, which nobody else can."""
    if os.getuid() != 0 or shutil.which("setpriv") is None:
        pytest.skip("needs to become another user")
    probe = [*NOBODY, sys.executable, "-c", "import ringbalance.scene"]
    if subprocess.run(probe, capture_output=True, check=False).returncode != 0:
        pytest.skip("another user cannot run this Python, or not read this checkout (a umask of 077)")
    folder = Path(tempfile.mkdtemp())
    folder.chmod(0o755)
    yield folder
    shutil.rmtree(folder)


def test_the_folder_above_need_not_be_writable(open_folder: Path) -> None:
    out = open_folder / "out"
    out.mkdir()
    os.chown(out, 65534, 65534)
    done = write(out, *NOBODY)
    assert done.returncode == 0, done.stderr
    assert names(open_folder) == {"out/figures/one", "out/page"}


def test_a_folder_that_is_not_writable_is_refused(open_folder: Path) -> None:
    (open_folder / "out").mkdir()
    done = write(open_folder / "out", *NOBODY)
    assert "out cannot be written: Permission denied" in done.stderr
    (open_folder / "out").chmod(0o777)
    (open_folder / "out" / "figures").mkdir()
    done = write(open_folder / "out", *NOBODY)
    assert "out cannot be written: Permission denied" in done.stderr
    assert names(open_folder) == set()
