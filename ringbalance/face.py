"""What a Python user calls, where it takes more than one room."""

from __future__ import annotations

from collections.abc import Collection
from typing import overload

from ringbalance.controller.compare import Comparison
from ringbalance.controller.compare import compare as run_comparison
from ringbalance.controller.eccentric_mass.run import simulate_eccentric
from ringbalance.controller.eccentric_mass.run_record import EccentricRun
from ringbalance.controller.loop import simulate as run_closed_loop
from ringbalance.controller.simulation import Simulation
from ringbalance.controller.tuning.tune import Tuning
from ringbalance.controller.tuning.tune import tune as tune_scene
from ringbalance.reduced_model.calibration import calibrate, calibrated_model
from ringbalance.reduced_model.law.model import BalancerModel, CompleteLaw
from ringbalance.scene import AnyScene, EccentricScene, Scene
from ringbalance.scene.narrowing import liquid_ring_scene


@overload
def simulate(
    scene: AnyScene, *, flow_law: CompleteLaw, modelled: Collection[str] | None = None
) -> Simulation: ...


@overload
def simulate(
    scene: Scene, *, flow_law: CompleteLaw | None = None, modelled: Collection[str] | None = None
) -> Simulation: ...


@overload
def simulate(scene: EccentricScene, *, flow_law: None = None, modelled: None = None) -> EccentricRun: ...


def simulate(
    scene: AnyScene, *, flow_law: CompleteLaw | None = None, modelled: Collection[str] | None = None
) -> Simulation | EccentricRun:
    """One closed-loop run of a scene's rotor: under a flow law, or with two eccentric masses.

    Args:
        scene: the scene, of either balancer.
        flow_law: the law, from `calibrate(scene).flow_law`, `paper_law(scene)` or `load_law(path)`; default
            the calibrated law of the scene. Eccentric masses have none.
        modelled: of "tube inertia", "gas filling" and "valve lag" those to model; default those whose
            estimated contribution is above the scene's tolerance.
    Raises: SceneError: a rotor too slow for the liquid to form a ring.
    Raises: ValueError: a flow law or terms for eccentric masses; terms that the scene or the law gives no
        numbers for.
    """
    if isinstance(scene, EccentricScene):
        if flow_law is not None:
            raise ValueError("eccentric masses have no flow law: leave flow_law out")
        if modelled is not None:
            raise ValueError("eccentric masses have no terms of a tube: leave modelled out")
        return simulate_eccentric(scene)
    law = calibrate(scene).flow_law if flow_law is None else flow_law
    return run_closed_loop(scene, BalancerModel.of(law), modelled=modelled)


def compare(first: AnyScene, second: AnyScene) -> Comparison:
    """Put two balancers on the rotor of the first scene, and let each balance it.

    Args: `first`: its rotor, vibration sensor and limit hold for both. `second`: only its balancer counts;
        liquid rings run under their calibrated laws.
    Raises: SceneError: a balancer that cannot work on that rotor.
    """
    return run_comparison(first, second, model_of=lambda scene: calibrated_model(scene))


def tune(scene: AnyScene, *, flow_law: CompleteLaw | None = None) -> Tuning:
    """Recommend the controller's gain, with its margins and the settling times under it.

    Raises: SceneError: a scene with eccentric masses, or a rotor too slow for the liquid to form a ring.
    """
    told = liquid_ring_scene(scene)
    return tune_scene(told, calibrated_model(told) if flow_law is None else BalancerModel.of(flow_law))
