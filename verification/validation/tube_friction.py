"""Friction factors of straight tubes and ducts at rest, as the program predicts them for measurements."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Final

import numpy as np

from ringbalance.identification.data.measurements import Measurements, MeasurementsError
from ringbalance.physics.tube.friction import friction_factor, friction_uncertainty
from ringbalance.scene.arrays import FloatArray
from ringbalance.verification.validation.kinds import Kind, Prediction

_WIDEST: Final = 20
"""Long over short side of a duct that is accepted."""
_TERMS: Final = 100
"""Up to which odd terms of a series are summed that fall like 1/n^5."""


def laminar_ratio(aspect_ratio: FloatArray) -> FloatArray:
    """Laminar friction of rectangular ducts over that of a tube of their hydraulic diameter; 0 for tubes.

    f Re = 96/[(1 + 1/a)^2 (1 - 192/(pi^5 a) sum tanh(n pi a/2)/n^5)] over odd n, against 64.
    Source: Fourier series of the velocity across the short side.
    """
    a, n = np.maximum(aspect_ratio, 1.0), np.arange(1, _TERMS, 2)
    terms = np.sum(np.tanh(np.pi / 2 * n * a[:, None]) / n**5, axis=1)
    ratio = 1.5 / ((1 + 1 / a) ** 2 * (1 - 192 / (np.pi**5 * a) * terms))
    return np.where(aspect_ratio > 0, ratio, 1.0)


def _predict(data: Measurements) -> Prediction:
    none = np.zeros(len(data))
    aspect, roughness = (data.columns.get(name, none) for name in ("aspect_ratio", "relative_roughness"))
    if not np.all((aspect == 0) | ((aspect >= 1) & (aspect <= _WIDEST))):
        raise MeasurementsError(f"aspect_ratio must be 0 or from 1 to {_WIDEST} in every row")
    reynolds, ratio = data.columns["reynolds"], laminar_ratio(aspect)

    def each(formula: Callable[..., Any]) -> FloatArray:
        """One wall after the other."""
        found = np.empty_like(reynolds)
        for wall in np.unique(roughness):
            here = roughness == wall
            found[here] = formula(
                reynolds=reynolds[here], relative_roughness=float(wall), laminar_ratio=ratio[here]
            )
        return found

    return Prediction(value=each(friction_factor), stated=each(friction_uncertainty))


FRICTION: Final = Kind(
    title="Darcy friction factor of a long straight tube or duct at rest",
    measured="friction_factor",
    columns={"reynolds": "Reynolds number with the hydraulic diameter and the mean velocity"},
    optional={
        "relative_roughness": "ks/d, grain of the wall over the bore; smooth without this column",
        "aspect_ratio": "long over short side of a rectangular duct; 0, or no such column, for a tube",
    },
    predict=_predict,
)
