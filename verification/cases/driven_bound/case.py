"""The printed force beside the largest one, and the corrected bound beside a run."""

from __future__ import annotations

from ringbalance.controller.eccentric_mass.plant.parameters import plant_parameters
from ringbalance.scene.models import Scene
from ringbalance.verification.eccentric_mass.bound import motion_bound
from ringbalance.verification.eccentric_mass.runs import figure_seven
from ringbalance.verification.eccentric_mass.scenes import driven_scene
from ringbalance.verification.evidence import Evidence, Found, Level, no_reference

_RATE = 1.0
"""rad/s, of the masses against the rotor."""


reference = no_reference


def compute(scene: Scene, level: Level, defect: str | None = None) -> Evidence:
    """Forces and amplitudes against their bounds."""
    rotor = driven_scene()
    speed = rotor.rotor.speed_profile[0].speed
    parameters = plant_parameters(rotor)
    turning = motion_bound(parameters, speed=speed, rate=_RATE)
    judged = turning if defect is None else motion_bound(parameters, speed=0.0, rate=_RATE)
    largest = max(run.worst_amplitude for run in figure_seven(rotor).runs)
    return Evidence(
        found={
            "force_ratio": Found(value=judged.printed_force / judged.force),
            "amplitude_ratio": Found(value=largest / turning.amplitude),
        },
        numbers={"bound": turning.amplitude, "largest": largest},
    )
