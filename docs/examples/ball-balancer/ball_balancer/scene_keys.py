"""The scene of two balls in a race: what is beside the rotor, and its kind."""

from dataclasses import dataclass
from importlib.resources import files
from typing import Annotated, ClassVar

from ringbalance.controller.standard_balancer import StandardScene, standard_kind
from ringbalance.scene.keys.declaration import UNCERTAIN, needed, standard
from ringbalance.scene.keys.fields import POSITIVE, Angles, PositiveLength, PositiveMass, quantity


@dataclass(frozen=True, kw_only=True)
class Balls:
    """Two equal balls in one race."""

    mass: Annotated[PositiveMass, needed("of each"), UNCERTAIN]
    race_radius: Annotated[PositiveLength, needed("of their centres")]
    drag: Annotated[
        float, quantity("damping", POSITIVE), needed("of the oil, per velocity of a ball"), UNCERTAIN
    ]
    initial_angle: Annotated[Angles, standard(["60 deg", "200 deg"], "of each at the start")]


@dataclass(frozen=True, kw_only=True, repr=False)
class BallScene(StandardScene):
    """All that a run needs, in SI units."""

    balls: Balls
    balancer: ClassVar[str] = "ball"


KIND = standard_kind(
    BallScene,
    balls="the balls in their race",
    example=files("ball_balancer").joinpath("balls.toml").read_text(encoding="utf-8"),
)
