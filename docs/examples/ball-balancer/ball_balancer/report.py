"""Pages of the report: those of any balancer, and a section on where the balls come to rest."""

import math
from typing import Any

from ball_balancer.balancer import BallBalancer
from ball_balancer.scene_keys import BallScene
from ringbalance.reports.pages.plain import SECTIONS as PLAIN
from ringbalance.reports.section import Section, Work
from ringbalance.scene.narrowing import scene_as


def rest(work: Work) -> dict[str, Any]:
    """Angles at which both balls cancel the unbalance: opposite to it, apart by 2 arccos(U/(2 m r))."""
    scene = scene_as(BallScene, work.scene)
    rotor, reach = scene.rotor, BallBalancer(scene).reach(scene)
    apart = 2 * math.acos(min(1.0, rotor.unbalance / reach))
    return {"direction_rad": (rotor.phase + math.pi) % (2 * math.pi), "apart_rad": apart, "reach_kg_m": reach}


SECTIONS = (
    PLAIN[0],
    Section(
        name="balls",
        title="Where the balls come to rest",
        document="report",
        collect=rest,
        template="ball_balancer:templates/balls.html",
    ),
    *PLAIN[1:],
)
