"""Checks of a balancer, for Python and as a command."""

from __future__ import annotations

from collections.abc import Callable

from ringbalance.controller.balancer import balancer_of
from ringbalance.controller.balancer_checks import CHECKS, BalancerChecks, problems_of
from ringbalance.interface import checked
from ringbalance.scene import AnyScene, scene_from
from ringbalance.scene.faults import COMMAND_LINE, SceneError
from ringbalance.scene.kinds import scene_kind
from ringbalance.scene.loader import balancer_name


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
        >>> scene = rb.load_scene("driven_masses_small").with_values({"run.time_limit": "3 s"})
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
