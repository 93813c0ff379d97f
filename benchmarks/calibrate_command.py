"""User CPU time of `ringbalance calibrate` on the paper's disc, over that of `import scipy.optimize`.

Both are whole processes, run alternately so that a busy machine slows both equally; medians are compared.
"""

from __future__ import annotations

import argparse
import os
import resource
import statistics
import subprocess
import sys
from pathlib import Path
from typing import Final

SCENE: Final = Path(__file__).parent.parent / "scenes" / "liquid_ring_paper.toml"
COMMANDS: Final = {
    "import scipy.optimize": ("-c", "import scipy.optimize"),
    "ringbalance calibrate": (
        "-c",
        "import sys; from ringbalance.cli import main; sys.exit(main(sys.argv[1:]))",
        "calibrate",
        str(SCENE),
        "--json",
    ),
}


def user_time(arguments: tuple[str, ...]) -> float:
    """User CPU time of a Python process, s. Args: `arguments`: of the interpreter."""
    before = resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime
    environment = os.environ | {"OPENBLAS_NUM_THREADS": "1", "OMP_NUM_THREADS": "1"}
    subprocess.run([sys.executable, *arguments], check=True, stdout=subprocess.DEVNULL, env=environment)
    return resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime - before


def main() -> None:
    """Measure alternately and print the medians and their ratio."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--repetitions", type=int, default=15)
    repetitions = parser.parse_args().repetitions
    times: dict[str, list[float]] = {name: [] for name in COMMANDS}
    for _ in range(repetitions + 1):
        for name, arguments in COMMANDS.items():
            times[name].append(user_time(arguments))
    # The first round compiles modules and fills the file cache.
    medians = {name: statistics.median(values[1:]) for name, values in times.items()}
    for name, seconds in medians.items():
        print(f"{name:24} {seconds:.3f} s user CPU time, median of {repetitions}")
    print(f"ratio {medians['ringbalance calibrate'] / medians['import scipy.optimize']:.2f}")


if __name__ == "__main__":
    main()
