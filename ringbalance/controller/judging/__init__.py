"""Settings, requirements and remedies by runs of drawn devices, the same for every balancer.

`judge` says in which fraction of devices a setting meets what is asked; the others use it.
"""
