"""The search for a design, for Python and as a command."""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import Executor

from ringbalance.design.design_rows import design_document, design_rows
from ringbalance.design.designing import Design, run_design
from ringbalance.interface import checked
from ringbalance.results.result import Presentation
from ringbalance.scene import AnyScene


@checked
def find_design(
    scene: AnyScene,
    *,
    executor: Executor | None = None,
    workers: int = 1,
    progress: Callable[[str], None] | None = None,
) -> Design:
    """Design what a scene's table [design] leaves open: the smallest disc that meets [requirement].

    Args: `executor`: any `concurrent.futures.Executor`; default `workers` processes of its own. `progress`:
        called with the present step.
    Returns: The design, judged on drawn devices as `tune` judges; where none meets the requirement, the
        nearest one, and the reasons.
    Raises: SceneError: a scene that cannot be used, or that leaves nothing to choose.

    Example:
        >>> scene = rb.load_scene(rb.bundled_scene("spindle_design"))
        >>> design = rb.find_design(scene, workers=2)
        >>> design.judgement.verdict
        'met'
    """
    return run_design(
        scene,
        presentation=Presentation(document=design_document, rows=design_rows),
        executor=executor,
        workers=workers,
        progress=progress,
    )
