"""Coverage over random discs; a heavy run."""

from __future__ import annotations

from collections.abc import Mapping
from functools import lru_cache
from typing import Final

from ringbalance.scene.arrays import FloatArray
from ringbalance.scene.models import Scene
from ringbalance.verification.coverage import QUANTITIES, Coverage, coverage, error_ratios, random_samples
from ringbalance.verification.evidence import Evidence, Found, Level, Table

_COUNT: Final = 240
_SEED: Final = 20
_NAMES: Final = ("volume", "wall_pressure", "moment", "lambda")
_FACTORS: Final = {None: 1.0, "half_widths_quartered": 0.25, "half_widths_padded": 100.0}


def compute(scene: Scene, level: Level, defect: str | None = None) -> Evidence:
    """Shares and medians over all samples."""
    results = coverage(ratios=_ratios(), width_factor=_FACTORS[defect])
    found: dict[str, Found] = {}
    for name, quantity in zip(_NAMES, QUANTITIES, strict=True):
        found[f"{name}_share"] = Found(value=results[quantity].share)
        found[f"{name}_tightness"] = Found(value=results[quantity].tightness)
    return Evidence(
        found=found,
        numbers={"samples": float(_COUNT), "worst": max(result.worst for result in results.values())},
        tables=(_table(results),),
    )


@lru_cache(maxsize=1)
def _ratios() -> FloatArray:
    return error_ratios(samples=random_samples(count=_COUNT, seed=_SEED))


def _table(results: Mapping[str, Coverage]) -> Table:
    return Table(
        name=f"{_COUNT} random discs, seed {_SEED}",
        columns={
            "quantity": [name.replace("_", " ") for name in results],
            "held": [result.share for result in results.values()],
            "median error over half-width": [result.tightness for result in results.values()],
            "largest error over half-width": [result.worst for result in results.values()],
            "not at round-off": [float(result.judged) for result in results.values()],
        },
    )
