"""Outputs are written whole or not at all, and what cannot be written is refused before the work.

What can be made again, and is only kept to save time, stands in the user's own cache folder.
"""

from __future__ import annotations

import errno
import os
from collections.abc import Iterator, Sequence
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import Final

from ringbalance.scene.platform.drafts import draft_folder, draft_path, remove_abandoned, replace_whole

_ELSEWHERE: Final = "move it away or choose another place"


def write_whole(path: Path, data: str | bytes) -> Path:
    """Write a file so that a reader never sees half of it, making its folder when there is none.

    After a power cut the old content or the new one is there, never an empty file: the content reaches the
    disk before the name does.
    Args: `path`: of the file; a link is followed, a device or a pipe is written to directly. `data`: its
        content; text is written as UTF-8.
    Raises: OSError: the folder cannot be made or written; nothing is left behind.
    """
    content = data.encode() if isinstance(data, str) else data
    if _is_special(path):
        path.write_bytes(content)
        return path
    target = _through_links(path)
    target.parent.mkdir(parents=True, exist_ok=True)
    remove_abandoned(target.parent)
    replace_whole(target, content)
    return path


def check_file(path: Path) -> None:
    """Refuse now what `write_whole` would refuse after the work; nothing is left behind.

    Raises: OSError: it is a folder, or its folder cannot be made or written.
    """
    with _refused(path):
        if path.is_dir():
            raise IsADirectoryError(f"{path} is a folder, not a file; name a file")
        if not _is_special(path):
            with draft_folder(_nearest(_through_links(path).parent)):
                pass


@contextmanager
def staged(folder: Path, *, files: Sequence[str] = (), folders: Sequence[str] = ()) -> Iterator[Path]:
    """Gather files for a folder, and move them there when all of them are whole.

    The folder is tried before the work, with a file moved into it. The files grow in a hidden folder inside
    it, or in the nearest folder that exists, so that they never cross devices.
    Args: `folder`: where the files shall stand in the end; a link to a folder is followed. `files`: names
        that it will hold, moved after all others, in this order. `folders`: names of sub-folders that it will
        hold.
    Yields: The folder to write into; after an exception nothing of it is moved.
    Raises: OSError: the folder cannot be written, or something else stands where it or a part of it belongs.
    """
    with ExitStack() as stack:
        with _refused(folder):
            target = _folder(folder, files, folders)
            place = _nearest(target)
            for each in {place, target.parent}:
                remove_abandoned(each)
            stage = stack.enter_context(draft_folder(place))
            _try_moves(stage, [target, *(target / name for name in folders)])
        yield stage
        try:
            _move_all(stage, target, files)
        except KeyboardInterrupt:
            # An interrupt comes before the moves or after them.
            _move_all(stage, target, files)
            raise


def _is_special(path: Path) -> bool:
    """True for a device, a pipe or a socket: nothing that a rename should replace."""
    return path.exists() and not path.is_file() and not path.is_dir()


def _through_links(path: Path) -> Path:
    return Path(os.path.realpath(path))


def _nearest(folder: Path) -> Path:
    """The folder itself, or the nearest one above it that exists."""
    while not folder.exists():
        folder = folder.parent
    if not folder.is_dir():
        raise NotADirectoryError(f"{folder} is a file, not a folder; {_ELSEWHERE}")
    return folder


def _folder(folder: Path, files: Sequence[str], folders: Sequence[str]) -> Path:
    """The folder behind the links, when all that is there already is of the right kind."""
    for each in (folder, *(folder / name for name in folders)):
        if each.is_symlink() and not each.exists():
            raise FileNotFoundError(
                f"{each} is a link to {os.readlink(each)}, which does not exist; make that folder or "
                "choose another"
            )
        if each.exists() and not each.is_dir():
            raise NotADirectoryError(f"{each} is a file, not a folder; {_ELSEWHERE}")
    for name in files:
        if (folder / name).is_dir():
            raise IsADirectoryError(f"{folder / name} is a folder, not a file; {_ELSEWHERE}")
    return _through_links(folder)


@contextmanager
def _refused(path: Path) -> Iterator[None]:
    """What the machine refuses, reported with the path that the user gave."""
    try:
        yield
    except OSError as error:
        if error.errno is None:
            raise
        place = f" ({error.filename})" if error.filename else ""
        raise OSError(
            f"{path} cannot be written: {error.strerror}{place}; make it writable or choose another place"
        ) from error


def _try_moves(stage: Path, folders: Sequence[Path]) -> None:
    for folder in filter(Path.exists, folders):
        probe, moved = stage / "probe", draft_path(folder)
        probe.touch()
        try:
            _move(probe, moved)
        finally:
            moved.unlink(missing_ok=True)


def _move_all(stage: Path, target: Path, last: Sequence[str]) -> None:
    finished = {path.relative_to(stage).as_posix(): path for path in stage.rglob("*") if path.is_file()}
    for name in sorted(finished, key=lambda name: (last.index(name) if name in last else -1, name)):
        place = target / name
        place.parent.mkdir(parents=True, exist_ok=True)
        _move(finished[name], place)


def _move(source: Path, target: Path) -> None:
    try:
        os.replace(source, target)
    except OSError as error:
        if error.errno != errno.EXDEV:
            raise
        # A sub-folder of the target that is a mount point of its own.
        write_whole(target, source.read_bytes())
        source.unlink()


def cache_folder() -> Path:
    """The user's folder for what ringbalance can make again, after the XDG base directory specification."""
    return Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "ringbalance"
