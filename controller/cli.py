"""The command `ringbalance simulate`."""

from __future__ import annotations

import json as json_format
from collections.abc import Callable
from pathlib import Path

from ringbalance.controller.document import simulation_document
from ringbalance.controller.eccentric_mass.document import eccentric_document
from ringbalance.controller.eccentric_mass.run import simulate_eccentric
from ringbalance.controller.eccentric_mass.show import show_eccentric
from ringbalance.controller.loop import simulate as run_loop
from ringbalance.controller.show import show
from ringbalance.reduced_model.law_by_name import law_by_name
from ringbalance.scene.accuracy import Models, with_tolerance
from ringbalance.scene.eccentric_models import EccentricScene
from ringbalance.scene.loader import load_scene
from ringbalance.scene.platform.progress import Activity, activity
from ringbalance.scene.platform.terminal import results_console

SETTLED = 0
NOT_SETTLED = 1


def simulate(
    scene: Path,
    *,
    law: str = "calibrated",
    json: bool = False,
    tolerance: str | None = None,
    models: Models | None = None,
) -> int:
    """Run one closed-loop balancing of a scene.

    Args:
        scene: the scene file.
        law: "calibrated", "paper", or a file written by `ringbalance calibrate --save`; eccentric masses have
            none.
        json: print one JSON document instead of tables.
        tolerance: in place of the scene's, such as "0.5 %" or 0.005.
        models: "finest" models every term that has a model, whatever the tolerance.

    Returns:
        Exit code: 0 settled, 1 not settled; the result is printed either way.

    Raises:
        SceneError: a scene or a law that cannot be used.
    """
    told = with_tolerance(load_scene(scene), tolerance=tolerance, models=models)
    if isinstance(told, EccentricScene):
        return _eccentric_masses(told, json=json)
    with activity("simulate", f"flow law: {law} ...") as shown:
        found = run_loop(told, law_by_name(told, law), progress=_clock(shown))
    if json:
        print(json_format.dumps(simulation_document(found), allow_nan=False))
    else:
        show(found, console=results_console())
    return SETTLED if found.settled else NOT_SETTLED


def _eccentric_masses(scene: EccentricScene, *, json: bool) -> int:
    # The first run on a machine compiles for about a minute; later ones take the code that is kept.
    with activity("simulate", "closed loop (the first run compiles)") as shown:
        found = simulate_eccentric(scene, progress=_clock(shown))
    if json:
        print(json_format.dumps(eccentric_document(found), allow_nan=False))
    else:
        show_eccentric(found, console=results_console())
    return SETTLED if found.settled else NOT_SETTLED


def _clock(shown: Activity) -> Callable[[float, float], None]:
    """Shows the simulated time, s, of the time limit, s."""
    return lambda time, limit: shown.show(f"{time:.1f} s of {limit:g} s simulated", done=time, total=limit)
