"""The scene of two balls in a race: its records, its keys and its kind."""

from dataclasses import dataclass
from typing import Annotated, ClassVar

from ringbalance.scene.keys.declaration import UNCERTAIN, needed, standard
from ringbalance.scene.keys.fields import (
    POSITIVE,
    Angles,
    Influence,
    PositiveLength,
    PositiveMass,
    PositiveRate,
    PositiveUnbalance,
    Turn,
    quantity,
)
from ringbalance.scene.keys.schema import Schema, TableSchema
from ringbalance.scene.kinds import SceneKind, reader_of
from ringbalance.scene.origins import SceneFile


@dataclass(frozen=True, kw_only=True)
class Rotor:
    """At constant speed, in steady vibration."""

    speed: Annotated[PositiveRate, needed("of the rotor")]
    influence_coefficient: Annotated[Influence, needed("vibration per unbalance"), UNCERTAIN]
    lag_angle: Annotated[Turn, needed("of the vibration behind the unbalance"), UNCERTAIN]
    unbalance: Annotated[PositiveUnbalance, needed("to be balanced"), UNCERTAIN]
    phase: Annotated[Turn, standard("0 deg", "of the unbalance in the rotor's frame")]


@dataclass(frozen=True, kw_only=True)
class Balls:
    """Two equal balls in one race."""

    mass: Annotated[PositiveMass, needed("of each"), UNCERTAIN]
    race_radius: Annotated[PositiveLength, needed("of their centres")]
    drag: Annotated[
        float, quantity("damping", POSITIVE), needed("of the oil, per velocity of a ball"), UNCERTAIN
    ]
    initial_angle: Annotated[Angles, standard(["60 deg", "200 deg"], "of each at the start")]


@dataclass(frozen=True, kw_only=True)
class Vibration:
    """What counts as balanced."""

    limit: Annotated[PositiveLength, needed("amplitude to come below")]


@dataclass(frozen=True, kw_only=True, repr=False)
class BallScene(SceneFile):
    """All that a run needs, in SI units."""

    rotor: Rotor
    balls: Balls
    vibration: Vibration
    balancer: ClassVar[str] = "ball"


_SCHEMA = Schema.of(
    {
        "rotor": TableSchema.of(Rotor, "the rotor"),
        "balls": TableSchema.of(Balls, "the balls in their race"),
        "vibration": TableSchema.of(Vibration, "what is required"),
    },
    balancer=needed('"ball"'),
    scene=BallScene,
)
KIND = SceneKind(schema=_SCHEMA, read=reader_of(_SCHEMA, ()), main=(("balls.mass", "balls.race_radius"),))
