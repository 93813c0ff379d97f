"""The command `ringbalance simulate`."""

from __future__ import annotations

import json as json_format
from pathlib import Path

from rich.console import Console
from rich.progress import BarColumn, Progress, TaskProgressColumn, TextColumn

from ringbalance.controller.document import simulation_document
from ringbalance.controller.eccentric.document import eccentric_document
from ringbalance.controller.eccentric.run import simulate_eccentric
from ringbalance.controller.eccentric.run_record import EccentricRun
from ringbalance.controller.eccentric.show import show_eccentric
from ringbalance.controller.loop import simulate as run_loop
from ringbalance.controller.show import show
from ringbalance.controller.simulation import Simulation
from ringbalance.reduced_model.calibration import calibrate
from ringbalance.reduced_model.loading import load_model
from ringbalance.reduced_model.model import BalancerModel
from ringbalance.reduced_model.paper_law import paper_model
from ringbalance.scene.eccentric_models import EccentricScene
from ringbalance.scene.loader import load_scene
from ringbalance.scene.models import Scene

SETTLED = 0
NOT_SETTLED = 1


def simulate(scene: Path, *, law: str = "calibrated", json: bool = False) -> int:
    """Run one closed-loop balancing of a scene.

    Args:
        scene: the scene file.
        law: "calibrated", "paper", or a file written by `ringbalance calibrate --save`; driven masses have
            none.
        json: print one JSON document instead of tables.

    Returns:
        Exit code: 0 settled, 1 not settled; the result is printed either way.

    Raises:
        SceneError: a scene or a law that cannot be used.
    """
    told = load_scene(scene)
    progress = Console(stderr=True)
    if isinstance(told, EccentricScene):
        return _driven_masses(told, progress, json=json)
    with progress.status(f"flow law: {law} ..."):
        model = _model(told, law)
    found = _run(told, model, progress)
    if json:
        print(json_format.dumps(simulation_document(found), allow_nan=False))
    else:
        show(found, console=Console())
    return SETTLED if found.settled else NOT_SETTLED


def _driven_masses(scene: EccentricScene, progress: Console, *, json: bool) -> int:
    found = _run_driven(scene, progress)
    if json:
        print(json_format.dumps(eccentric_document(found), allow_nan=False))
    else:
        show_eccentric(found, console=Console())
    return SETTLED if found.settled else NOT_SETTLED


def _run_driven(scene: EccentricScene, console: Console) -> EccentricRun:
    columns = (TextColumn("{task.description}"), BarColumn(), TaskProgressColumn())
    with Progress(*columns, console=console, transient=True) as bar:
        # The first run on a machine compiles for about a minute; later ones take the code that is kept.
        task = bar.add_task("closed loop (the first run compiles)", total=scene.run.time_limit)
        return simulate_eccentric(scene, progress=lambda time, _: bar.update(task, completed=time))


def _model(scene: Scene, law: str) -> BalancerModel:
    if law == "calibrated":
        return calibrate(scene).model
    return paper_model(scene) if law == "paper" else load_model(Path(law))


def _run(scene: Scene, model: BalancerModel, console: Console) -> Simulation:
    columns = (TextColumn("closed loop"), BarColumn(), TaskProgressColumn())
    with Progress(*columns, console=console, transient=True) as bar:
        task = bar.add_task("closed loop", total=scene.run.time_limit)
        return run_loop(scene, model, progress=lambda time, _: bar.update(task, completed=time))
