"""Simulation, comparison, tuning and checks of a balancer, for Python and as commands.

Unchecked changes of a scene are refused.
"""

from __future__ import annotations

from collections.abc import Callable, Collection
from dataclasses import replace
from json import dumps
from types import SimpleNamespace
from typing import Any, Literal, Protocol, cast, overload

from ringbalance.controller.algorithms.algorithm import Controller
from ringbalance.controller.balancer import AS_GIVEN, Progress, balancer_of, takes
from ringbalance.controller.balancer_checks import CHECKS, BalancerChecks, problems_of
from ringbalance.controller.compare import Comparison
from ringbalance.controller.compare import compare as run_comparison
from ringbalance.controller.eccentric_mass.run_record import EccentricRun
from ringbalance.controller.eccentric_mass.scene_records import EccentricScene
from ringbalance.controller.judging.tune import tuned
from ringbalance.controller.judging.tuning import Tuning
from ringbalance.controller.rotor import Sensor
from ringbalance.controller.simulation import Simulation
from ringbalance.interface import checked, law_for, opened
from ringbalance.reduced_model.law.flow_law import Flow
from ringbalance.results.result import csv_text, print_rows
from ringbalance.scene import AnyScene, Scene, scene_from
from ringbalance.scene.faults import COMMAND_LINE, SceneError
from ringbalance.scene.kinds import scene_kind
from ringbalance.scene.loader import balancer_name
from ringbalance.scene.platform.files import write_whole
from ringbalance.scene.platform.terminal import activity
from ringbalance.scene.registry import registered


class GivesVelocities(Protocol):
    """The methods that a user's own flow law must have."""

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


@checked
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
        sensor: measured vibration, called with the time, s, and the vibration, m, complex, which
            includes the scene's runout; default the scene's noise from the scene's seed.
        progress: called with the simulated time and the time limit, s.
        modelled: of "tube inertia", "gas filling", "valve lag" and "liquid held in the tube" those to model;
            default all that the scene gives numbers for.
    Raises: SceneError: a rotor too slow for the liquid to form a ring.
    Raises: ValueError: a law, an algorithm, a sensor or terms for eccentric masses; terms that the scene or
        the law gives no numbers for.

    Example:
        >>> scene = rb.load_scene(rb.bundled_scene("liquid_ring_paper"))
        >>> run = rb.simulate(scene)
        >>> run.settled
        True
    """
    balancer = balancer_of(scene, flow_law=flow_law, controller=controller, sensor=sensor, modelled=modelled)
    run = balancer.run({}, AS_GIVEN, trace=True, progress=progress).traced[0].run
    return cast("Simulation | EccentricRun", run)


def simulate_file(options: SimpleNamespace) -> int:
    """Run the command `simulate`. Returns: Exit code: 0 settled, with all that the scene requires."""
    scene = opened(options.scene, options.tolerance)
    if options.seed is not None:
        scene = replace(scene, run=replace(scene.run, seed=options.seed))
    balancer = balancer_of(scene, flow_law=law_for(scene, options.law))
    with activity("simulate", "closed loop ...") as shown:

        def show(time: float, limit: float) -> None:
            shown.show(f"{time:.1f} s of {limit:g} s simulated", done=time, total=limit)

        outcomes = balancer.run({}, AS_GIVEN, trace=True, progress=show)
        run, met = outcomes.traced[0].run, all(each.met(outcomes).all() for each in balancer.demands())
        document = run.to_dict() if options.json else {}
        sheet = ""
        if options.plot is not None:
            # Loading the modules that draw takes as long as a short run.
            sheet = registered("function", "sheet")(registered("function", "figures_of")(scene, run))
    if options.csv is not None:
        write_whole(options.csv, csv_text(balancer.history(run)))
    if options.plot is not None:
        write_whole(options.plot, sheet)
    if options.json:
        print(dumps(document, allow_nan=False))
    else:
        print_rows(balancer.rows(run))
    return 0 if run.settled and met else 1


@checked
def compare(
    first: AnyScene, second: AnyScene, *, rotor: Literal["first", "second"] | None = None
) -> Comparison:
    """Compare two balancers on one rotor; liquid rings under their calibrated laws.

    Args: `rotor`: the scene whose rotor, vibration sensor and limit hold for both; default that of both.
    Raises: SceneError: the scenes describe two rotors and none is named, or a balancer cannot work on it.

    Example:
        >>> first, second = (rb.load_scene(rb.bundled_scene(n)) for n in ("liquid_ring_paper", "six_chamber"))
        >>> comparison = rb.compare(first, second, rotor="first")
        >>> len(comparison.to_dict()["scenes"])
        2
    """
    return run_comparison(balancer_of(first), balancer_of(second), rotor=rotor)


def compare_under(
    first: AnyScene,
    second: AnyScene,
    *,
    law: str,
    rotor: Literal["first", "second"] | None,
    progress: Callable[[str], None],
) -> Comparison:
    """Compare as the command does: under a law for each balancer that has one."""
    balancers = [
        balancer_of(scene, flow_law=law if takes(scene, "flow_law") else None) for scene in (first, second)
    ]
    return run_comparison(*balancers, rotor=rotor, progress=progress)


@checked
def tune(
    scene: AnyScene,
    *,
    flow_law: GivesVelocities | None = None,
    pressure: bool = False,
    remedies: bool | None = False,
    progress: Callable[[str], None] | None = None,
) -> Tuning:
    """Recommend settings of the controller, chosen by runs of drawn devices and judged on others.

    Args: `flow_law`: as in `simulate`. `pressure`: True to search the gas pressure even where that of the
        scene meets the requirement. `remedies`: True or None to try changes of the scene where it is not
        met, and, where the scene gives no valve, to judge valves that can be bought; False: the verdict is
        then that of an ideal valve. `progress`: called with what is being done.
    Raises: SceneError: a rotor too slow for the liquid to form a ring.
    Raises: ValueError: a flow law for eccentric masses.

    Example:
        >>> scene = rb.load_scene(rb.bundled_scene("liquid_ring_paper"))
        >>> tuning = rb.tune(scene)
        >>> sorted(tuning.recommended.settings)
        ['controller.gas_time_offset', 'controller.integral_time', 'controller.proportional', 'gas.pressure']
    """
    balancer = balancer_of(scene, flow_law=flow_law)
    tries = remedies is not False
    return tuned(balancer, scan=pressure, remedies=tries, choices=tries, progress=progress)


@checked
def check_balancer(
    name: str, scene: AnyScene | None = None, *, progress: Callable[[str], None] | None = None
) -> BalancerChecks:
    """Check that a balancer, such as one of another package, is what every command expects.

    Args: `name`: the word of the scene's key `balancer`. `scene`: one of its scenes, whose runs should be
        short; default the example that its package brings. `progress`: called with the present check.
    Raises: SceneError: no balancer of that name is installed, its package cannot be used, or there is no
        scene of it.

    Example:
        >>> scene = rb.load_scene("driven_masses_small").with_values({"run.time_limit": "5 s"})
        >>> rb.check_balancer("eccentric_mass", scene).succeeded
        True
    """
    example = scene_kind(balancer_name(name, file=COMMAND_LINE, key="NAME")).example
    if scene is None and not example:
        problem = "its package brings no example"
        allowed = "--scene SCENE with it"
        raise SceneError.of_option(option="NAME", value=name, problem=problem, allowed=allowed)
    if scene is None:
        scene = scene_from(content=example.encode(), file=f"example of {name}")
    elif scene.balancer != name:
        problem, allowed = f"this is a scene of the balancer {scene.balancer}", f"a scene of {name}"
        raise SceneError.of_option(option="--scene", value=scene.source, problem=problem, allowed=allowed)
    balancer, problems = balancer_of(scene), []
    for check in CHECKS:
        if progress is not None:
            progress(f"{check.__name__.replace('_', ' ')} ...")
        problems.append((check, problems_of(check, balancer)))
    return BalancerChecks(name=name, source=scene.source, problems=problems)
