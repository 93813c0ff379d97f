"""What a Python user calls, where it takes more than one room."""

from __future__ import annotations

from ringbalance.controller import Simulation
from ringbalance.controller import simulate as run_closed_loop
from ringbalance.reduced_model import CompleteLaw, balancer_model, calibrate
from ringbalance.scene import AnyScene, liquid_ring_scene


def simulate(scene: AnyScene, *, flow_law: CompleteLaw | None = None) -> Simulation:
    """One closed-loop run of a scene's rotor under a flow law.

    Args:
        scene: the scene.
        flow_law: the law, from `calibrate(scene).flow_law`, `paper_law(scene)` or `load_law(path)`;
            default the calibrated law of the scene.

    Returns:
        Simulation.

    Raises:
        SceneError: a rotor too slow for the liquid to form a ring, or a balancer without liquid.
    """
    told = liquid_ring_scene(scene)
    law = calibrate(told).flow_law if flow_law is None else flow_law
    return run_closed_loop(told, balancer_model(law))
