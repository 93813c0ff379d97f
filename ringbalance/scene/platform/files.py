"""Outputs are written whole or not at all; an output that cannot be written is refused before the work.

An output grows in a draft: a hidden file or folder, locked while its writer runs. A draft without a lock was
left by a killed process; the next process that writes to the folder removes it. Where files cannot be locked,
the draft's age decides. Files that can be made again, and are kept only to save time, are in the user's cache
folder.
"""

from __future__ import annotations

import csv
import errno
import os
import re
import secrets
import shutil
import stat
import time
from collections.abc import Iterator, Sequence
from contextlib import ExitStack, contextmanager, suppress
from importlib.resources import files
from pathlib import Path
from typing import BinaryIO, Final

try:
    import fcntl
except ImportError:  # Windows has no such locks.
    fcntl = None  # type: ignore[assignment]

NOT_TEXT: Final = "this is not UTF-8 text"
_ELSEWHERE: Final = "move it away or choose another place"
_PREFIX: Final = ".ringbalance-"
_NAME: Final = re.compile(re.escape(_PREFIX) + "[0-9a-f]{16}")
_LOCK: Final = "lock"
_FILES: Final = "files"
_SYSTEM: Final = ("/dev/", "/proc/")
"""Folders whose links lead to open files of the process."""
_MOST_KEPT_BYTES: Final = 2**28
_LOCKING_TIME_S: Final = 60.0
"""Longest time until a new folder has its lock."""
_LONGEST_WORK_S: Final = 86400.0
"""Age at which a draft counts as abandoned where files cannot be locked."""


def write_whole(path: Path, data: str | bytes, *, private: bool = False) -> Path:
    """Write a file so that a reader never sees half of it, making its folder when there is none.

    After a power cut the file has the old content or the new one, and is never empty: the content reaches
    the disk before the name does.
    Args: `path`: of the file; a link there is replaced, one to its folder is followed, a device or a pipe is
        written to directly. `data`: its content; text is written as UTF-8. `private`: only this user may read
        or write it.
    Raises: OSError: the folder cannot be made or written; nothing is left behind.
    """
    content = data.encode() if isinstance(data, str) else data
    if _is_special(path):
        path.write_bytes(content)
        return path
    folder = _through_links(path.parent)
    folder.mkdir(parents=True, exist_ok=True)
    _remove_abandoned(folder)
    target, draft, mode = folder / path.name, _draft_path(folder), 0o600 if private else 0o666
    try:
        with open(draft, "xb", opener=lambda name, flags: os.open(name, flags, mode)) as stream:
            _lock(stream, without_locks=True)
            stream.write(content)
            stream.flush()
            os.fsync(stream.fileno())
            if fcntl is not None:
                # Under the lock, so that no other process takes the draft for an abandoned one.
                os.replace(draft, target)
        if fcntl is None:
            os.replace(draft, target)
    except BaseException as error:
        draft.unlink(missing_ok=True)
        if isinstance(error, OSError) and error.filename in (None, str(draft)):
            error.filename = str(target)
        raise
    # The new name reaches the disk too, but for some file systems, and Windows, which cannot sync a folder.
    with suppress(OSError):
        handle = os.open(folder, os.O_RDONLY)
        try:
            os.fsync(handle)
        finally:
            os.close(handle)
    return path


def packaged_rows(package: str, *path: str) -> list[dict[str, str]]:
    """Rows of a CSV file that comes with the program, by its path below a package; "#" begins a comment."""
    lines = files(package).joinpath(*path).read_text(encoding="utf-8").splitlines()
    return list(csv.DictReader(line for line in lines if not line.startswith("#")))


def check_file(path: Path, *, apart_from: Path | None = None) -> None:
    """Refuse now what `write_whole` would refuse after the work; nothing is left behind.

    Args: `apart_from`: the scene, which must not be written over.
    Raises: OSError: it is that scene or a folder, or its folder cannot be made or written.
    """
    if apart_from is not None and path.resolve() == apart_from.resolve():
        raise OSError(f"{path} is the scene itself; choose another file")
    with _refused(path):
        if path.is_dir():
            raise IsADirectoryError(f"{path} is a folder, not a file; name a file")
        if not _is_special(path):
            with draft_folder(_nearest(_through_links(path.parent))):
                pass


def read_bounded(path: str | Path, *, what: str, most: int, regular: bool = False) -> tuple[bytes, str]:
    """The bytes of a file, and its error: it cannot be read or is too large; empty without one.

    Args: `what`: such as "scene file". `most`: largest size, bytes. `regular`: True to refuse a pipe, to
        which perhaps no process ever writes.
    """
    try:
        if regular and not stat.S_ISREG(os.stat(path).st_mode):
            return b"", "this is a folder or a device, not a file"
        with open(path, "rb") as stream:
            content = stream.read(most + 1)
    except FileNotFoundError:
        return b"", "there is no such file"
    except IsADirectoryError:
        return b"", f"this is a folder, not a {what}"
    except (OSError, ValueError) as error:
        reason = error.strerror if isinstance(error, OSError) and error.strerror else str(error)
        return b"", f"the file cannot be read: {reason}"
    too_large = f"the file is larger than any {what}, which has up to {most // 2**20} MiB"
    return content, too_large if len(content) > most else ""


def read_kept(path: Path) -> bytes:
    """The bytes of a file that the program keeps for itself; any other object in its place is refused.

    Raises: OSError: it cannot be read, is a link, no file, or larger than any that is kept.
    """
    flags = getattr(os, "O_NOFOLLOW", 0) | getattr(os, "O_NONBLOCK", 0)
    with open(path, "rb", opener=lambda name, mode: os.open(name, mode | flags)) as stream:
        status = os.fstat(stream.fileno())
        if not stat.S_ISREG(status.st_mode) or status.st_size > _MOST_KEPT_BYTES:
            raise OSError(f"{path} is no file that is kept")
        return stream.read()


def discard(path: Path) -> None:
    """Remove a file, a link or a folder with its content, as far as possible."""
    try:
        path.unlink(missing_ok=True)
    except OSError:
        shutil.rmtree(path, ignore_errors=True)


@contextmanager
def staged(folder: Path, *, files: Sequence[str] = (), folders: Sequence[str] = ()) -> Iterator[Path]:
    """Gather files for a folder, and move them there when all of them are whole.

    The folder is tried before the work, with a file moved into it. The files grow in a hidden folder inside
    it, or in the nearest folder that exists, so that they never cross devices.
    Args: `folder`: final folder; a link to a folder is followed. `files`: names of final files, moved
        after all others, in this order. `folders`: names of final sub-folders.
    Yields: The folder to write into; after an exception nothing of it is moved.
    Raises: OSError: the folder cannot be written, or it or a part of it exists as another kind of object.
    """
    with ExitStack() as stack:
        with _refused(folder):
            target = _folder(folder, files, folders)
            nearest = _nearest(target)
            for each in {nearest, target.parent}:
                _remove_abandoned(each)
            stage = stack.enter_context(draft_folder(nearest))
            for each in filter(Path.exists, [target, *(target / name for name in folders)]):
                probe, moved = stage / "probe", _draft_path(each)
                probe.touch()
                try:
                    _move(probe, moved)
                finally:
                    moved.unlink(missing_ok=True)
        yield stage
        try:
            _move_all(stage, target, files)
        except KeyboardInterrupt:
            # An interrupt comes before the moves or after them.
            _move_all(stage, target, files)
            raise


def _is_special(path: Path) -> bool:
    """True for a device, a pipe, a socket, /dev/stdout and the like, which no rename should replace."""
    if path.is_symlink() and f"{_through_links(path.parent)}/".startswith(_SYSTEM):
        return True
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
    """The folder behind the links. Raises: OSError: an existing part is of the wrong kind."""
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
    """Report an error of the system with the path that the user gave."""
    try:
        yield
    except OSError as error:
        if error.errno is None:
            raise
        name = f" ({error.filename})" if error.filename else ""
        raise OSError(
            f"{path} cannot be written: {error.strerror}{name}; make it writable or choose another place"
        ) from error


def _move_all(stage: Path, target: Path, last: Sequence[str]) -> None:
    finished = {path.relative_to(stage).as_posix(): path for path in stage.rglob("*") if path.is_file()}
    for name in sorted(finished, key=lambda name: (last.index(name) if name in last else -1, name)):
        destination = target / name
        destination.parent.mkdir(parents=True, exist_ok=True)
        _move(finished[name], destination)


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
    """The user's cache folder for ringbalance, by the XDG base directory specification."""
    cache_home = Path(os.environ.get("XDG_CACHE_HOME", ""))
    # The specification requires that a relative path is ignored.
    return (cache_home if cache_home.is_absolute() else Path.home() / ".cache") / "ringbalance"


def _draft_path(folder: Path) -> Path:
    """A fresh name for a draft in a folder."""
    return folder / f"{_PREFIX}{secrets.token_hex(8)}"


@contextmanager
def draft_folder(folder: Path) -> Iterator[Path]:
    """A locked folder for outputs that grow, removed at the end whatever happens.

    Yields: The folder to write into.
    Raises: OSError: nothing can be made there.
    """
    path = _draft_path(folder)
    path.mkdir(mode=0o700)
    try:
        with open(path / _LOCK, "xb") as lock:
            _lock(lock, without_locks=True)
            (path / _FILES).mkdir()
            yield path / _FILES
    finally:
        shutil.rmtree(path, ignore_errors=True)


def _remove_abandoned(folder: Path) -> None:
    """Remove the drafts of killed processes, as far as possible; those of running ones stay."""
    with suppress(OSError):
        for path in [folder / name for name in os.listdir(folder) if _NAME.fullmatch(name)]:
            with suppress(OSError):
                if path.is_symlink():
                    continue
                age = time.time() - path.stat().st_mtime
                lock = path / _LOCK if path.is_dir() else path
                if not lock.exists():
                    if age > _LOCKING_TIME_S:
                        discard(path)
                elif fcntl is None:
                    if age > _LONGEST_WORK_S:
                        discard(path)
                else:
                    with open(lock, "r+b") as stream:
                        if age > 1.0 and _lock(stream, without_locks=age > _LONGEST_WORK_S):
                            discard(path)


def _lock(stream: BinaryIO, *, without_locks: bool) -> bool:
    """Lock an open file until it is closed; False when another process has it locked."""
    if fcntl is None:
        return without_locks
    try:
        fcntl.flock(stream.fileno(), fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        return False
    except OSError:
        return without_locks
    return True
