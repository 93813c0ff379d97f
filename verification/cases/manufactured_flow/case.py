"""Orders of velocity and pressure on the curved half section."""

from __future__ import annotations

from functools import partial
from typing import Final

from ringbalance.scene.models import Scene
from ringbalance.verification.evidence import Evidence, Found, Level
from ringbalance.verification.orders import order_figure, order_table
from ringbalance.verification.reference.manufactured_flow import flow_study

_AROUND: Final = {"light": (1, 2, 4, 8), "heavy": (1, 2, 4, 8, 16)}


def compute(scene: Scene, level: Level, defect: str | None = None) -> Evidence:
    study = flow_study(around=_AROUND[level], defect=defect)
    note = f"unknowns {', '.join(map(str, study.unknowns))}"
    table = partial(order_table, geometry="quadratic", note=note)
    return Evidence(
        found={
            "velocity_order": Found(value=study.velocity.settled_order),
            "velocity_error": Found(value=study.velocity.finest_error),
            "pressure_order": Found(value=study.pressure.settled_order),
            "pressure_error": Found(value=study.pressure.finest_error),
        },
        numbers={"unknowns": float(study.unknowns[-1])},
        series=(order_figure({"velocity": study.velocity, "pressure": study.pressure}),),
        convergence=(
            table("velocity, relative error", study.velocity, 3.0),
            table("pressure, relative error", study.pressure, 2.0),
        ),
    )
