"""Time of the law at one point, and per point of arrays, beside scipy's cubic pieces that invert one head.

`python benchmarks/law_points.py`: microseconds of processor time a point. scipy's time is the least of a
user's own law: one velocity from one head, without chambers, regimes and half-widths.
"""

from __future__ import annotations

import time
from collections.abc import Callable

import numpy as np
from rich.console import Console
from rich.table import Table
from scipy.interpolate import CubicHermiteSpline, PchipInterpolator

from ringbalance.reduced_model.calibration import calibrated_model
from ringbalance.reduced_model.law.calibrated_law import CalibratedLaw
from ringbalance.reduced_model.tube.heads import velocities_of
from ringbalance.scene.loader import bundled_scene, load_scene
from ringbalance.scene.narrowing import liquid_ring_scene

MANY = 100_000


def seconds(call: Callable[[], object], *, times: int) -> float:
    """Processor time of one call, s, the smallest of five rounds."""
    call()
    durations = []
    for _ in range(5):
        start = time.process_time()
        for _ in range(times):
            call()
        durations.append((time.process_time() - start) / times)
    return min(durations)


def main() -> None:
    """Print the table."""
    law = calibrated_model(liquid_ring_scene(load_scene(bundled_scene("liquid_ring_paper")))).flow
    assert isinstance(law, CalibratedLaw)
    table = law.heads.siphon
    hermite = CubicHermiteSpline(table.knots, table.column(0), table.column(1))
    pchip = PchipInterpolator(np.log(table.knots), np.log(velocities_of(table)))
    x = np.random.default_rng(1).uniform(0.0, law.max_fill_ratio, MANY)
    root = np.random.default_rng(2).uniform(table.knots[0], table.knots[-1], MANY)
    ways: dict[str, Callable[..., object]] = {
        "evaluate": lambda fill, _: law.evaluate(fill_ratio=fill, gas_pressure=0.7e6),
        "CubicHermiteSpline": lambda _, s: s**4 * hermite(s),
        "PchipInterpolator": lambda _, s: np.exp(pchip(np.log(s))),
    }
    shown = Table("", "one point, us", "in an array, us")
    for name, call in ways.items():
        single = seconds(lambda call=call: call(0.25, 2.0), times=2000)  # type: ignore[misc]
        many = seconds(lambda call=call: call(x, root), times=5)  # type: ignore[misc]
        shown.add_row(name, f"{1e6 * single:.1f}", f"{1e6 * many / MANY:.3f}")
    Console().print(shown)


if __name__ == "__main__":
    main()
