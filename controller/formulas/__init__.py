"""Pure functions of numbers that a single run interprets and an ensemble compiles.

One formula, one place: each calls nothing but `math`, so that `controller.ensemble` compiles it as it stands.
"""
