"""The search for a design, for Python and as a command."""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import Executor
from functools import partial
from typing import TYPE_CHECKING

from ringbalance.design.design_rows import design_document, design_rows
from ringbalance.design.designing import Design, run_design
from ringbalance.design.in_place import beside_unchanged, keep_design, opens_valve, within_disc
from ringbalance.interface import checked
from ringbalance.results.result import Presentation
from ringbalance.scene import AnyScene
from ringbalance.scene.narrowing import liquid_ring_scene
from ringbalance.scene.registry import imported

if TYPE_CHECKING:
    from ringbalance.design.mass_design import MassDesign


@checked
def find_design(
    scene: AnyScene,
    *,
    in_place: bool = False,
    executor: Executor | None = None,
    workers: int = 1,
    progress: Callable[[str], None] | None = None,
) -> Design | MassDesign:
    """Design what a scene's table [design] leaves open: the smallest disc that meets [requirement].

    Of eccentric masses the lightest, with guide radius, gear and motor (`MassDesign`).

    Args: `in_place`: True to keep the disc's size and choose bore, pressure, siphon crest, gas hole and valve
        alone, within what [design] states or usual ranges; a report then shows the answer. `executor`: any
        `concurrent.futures.Executor`; default `workers` processes of its own. `progress`: called with the
        present step.
    Returns: The design, judged on drawn devices as `tune` judges; where none meets the requirement, the
        nearest one, and the reasons.
    Raises: SceneError: a scene that cannot be used, or that leaves nothing to choose.

    Example:
        >>> scene = rb.load_scene(rb.bundled_scene("spindle_design"))
        >>> design = rb.find_design(scene, workers=2)
        >>> design.judgement.verdict
        'met'
    """
    if scene.balancer == "eccentric_mass" and not in_place:
        design_masses: Callable[..., MassDesign] = imported("ringbalance.design.mass_design:design_masses")
        return design_masses(scene, executor=executor, workers=workers, progress=progress)
    run = partial(
        run_design,
        presentation=Presentation(document=design_document, rows=design_rows),
        executor=executor,
        workers=workers,
        progress=progress,
    )
    if not in_place:
        return run(scene)
    ring = liquid_ring_scene(scene)
    design = run(within_disc(ring))
    if not design.succeeded and ring.gas.conductance is not None and opens_valve(ring):
        # The scene's own valve stays where it suffices.
        other = run(within_disc(ring, other_valves=True))
        design = other if other.succeeded else design
    if design.judgement is None:
        return design
    keep_design(scene, design)
    return beside_unchanged(ring, design)
