"""Two balls that roll in a race by themselves, a balancer for ringbalance.

Above the critical speed the rotor moves away from its unbalance, and the balls roll the other way.
"""

import ringbalance

SENTENCES = {
    "too_light": {
        "severity": "warning",
        "text": "balls of {mass:kg} are too light, more than {needed:kg} each are needed",
        "change": {"balls.mass": "raise"},
    },
}


def register() -> None:
    """Make the balancer known; named by the entry point in pyproject.toml."""
    ringbalance.register(
        "ball",
        scene="ball_balancer.scene_keys:KIND",
        balancer="ball_balancer.balancer:BallBalancer",
        sentences="ball_balancer:SENTENCES",
        report="ball_balancer.report:SECTIONS",
    )
