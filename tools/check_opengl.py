"""Can this machine draw off-screen?  Exit code 0: yes; 1: no, with one sentence on why.

VTK ends in a segmentation fault where no OpenGL library is found, so this asks first, with ctypes alone and
in a process of its own: whatever a broken driver does there, the caller gets an answer.
"""

from __future__ import annotations

import ctypes
import subprocess
import sys

EGL_PLATFORM_DEVICE = 0x313F
EGL_OPENGL_API = 0x30A2
MOST_DEVICES = 16


def entry_point(egl: ctypes.CDLL, name: str) -> ctypes._FuncPointer:
    """An EGL extension's function, returning a pointer; RuntimeError when there is none of that name."""
    egl.eglGetProcAddress.restype = ctypes.c_void_p
    address = egl.eglGetProcAddress(name.encode())
    if not address:
        raise RuntimeError(f"libEGL has no {name}")
    return ctypes.CFUNCTYPE(ctypes.c_void_p, ctypes.c_void_p, ctypes.c_void_p, ctypes.c_void_p)(address)


def devices(egl: ctypes.CDLL) -> list[int]:
    """Handles of the devices that EGL can draw on; Mesa's software renderer is one."""
    handles = (ctypes.c_void_p * MOST_DEVICES)()
    count = ctypes.c_int(0)
    entry_point(egl, "eglQueryDevicesEXT")(MOST_DEVICES, handles, ctypes.addressof(count))
    return [handle for handle in handles[: count.value] if handle]


def initialises(egl: ctypes.CDLL, device: int) -> bool:
    """True when a display on the device starts and speaks OpenGL."""
    display = entry_point(egl, "eglGetPlatformDisplayEXT")(EGL_PLATFORM_DEVICE, device, None)
    started = display and egl.eglInitialize(ctypes.c_void_p(display), None, None)
    return bool(started) and bool(egl.eglBindAPI(EGL_OPENGL_API))


def probe() -> str:
    """Empty when off-screen drawing works, else one sentence on why it does not."""
    try:
        egl = ctypes.CDLL("libEGL.so.1")
        found = devices(egl)
    except (OSError, RuntimeError) as error:
        return f"Off-screen OpenGL is missing: {error}."
    if not any(initialises(egl, device) for device in found):
        return f"Off-screen OpenGL does not start: none of {len(found)} EGL devices initialises."
    return ""


def main() -> int:
    """Run the probe in a child process and print its sentence."""
    if sys.argv[1:] == ["--probe"]:
        print(probe())
        return 0
    child = subprocess.run([sys.executable, __file__, "--probe"], capture_output=True, text=True, check=False)
    crash = "" if child.returncode == 0 else f"Off-screen OpenGL crashes (exit code {child.returncode})."
    sentence = crash or child.stdout.strip()
    print(sentence, end="\n" if sentence else "")
    return 1 if sentence else 0


if __name__ == "__main__":
    sys.exit(main())
