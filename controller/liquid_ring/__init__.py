"""The liquid-ring plant: pairs of chambers, the transfer of liquid, and the dynamics of tube and gas.

A new effect on an injection goes into `motion` (what moves the liquid) and into the `compiled_` modules that
carry it through time; a new way to integrate a transfer implements `transfer`.
"""
