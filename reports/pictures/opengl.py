"""Asks whether this machine can draw off-screen, before VTK is imported.

Without an OpenGL library VTK ends in a segmentation fault, so the question is put with ctypes alone and in
a process of its own: whatever a broken driver does there, the caller gets a sentence.  Only the standard
library is imported here, and the file runs by its path as well as a module.
"""

from __future__ import annotations

import ctypes
import json
import subprocess
import sys
from dataclasses import asdict, dataclass
from importlib.util import find_spec
from pathlib import Path
from typing import Final

EGL_LIBRARY: Final = "libEGL.so.1"
OSMESA_LIBRARY: Final = "libOSMesa.so.8"
DEBIAN_PACKAGES: Final = "libegl1 libgl1 libgl1-mesa-dri libglu1-mesa"

_EGL_PLATFORM_DEVICE: Final = 0x313F
_EGL_OPENGL_API: Final = 0x30A2
_MOST_DEVICES: Final = 16
_PATIENCE: Final = 30.0


@dataclass(frozen=True, kw_only=True)
class OpenGL:
    """Whether, and through which VTK window class, pictures can be drawn off-screen."""

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


def _egl_devices(egl: ctypes.CDLL) -> list[int]:
    """Handles of what EGL can draw on; Mesa's software renderer is one."""
    handles = (ctypes.c_void_p * _MOST_DEVICES)()
    count = ctypes.c_int(0)
    _entry_point(egl, "eglQueryDevicesEXT")(_MOST_DEVICES, handles, ctypes.addressof(count))
    return [handle for handle in handles[: count.value] if handle]


def _initialises(egl: ctypes.CDLL, device: int) -> bool:
    """True when a display on the device starts and speaks OpenGL."""
    display = _entry_point(egl, "eglGetPlatformDisplayEXT")(_EGL_PLATFORM_DEVICE, device, None)
    started = display and egl.eglInitialize(ctypes.c_void_p(display), None, None)
    return bool(started) and bool(egl.eglBindAPI(_EGL_OPENGL_API))


def _egl_fault(library: str) -> str:
    """Empty when EGL draws, else why not."""
    try:
        egl = ctypes.CDLL(library)
        devices = _egl_devices(egl)
    except (OSError, AttributeError) as error:
        return str(error)
    if not any(_initialises(egl, device) for device in devices):
        return f"none of the {len(devices)} devices of {library} starts"
    return ""


def _loads(library: str) -> bool:
    try:
        ctypes.CDLL(library)
    except OSError:
        return False
    return True


def probe(*, egl: str, osmesa: str) -> OpenGL:
    """Tries EGL, then OSMesa, in this very process; a broken driver may end it.

    Args: `egl`: file name of the EGL library. `osmesa`: file name of the OSMesa library.
    """
    fault = _egl_fault(egl)
    if not fault:
        return OpenGL(available=True, window="vtkEGLRenderWindow", text="Off-screen OpenGL through EGL.")
    if _loads(osmesa):
        return OpenGL(
            available=True, window="vtkOSOpenGLRenderWindow", text="Off-screen OpenGL through OSMesa."
        )
    return _nothing(f"no off-screen OpenGL ({fault})")


def _nothing(reason: str) -> OpenGL:
    text = f"The 3-D pictures were left out: {reason}. On Debian: apt-get install {DEBIAN_PACKAGES}"
    return OpenGL(available=False, window="", text=text)


def find_opengl(*, egl: str = EGL_LIBRARY, osmesa: str = OSMESA_LIBRARY) -> OpenGL:
    """Whether pictures can be drawn off-screen: pyvista is there, and OpenGL answers in a child process.

    Args: `egl`: file name of the EGL library. `osmesa`: file name of the OSMesa library, tried second.
    """
    if find_spec("pyvista") is None:
        text = "The 3-D pictures were left out: pyvista is not installed; pip install 'ringbalance[pictures]'"
        return OpenGL(available=False, window="", text=text)
    command = [sys.executable, str(Path(__file__).resolve()), egl, osmesa]
    try:
        child = subprocess.run(command, capture_output=True, text=True, check=False, timeout=_PATIENCE)
    except subprocess.TimeoutExpired:
        return _nothing(f"the OpenGL driver did not answer within {_PATIENCE:.0f} s")
    if child.returncode != 0:
        return _nothing(f"the OpenGL driver ended its process with code {child.returncode}")
    return OpenGL(**json.loads(child.stdout))


if __name__ == "__main__":
    print(json.dumps(asdict(probe(egl=sys.argv[1], osmesa=sys.argv[2]))))
