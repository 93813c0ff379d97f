"""Orders of velocity and pressure on the curved half section."""

from __future__ import annotations

from typing import Final

import numpy as np

from ringbalance.scene.models import Scene
from ringbalance.verification.evidence import Convergence, Curve, Evidence, Found, Level, Series, figure
from ringbalance.verification.reference.manufactured_flow import FlowStudy, flow_study

_AROUND: Final = {"light": (1, 2, 4, 8), "heavy": (1, 2, 4, 8, 16)}


def compute(scene: Scene, level: Level, defect: str | None = None) -> Evidence:
    """Errors over levels."""
    study = flow_study(around=_AROUND[level], defect=defect)
    return Evidence(
        found={
            "velocity_order": Found(value=study.velocity.settled_order),
            "velocity_error": Found(value=study.velocity.finest_error),
            "pressure_order": Found(value=study.pressure.settled_order),
            "pressure_error": Found(value=study.pressure.finest_error),
        },
        numbers={"unknowns": float(study.unknowns[-1])},
        series=(_figure(study),),
        convergence=tuple(
            Convergence(
                quantity=f"{name}, relative error",
                unit="1",
                formal_order=formal,
                size=orders.size,
                error=orders.error,
                observed_order=orders.order,
                geometry="quadratic",
                note=f"unknowns {', '.join(map(str, study.unknowns))}",
            )
            for name, formal, orders in (
                ("velocity", 3.0, study.velocity),
                ("pressure", 2.0, study.pressure),
            )
        ),
    )


def _figure(study: FlowStudy) -> Series:
    return figure(
        "error against mesh size",
        ("relative mesh size", "1", np.array(study.velocity.size)),
        Curve("velocity", "1", np.array(study.velocity.error)),
        Curve("pressure", "1", np.array(study.pressure.error)),
        log=True,
    )
