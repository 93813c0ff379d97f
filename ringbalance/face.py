"""What a Python user calls, where it takes more than one room."""

from __future__ import annotations

from typing import overload

from ringbalance.controller import Simulation
from ringbalance.controller import simulate as run_closed_loop
from ringbalance.controller.compare import Comparison
from ringbalance.controller.compare import compare as run_comparison
from ringbalance.controller.eccentric.run import simulate_eccentric
from ringbalance.controller.eccentric.run_record import EccentricRun
from ringbalance.reduced_model import CompleteLaw, balancer_model, calibrate
from ringbalance.scene import AnyScene, EccentricScene, Scene


@overload
def simulate(scene: AnyScene, *, flow_law: CompleteLaw) -> Simulation: ...


@overload
def simulate(scene: Scene, *, flow_law: CompleteLaw | None = None) -> Simulation: ...


@overload
def simulate(scene: EccentricScene, *, flow_law: None = None) -> EccentricRun: ...


def simulate(scene: AnyScene, *, flow_law: CompleteLaw | None = None) -> Simulation | EccentricRun:
    """One closed-loop run of a scene's rotor: under a flow law, or with two driven masses.

    Args:
        scene: the scene, of either balancer.
        flow_law: the law, from `calibrate(scene).flow_law`, `paper_law(scene)` or `load_law(path)`;
            default the calibrated law of the scene.  Driven masses have none.

    Returns:
        Simulation, or EccentricRun of a scene with driven masses.

    Raises:
        SceneError: a rotor too slow for the liquid to form a ring.
        ValueError: a flow law for driven masses.
    """
    if isinstance(scene, EccentricScene):
        if flow_law is not None:
            raise ValueError("driven masses have no flow law: leave flow_law out")
        return simulate_eccentric(scene)
    law = calibrate(scene).flow_law if flow_law is None else flow_law
    return run_closed_loop(scene, balancer_model(law))


def compare(first: AnyScene, second: AnyScene) -> Comparison:
    """Put two balancers on the rotor of the first scene, and let each balance it.

    Args:
        first: its rotor, vibration sensor and limit hold for both.
        second: only its balancer counts; liquid rings run under their calibrated laws.

    Returns:
        Comparison.

    Raises:
        SceneError: a balancer that cannot work on that rotor.
    """
    return run_comparison(first, second, model_of=lambda scene: calibrate(scene).model)
