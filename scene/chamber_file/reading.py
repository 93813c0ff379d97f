"""A mesh file's bytes, and what they hold: the formats that are read, and how large a file may be."""

from __future__ import annotations

import os
import stat
from collections.abc import Callable, Mapping
from pathlib import Path
from types import MappingProxyType
from typing import Final

from ringbalance.scene.chamber_file.abaqus_file import read_abaqus
from ringbalance.scene.chamber_file.contents import Contents, unreadable
from ringbalance.scene.chamber_file.gmsh_file import read_gmsh
from ringbalance.scene.chamber_file.step_file import STEP_ENDINGS, meshed_step
from ringbalance.scene.chamber_file.vtu_file import read_vtu

_LARGEST: Final = 2**28
_READERS: Final[Mapping[str, Callable[[bytes], Contents]]] = MappingProxyType(
    {".msh": read_gmsh, ".inp": read_abaqus, ".vtu": read_vtu}
)
FORMATS: Final = "a mesh of Gmsh 2.2 or 4.1 (.msh), Abaqus (.inp) or VTK (.vtu), or a solid (.step, .stp)"


def is_step(path: Path) -> bool:
    """Whether a file is a solid that is yet to be meshed, and has its own unit."""
    return path.suffix.lower() in STEP_ENDINGS


def content_of(path: Path) -> bytes:
    """The bytes of a mesh file. Raises: MeshFileError: it cannot be read, or is larger than any mesh."""
    if path.suffix.lower() not in (*_READERS, *STEP_ENDINGS):
        raise unreadable(f"a name that ends with {path.suffix[:20] or 'no .ending'} is not read", FORMATS)
    try:
        # Without blocking: a pipe that nobody writes to must not hold the program.
        handle = os.open(path, os.O_RDONLY | getattr(os, "O_NONBLOCK", 0) | getattr(os, "O_BINARY", 0))
        with os.fdopen(handle, "rb") as stream:
            kind = os.fstat(stream.fileno())
            if not stat.S_ISREG(kind.st_mode):
                raise unreadable("this is a folder or a device, not a file", FORMATS)
            content = stream.read(_LARGEST + 1)
    except FileNotFoundError as error:
        raise unreadable(f"there is no file {path}", "a path from the folder of the scene file") from error
    except (OSError, ValueError) as error:
        reason = error.strerror if isinstance(error, OSError) and error.strerror else str(error)
        raise unreadable(f"the file cannot be read: {reason}") from error
    if len(content) > _LARGEST:
        raise unreadable("the file is too large to be checked", f"up to {_LARGEST // 2**20} MiB")
    if not content.strip():
        raise unreadable("the file is empty", FORMATS)
    return content


def contents_of(path: Path, content: bytes, *, tolerance: float) -> Contents:
    """What a mesh file's bytes hold; a solid is meshed. Raises: MeshFileError.

    Args: `tolerance`: of the scene, from which the size of a solid's cells follows.
    """
    if is_step(path):
        return meshed_step(content, tolerance=tolerance)
    return _READERS[path.suffix.lower()](content)
