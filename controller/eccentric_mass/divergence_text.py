"""Which loop of the drives has made a run diverge, and what to change."""

from __future__ import annotations

from ringbalance.controller.eccentric_mass.sampled_loops import regulator_loop, speed_loop
from ringbalance.scene.eccentric_models import EccentricScene
from ringbalance.scene.units import format_quantity


def divergence_remedy(scene: EccentricScene, *, friction_stage: bool) -> str:
    """What is unstable, and which values are not.

    Args: `scene`: of a run that diverged. `friction_stage`: whether it did so in the friction stage, where
        the speed control drives the masses; in all others the regulator does.
    Returns: Part of a sentence: the loop that drove the masses with a value that leaves a gain margin of two,
        the other one when it is unstable as well, or what to try when both are stable by themselves.
    """
    unstable = unstable_loops(scene)
    if friction_stage:
        unstable.reverse()
    step = format_quantity(scene.lqr.step, "time", "s")
    if not unstable:
        return (
            f"each drive alone is stable at a voltage held for {step}: lower lqr.state_weight and "
            "friction_filter.speed_gain together, or set a motor.maximum_voltage"
        )
    also = f"; then, if the run still does not settle, {unstable[1]}" if len(unstable) > 1 else ""
    return f"drives so light are unstable at a voltage held for {step}: {unstable[0]}{also}"


def unstable_loops(scene: EccentricScene) -> list[str]:
    """The drives' loops that are unstable by themselves, each with a value that is not.

    Returns: What to lower to what; the regulator first.
    """
    regulator, speed = regulator_loop(scene), speed_loop(scene)
    weight, gain = scene.lqr.state_weight, scene.friction_filter.speed_gain
    texts = (
        (regulator, f"lower lqr.state_weight = {weight:.4g} to {regulator.recommended:.2g} or less"),
        (speed, f"lower friction_filter.speed_gain = {gain:.4g} to {speed.recommended:.2g} V*s/rad or less"),
    )
    return [f"{text} (largest sampled pole {loop.radius:.3g})" for loop, text in texts if not loop.stable]
