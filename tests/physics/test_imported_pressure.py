"""Pressure and loads in imported chambers, against the exact ones of a sector."""

from __future__ import annotations

import numpy as np
import pytest
from block_discs import sector_chamber

from ringbalance.physics.pressure.loads import ImportedRing, solved_ring
from ringbalance.scene.chamber_file.record import CellKind

_RHO, _OMEGA, _A, _ANGLE, _WIDTH = 900.0, 150.0, 0.77, np.pi / 2, 1.3
_PRESSURE = _RHO * _OMEGA**2 * (1 - _A**2) / 2


def _ring(n: int, *, kind: CellKind = "hexahedron27") -> ImportedRing:
    return solved_ring(
        geometry=sector_chamber((n, 2 * n, n), radii=(0.5, 1.0), angle=_ANGLE, width=_WIDTH, kind=kind),
        density=_RHO,
        angular_velocity=_OMEGA,
        surface_radius=_A,
    )


@pytest.mark.parametrize("kind", ["hexahedron27", "hexahedron"])
def test_wall_pressure_and_force_hold_their_uncertainty(kind: CellKind) -> None:
    ring = _ring(6, kind=kind)
    assert ring.status.ok
    assert abs(ring.wall_pressure.value - _PRESSURE) <= ring.wall_pressure.uncertainty
    outer = ring.loads["outer_wall"].force
    exact = _PRESSURE * 2 * np.sin(_ANGLE / 2) * _WIDTH
    assert abs(outer.value[0] - exact) <= outer.uncertainty[0]
    limit = 1e-4 if kind == "hexahedron27" else 2e-2
    assert ring.wall_pressure.uncertainty <= limit * _PRESSURE
