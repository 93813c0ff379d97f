"""Whether a mesh is in the unit that its scene says: the tube's lengths fit one size of chamber only."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Final, get_args

from ringbalance.scene.chamber_file.keys import MeshUnit
from ringbalance.scene.dimensions import DIMENSIONS
from ringbalance.scene.keys.reading import Reading
from ringbalance.scene.rules.check import Finding, failed_checks, written
from ringbalance.scene.rules.shape import SIZE_CHECKS

_LARGEST, _SMALLEST = 5.0, 1e-3
"""Outer radii, m, beyond which no balancing disc is built."""
_LENGTHS: Final = ("outer_radius", "inner_radius", "axial_width")


def scale_findings(
    reading: Reading, dimensions: Mapping[str, float], *, unit: str, port: float | None
) -> Iterator[Finding]:
    """Lengths of the scene that no chamber of this size has, and the units in which they would fit.

    A length that fits no unit is an error of its own, not one of scale.
    Args: `dimensions`: of the mesh in `unit`, SI. `port`: radius of its boundary of that name, m.
    """

    def misfit(other: str) -> str | None:
        units = DIMENSIONS["length"].units
        return _misfit(reading, dimensions, factor=float(units[other].factor / units[unit].factor), port=port)

    reason = misfit(unit)
    fitting = [name for name in get_args(MeshUnit) if misfit(name) is None]
    inner, outer = dimensions["inner_radius"], dimensions["outer_radius"]
    if reason is None or (not fitting and _SMALLEST <= outer <= _LARGEST):
        return
    problem = f'in "{unit}" the chamber reaches from {written(inner, "mm")} to {written(outer, "mm")}: '
    allowed = " or ".join(f'mesh_unit = "{name}"' for name in fitting)
    if not reading.given("disc.mesh_unit"):
        allowed = " or ".join(f'a STEP file in "{name}"' for name in fitting)
    yield Finding(
        problem=f"{problem}wrong scale; {reason}",
        allowed=allowed or f"an outer radius of {_SMALLEST:g} m to {_LARGEST:g} m",
    )


def _misfit(
    reading: Reading, dimensions: Mapping[str, float], *, factor: float, port: float | None
) -> str | None:
    """Why a chamber so many times as large cannot be; None where it can."""
    sized = {key: value * (factor if key in _LENGTHS else 1.0) for key, value in dimensions.items()}
    if not _SMALLEST <= sized["outer_radius"] <= _LARGEST:
        return "no disc is of that size"
    values = {f"disc.{key}": value for key, value in sized.items()}
    if reading.lacks("tube.port_radius"):
        values["tube.port_radius"] = sized["outer_radius"] if port is None else factor * port
    fault = next(failed_checks(reading.adding(values), SIZE_CHECKS), None)
    return None if fault is None else f"[{fault.table}] {fault.key} = {fault.value}: {fault.problem}"
