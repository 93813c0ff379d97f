"""The printed force beside the largest one, and the corrected bound beside a run."""

from __future__ import annotations

from ringbalance.controller.eccentric_mass.plant.parameters import plant_parameters
from ringbalance.scene.eccentric_models import EccentricScene
from ringbalance.verification.eccentric_mass.bound import motion_bound
from ringbalance.verification.eccentric_mass.runs import figure_seven
from ringbalance.verification.evidence import Evidence, Found, Level

_RATE = 1.0
"""rad/s, of the masses against the rotor."""


def compute(scene: EccentricScene, level: Level, defect: str | None = None) -> Evidence:
    """Forces and amplitudes against their bounds."""
    speed = scene.rotor.speed_profile[0].speed
    parameters = plant_parameters(scene)
    turning = motion_bound(parameters, speed=speed, rate=_RATE)
    judged = motion_bound(parameters, speed=0.0, rate=_RATE) if defect == "rotor_at_rest" else turning
    bound = turning.amplitude
    if defect == "response_left_out":
        bound = parameters.unbalance * speed**2 / parameters.stiffness
    missing = 2 * parameters.moment * speed**2
    largest = max(run.worst_amplitude for run in figure_seven(scene).runs)
    return Evidence(
        found={
            "force_ratio": Found(
                value=judged.printed_force / judged.force,
                corrected=(judged.printed_force + missing) / judged.force,
            ),
            "amplitude_ratio": Found(value=largest / bound),
        },
        numbers={"bound": turning.amplitude, "largest": largest},
    )
