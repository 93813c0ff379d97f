"""Types of the values of keys, each with its reader: what several keys take is written once."""

from __future__ import annotations

from typing import Annotated

from ringbalance.scene.keys.fields import (
    NOT_NEGATIVE,
    POSITIVE,
    Bounds,
    angle_of_turn,
    each_of,
    number,
    one_or_each,
    quantity,
    share,
    text,
    whole,
)

OneLine = Annotated[str, text()]
PositiveLength = Annotated[float, quantity("length", POSITIVE)]
Length = Annotated[float, quantity("length", NOT_NEGATIVE)]
PositiveAngle = Annotated[float, quantity("angle", POSITIVE)]
Angle = Annotated[float, quantity("angle", NOT_NEGATIVE)]
Turn = Annotated[float, angle_of_turn()]
PositiveTime = Annotated[float, quantity("time", POSITIVE)]
Time = Annotated[float, quantity("time", NOT_NEGATIVE)]
Pressure = Annotated[float, quantity("pressure", NOT_NEGATIVE)]
TimePerChamber = Annotated[
    tuple[float, ...], one_or_each(quantity("time", NOT_NEGATIVE), example='["50 ms", "30 ms"]')
]
PositivePressure = Annotated[float, quantity("pressure", POSITIVE)]
Temperature = Annotated[float, quantity("temperature")]
Influence = Annotated[float, quantity("influence_coefficient", POSITIVE)]
PositiveMass = Annotated[float, quantity("mass", POSITIVE)]
Mass = Annotated[float, quantity("mass", NOT_NEGATIVE)]
Stiffness = Annotated[float, quantity("stiffness", POSITIVE)]
Damping = Annotated[float, quantity("damping", NOT_NEGATIVE)]
PositiveVelocity = Annotated[float, quantity("velocity", POSITIVE)]
Velocity = Annotated[float, quantity("velocity", NOT_NEGATIVE)]
PositiveUnbalance = Annotated[float, quantity("unbalance", POSITIVE)]
Unbalance = Annotated[float, quantity("unbalance", NOT_NEGATIVE)]
PositiveRate = Annotated[float, quantity("speed", POSITIVE)]
Rate = Annotated[float, quantity("speed", NOT_NEGATIVE)]
Inertia = Annotated[float, quantity("inertia", NOT_NEGATIVE)]
Weight = Annotated[float, number(POSITIVE)]
FillRatio = Annotated[float, share(Bounds(above=0, at_most=1), example=0.5)]
ProperFraction = Annotated[float, share(Bounds(above=0, below=1), example=0.5)]
Gate = Annotated[float, share(Bounds(above=0, at_most=1), example=0.01)]
Angles = Annotated[tuple[float, float], each_of(angle_of_turn(), count=2, example='["0 deg", "180 deg"]')]
Arms = Annotated[
    tuple[float, float],
    each_of(quantity("length", NOT_NEGATIVE), count=2, example='["10 mm", "10 mm"]'),
]
Teeth = Annotated[tuple[int, int, int], each_of(whole(1, 100000), count=3, example="[10, 40, 400]")]
