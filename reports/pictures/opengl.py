"""Probe whether this machine can draw off-screen, before VTK is imported.

Without an OpenGL library VTK ends in a segmentation fault, so the probe uses ctypes alone in a separate
process: even if a driver crashes there, the caller gets a sentence.  This file imports only the standard
library, and runs by its path as well as as a module.
"""

from __future__ import annotations

import ctypes
import json
import subprocess
import sys
from contextlib import suppress
from dataclasses import asdict, dataclass
from importlib.util import find_spec
from pathlib import Path
from typing import Final

EGL_LIBRARY: Final = "libEGL.so.1"
OSMESA_LIBRARY: Final = "libOSMesa.so.8"
DEBIAN_PACKAGES: Final = "libegl1 libgl1 libgl1-mesa-dri libglu1-mesa"

_EGL_PLATFORM_DEVICE: Final = 0x313F
_EGL_OPENGL_API: Final = 0x30A2
_MAX_DEVICES: Final = 16
_TIMEOUT_S: Final = 30.0


@dataclass(frozen=True, kw_only=True)
class OpenGL:
    """Result of the probe: VTK window class for pictures off-screen, or the reason why there are none."""

    available: bool
    window: str
    """Value for VTK_DEFAULT_OPENGL_WINDOW; empty when nothing can be drawn."""
    text: str
    """One sentence; when nothing can be drawn, what is missing and what to install."""


def _entry_point(egl: ctypes.CDLL, name: str) -> ctypes._FuncPointer:
    """An EGL extension's function, returning a pointer."""
    egl.eglGetProcAddress.restype = ctypes.c_void_p
    address = egl.eglGetProcAddress(name.encode())
    if not address:
        raise OSError(f"{name} is not offered")
    return ctypes.CFUNCTYPE(ctypes.c_void_p, ctypes.c_void_p, ctypes.c_void_p, ctypes.c_void_p)(address)


def probe(*, egl: str, osmesa: str) -> OpenGL:
    """Try EGL, then OSMesa, in this process, which a broken driver may end.

    Args: `egl`: file name of the EGL library. `osmesa`: file name of the OSMesa library.
    """
    try:
        library = ctypes.CDLL(egl)
        # Handles of what EGL can draw on; Mesa's software renderer is one.
        handles, count = (ctypes.c_void_p * _MAX_DEVICES)(), ctypes.c_int(0)
        _entry_point(library, "eglQueryDevicesEXT")(_MAX_DEVICES, handles, ctypes.addressof(count))
        devices = [handle for handle in handles[: count.value] if handle]
        for device in devices:
            display = _entry_point(library, "eglGetPlatformDisplayEXT")(_EGL_PLATFORM_DEVICE, device, None)
            started = display and library.eglInitialize(ctypes.c_void_p(display), None, None)
            if started and library.eglBindAPI(_EGL_OPENGL_API):
                return OpenGL(
                    available=True, window="vtkEGLRenderWindow", text="Off-screen OpenGL through EGL."
                )
        fault = f"none of the {len(devices)} devices of {egl} starts"
    except (OSError, AttributeError) as error:
        fault = str(error)
    with suppress(OSError):
        ctypes.CDLL(osmesa)
        return OpenGL(
            available=True, window="vtkOSOpenGLRenderWindow", text="Off-screen OpenGL through OSMesa."
        )
    return _nothing(f"no off-screen OpenGL ({fault})")


def _nothing(reason: str) -> OpenGL:
    text = f"The 3-D pictures were left out: {reason}. On Debian: apt-get install {DEBIAN_PACKAGES}"
    return OpenGL(available=False, window="", text=text)


def find_opengl(*, egl: str = EGL_LIBRARY, osmesa: str = OSMESA_LIBRARY) -> OpenGL:
    """Check that pyvista is installed and that OpenGL answers in a child process.

    Args: `egl`: file name of the EGL library. `osmesa`: file name of the OSMesa library, tried second.
    """
    if find_spec("pyvista") is None:
        text = "The 3-D pictures were left out: pyvista is not installed; pip install 'ringbalance[pictures]'"
        return OpenGL(available=False, window="", text=text)
    command = [sys.executable, str(Path(__file__).resolve()), egl, osmesa]
    try:
        child = subprocess.run(command, capture_output=True, text=True, check=False, timeout=_TIMEOUT_S)
    except subprocess.TimeoutExpired:
        return _nothing(f"the OpenGL driver did not answer within {_TIMEOUT_S:.0f} s")
    if child.returncode != 0:
        return _nothing(f"the OpenGL driver ended its process with code {child.returncode}")
    return OpenGL(**json.loads(child.stdout))


if __name__ == "__main__":
    print(json.dumps(asdict(probe(egl=sys.argv[1], osmesa=sys.argv[2]))))
