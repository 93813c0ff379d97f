"""The run-up through the critical speed, balanced at low speed and locked.

The critical speed that the paper prints leaves the eccentric masses out.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from functools import lru_cache

import numpy as np

from ringbalance.controller.eccentric_mass.plant import PlantParameters
from ringbalance.controller.eccentric_mass.run import simulate_eccentric
from ringbalance.controller.eccentric_mass.run_record import EccentricRun
from ringbalance.controller.eccentric_mass.scene_records import EccentricScene
from ringbalance.verification.eccentric_scenes import changed, envelope, thinned
from ringbalance.verification.evidence import (
    Curve,
    Evidence,
    Found,
    Level,
    Reference,
    Series,
    figure,
    from_rounding,
)

_RPM = 30 / np.pi
_PRINTED = 135.0


reference = {"critical": Reference(value=_PRINTED, uncertainty=from_rounding(1.0))}


def compute(scene: EccentricScene, level: Level, defect: str | None = None) -> Evidence:
    """Peaks and critical speeds."""
    parameters = PlantParameters.of(scene)
    critical, without = (
        _RPM * math.sqrt(parameters.stiffness / mass) for mass in (parameters.mass, scene.rotor.mass)
    )
    balanced, locked = simulate_eccentric(scene), _locked(changed(scene, "sensor", position_noise=0.0))
    begins = scene.rotor.speed_profile[-2].time if len(scene.rotor.speed_profile) > 1 else 0.0
    largest, speed = _run_up_peak(locked, after=begins)
    peak = largest if defect else _run_up_peak(balanced, after=begins)[0]
    return Evidence(
        found={"critical": Found(value=critical, corrected=without), "peak": Found(value=peak / largest)},
        numbers={"locked": largest, "balanced": peak, "peak_speed": _RPM * speed, "without": without},
        series=(
            _amplitude_figure(
                "amplitude during the run-up",
                {"locked": locked, "balanced at 100 rpm": balanced},
                beside="locked",
            ),
        ),
    )


@lru_cache(maxsize=1)
def _locked(scene: EccentricScene) -> EccentricRun:
    """With locked masses; no sensor is looked at, so that one run serves every noise of the position."""
    return simulate_eccentric(changed(scene, "supervisor", strategy="locked"))


def _run_up_peak(run: EccentricRun, *, after: float) -> tuple[float, float]:
    """Largest amplitude from a time on, and the speed at which it falls. Returns: m and rad/s."""
    first = int(np.searchsorted(run.time, after))
    at = first + int(np.argmax(run.amplitude[first:]))
    return float(run.amplitude[at]), float(run.speed[at])


def _amplitude_figure(
    name: str, runs: Mapping[str, EccentricRun], *, until: float = math.inf, beside: str = ""
) -> Series:
    """Amplitude over time of runs with the same samples, by curve name; `beside` is one to compare with."""
    time = next(iter(runs.values())).time
    shown = time <= until
    curves = (
        Curve(label, "m", envelope(run.amplitude[shown]), style="reference" if label == beside else "found")
        for label, run in runs.items()
    )
    return figure(name, ("time", "s", thinned(time[shown])), *curves)
