"""Residual unbalances and limits as ISO 21940-11 and API 617 grade them."""

from __future__ import annotations

from collections.abc import Iterator

from ringbalance.physics.balancing import api_617_unbalance, balance_grade
from ringbalance.results.rows import Quantity


def grade_quantities(
    *, mass: float | None, speed: float, residual: float, limit: float, reached_by: str
) -> Iterator[Quantity]:
    """Balance quality grades of a residual unbalance and of a limit, and the residual that API 617 allows.

    None without the rotor's mass.  The residual in the plane of the disc is the vector sum of those in the
    planes of two bearings: where it exceeds the sum that API 617 allows, one of them is exceeded wherever the
    bearings stand; below, both are kept if the rotor has no couple and divides it among them as its weight.
    Args: `residual`, `limit`: unbalances, kg m. `reached_by`: as in "at the end".
    """
    if mass is None:
        return
    for key, name, unbalance in (
        ("grade_reached", f"balance quality grade reached {reached_by} (ISO 21940-11)", residual),
        ("grade_of_limit", "balance quality grade of the limit (ISO 21940-11)", limit),
    ):
        grade = balance_grade(unbalance=unbalance, mass=mass, speed=speed)
        yield Quantity.simulated(key, name, grade, "m/s")
    allowed = api_617_unbalance(mass=mass, speed=speed)
    verdict = "not exceeded" if residual <= allowed else "exceeded"
    name = f"residual unbalance of both planes that API 617 allows: {verdict} {reached_by}"
    yield Quantity.simulated("api_617_unbalance", name, allowed, "kg m")
