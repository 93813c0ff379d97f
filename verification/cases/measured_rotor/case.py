"""Vibration of a rotor with known unbalances: what small ones teach, compared with larger ones."""

from __future__ import annotations

import dataclasses
import math
from typing import Final

import numpy as np

from ringbalance.identification.kinds.kind import Observations
from ringbalance.scene.arrays import FloatArray
from ringbalance.scene.loop_models import Rotor
from ringbalance.scene.models import Scene
from ringbalance.verification.evidence import Curve, Evidence, Found, Level, Reference, figure
from ringbalance.verification.validation.comparison import MUTATIONS, measurements

_WASHER: Final = 12.4e-6
"""Unbalance of a washer, kg m."""
_WASHER_UNCERTAINTY: Final = 0.5e-6
"""Of each, 95 %, kg m."""
_TAUGHT: Final = (0, 1, 2)
"""Numbers of washers that gave the coefficient."""
_PREDICTED: Final = (3, 4)


def compute(scene: Scene, level: Level, defect: str | None = None) -> Evidence:
    run = measurements("rodrigues_2011")
    rotor = _calibrated(scene.rotor, [_amplitude(run, "plain", count) for count in _TAUGHT])
    rotor = dataclasses.replace(
        rotor, influence_coefficient=MUTATIONS.get(defect, 1.0) * rotor.influence_coefficient
    )
    predicted = np.abs(rotor.vibration(_WASHER * np.arange(5)))
    spread = rotor.influence_coefficient * _WASHER_UNCERTAINTY / 2
    return Evidence(
        found={
            # Two washers taught the coefficient, so their error counts n/2 times, as sqrt(2) of one.
            f"washers_{count}": Found(value=float(predicted[count]), input=spread * count / math.sqrt(2))
            for count in _PREDICTED
        },
        reference=_reference(),
        numbers={
            "points": float(sum(_chosen(run, "plain", count).size for count in _PREDICTED)),
            "taught_points": float(sum(_chosen(run, "plain", count).size for count in _TAUGHT)),
            "worst_mean": max((predicted[n] / _amplitude(run, "plain", n) - 1 for n in _PREDICTED), key=abs),
            "influence_coefficient": rotor.influence_coefficient,
            "balls_up": _amplitude(run, "abb_runup", 4),
            "balls_down": _amplitude(run, "abb_rundown", 4),
        },
        series=(
            figure(
                "vibration of a rotor, measured and predicted",
                ("unbalance", "kg*m", _WASHER * np.arange(5)),
                Curve("predicted", "m", predicted),
                Curve(
                    "measured", "m", np.array([_amplitude(run, "plain", n) for n in range(5)]), style="points"
                ),
            ),
        ),
    )


def _reference() -> dict[str, Reference]:
    """The measured amplitudes; u_D of their scatter over the speeds and of the washers on the disc."""
    run = measurements("rodrigues_2011")
    found = {}
    for count in _PREDICTED:
        amplitude = _amplitude(run, "plain", count)
        washers = amplitude * _WASHER_UNCERTAINTY / (2 * _WASHER * math.sqrt(count))
        scatter = float(np.std(_chosen(run, "plain", count), ddof=1))
        found[f"washers_{count}"] = Reference(value=amplitude, uncertainty=math.hypot(washers, scatter))
    return found


def _calibrated(rotor: Rotor, amplitudes: list[float]) -> Rotor:
    """The rotor whose amplitudes with none, one and two washers are the measured ones.

    |V0 + n K u|^2 = |V0|^2 + 2 n Re(V0* K u) + n^2 |K u|^2 for n = 0, 1, 2 gives |V0|, |K u| and the angle
    between them.
    """
    none, one, two = (a**2 for a in amplitudes)
    square = (two - 2 * one + none) / 2
    cosine = (one - none - square) / (2 * math.sqrt(square * none))
    return dataclasses.replace(
        rotor,
        influence_coefficient=math.sqrt(square) / _WASHER,
        lag_angle=0.0,
        initial_amplitude=amplitudes[0],
        initial_phase=math.acos(cosine),
    )


def _amplitude(run: Observations, series: str, washers: int) -> float:
    """Mean over all speeds, m."""
    return float(np.mean(_chosen(run, series, washers)))


def _chosen(run: Observations, series: str, washers: int) -> FloatArray:
    here = (run.series == series) & (run.columns["washers"] == washers)
    return np.asarray(run.columns["amplitude"][here], dtype=np.float64)
