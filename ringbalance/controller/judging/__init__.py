"""Settings, requirements and remedies by runs of drawn devices, the same for every balancer.

`judge` finds the fraction of devices in which settings meet the demands; the others use it.
"""
