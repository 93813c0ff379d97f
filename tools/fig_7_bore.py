"""Bores that give the rate of the liquid-ring paper's Fig. 7, under k = 50 and under the calibrated law.

python tools/fig_7_bore.py    prints both bores; scenes/liquid_ring_paper*.toml state them, rounded

The paper gives no bore. Its Fig. 7 fixes the fall of the vibration per second of gas, K lambda rho S u at
equal fills, so a bore follows from a flow law and the other values of the scene.
"""

from __future__ import annotations

from collections.abc import Callable

from scipy.optimize import brentq

import ringbalance as rb
from ringbalance.reduced_model.law.flow_law import BalancerModel
from ringbalance.scene import Scene, bundled_scene, liquid_ring_scene, load_scene

RATE = 7.2e-6
"""Fall of the vibration per second of gas, m/s, read off Fig. 7."""
SHORTEST, LONGEST = 0.5e-3, 2.5e-3
"""Limits of the search for a bore, m."""
_MOVED = 1e-4
"""Fill ratio moved from one chamber to the other; the pair's moment is odd in it."""


def paper_model(scene: Scene) -> BalancerModel:
    """Model with k = 50 and lambda = 72 mm."""
    return BalancerModel.of(rb.paper_law(scene))


def calibrated_model(scene: Scene) -> BalancerModel:
    """Model with the calibrated law and moment."""
    return rb.calibrate(scene).model


def rate(scene: Scene, model: BalancerModel) -> tuple[float, float]:
    """Fall of the vibration per second of gas at equal fills, m/s, with the law's expanded uncertainty."""
    fill = scene.disc.max_fill_ratio / 2
    flow = model.flow.evaluate(fill_ratio=fill, gas_pressure=scene.gas.pressure)
    pair = model.moment.pair_moment(fill_ratio=fill + _MOVED, opposite_fill_ratio=fill - _MOVED)
    per_volume = abs(float(pair)) / (_MOVED * model.chamber_volume)
    factor = scene.rotor.influence_coefficient * per_volume * model.tube_area
    return factor * float(flow.velocity), factor * float(flow.uncertainty)


def bore(scene: Scene, model_of: Callable[[Scene], BalancerModel]) -> float:
    """Bore, m, at which the rate is that of Fig. 7."""

    def excess(diameter: float) -> float:
        changed = scene.with_values({"tube.bore": diameter})
        return rate(changed, model_of(changed))[0] - RATE

    return float(brentq(excess, SHORTEST, LONGEST, xtol=1e-7))


if __name__ == "__main__":
    PAPER = liquid_ring_scene(load_scene(bundled_scene("liquid_ring_paper")))
    for name, model_of in (("k = 50", paper_model), ("calibrated law", calibrated_model)):
        print(f"{name}: {bore(PAPER, model_of) * 1e3:.4f} mm")
