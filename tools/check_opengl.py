"""Can this machine draw off-screen?  Exit code 0: yes; 1: no, with the Debian packages that it would take.

Runs under any Python without an environment: the check uses only the standard library.
"""

from __future__ import annotations

import runpy
import sys
from pathlib import Path

PROBE = Path(__file__).resolve().parents[1] / "reports" / "pictures" / "opengl.py"


def main() -> int:
    """Print the Debian packages that are missing; 0 when none is."""
    probe = runpy.run_path(str(PROBE), run_name="opengl")
    if probe["find_opengl"]().available:
        return 0
    print(probe["DEBIAN_PACKAGES"])
    return 1


if __name__ == "__main__":
    sys.exit(main())
