"""The command `ringbalance compare`."""

from __future__ import annotations

import cmath
import json as json_format
import math
from pathlib import Path
from typing import Final

from rich.console import Console
from rich.table import Table

from ringbalance.controller.balancer import balancer_of, takes
from ringbalance.controller.compare import Comparison, Side
from ringbalance.controller.compare import compare as compare_balancers
from ringbalance.controller.tuning.dead_time import offset_text
from ringbalance.scene.describe import in_usual_unit, usual_unit
from ringbalance.scene.loader import load_scene
from ringbalance.scene.narrowing import Models, with_tolerance
from ringbalance.scene.platform.terminal import activity, results_console

SETTLED = 0
NOT_SETTLED = 1
_OFFSETS: Final = "controller.gas_time_offset."
_UNITS: Final = {
    "controller.proportional": ("s/um", 1e-6),
    "friction_filter.drive_speed": ("rpm", 30 / math.pi),
    "friction_filter.pair_gain": ("V/rad", 1.0),
    "friction_filter.speed_gain": ("V*s/rad", 1.0),
    "lqr.state_weight": ("", 1.0),
}
"""Of the keys that tuning may change: the usual unit in scene files, and how many of it one in SI is."""


def compare(
    first: Path,
    second: Path,
    *,
    law: str = "calibrated",
    json: bool = False,
    tolerance: str | None = None,
    models: Models | None = None,
) -> int:
    """Run two balancers, both tuned, on one rotor: that of the first scene, over one span and several seeds.

    Args:
        first: a scene file; its rotor, vibration sensor and limit hold for both.
        second: another scene file; only its balancer counts.
        law: of a liquid ring: "calibrated", "paper", or a file written by `ringbalance calibrate --save`.
        json: print one JSON document instead of a table.
        tolerance: in place of that of both scenes, such as "0.5 %" or 0.005.
        models: "finest" takes the finest of all that is expensive, as at a tolerance of zero.

    Returns:
        Exit code: 0 both settled, 1 not both; the result is printed either way.

    Raises:
        SceneError: a scene that cannot be used, or a balancer that cannot work on that rotor.
    """
    one, other = (
        balancer_of(scene, flow_law=law if takes(scene, "flow_law") else None)
        for path in (first, second)
        for scene in [with_tolerance(load_scene(path), tolerance=tolerance, models=models)]
    )
    with activity("compare", "both balancers on one rotor ..."):
        found = compare_balancers(one, other)
    if json:
        print(json_format.dumps(found.document(), allow_nan=False))
    else:
        _show(found, results_console())
    return SETTLED if all(side.settled for side in found.sides) else NOT_SETTLED


def _show(comparison: Comparison, console: Console) -> None:
    rotor = comparison.rotor
    lag = math.degrees(-cmath.phase(rotor.influence))
    console.print(
        f"rotor of {rotor.source}: {rotor.speed * 30 / math.pi:.6g} rpm, "
        f"{abs(rotor.influence):.4g} um/(g*mm) at a lag of {lag:.4g} deg, "
        f"{1e6 * rotor.amplitude:.4g} um before balancing, limit {1e6 * rotor.limit:.4g} um; "
        f"over {comparison.span:.4g} s, medians (smallest to largest)",
        highlight=False,
    )
    names = [side.scene.name for side in comparison.sides]
    table = Table("", *(names if len(set(names)) > 1 else [side.scene.source for side in comparison.sides]))
    rows = {
        "balancer": [side.scene.balancer.replace("_", " ") for side in comparison.sides],
        "tuned": [_tuned_text(side) for side in comparison.sides],
        "settled": [_settled(side) for side in comparison.sides],
        "time to the limit": [_cell(side, "time", 1.0, "s") for side in comparison.sides],
        "left over": [_cell(side, "residual_ratio", 100.0, "%") for side in comparison.sides],
        "energy": [_cell(side, "energy", 1.0, "J") for side in comparison.sides],
        "worst on the way": [_cell(side, "worst_amplitude", 1e6, "um") for side in comparison.sides],
    }
    for name, cells in rows.items():
        table.add_row(name, *cells)
    console.print(table)
    for side in comparison.sides:
        console.print(f"{side.scene.source}: {side.status}", markup=False, highlight=False)


def _cell(side: Side, name: str, factor: float, unit: str) -> str:
    """Median, and in brackets the smallest and the largest of the runs."""
    low, high = side.ends(name)

    def shown(value: float) -> str:
        return f"{factor * value:.4g}" if math.isfinite(value) else "not settled"

    middle = side.middle(name)
    text = f"{shown(middle)} {unit}" if math.isfinite(middle) else shown(middle)
    return text if low == high else f"{text} ({shown(low)} to {shown(high)})"


def _settled(side: Side) -> str:
    return f"{sum(math.isfinite(r.time) for r in side.results)} of {len(side.results)} runs"


def _tuned_text(side: Side) -> str:
    """What tuning has changed, as a scene file has it."""
    told = [_written(key, value) for key, value in side.tuned.items() if not key.startswith(_OFFSETS)]
    if offsets := [value for key, value in side.tuned.items() if key.startswith(_OFFSETS)]:
        told.append(offset_text(offsets))
    return ", ".join(told) or "as it is"


def _written(key: str, value: float) -> str:
    unit, factor = _UNITS.get(key) or (usual_unit(key), in_usual_unit(key, 1.0))
    return f'{key} = "{factor * value:.4g} {unit}"' if unit else f"{key} = {value:.4g}"
