"""A sweep against loops of calibrations and simulations, its growth with its size, and a thousand workers on
paper.

python benchmarks/sweep.py [DESIGNS]
"""

from __future__ import annotations

import heapq
import sys
import time
from collections.abc import Callable
from functools import partial

import ringbalance as rb
from ringbalance.design.work import CALL, bundle_size
from ringbalance.scene import AnyScene

CALIBRATED = 20
DRIVEN, RUNS = 20, 200
"""Designs that are run, and devices of each at most."""
SIMULATED = 5
"""Designs that are simulated one by one, a run each."""
VARY = {"tube.bore": "0.7mm:2.5mm", "rotor.speed": "5000rpm:7000rpm", "gas.pressure": "0.5MPa:1MPa"}


def seconds(call: Callable[[], object]) -> float:
    """Processor time."""
    start = time.process_time()
    call()
    return time.process_time() - start


def on_paper(workers: int, *, designs: int, each: float) -> float:
    """Share of the workers' time that goes into designs, if one process sends and takes all bundles.

    Args: `each`: s, that a design takes.
    """
    size = bundle_size(each, count=designs, workers=workers)
    free, caller = [0.0] * workers, 0.0
    for start in range(0, designs, size):
        caller = max(caller, heapq.heappop(free)) + CALL
        heapq.heappush(free, caller + min(size, designs - start) * each)
    return designs * each / (workers * max(free))


def with_runs(scene: AnyScene, small: rb.Sweep) -> float:
    """Print what a design with runs takes, beside as many calls of `rb.simulate`. Returns: the first, s."""
    points, devices, ran = small.points[:DRIVEN], 0, []
    rb.objective(scene, points[0], runs=1)
    for point in points:
        start = time.process_time()
        devices += rb.objective(scene, point, runs=RUNS)["devices"]
        ran.append(time.process_time() - start)
    each = sum(ran) / DRIVEN
    print(f"up to {RUNS} devices each: {each:.3f} s, from {min(ran):.3f} to {max(ran):.3f} s")
    rb.simulate(small.point_scene(0))
    alone = seconds(lambda: [rb.simulate(small.point_scene(row)) for row in range(SIMULATED)]) / SIMULATED
    loop = alone * devices / DRIVEN
    print(f"simulate: {1e3 * alone:.0f} ms a run; as many one by one take {loop / each:.0f} times as long")
    return each


def main(designs: int) -> None:
    """Print times a design, and the ratios."""
    scene = rb.load_scene(rb.bundled_scene("liquid_ring_paper"))
    small = rb.sweep(scene, VARY, sample=f"latin:{CALIBRATED}")
    scenes = [small.point_scene(row) for row in range(CALIBRATED)]
    rb.calibrate(scenes[0])
    one = seconds(lambda: [rb.calibrate(each) for each in scenes]) / CALIBRATED
    print(f"calibrate: {1e3 * one:.0f} ms each")
    for intervals, sizes in ((False, (1, 4, 16, 64)), (True, (1, 4, 8))):
        for count in (designs * size // 8 for size in sizes):
            run = partial(rb.sweep, scene, VARY, sample=f"latin:{count}", intervals=intervals)
            spent = seconds(run) / count
            what = f"{count} designs, {'with' if intervals else 'without'} intervals"
            print(f"{what}: {1e3 * spent:.2f} ms each, calibrate takes {one / spent:.0f} times as long")
    each = with_runs(scene, small)
    for workers in (10, 100, 1000):
        for count in (1000, 10_000, 100_000):
            share = on_paper(workers, designs=count, each=each)
            print(f"{workers} workers on paper, {count} designs with runs: {share:.0%} of their time is used")


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 1000)
