"""The liquid's body in an imported chamber: it fills what lies outside the surface, and no more."""

from __future__ import annotations

import numpy as np
import pytest
from block_discs import ribbed_chamber, sector_chamber

from ringbalance.mesh.chamber import FREE_SURFACE
from ringbalance.mesh.geometry import chamber_volume, surface_radius
from ringbalance.mesh.liquid_body import _jacobians, liquid_body
from ringbalance.mesh.quadratic_tetrahedra import (
    Tetrahedra,
    face_nodes,
    lonely,
    scikit_fem_mesh,
    tetrahedra,
)
from ringbalance.physics.pressure.solve import quadratic_basis, side
from ringbalance.scene import bundled_scene, load_scene
from ringbalance.scene.chamber_file.record import CellKind
from ringbalance.scene.narrowing import liquid_ring_scene

_ANGLE, _WIDTH = np.pi / 2, 1.3


def _sector(n: int, kind: CellKind = "hexahedron27", turn: float = _ANGLE) -> Tetrahedra:
    cells = (n, 2 * n, n)
    return tetrahedra(sector_chamber(cells, radii=(0.5, 1.0), angle=turn, width=_WIDTH, kind=kind))


def _surface(body: Tetrahedra) -> np.ndarray:
    number = body.names.index(FREE_SURFACE)
    parts = [face_nodes(body.cells[body.faces[:, k] == number], k) for k in range(4)]
    return body.nodes[np.unique(np.concatenate(parts))]


@pytest.mark.parametrize("radius", [0.51, 0.6, 0.731, 0.75, 0.874, 0.96])
@pytest.mark.parametrize("kind", ["hexahedron27", "hexahedron20", "tetra10"])
def test_it_holds_the_volume_outside_the_surface(kind: CellKind, radius: float) -> None:
    body = liquid_body(_sector(6, kind), radius)
    exact = _ANGLE / 2 * _WIDTH * (1 - radius**2)
    mesh = scikit_fem_mesh(body)
    # Quadratic edges leave their arcs by R (angle / 2)^4 / 32: 2e-7 R here, over a depth of at least 0.04 R.
    assert quadratic_basis(mesh).dx.sum() == pytest.approx(exact, rel=2e-5)
    assert _jacobians(body).min() > 0
    assert np.abs(np.hypot(*_surface(body)[:, :2].T) - radius).max() < 1e-9
    areas = {name: side(mesh, name).weights.sum() for name in mesh.boundaries}
    assert areas[FREE_SURFACE] == pytest.approx(_ANGLE * radius * _WIDTH, rel=2e-5)
    assert areas["outer_wall"] == pytest.approx(_ANGLE * _WIDTH, rel=2e-5)
    assert areas["plate_left"] == pytest.approx((1 - radius) * _WIDTH, rel=2e-5)
    assert areas["end_front"] == pytest.approx(exact / _WIDTH, rel=2e-5)


@pytest.mark.parametrize("kind", ["hexahedron27", "hexahedron", "tetra", "tetra10"])
def test_every_face_is_shared_or_named_and_the_normals_close(kind: CellKind) -> None:
    body = liquid_body(_sector(5, kind), 0.77)
    assert np.array_equal(lonely(body.cells, len(body.nodes)), body.faces >= 0)
    mesh = scikit_fem_mesh(body)
    sides = [side(mesh, name) for name in mesh.boundaries]
    assert np.abs(sum(each.area.sum(axis=(1, 2)) for each in sides)).max() < 1e-12
    # Gauss: the integral of x . n is three times the volume, on curved cells within the quadrature.
    outflow = sum((each.points * each.area).sum() for each in sides)
    assert outflow / 3 == pytest.approx(quadratic_basis(mesh).dx.sum(), rel=1e-6)


@pytest.mark.parametrize("fill", [0.03, 0.25, 0.5, 0.9])
def test_a_chamber_with_fillets_and_a_gas_tube_holds_what_exact_integrals_say(fill: float) -> None:
    disc = liquid_ring_scene(load_scene(bundled_scene("imported_chamber"))).disc
    assert disc.geometry is not None
    radius = float(surface_radius(disc=disc, fill_ratio=fill))
    body = liquid_body(tetrahedra(disc.geometry), radius)
    exact = fill * chamber_volume(disc=disc)
    # Where a fillet leaves no room in a flat cell, the surface stays nearly straight over up to 7 mm: 0.16 mm
    # off on average, of 4.6 mm, over a tenth of it.
    assert quadratic_basis(scikit_fem_mesh(body)).dx.sum() == pytest.approx(exact, rel=3e-3)
    assert _jacobians(body).min() > 0


def test_a_rib_on_the_wall_and_nameless_walls_stay() -> None:
    geometry = ribbed_chamber(_ANGLE)
    named = {name: geometry.boundaries[name] for name in ("outer_wall", "end_back")}
    object.__setattr__(geometry, "boundaries", named)
    body = liquid_body(tetrahedra(geometry), 0.95)
    # The rib comes out of the liquid: the surface has two parts, and the walls keep their nodes.
    assert set(np.unique(body.faces)) == {-1, 0, 1, 2, 3}
    assert body.names == ("outer_wall", "end_back", "other_walls", FREE_SURFACE)
    angle = np.arctan2(*_surface(body)[:, 1::-1].T)
    assert np.abs(angle).min() > 0.05
