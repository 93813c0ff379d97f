"""The figures of the paper on eccentric masses, computed again for its cases.

A further figure or bound of that paper is a module of its own here.
"""
