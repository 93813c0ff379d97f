"""Rules for the SI values of a scene, each a function that returns an error or None.

`shape` has the rules for the disc and its tube, `working` those for liquid, gas and controller and the limits
of validity of the physics; the tuple at the end of each binds its rules to keys. A bound on a single value is
no rule but part of the key's declaration, see `ringbalance.scene.keys`.
"""
