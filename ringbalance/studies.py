"""Verification for Python, and the commands of its studies: trade, extremes and cases."""

from __future__ import annotations

import os
from collections.abc import Callable
from contextlib import nullcontext
from json import dumps
from types import SimpleNamespace
from typing import Final

from ringbalance.interface import checked, print_result
from ringbalance.scene import AnyScene, load_scene
from ringbalance.scene.narrowing import liquid_ring_scene
from ringbalance.scene.platform.files import staged, write_whole
from ringbalance.scene.platform.terminal import activity, print_message
from ringbalance.verification.evidence import Level
from ringbalance.verification.extremes.study import SIZES, Extremes, check_sector, find_extremes
from ringbalance.verification.runner import run_cases as run_scene_cases
from ringbalance.verification.trade import TradeStudy, trade_study

_EXTREMES: Final = "extremes.json"


@checked
def trade(
    scene: AnyScene, *, level: Level = "heavy", progress: Callable[[str], None] | None = None
) -> TradeStudy:
    """Measure speed against accuracy on a scene: designs per second and error of every model.

    Args: `level`: "light" leaves out the meshes in three dimensions. `progress`: called with each title.
    Raises: SceneError: a scene that cannot be used.

    Example:
        >>> scene = rb.load_scene(rb.bundled_scene("liquid_ring_paper"))
        >>> study = rb.trade(scene, level="light")
        >>> len(study.to_dict()["models_used"]) > 10
        True
    """
    return trade_study(liquid_ring_scene(scene), level=level, progress=progress)


@checked
def extremes(
    scene: AnyScene,
    *,
    level: Level = "light",
    workers: int = 1,
    progress: Callable[[str, int, int], None] | None = None,
) -> Extremes:
    """Find the limits of validity of a scene: where results stop, what is reported beyond, and whether the
    invariants hold inside.

    Args: `level`: "heavy" judges thousands of points. `workers`: processes. `progress`: called with what is
        being done, the points done and their number.
    Raises: SceneError: a scene that cannot be used, or whose chamber is imported.

    Example:
        >>> scene = rb.load_scene(rb.bundled_scene("liquid_ring_paper"))
        >>> study = rb.extremes(scene)
        >>> study.to_dict()["violations"]
        []
    """
    return find_extremes(liquid_ring_scene(scene), size=SIZES[level], workers=workers, progress=progress)


def extremes_file(options: SimpleNamespace) -> int:
    """Run the command `extremes`. Returns: Exit code: 1 when an invariant was violated."""
    scene = liquid_ring_scene(load_scene(options.scene))
    check_sector(scene)
    with nullcontext() if options.out is None else staged(options.out, files=(_EXTREMES,)) as stage:
        with activity("extremes", "axes") as shown:
            study = find_extremes(
                scene,
                size=SIZES[options.level],
                workers=options.workers or min(2, os.cpu_count() or 1),
                progress=lambda what, done, number: shown.show(
                    f"{what}: {done} of {number} points", done=done, total=number
                ),
                folder=None if options.out is None else options.out / "store",
            )
        if stage is not None:
            write_whole(stage / _EXTREMES, dumps(study.to_dict(), allow_nan=False) + "\n")
    if options.out is not None:
        print_message(f"written to {options.out}")
    print_result(study, json=options.json, headline=False)
    return 1 if study.broken() else 0


run_cases = checked(run_scene_cases, module=__name__)
