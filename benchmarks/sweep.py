"""A sweep against a loop of calibrations, as a ratio within one run, and its growth with its size.

python benchmarks/sweep.py [DESIGNS]
"""

from __future__ import annotations

import sys
import time
from collections.abc import Callable
from functools import partial

import ringbalance as rb

CALIBRATED = 20
VARY = {"tube.bore": "0.7mm:2.5mm", "rotor.speed": "5000rpm:7000rpm", "gas.pressure": "0.5MPa:1MPa"}


def seconds(call: Callable[[], object]) -> float:
    """Processor time."""
    start = time.process_time()
    call()
    return time.process_time() - start


def main(designs: int) -> None:
    """Print times a design, and the ratio."""
    scene = rb.load_scene(rb.bundled_scene("liquid_ring_paper"))
    small = rb.sweep(scene, VARY, sample=f"latin:{CALIBRATED}")
    scenes = [small.point_scene(row) for row in range(CALIBRATED)]
    rb.calibrate(scenes[0])
    one = seconds(lambda: [rb.calibrate(each) for each in scenes]) / CALIBRATED
    for intervals in (False, True):
        for count in (designs // 4, designs):
            sample = f"latin:{count}"
            run = partial(rb.sweep, scene, VARY, sample=sample, intervals=intervals)
            spent = seconds(run) / count
            what = f"{count} designs, {'with' if intervals else 'without'} intervals"
            print(f"{what}: {1e3 * spent:.2f} ms each, calibrate takes {one / spent:.0f} times as long")


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 1000)
