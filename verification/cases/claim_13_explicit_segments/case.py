"""Explicit segments against the closed form over one long operation."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from ringbalance.reduced_model.law.paper_law import paper_law
from ringbalance.scene.models import Scene
from ringbalance.verification.evidence import (
    Curve,
    Evidence,
    Found,
    Level,
    NotRunError,
    Reference,
    Series,
    figure,
    from_half_width,
)
from ringbalance.verification.orders import OrderStudy
from ringbalance.verification.reference.transfers import Drive, closed_form, explicit_segments, paper_drive

_COUNTS = (4, 8, 16, 32, 64, 128, 256, 512)
_SHARE = 0.9
"""Of the time until the chamber is empty or the flow stalls; at a stall itself no scheme has its order."""
_SHORT = 0.1
"""Share of the long operation that a controller's usual command lasts."""


@dataclass(frozen=True, kw_only=True)
class _Operation:
    """One chamber from full towards empty under the scene's gas pressure."""

    drive: Drive
    duration: float
    """s."""

    def moved(self, fill: float) -> float:
        """Fill ratio given away."""
        return self.drive.fill - fill

    def exact(self) -> float:
        """Moved fill ratio by the closed form."""
        return self.moved(float(closed_form(self.drive, np.array([self.duration])).fill[-1]))

    def stepped(self, count: int) -> float:
        """Moved fill ratio by explicit segments."""
        transfer = explicit_segments(count)(self.drive, np.array([self.duration]))
        return self.moved(float(transfer.fill[-1]))

    def frozen(self) -> float:
        """Moved fill ratio with the first velocity kept."""
        velocity = float(self.drive.flow(self.drive.fill).velocity)
        return velocity * self.drive.exchange_rate * self.duration

    def error(self, count: int) -> float:
        """Relative error of the moved fill."""
        return abs(self.stepped(count) / self.exact() - 1)


def reference(scene: Scene) -> Mapping[str, Reference]:
    return {"moved_fill": Reference(value=_long_operation(scene).exact())}


def compute(scene: Scene, level: Level, defect: str | None = None) -> Evidence:
    operation = _long_operation(scene)
    frozen = defect == "frozen_velocity"
    exact = operation.exact()
    moved = [operation.frozen() if frozen else operation.stepped(count) for count in _COUNTS]
    error = [abs(value / exact - 1) for value in moved]
    study = OrderStudy.of(size=[_COUNTS[0] / count for count in _COUNTS], error=error)
    # Richardson's extrapolation at first order, from segments half as long.
    limit = moved[-1] + (moved[-1] - moved[-2])
    # One half of the last correction bounds what the extrapolation has left.
    standard_uncertainty = from_half_width(abs(limit - moved[-1]) / 2)
    return Evidence(
        found={
            "moved_fill": Found(value=limit, numerical=standard_uncertainty),
            "order": Found(value=study.settled_order),
            "finest_error": Found(value=study.finest_error),
        },
        numbers=_numbers(operation),
        series=(_figure(error),),
        convergence=(study.table("moved fill ratio, relative", 1.0),),
    )


def _numbers(operation: _Operation) -> dict[str, float]:
    brief = _Operation(drive=operation.drive, duration=_SHORT * operation.duration)
    return {
        "duration": operation.duration,
        "moved": operation.exact(),
        "single": operation.error(1),
        "segments_percent": _segments_for(operation, 1e-2),
        "segments_per_mille": _segments_for(operation, 1e-3),
        "short": brief.duration,
        "short_segments": _segments_for(brief, 1e-3),
    }


def _long_operation(scene: Scene) -> _Operation:
    law = paper_law(scene)
    full = law.max_fill_ratio
    drive = paper_drive(law, gas_pressure=scene.gas.pressure, fill=full, total=full)
    end = closed_form(drive, np.array([1e6])).event_time
    if not end:
        raise NotRunError("the gas pressure of this scene does not start the flow by Eq. 19: raise it")
    return _Operation(drive=drive, duration=_SHARE * end)


def _segments_for(operation: _Operation, tolerance: float) -> float:
    """Smallest number of segments within a tolerance: first guessed from the error of many, then counted."""
    exact, many = operation.exact(), _COUNTS[-1]
    count = max(1, int(np.ceil(many * operation.error(many) / tolerance)))
    while abs(operation.stepped(count) / exact - 1) > tolerance:
        count += 1
    return float(count)


def _figure(error: list[float]) -> Series:
    counts = np.array(_COUNTS, dtype=np.float64)
    first_order = error[0] * counts[0] / counts
    return figure(
        "error of the moved fill against the number of segments",
        ("segments", "1", counts),
        Curve("Eq. 20", "1", np.array(error), style="paper"),
        Curve("first order", "1", first_order, style="reference"),
        log=True,
    )
