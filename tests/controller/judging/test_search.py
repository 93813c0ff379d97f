"""Settings chosen by runs, beside settings that were tried one by one."""

from __future__ import annotations

import numpy as np

from ringbalance.controller.balancer import Draws, balancer_of
from ringbalance.controller.judging.search import searched
from ringbalance.scene import bundled_scene, load_scene


def test_a_slow_valve_gets_settings_nearly_as_good_as_any_known() -> None:
    """Beside the best of 910 target-vector and 13 law-based settings, tried one by one on 256 devices."""
    valve = {"gas.conductance": "1 l/(s*bar)", "gas.critical_ratio": 0.3, "gas.valve_lag": "5 ms"}
    balancer = balancer_of(load_scene(bundled_scene("six_chamber")).with_values(valve))
    known = {"controller.kind": "law_based", "controller.gas_time_offset": (0.0199,)}
    chosen, best = balancer.run_all(
        [searched(balancer), known], Draws.block((1 << 21) + 4096, 256, complete=False)
    )
    assert np.mean(chosen.settled) >= np.mean(best.settled) - 0.05
