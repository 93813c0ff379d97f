"""Two balls that roll in a race by themselves, a balancer for ringbalance.

Above the critical speed the rotor moves away from its unbalance, and the balls roll the other way.
"""

import ringbalance


def register() -> None:
    """Make the balancer known; named by the entry point in pyproject.toml."""
    ringbalance.register(
        "ball", scene="ball_balancer.scene_keys:KIND", balancer="ball_balancer.balancer:BallBalancer"
    )
