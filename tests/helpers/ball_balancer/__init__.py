"""A third balancer, as a user would write one: two balls that roll in a race by themselves.

Above the critical speed the rotor moves away from its unbalance, and the balls roll the other way.
"""
