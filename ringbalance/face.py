"""What a Python user calls: each function refuses a scene that was changed without its checks."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterator
from dataclasses import replace
from typing import Any, Protocol, overload

from ringbalance.controller.algorithms.algorithm import Controller
from ringbalance.controller.compare import Comparison
from ringbalance.controller.compare import compare as run_comparison
from ringbalance.controller.eccentric_mass.run import simulate_eccentric
from ringbalance.controller.eccentric_mass.run_record import EccentricRun
from ringbalance.controller.loop import Progress
from ringbalance.controller.loop import simulate as run_closed_loop
from ringbalance.controller.rotor import Sensor
from ringbalance.controller.simulation import Simulation
from ringbalance.controller.terms import can_carry
from ringbalance.controller.tuning.eccentric import EccentricTuning, tune_eccentric
from ringbalance.controller.tuning.tune import Tuning
from ringbalance.controller.tuning.tune import tune as tune_scene
from ringbalance.reduced_model.calibration import calibrate as calibrate_scene
from ringbalance.reduced_model.calibration import calibrated_model
from ringbalance.reduced_model.law.calibrated_law import CalibratedLaw
from ringbalance.reduced_model.law.completing import completed_model, lacking
from ringbalance.reduced_model.law.flow_law import Flow
from ringbalance.reduced_model.law.model import BalancerModel
from ringbalance.reduced_model.law.paper_law import PaperLaw
from ringbalance.reduced_model.terms import IN_INJECTIONS, NOT_MODELLED
from ringbalance.results.findings import Finding
from ringbalance.scene import AnyScene, EccentricScene, Scene
from ringbalance.scene.changes import checked_scene


class GivesVelocities(Protocol):
    """The least that a flow law of one's own has."""

    @property
    def evaluate(self) -> Callable[..., Flow]:
        """Flow for `fill_ratio`, `opposite_fill_ratio`, `gas_pressure` and `primed`, see `FlowLaw`."""
        ...


@overload
def simulate(
    scene: Scene,
    *,
    flow_law: GivesVelocities | None = None,
    controller: Controller[Any] | None = None,
    sensor: Sensor | None = None,
    progress: Progress | None = None,
    modelled: Collection[str] | None = None,
) -> Simulation: ...


@overload
def simulate(
    scene: EccentricScene,
    *,
    flow_law: None = None,
    controller: None = None,
    sensor: None = None,
    progress: Progress | None = None,
    modelled: None = None,
) -> EccentricRun: ...


@overload
def simulate(
    scene: AnyScene, *, flow_law: GivesVelocities, progress: Progress | None = None
) -> Simulation: ...


@overload
def simulate(scene: AnyScene, *, progress: Progress | None = None) -> Simulation | EccentricRun: ...


def simulate(
    scene: AnyScene,
    *,
    flow_law: GivesVelocities | None = None,
    controller: Controller[Any] | None = None,
    sensor: Sensor | None = None,
    progress: Progress | None = None,
    modelled: Collection[str] | None = None,
) -> Simulation | EccentricRun:
    """One closed-loop run of a scene's rotor: under a flow law, or with two eccentric masses.

    Args:
        scene: the scene, of either balancer; all but `progress` is for a liquid ring alone.
        flow_law: the law, from `calibrate(scene).flow_law`, `paper_law(scene)` or `load_law(path)`, or one of
            your own; what that lacks is the calibrated law's, and the status says so. Default the calibrated
            law.
        controller: an algorithm of your own, see `Controller`; default that of the scene.
        sensor: what the controller sees, called with the time, s, and the vibration, m, complex; default the
            scene's noise from the scene's seed.
        progress: called with the simulated time and the time limit, s.
        modelled: of "tube inertia", "gas filling", "valve lag" and "liquid held in the tube" those to model;
            default all that the scene gives numbers for.
    Raises: SceneError: a rotor too slow for the liquid to form a ring.
    Raises: ValueError: a law, an algorithm, a sensor or terms for eccentric masses; terms that the scene or
        the law gives no numbers for.
    """
    scene = checked_scene(scene)
    if isinstance(scene, EccentricScene):
        given = {"flow_law": flow_law, "controller": controller, "sensor": sensor, "modelled": modelled}
        if names := [name for name, value in given.items() if value is not None]:
            raise ValueError(f"eccentric masses have their own strategy: leave {', '.join(names)} out")
        return simulate_eccentric(scene, progress=progress)
    if controller is not None and not (hasattr(controller, "start") and hasattr(controller, "step")):
        raise TypeError(
            f"an algorithm has start() and step(state, measurement), which {controller!r} has not"
        )
    run = run_closed_loop(
        scene,
        _model_of(scene, flow_law),
        controller=controller,
        sensor=sensor,
        progress=progress,
        modelled=modelled,
    )
    return replace(run, findings=(*run.findings, *_of_own_law(scene, flow_law, run)))


def _model_of(scene: Scene, law: Any) -> BalancerModel:
    if law is None:
        return BalancerModel.of(calibrate_scene(scene).flow_law)
    if isinstance(law, CalibratedLaw | PaperLaw):
        return BalancerModel.of(law)
    return completed_model(law, by=calibrate_scene(scene).flow_law)


def _of_own_law(scene: Scene, law: object, run: Simulation) -> Iterator[Finding]:
    """What a run takes from elsewhere, or leaves out, because a law of the caller's own does not give it."""
    if law is None or isinstance(law, CalibratedLaw | PaperLaw):
        return
    rows = [row.term for row in run.models_used if row.term in IN_INJECTIONS and row.model == NOT_MODELLED]
    if names := lacking(law):
        yield Finding(code="own_law_lacks", values={"names": names})
    if rows and not can_carry(scene, run.model):
        yield Finding(code="own_law_without_forces", values={"terms": rows})


def compare(first: AnyScene, second: AnyScene) -> Comparison:
    """Put two balancers on the rotor of the first scene, and let each balance it.

    Args: `first`: its rotor, vibration sensor and limit hold for both. `second`: only its balancer counts;
        liquid rings run under their calibrated laws.
    Raises: SceneError: a balancer that cannot work on that rotor.
    """
    scenes = checked_scene(first), checked_scene(second)
    return run_comparison(*scenes, model_of=lambda scene: calibrated_model(scene))


@overload
def tune(
    scene: Scene, *, flow_law: GivesVelocities | None = None, progress: Callable[[str], None] | None = None
) -> Tuning: ...


@overload
def tune(
    scene: EccentricScene, *, flow_law: None = None, progress: Callable[[str], None] | None = None
) -> EccentricTuning: ...


@overload
def tune(scene: AnyScene, *, progress: Callable[[str], None] | None = None) -> Tuning | EccentricTuning: ...


def tune(
    scene: AnyScene,
    *,
    flow_law: GivesVelocities | None = None,
    progress: Callable[[str], None] | None = None,
) -> Tuning | EccentricTuning:
    """Recommend the controller's gain, with its margins and the settling times under it.

    Args: `flow_law`: as in `simulate`. `progress`: called with what is being done.
    Raises: SceneError: a rotor too slow for the liquid to form a ring.
    Raises: ValueError: a flow law for eccentric masses.
    """
    scene = checked_scene(scene)
    if not isinstance(scene, EccentricScene):
        model = calibrated_model(scene) if flow_law is None else _model_of(scene, flow_law)
        return tune_scene(scene, model, progress=progress)
    if flow_law is not None:
        raise ValueError("eccentric masses have no flow law: leave flow_law out")
    return tune_eccentric(scene, told=progress)
