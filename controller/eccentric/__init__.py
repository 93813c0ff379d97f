"""Two driven eccentric masses on a rotor: plant, estimators, regulator, supervisor and the run of them all.

Modules with compiled functions are imported where they are used, so that the compiler is loaded only then.
"""
