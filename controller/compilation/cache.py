"""Compiled code kept in files, and what else saves time: what cannot be read is discarded and made again.

The layout is numba's, an index for each function and a data file for each signature.  Different from numba's
own, each file begins with a checksum of the rest, is written whole and brought to the disk, and a data file's
name follows from its content, so that no index can lead to another function's code.  A file that cannot be
written costs time in later runs and is no error.  What another user may have written is not read.
"""

from __future__ import annotations

import contextlib
import hashlib
import inspect
import os
import pickle
import shutil
import sys
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any, ClassVar, Final

from numba.core import caching, serialize

from ringbalance.controller.compilation.folders import foreign, make_private, mark_used, remove_old
from ringbalance.scene.platform.files import write_whole

INDEX: Final = ".nbi"
DATA: Final = ".nbc"
OTHER: Final = ".kept"
"""What another room keeps beside the code, and makes again without it."""
_SIZE: Final = hashlib.sha256().digest_size

_dumps: Any = serialize.dumps
# Private parts of numba: without them everything is compiled in every process.
_NumbaCache: Any = getattr(caching, "FunctionCache", object)
_NumbaFormat: Any = getattr(caching, "CompileResultCacheImpl", object)


def checked_content(path: Path) -> bytes:
    """Content of a kept file without the checksum; OSError or ValueError when it cannot be used."""
    if path.exists() and not path.is_file():
        raise OSError(f"{path} is not a file")
    if foreign([path]) is not None:
        raise PermissionError(f"{path} may have been written by another user")
    data = path.read_bytes()
    if hashlib.sha256(data[_SIZE:]).digest() != data[:_SIZE]:
        raise ValueError(f"{path} is damaged")
    return data[_SIZE:]


def discard(path: Path) -> None:
    """Remove a file or a folder, as far as that is possible."""
    try:
        path.unlink(missing_ok=True)
    except OSError:
        shutil.rmtree(path, ignore_errors=True)


def is_damaged(path: Path) -> bool:
    """Whether a kept file would be discarded when it is needed."""
    try:
        checked_content(path)
    except (OSError, ValueError):
        return True
    return False


@dataclass(frozen=True, kw_only=True)
class _Place:
    """Where numba looks for the code of a function: a "locator" in its words."""

    folder: Path
    source: Path
    line: int

    def get_cache_path(self) -> str:
        """One folder for each folder of sources."""
        parent = self.source.parent
        digest = hashlib.sha256(os.fsencode(parent)).hexdigest()[:16]
        return str(self.folder / f"{parent.name}_{digest}")

    def get_source_stamp(self) -> str:
        """Of the function's own file."""
        return hashlib.sha256(self.source.read_bytes()).hexdigest()

    def get_disambiguator(self) -> str:
        """Tells functions of one name in one file apart."""
        return str(self.line)

    def ensure_cache_path(self) -> None:
        """Make the folder; a file in its place is discarded."""
        path = Path(self.get_cache_path())
        for place in (path.parent, path):
            if place.is_symlink() or (place.exists() and not place.is_dir()):
                discard(place)
        make_private(path)


class _Files:
    """Index and data files of one function."""

    def __init__(self, *, folder: Path, name: str, stamp: str) -> None:
        self._folder, self._name, self._stamp = folder, name, stamp
        self._index_path = folder / f"{name}{INDEX}"

    def load(self, key: object) -> object:
        """What was saved under a key, or None."""
        name = self._index().get(key)
        if not isinstance(name, str) or not name.startswith(self._name) or os.sep in name:
            return None
        return self._unpickled(self._folder / name, named=True)

    def save(self, key: object, data: object) -> None:
        """Keep an entry; OSError when that cannot be done."""
        content = _dumps(data)
        name = self._data_name(content)
        write_checked(self._folder / name, content)
        write_checked(self._index_path, _dumps((self._stamp, {**self._index(), key: name})))

    def flush(self) -> None:
        """Forget every entry."""
        discard(self._index_path)

    def _index(self) -> dict[Any, object]:
        found = self._unpickled(self._index_path)
        if not isinstance(found, tuple) or len(found) != 2 or not isinstance(found[1], dict):
            return {}
        return found[1] if found[0] == self._stamp else {}

    def _data_name(self, content: bytes) -> str:
        return f"{self._name}.{hashlib.sha256(content).hexdigest()[:16]}{DATA}"

    def _unpickled(self, path: Path, *, named: bool = False) -> object:
        """What a file holds; None, and the file is discarded, where that is damaged or not what it is named.

        Args: `named`: whether the file's name follows from its content.
        """
        try:
            content = checked_content(path)
            if named and path.name != self._data_name(content):
                raise ValueError(f"{path} holds what belongs to another name")
            return pickle.loads(content)
        except FileNotFoundError:
            return None
        except Exception:
            # A checksum holds nobody to a format: what an older library has written may raise anything.
            discard(path)
            return None


def write_checked(path: Path, content: bytes) -> None:
    """Keep a file that `checked_content` reads; OSError when that cannot be done."""
    if path.is_dir():
        discard(path)
    make_private(path.parent)
    write_whole(path, hashlib.sha256(content).digest() + content, private=True)


class KeptCode(_NumbaCache):  # type: ignore[misc]
    """Numba's cache of one function, in the files described above."""

    def __init__(self, function: Callable[..., Any], folder: Path) -> None:
        source = Path(inspect.getfile(function))
        place = _Place(folder=folder, source=source, line=function.__code__.co_firstlineno)

        class Found:
            """The place, as numba asks for it."""

            @staticmethod
            def from_function(*_: object) -> _Place:
                return place

        class Format(_NumbaFormat):  # type: ignore[misc]
            """What numba writes for a compiled function."""

            _locator_classes: ClassVar = [Found]

        self._impl_class = Format
        super().__init__(function)
        self._folder = folder
        self._cache_file = _Files(
            folder=Path(place.get_cache_path()), name=self._impl.filename_base, stamp=place.get_source_stamp()
        )

    def load_overload(self, sig: object, target_context: object) -> object:
        """The compiled code of a signature, or None: it is then compiled."""
        if not trusted(self._folder):
            return None
        try:
            found = super().load_overload(sig, target_context)
        except Exception:
            # Code that was kept by another release of a library: it is only worth the time to compile it.
            self._cache_file.flush()
            return None
        if found is not None:
            mark_used(self._folder)
        return found

    def save_overload(self, sig: object, data: object) -> None:
        """Keep the compiled code of a signature, where that can be done."""
        if not trusted(self._folder):
            return
        try:
            super().save_overload(sig, data)
            remove_old(self._folder)
        except OSError as error:
            _note_unwritable(self._folder, error.strerror or str(error))


@cache
def trusted(folder: Path) -> bool:
    """Whether what a version's folder holds may be used: nobody else can have written it.

    A folder of this user's that others may write is made private first. Otherwise that is said once.
    """
    with contextlib.suppress(OSError):
        if folder.parent.exists():
            make_private(folder.parent)
    other = foreign([folder.parent, folder])
    if other is not None and sys.stderr is not None:
        print(
            f"ringbalance: {other} belongs to another user, or others may write to it; what it holds is not "
            "used, and every run compiles again, see `ringbalance cache`",
            file=sys.stderr,
        )
    return other is None


@cache
def _note_unwritable(folder: Path, reason: str) -> None:
    if sys.stderr is not None:
        print(
            f"ringbalance: compiled code cannot be kept in {folder} ({reason}); every run compiles it again, "
            "see `ringbalance cache`",
            file=sys.stderr,
        )


def kept_files(folder: Path) -> Iterator[Path]:
    """All files that are kept below a folder, which may not exist."""
    yield from (path for path in folder.rglob("*") if path.suffix in {INDEX, DATA, OTHER})
