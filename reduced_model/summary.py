"""A calibration in a few lines."""

from __future__ import annotations

from collections.abc import Iterator

from ringbalance.reduced_model.calibration import Calibration
from ringbalance.reduced_model.law.flow_law import Regime
from ringbalance.results.numbers import believed, measured, plain


def calibration_lines(calibration: Calibration) -> Iterator[str]:
    """Main quantities with their expanded uncertainties (95 %), and whether the models hold."""
    scene, point = calibration.scene, calibration.operating_point

    def quantity(name: str, unit: str, scale: float) -> str:
        budget = calibration.budgets[name]
        total = believed(budget.value, budget.total, stated=bool(scene.uncertainty))
        shown = measured(scale * budget.value, None if total is None else scale * total)
        return f"{plain(shown)} {unit}".rstrip()

    yield f"Calibration of {scene.name} ({scene.source})"
    yield f"lambda {quantity('lambda', 'mm', 1e3)} per transferred mass"
    yield f"usable moment {quantity('usable_moment', 'g mm', 1e6)} a pair"
    flow = f"{point.regime.label} at {point.gas_pressure / 1e6:.4g} MPa and equal fills"
    if point.regime is not Regime.BLOCKED:
        flow += f", {quantity('velocity', 'm/s', 1.0)}"
    if "drag_coefficient" in calibration.budgets:
        flow += f", k {quantity('drag_coefficient', '', 1.0)}"
    yield flow
    status = calibration.chamber.status
    yield "the models of the chamber hold over its range of fills" if status.ok else status.text
