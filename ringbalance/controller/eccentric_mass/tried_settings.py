"""Settings of the strategy that a search tries: multiples of the scene's own, each on an axis of its own.

After a move the strategy waits for the rotor, and after its check it is done: `fine_tuning.wait` sets its
pace.  The weight of the regulator sets the time of a move, the drive speed that of the friction stage.  A
gate is tried only where its stage lasts longer than its shortest time, since it ends no other.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Final

from ringbalance.controller.eccentric_mass.drive_law import track_model
from ringbalance.controller.eccentric_mass.memory import STAGE_NAMES, Stage
from ringbalance.controller.eccentric_mass.plant import PlantParameters
from ringbalance.controller.eccentric_mass.run_record import EccentricRun
from ringbalance.controller.eccentric_mass.sampled_loops import RecommendedGains, advised
from ringbalance.controller.eccentric_mass.scene_records import EccentricScene
from ringbalance.controller.eccentric_mass.settings import StrategySettings
from ringbalance.controller.eccentric_mass.supervisor import LEAST_DRIVE_TIME_S
from ringbalance.controller.trials import Point, SearchAxis, Trials, rounded
from ringbalance.scene.origins import value_at, with_values_at

_MARGINS: Final = "margins of the drives"
_WEIGHT: Final = "lqr.state_weight"
_FACTORS: Final = {
    "fine_tuning.wait": ((1 / 16, 1 / 8, 1 / 4, 1 / 2, 1.0, 2.0), (2, 4)),
    _WEIGHT: ((1 / 4, 1.0, 4.0, 16.0), (1,)),
    "friction_filter.drive_speed": ((1 / 2, 1.0, 2.0, 4.0), (1,)),
}
"""Factors on the scene's value, and the indices of those that are tried first, by key."""
_MOVE_PACE_RAD_S: Final = 10.0
_SPEED_PACE_RAD_S: Final = 50.0
_PAIR_PACE_RAD_S: Final = 2.0
"""Paces of regulator, speed and pair control for any size, rad/s: those of the bundled scenes."""
_FRICTION_ANGLE_RAD: Final = 0.2
"""Distance from its goal at which the regulator overcomes all friction, uncompensated."""
_FRICTION_FACTOR: Final = 1.5
"""Torque of the speed control at standstill over the friction, at the drive speed."""
_GATES: Final = {
    Stage.IMBALANCE_ESTIMATION: "imbalance_filter.gate",
    Stage.FRICTION_ESTIMATION: "friction_filter.gate",
}
"""Gate by the stage that it ends."""
_GATE_FACTORS: Final = ((1.0, 2.0, 4.0), (0,))
_LONG: Final = 1.5
"""Ratio of the length of a stage to its shortest beyond which its gate is tried."""


def trials_of(scene: EccentricScene, nominal: EccentricRun) -> Trials:
    """Multiples of a scene's settings, of gates by its run as it is, and gains with margins where drives lack
    them."""
    loops, margins = RecommendedGains.of(scene).loops, advised(scene)
    largest = next(loop.recommended for loop in loops if loop.key == _WEIGHT)
    tried = {**_FACTORS, **dict.fromkeys(_gates(scene, nominal), _GATE_FACTORS)}
    values = {path: value for path in tried if (value := value_at(scene, path)) > 0}
    axes = [
        SearchAxis(
            name=path,
            levels=tuple(value if factor == 1 else rounded(factor * value) for factor in tried[path][0]),
            first=tried[path][1],
        )
        for path, value in values.items()
    ]
    if any(loop.value > loop.recommended for loop in loops):
        axes.insert(0, SearchAxis(name=_MARGINS, levels=(0.0, 1.0), first=(0, 1)))

    def settings(at: Point) -> dict[str, float] | None:
        changes = dict(margins) if at.get(_MARGINS) else {}
        for path, value in values.items():
            if at[path] != value:
                changes[path] = rounded(changes.get(path, value) * (at[path] / value))
        stiffer = at[_WEIGHT] > values[_WEIGHT] and changes[_WEIGHT] > largest
        return None if stiffer else changes

    return Trials(kind=scene.balancer, axes=tuple(axes), settings=settings)


def sized_gains(scene: EccentricScene) -> dict[str, float]:
    """Gains by key, SI, for the inertia J of the drives, with their margins, and a sufficient drive speed.

    q = r k_p^2 with k_p = J w^2, B_add gamma = J w_s with fixed paces w and w_s, or more, for the friction.
    """
    plant, inertia, keys = PlantParameters.of(scene), track_model(scene).inertia, scene.friction_filter
    friction = max(plant.friction_arm) * plant.moment * scene.rotor.speed_profile[0].speed ** 2
    stiffness = max(inertia * _MOVE_PACE_RAD_S**2, friction / _FRICTION_ANGLE_RAD)
    torque = max(inertia * _SPEED_PACE_RAD_S, _FRICTION_FACTOR * friction / keys.drive_speed)
    gains = {
        _WEIGHT: scene.lqr.input_weight * stiffness**2,
        "friction_filter.speed_gain": torque / plant.drive_gain,
        "friction_filter.pair_gain": _PAIR_PACE_RAD_S * torque / plant.drive_gain,
    }
    changes = {**gains, **advised(with_values_at(scene, gains))}
    return {path: rounded(value) for path, value in changes.items()}


def _gates(scene: EccentricScene, nominal: EccentricRun) -> Iterator[str]:
    least = {
        Stage.IMBALANCE_ESTIMATION: StrategySettings.of(scene).gates.least_estimate,
        Stage.FRICTION_ESTIMATION: LEAST_DRIVE_TIME_S,
    }
    lasted = {each.name: each.end - each.start for each in nominal.stages}
    for stage, path in _GATES.items():
        if lasted.get(STAGE_NAMES[stage], 0.0) > _LONG * least[stage]:
            yield path
