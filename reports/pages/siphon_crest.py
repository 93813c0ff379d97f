"""The pressure along the tube's path in each regime, with the margin before the column separates."""

from __future__ import annotations

from typing import Final

import numpy as np

from ringbalance.reduced_model.law.calibrated_law import CalibratedLaw
from ringbalance.reduced_model.law.flow_law import Regime
from ringbalance.reduced_model.tube.pressure_profile import HumpProfile, hump_profile
from ringbalance.reports.figures.siphon_crest import path_figure
from ringbalance.reports.numbers import MISSING
from ringbalance.reports.section import Record, Section, Work
from ringbalance.reports.units import given, shown
from ringbalance.scene.models import Scene

_POINTS: Final = 161
_SHARES: Final = np.linspace(0.06, 0.94, 23)
"""Fills at which a regime is looked for, as shares of the largest."""
_FACTORS: Final = (1.0, 0.6, 0.3, 1.5, 2.0)
"""Gas pressures at which it is looked for, over the scene's."""
_ORDER: Final = (Regime.SIPHON, Regime.SEPARATED, Regime.BLOCKED, Regime.REVERSE)


def collect(work: Work) -> Record | None:
    """One operating state of every regime that this tube can be in, with its pressures along the path.

    Args: `work`: scene, calibration and level.
    Returns: Record; None for a tube without a crest.
    """
    law = work.calibration.flow_law
    if work.scene.tube.hump_radius is None:
        return None
    found = [(regime, _state_in(regime, work.scene, law)) for regime in _ORDER]
    return {
        "hump_radius_m": work.scene.tube.hump_radius,
        "states": [_record(work.scene, law, *state) for _, state in found if state is not None],
        "absent": [regime.label for regime, state in found if state is None],
    }


def _state_in(regime: Regime, scene: Scene, law: CalibratedLaw) -> tuple[float, float, bool] | None:
    """Fill, gas pressure and whether the tube is primed, of the first pressure with that regime."""
    fills, primed = _SHARES * law.max_fill_ratio, regime is Regime.REVERSE
    for pressure in (0.0,) if primed else tuple(f * scene.gas.pressure for f in _FACTORS):
        flow = law.evaluate(fill_ratio=fills, gas_pressure=pressure, primed=primed)
        there = np.flatnonzero(flow.regime == regime)
        if there.size:
            return float(fills[there[there.size // 2]]), pressure, primed
    return None


def _record(scene: Scene, law: CalibratedLaw, fill: float, pressure: float, primed: bool) -> Record:
    found: HumpProfile = hump_profile(
        scene=scene, law=law, fill_ratio=fill, gas_pressure=pressure, primed=primed, points=_POINTS
    )
    return {
        "regime": found.regime.label,
        "fill_ratio": fill,
        "opposite_fill_ratio": law.max_fill_ratio - fill,
        "gas_pressure_Pa": pressure,
        "velocity_m_s": found.velocity,
        "path_m": found.path.tolist(),
        "pressure_Pa": found.pressure.tolist(),
        "full": found.full.astype(int).tolist(),
        "hump_path_m": found.hump_path,
        "hump_pressure_Pa": found.hump_pressure,
        "cavity_pressure_Pa": found.cavity_pressure,
        "margin_Pa": found.cavitation_margin,
        "margin_uncertainty_Pa": found.cavitation_margin_uncertainty,
    }


def _judged(state: Record) -> str:
    margin, width = state["margin_Pa"], state["margin_uncertainty_Pa"]
    if margin is None:
        return MISSING
    if width is not None and abs(margin) <= width:
        return "cannot be told"
    return "holds" if margin > 0 else "separates"


def _row(state: Record) -> Record:
    pressures = {
        name: shown(state[f"{name}_Pa"], "Pa", digits=3) for name in ("hump_pressure", "cavity_pressure")
    }
    return {
        "regime": state["regime"],
        "fills": f"{state['fill_ratio']:.3f}, {state['opposite_fill_ratio']:.3f}",
        "gas": given(state["gas_pressure_Pa"], "Pa", digits=3),
        "velocity": shown(state["velocity_m_s"], "m/s", digits=3),
        **pressures,
        "margin": shown(state["margin_Pa"], "Pa", state["margin_uncertainty_Pa"]),
        "column": _judged(state),
    }


def view(evidence: Record) -> Record | None:
    """The section's table and figure.

    Args: `evidence`: the whole document.
    Returns: Record; None where the evidence has none of it.
    """
    found = evidence.get("hump")
    if not found or not found["states"]:
        return None
    return {
        "rows": [_row(state) for state in found["states"]],
        "absent": " and ".join(found["absent"]),
        "figure": path_figure(found),
    }


SECTION: Final = Section(name="hump", title="Pressure over the siphon crest", collect=collect, view=view)
