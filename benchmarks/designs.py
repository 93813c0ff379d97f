"""Rate of designs in batches of growing size, compared with one design at a time in the same run.

`python benchmarks/designs.py`; with `--json` for a program.
"""

from __future__ import annotations

import argparse
import json
import sys
import time
from collections.abc import Callable
from dataclasses import asdict, dataclass
from functools import partial
from typing import Any, cast

import numpy as np
from rich.console import Console
from rich.table import Table

from ringbalance.reduced_model.core import Answers
from ringbalance.scene.designs import Designs
from ringbalance.scene.loader import bundled_scene, load_scene
from ringbalance.scene.models import Scene

SIZES = (1, 10, 100, 1000, 10_000, 50_000)
SINGLE = 30
"""Number of designs evaluated one at a time."""
SIDED = 500
"""Number of designs evaluated with both sides of their inputs."""


@dataclass(frozen=True, kw_only=True)
class Rate:
    """Size of one batch and its rate."""

    designs: int
    processor_seconds: float
    designs_per_second: float


def drawn(scene: Scene, count: int, *, seed: int = 0) -> Designs:
    """Random designs: radii 30 to 150 mm, rims at 15 to 90 m/s, gas at 0.9 to 2.5 times the lift."""
    random = np.random.default_rng(seed)
    outer = np.exp(random.uniform(np.log(0.03), np.log(0.15), count))
    port = outer * random.uniform(0.97, 1.0, count)
    hump = np.minimum(outer * random.uniform(0.6, 0.85, count), 0.98 * port)
    speed = np.exp(random.uniform(np.log(15), np.log(90), count)) / outer
    density = random.uniform(800, 1900, count)
    lift = density * speed**2 * (outer**2 - hump**2) / 2
    return Designs.of(
        scene,
        {
            "disc.outer_radius": outer,
            "disc.inner_radius": outer * random.uniform(0.4, 0.75, count),
            "disc.axial_width": outer * random.uniform(0.3, 1.5, count),
            "disc.plate_thickness": outer * random.uniform(0.0, 0.06, count),
            "disc.max_fill_ratio": random.uniform(0.3, 0.8, count),
            "liquid.density": density,
            "liquid.kinematic_viscosity": np.exp(random.uniform(np.log(0.5e-6), np.log(60e-6), count)),
            "tube.bore": np.exp(random.uniform(np.log(0.8e-3), np.log(4e-3), count)),
            "tube.port_radius": port,
            "tube.hump_radius": hump,
            "tube.hump_position": random.uniform(0.4, 0.6, count),
            "tube.length": outer * random.uniform(4.0, 6.0, count),
            "tube.roughness": np.exp(random.uniform(np.log(0.3e-6), np.log(10e-6), count)),
            "rotor.speed": speed,
            "gas.pressure": lift * random.uniform(0.9, 2.5, count),
        },
    )


def seconds(function: Callable[[], object]) -> float:
    """Processor time of the faster of two calls."""
    results = []
    for _ in range(2):
        start = time.process_time()
        function()
        results.append(time.process_time() - start)
    return min(results)


def with_sides(designs: Designs, step: float = 0.01) -> Designs:
    """Each design with both sides of each of the m numbers that differ between designs: 2 m + 1 rows each."""
    keys = [(table, key) for table, names in designs.varied.items() for key in names]
    values = {}
    for index, (table, key) in enumerate(keys):
        factors = np.ones((2 * len(keys) + 1, 1))
        factors[2 * index + 1 : 2 * index + 3] += np.array([[-step], [step]])
        values[f"{table}.{key}"] = (factors * getattr(getattr(designs.scene, table), key)).ravel()
    return Designs.of(designs.scene, values)


def measured(scene: Scene) -> dict[str, Any]:
    """Rates by size, of one row at a time, and of designs with both sides of all their inputs."""
    designs = drawn(scene, max(SIZES))
    Answers.of(designs.take(np.arange(1)))
    rates = []
    for size in SIZES:
        used = seconds(partial(Answers.of, designs.take(np.arange(size))))
        rates.append(Rate(designs=size, processor_seconds=used, designs_per_second=size / used))
    rows = [designs.take(np.array([row])) for row in range(SINGLE)]
    single = SINGLE / seconds(lambda: [Answers.of(row) for row in rows])
    sides = with_sides(designs.take(np.arange(SIDED)))
    return {
        "growth": [asdict(rate) for rate in rates],
        "one_row_at_a_time_per_second": single,
        "ratio": rates[-1].designs_per_second / single,
        "rows_with_sides": sides.size // SIDED,
        "with_sides_per_second": SIDED / seconds(partial(Answers.of, sides)),
    }


def main() -> int:
    """Measure on the liquid-ring paper's disc and print."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--json", action="store_true", help="print a document")
    results = measured(cast("Scene", load_scene(bundled_scene("liquid_ring_paper"))))
    if parser.parse_args().json:
        sys.stdout.write(json.dumps(results, indent=1) + "\n")
        return 0
    table = Table("designs", "processor time, s", "designs a second")
    for rate in results["growth"]:
        numbers = rate["designs"], rate["processor_seconds"], rate["designs_per_second"]
        table.add_row(f"{numbers[0]}", f"{numbers[1]:.3g}", f"{numbers[2]:.3g}")
    console = Console()
    console.print(table)
    console.print(
        f"one row at a time {results['one_row_at_a_time_per_second']:.3g} a second: the batch does "
        f"{results['ratio']:.3g} times as many"
    )
    console.print(
        f"with both sides of all inputs, {results['rows_with_sides']} rows a design: "
        f"{results['with_sides_per_second']:.3g} designs a second"
    )
    return 0


if __name__ == "__main__":
    sys.exit(main())
