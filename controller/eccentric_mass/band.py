"""Where the vibration of drawn devices lies over time."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from ringbalance.controller.balancer import TracedRun

_INSTANTS = 600


def amplitude_band(runs: Sequence[TracedRun], *, start: float, end: float) -> dict[str, Any]:
    """Least, middle and largest amplitude of runs at equally spaced times, each the largest since the last
    one, so that no peak is lost.

    Args: `start`, `end`: of the times, s. Returns: For JSON, SI; a run that ended before has its last value.
    """
    time = np.linspace(start, end, _INSTANTS)
    peaks = np.array([_peaks(run.run, time) for run in runs])
    low, middle, high = (row.tolist() for row in np.quantile(peaks, [0.0, 0.5, 1.0], axis=0))
    return {
        "time_s": time.tolist(),
        "low_m": low,
        "middle_m": middle,
        "high_m": high,
        "runs": len(runs),
        "settled": sum(each.settling_time is not None for each in runs),
    }


def _peaks(run: Any, time: Any) -> Any:
    edges = np.minimum(np.searchsorted(run.time, time), run.time.size - 1)
    since = np.concatenate([edges[:1], edges[:-1]])
    return [float(run.amplitude[a : max(b, a) + 1].max()) for a, b in zip(since, edges, strict=True)]
