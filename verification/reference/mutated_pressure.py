"""Mutations of the pressure problem, put in from outside: the product has no parameter for them."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from unittest.mock import patch

from ringbalance.physics.pressure.solve import PressureProblem, RotatingLiquid


@contextmanager
def mutated_pressure(*, source: float = 1.0, wall: float = 1.0) -> Iterator[None]:
    """Multiply the source term and the walls' condition of every rotating liquid solved inside."""
    true = RotatingLiquid.problem

    def problem(liquid: RotatingLiquid) -> PressureProblem:
        exact = true(liquid)
        return PressureProblem(
            source=lambda places: source * exact.source(places),
            wall_flux=lambda places, normals: wall * exact.wall_flux(places, normals),
            surface_pressure=exact.surface_pressure,
        )

    with patch.object(RotatingLiquid, "problem", problem):
        yield
