"""A scene at its extremes: axes, a designed set over all, and what must hold at each point.

A new input is one more axis in `axes`; a new invariant is checked in `point`.
"""
