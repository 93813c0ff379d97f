"""Rules: what SI values of a scene must fulfil, each a function that returns an error or None.

A rule on the disc or its tube goes to `shape`, one on liquid, gas or controller, and a bound of what the
physics holds for, to `working`; the tuple at the end of each binds its rules to keys. A bound on a single
value is no rule: it stands in the key's declaration, see `ringbalance.scene.keys`.
"""
