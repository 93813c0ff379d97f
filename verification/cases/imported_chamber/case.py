"""The built-in chamber as a mesh file would give it, against the closed forms and a manufactured solution."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Final

import numpy as np

from ringbalance.mesh.chamber import FREE_SURFACE
from ringbalance.mesh.geometry import chamber_volume, surface_radius
from ringbalance.mesh.quadratic_tetrahedra import scikit_fem_mesh, tetrahedra
from ringbalance.physics.convergence import gci
from ringbalance.physics.pressure.imported import solved_ring
from ringbalance.physics.pressure.solve import quadratic_basis, solve_on
from ringbalance.reduced_model.chamber.values import chamber_closed_forms
from ringbalance.scene.chamber_file.record import ChamberGeometry
from ringbalance.scene.models import Disc, Scene
from ringbalance.verification.evidence import Evidence, Found, Level, Reference, from_half_width
from ringbalance.verification.orders import OrderStudy
from ringbalance.verification.reference.block_chambers import disc_chamber
from ringbalance.verification.reference.exact_chamber import exact_totals
from ringbalance.verification.reference.manufactured import Manufactured

_CELLS: Final = ((8, 32, 2), (4, 16, 1), (2, 8, 1))
"""Finest first; the arcs alone are approximated, so the cells along the angle decide."""
_SIZES: Final = (1.0, 2.0, 4.0)
_ORDER: Final = 4.0
"""Of what an arc drawn by quadratic edges encloses."""
_COARSE_TO_FINE: Final = ((2, 4, 2), (4, 8, 4), (8, 16, 8))
_MANUFACTURED: Final = ("force_off_by_a_percent", "force_across_dropped", "surface_pressure_shifted")


def reference(scene: Scene) -> Mapping[str, Reference]:
    exact = exact_totals(scene)
    exact["lever"] = exact.pop("lambda")
    return {name: Reference(value=value) for name, value in exact.items()}


def compute(scene: Scene, level: Level, defect: str | None = None) -> Evidence:
    records = [_record(scene.disc, cells, defect) for cells in _CELLS]
    rows = np.array([_totals(scene, record) for record in records])
    names = ("volume", "moment", "lever")
    found = {name: _converged(rows[:, k]) for k, name in enumerate(names)}
    pressure = _by_elements(scene, records[0])
    orders = _manufactured(scene.disc, defect if defect in _MANUFACTURED else None)
    return Evidence(
        found={
            **found,
            "wall_pressure": pressure,
            "field_order": Found(value=orders[0]),
            "field_error": Found(value=orders[1]),
        },
        numbers={"cells": float(len(records[0].cells))},
    )


def _record(disc: Disc, cells: tuple[int, int, int], defect: str | None) -> ChamberGeometry:
    record = disc_chamber(disc, cells)
    if defect == "drawn_too_large":
        return replace(record, points=record.points * 1.0001, digest=f"large {record.digest}")
    return record


def _totals(scene: Scene, record: ChamberGeometry) -> tuple[float, float, float]:
    """Volume, moment at the largest fill, and lambda at equal fills, by integrals over the walls."""
    disc = replace(scene.disc, geometry=record)
    own = replace(scene, disc=disc)
    fills = np.array([disc.max_fill_ratio, disc.max_fill_ratio / 2])
    _, moment, ratio = chamber_closed_forms(scene=own, fill_ratio=fills)
    return chamber_volume(disc=disc), float(moment[0]), float(ratio[1])


def _converged(values: np.ndarray) -> Found:
    study = gci(values=values.tolist(), sizes=_SIZES, formal_order=_ORDER)
    # What a table of integrals is good to, besides.
    width = study.uncertainty + 1e-8 * abs(float(values[0]))
    return Found(value=float(values[0]), numerical=from_half_width(width))


def _by_elements(scene: Scene, record: ChamberGeometry) -> Found:
    ring = solved_ring(
        geometry=record,
        density=scene.liquid.density,
        angular_velocity=scene.rotor.speed,
        surface_radius=float(surface_radius(disc=scene.disc, fill_ratio=scene.disc.max_fill_ratio)),
    )
    pressure = ring.wall_pressure
    return Found(
        value=float(pressure.value),
        numerical=from_half_width(float(pressure.uncertainty)),
        conclusive=ring.status.ok,
    )


def _manufactured(disc: Disc, defect: str | None) -> tuple[float, float]:
    """Order and finest error of the pressure in the whole chamber, its inner wall taken for the surface."""
    exact = Manufactured(length=disc.outer_radius, width=disc.axial_width)
    errors = []
    for cells in _COARSE_TO_FINE:
        record = disc_chamber(disc, cells)
        walls = {FREE_SURFACE if n == "inner_wall" else n: each for n, each in record.boundaries.items()}
        mesh = scikit_fem_mesh(tetrahedra(replace(record, boundaries=walls)))
        solution = solve_on(quadratic_basis(mesh), exact.problem(defect))
        true = exact.pressure(mesh.doflocs)
        errors.append(float(np.sqrt(np.mean((solution.values - true) ** 2) / np.mean(true**2))))
    study = OrderStudy.of(size=[4.0, 2.0, 1.0], error=errors)
    return study.settled_order, study.finest_error
