"""Overshoots and misadjustments, from what was sampled."""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import pairwise
from typing import Final

from ringbalance.controller.formulas.stopping import has_risen, has_turned
from ringbalance.controller.simulation import Sample

ROUND_OFF: Final = 1e-9
"""Relative to the initial amplitude: a smaller rise is arithmetic."""
NOISE_DEVIATIONS: Final = 3.0


def noise_floor(*, amplitude_noise: float, initial_amplitude: float) -> float:
    """Rise of the amplitude between two samples that noise alone does not explain.

    3 sqrt(2) sigma: three standard deviations of the difference of two samples.
    Args: `amplitude_noise`: sigma, m. `initial_amplitude`: m; a billionth of it guards against round-off.
    Returns: m.
    """
    return NOISE_DEVIATIONS * math.sqrt(2) * amplitude_noise + ROUND_OFF * initial_amplitude


def overshoots(samples: Sequence[Sample], *, limit: float) -> int:
    """Times that the residual turned by more than 90 degrees between usable samples while above the limit.

    Args: `samples`: of one run, in order. `limit`: m.
    """
    seen = [m for s in samples if (m := s.measurement) is not None and m.usable(needs_phase=True)]
    return sum(b.amplitude > limit and has_turned(a.phase, b.phase) for a, b in pairwise(seen))


def misadjustments(samples: Sequence[Sample], *, floor: float) -> int:
    """Operations after which the measured amplitude was higher by more than the noise floor.

    Args: `samples`: of one run, in order; one without a usable amplitude is passed over. `floor`: m.
    """
    count, before, operated = 0, math.inf, False
    for sample in samples:
        if sample.measurement is not None and sample.measurement.usable(needs_phase=False):
            count += operated and has_risen(before, sample.measurement.amplitude, floor)
            before, operated = sample.measurement.amplitude, False
        operated = operated or bool(sample.command.valves)
    return count
