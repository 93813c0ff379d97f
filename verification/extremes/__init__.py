"""A scene at its extremes: axes, a designed set over all of them, and the invariants of each point.

A new input is one more axis in `axes`; a new invariant is checked in `point`.
"""
