"""What the commands on balancers share."""

from __future__ import annotations

from ringbalance.controller.balancer import Balancer, balancer_of, takes
from ringbalance.scene.faults import SceneError
from ringbalance.scene.origins import SceneFile

CALIBRATED = "calibrated"
"""The law of a liquid ring where no other is asked for."""


def balancer_under(law: str, scene: SceneFile) -> Balancer:
    """The balancer of a scene under the law of the option `--law`.

    Raises: SceneError: a law for a balancer that has none.
    """
    if law == CALIBRATED:
        return balancer_of(scene)
    if not takes(scene, "flow_law"):
        problem = f"the balancer of {scene.source} has no flow law"
        raise SceneError.of_option(
            option="--law", value=law, problem=problem, allowed="this option with a liquid ring alone"
        )
    return balancer_of(scene, flow_law=law)
