"""Outputs: whole or not at all, refused before the work, and nothing left behind by a killed process."""

from __future__ import annotations

import os
import resource
import signal
import subprocess
import sys
import threading
from collections.abc import Iterator
from pathlib import Path

import pytest

from ringbalance.scene.platform.files import check_file, staged, write_whole


@pytest.fixture
def umask() -> Iterator[None]:
    """An umask that leaves files to their owner."""
    before = os.umask(0o077)
    yield
    os.umask(before)


def names(folder: Path) -> set[str]:
    return {path.relative_to(folder).as_posix() for path in folder.rglob("*") if path.is_file()}


@pytest.mark.usefixtures("umask")
def test_files_follow_the_umask(tmp_path: Path) -> None:
    with staged(tmp_path / "out") as stage:
        write_whole(stage / "a" / "one", "1")
    write_whole(tmp_path / "two", "2")
    files = [tmp_path / "out" / "a" / "one", tmp_path / "two"]
    assert [path.stat().st_mode & 0o777 for path in files] == [0o600, 0o600]


def test_nothing_is_moved_after_an_exception(tmp_path: Path) -> None:
    def fail() -> None:
        with staged(tmp_path / "new" / "out") as stage:
            (stage / "page").write_text("half")
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        fail()
    assert list(tmp_path.iterdir()) == []


def test_named_files_are_moved_last(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    moved: list[str] = []
    replace = os.replace

    def told(source: Path, target: Path) -> None:
        moved.append(target.name)
        replace(source, target)

    monkeypatch.setattr(os, "replace", told)
    with staged(tmp_path / "out", files=("evidence", "a_page")) as stage:
        for name in ("a_page", "b", "evidence", "z"):
            (stage / name).touch()
    assert moved == ["b", "z", "evidence", "a_page"]


def test_a_link_to_a_folder_is_followed_and_one_to_a_file_replaced(tmp_path: Path) -> None:
    """By what moves many files to their folder, and by what writes one."""
    real = tmp_path / "real"
    real.mkdir()
    (tmp_path / "out").symlink_to(real)
    with staged(tmp_path / "out", folders=("figures",)) as stage:
        (stage / "figures").mkdir()
        (stage / "figures" / "one").touch()
        (stage / "page").write_text("page")
        (real / "page").symlink_to(tmp_path / "other")
    (tmp_path / "other").write_text("mine")
    (real / "law.json").symlink_to(tmp_path / "other")
    check_file(tmp_path / "out" / "law.json")
    write_whole(tmp_path / "out" / "law.json", "{}")
    assert names(real) == {"figures/one", "page", "law.json"}
    assert not any(path.is_symlink() for path in real.iterdir())
    assert (tmp_path / "other").read_text() == "mine"


@pytest.mark.skipif(not Path("/dev/stdout").is_symlink(), reason="no /dev/stdout that is a link")
def test_standard_output_is_written_to(tmp_path: Path) -> None:
    code = "import pathlib; from ringbalance.scene.platform.files import check_file, write_whole; "
    code += "check_file(out := pathlib.Path('/dev/stdout')); write_whole(out, 'law')"
    with open(tmp_path / "law", "wb") as stream:
        subprocess.run([sys.executable, "-c", code], stdout=stream, check=True)
    assert (tmp_path / "law").read_text() == "law"
    assert Path("/dev/stdout").is_symlink()


def test_a_file_that_the_system_cuts_off_is_named(tmp_path: Path) -> None:
    path = tmp_path / "large"
    before = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (1000, before[1]))
    try:
        with pytest.raises(OSError, match="large") as refused:
            write_whole(path, b"x" * 100_000)
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, before)
    assert refused.value.filename == str(path)
    assert list(tmp_path.iterdir()) == []


def test_a_pipe_is_written_to(tmp_path: Path) -> None:
    pipe, seen = tmp_path / "pipe", []
    os.mkfifo(pipe)
    reader = threading.Thread(target=lambda: seen.append(pipe.read_text()))
    reader.start()
    check_file(pipe)
    write_whole(pipe, "law")
    reader.join()
    assert seen == ["law"]
    assert pipe.is_fifo()


def test_a_file_is_checked_without_a_trace(tmp_path: Path) -> None:
    check_file(tmp_path / "new" / "law.json")
    assert list(tmp_path.iterdir()) == []
    with pytest.raises(OSError, match="is a folder"):
        check_file(tmp_path)
    (tmp_path / "file").touch()
    with pytest.raises(OSError, match="is a file, not a folder"):
        check_file(tmp_path / "file" / "law.json")


@pytest.mark.parametrize("what", ["file", "figures", "dangling", "page"])
def test_what_is_in_the_way_is_refused_at_once(what: str, tmp_path: Path) -> None:
    out = tmp_path / "out"
    if what == "file":
        out.touch()
    elif what == "dangling":
        out.symlink_to(tmp_path / "nowhere")
    elif what == "figures":
        out.mkdir()
        (out / "figures").touch()
    else:
        (out / "page").mkdir(parents=True)
    before = names(tmp_path)
    with (
        pytest.raises(OSError, match=r"move it away|does not exist"),
        staged(out, files=("page",), folders=("figures",)),
    ):
        pytest.fail("begun")
    assert names(tmp_path) == before


KILLED = """
import os, signal, sys
from pathlib import Path
from ringbalance.scene.platform import files
if sys.argv[2] == "folder":
    with files.staged(Path(sys.argv[1])) as stage:
        (stage / "half").write_text("half")
        os.kill(os.getpid(), signal.SIGKILL)
os.replace = lambda *_: os.kill(os.getpid(), signal.SIGKILL)
files.write_whole(Path(sys.argv[1]) / "file", "half")
"""


@pytest.mark.parametrize("kind", ["folder", "file"])
def test_the_draft_of_a_killed_process_is_removed_by_the_next(kind: str, tmp_path: Path) -> None:
    child = subprocess.run([sys.executable, "-c", KILLED, str(tmp_path), kind], check=False)
    assert child.returncode == -signal.SIGKILL
    (draft,) = tmp_path.iterdir()
    for path in (draft, *draft.rglob("*")):
        os.utime(path, (1, 1))
    write_whole(tmp_path / "law.json", "{}")
    assert [path.name for path in tmp_path.iterdir()] == ["law.json"]


def test_the_draft_of_a_living_process_stays(tmp_path: Path) -> None:
    """Two reports into one folder at once."""
    with staged(tmp_path / "out") as stage:
        (stage / "one").touch()
        for path in (stage, stage.parent, *stage.parent.iterdir()):
            os.utime(path, (1, 1))
        with staged(tmp_path / "out") as other:
            (other / "two").touch()
    assert names(tmp_path) == {"out/one", "out/two"}


def test_folders_of_other_names_are_left_alone(tmp_path: Path) -> None:
    mine = tmp_path / ".ringbalance-mine"
    mine.mkdir()
    os.utime(mine, (1, 1))
    write_whole(tmp_path / "law.json", "{}")
    assert mine.is_dir()
