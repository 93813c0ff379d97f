"""Evidence of a manufactured study on curved and on straight-sided meshes."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

import numpy as np

from ringbalance.scene.models import Disc
from ringbalance.verification.evidence import Convergence, Curve, Evidence, Found, Series, figure
from ringbalance.verification.orders import OrderStudy
from ringbalance.verification.reference.manufactured import Study, study

_GEOMETRIES: Final = ("quadratic", "straight")
_FIELD_ORDER: Final = 3.0
_WALL_ORDER: Final = {"quadratic": 4.0, "straight": 2.0}
_FILL_SHARE: Final = 0.8
"""Of the largest fill: a ring deep enough to show every direction."""


def manufactured_evidence(*, disc: Disc, cells: Sequence[tuple[int, ...]], defect: str | None) -> Evidence:
    """Run both geometries and hand out orders, finest errors and figures.

    Args: `cells`: of each level, coarse to fine. `defect`: a fault of the right-hand sides; None for none.
    Returns: Evidence with the quantities of the manufactured cases.
    """
    fill = _FILL_SHARE * disc.max_fill_ratio
    studies = {
        geometry: study(disc=disc, fill_ratio=fill, cells=cells, geometry=geometry, defect=defect)
        for geometry in _GEOMETRIES
    }
    curved, straight = studies["quadratic"], studies["straight"]
    found = {
        "field_order_quadratic": Found(value=curved.field.settled_order),
        "field_error_quadratic": Found(value=curved.field.finest_error),
        "wall_order_quadratic": Found(value=curved.wall.settled_order),
        "wall_error_quadratic": Found(value=curved.wall.finest_error),
        "field_order_straight": Found(value=straight.field.settled_order),
        "wall_order_straight": Found(value=straight.wall.settled_order),
        "wall_error_straight": Found(value=straight.wall.finest_error),
    }
    return Evidence(
        found=found,
        numbers={
            "curving": straight.wall.finest_error / curved.wall.finest_error,
            "unknowns": float(curved.unknowns[-1]),
        },
        series=(_figure(studies["quadratic"], studies["straight"]),),
        convergence=tuple(entry for one in studies.values() for entry in _tables(one)),
    )


def _tables(one: Study) -> tuple[Convergence, Convergence]:
    cells = ", ".join(" x ".join(map(str, count)) for count in one.cells)
    note = f"cells {cells}; up to {one.unknowns[-1]} unknowns"

    def table(quantity: str, orders: OrderStudy, formal: float) -> Convergence:
        return Convergence(
            quantity=quantity,
            unit="1",
            formal_order=formal,
            size=orders.size,
            error=orders.error,
            observed_order=orders.order,
            geometry=one.geometry,
            note=note,
        )

    return (
        table("pressure field, relative error", one.field, _FIELD_ORDER),
        table("force on the outer wall, relative error", one.wall, _WALL_ORDER[one.geometry]),
    )


def _figure(curved: Study, straight: Study) -> Series:
    curves = {
        "pressure field, curved": curved.field.error,
        "wall force, curved": curved.wall.error,
        "pressure field, straight": straight.field.error,
        "wall force, straight": straight.wall.error,
    }
    return figure(
        "error against mesh size",
        ("relative mesh size", "1", np.array(curved.field.size)),
        *(Curve(name, "1", np.array(error)) for name, error in curves.items()),
        log=True,
    )
