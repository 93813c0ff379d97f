"""ringbalance: are the closed formulas of a liquid-ring balancer to be trusted, for your disc?"""

__version__ = "0.1.0"
