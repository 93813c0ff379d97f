"""Friction factors of straight tubes and ducts as measured, beside what the program predicts for the same."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final, Protocol

import numpy as np

from ringbalance.identification.data.measurements import Measurements, MeasurementsError
from ringbalance.physics.tube.friction import friction_factor, friction_uncertainty
from ringbalance.scene.arrays import BoolArray, FloatArray, IntArray, StringArray
from ringbalance.verification.evidence import Curve, Series, figure
from ringbalance.verification.validation.kinds import Kind, Prediction, measurements
from ringbalance.verification.validation.model_bias import ModelStatistics, model_statistics

_WIDEST: Final = 20
"""Long over short side of a duct that is accepted."""
_TERMS: Final = 100
"""Up to which odd terms of a series are summed that fall like 1/n^5."""


class Formula(Protocol):
    """A friction factor, or its uncertainty, over the Reynolds number."""

    def __call__(
        self, *, reynolds: FloatArray, relative_roughness: float, laminar_ratio: FloatArray
    ) -> FloatArray: ...


@dataclass(frozen=True, kw_only=True)
class FrictionPoints:
    """Measured Darcy friction factors of straight tubes and ducts at rest; all fields of one length."""

    reynolds: FloatArray
    """With the hydraulic diameter."""
    relative_roughness: FloatArray
    """ks/d."""
    laminar_ratio: FloatArray
    """Laminar friction over that of a circular tube, 1 for tubes."""
    friction: FloatArray
    measurement_uncertainty: FloatArray
    """U_D (95 %), relative."""
    series: StringArray

    def where(self, chosen: slice | BoolArray | IntArray) -> FrictionPoints:
        """Some of the points."""
        return FrictionPoints(**{name: column[chosen] for name, column in vars(self).items()})

    def predicted(self) -> FloatArray:
        """The program's friction factor of each point."""
        return self._each(friction_factor)

    def stated(self) -> FloatArray:
        """Expanded uncertainty (95 %) that the program states for it."""
        return self._each(friction_uncertainty)

    def _each(self, formula: Formula) -> FloatArray:
        found = np.empty_like(self.reynolds)
        for wall in np.unique(self.relative_roughness):
            here = self.relative_roughness == wall
            found[here] = formula(
                reynolds=self.reynolds[here],
                relative_roughness=float(wall),
                laminar_ratio=self.laminar_ratio[here],
            )
        return found

    def figure(self, of: str, predicted: FloatArray) -> Series:
        """Predicted friction factors with their stated uncertainty, and the measured ones."""
        return figure(
            f"friction factor of {of}, measured and predicted",
            ("Reynolds number", "1", self.reynolds),
            Curve("predicted", "1", predicted, uncertainty=self.stated()),
            Curve("measured", "1", self.friction, style="points"),
            log=True,
        )

    def statistics(self, predicted: FloatArray) -> ModelStatistics:
        """How predicted friction factors stand to the measured ones."""
        return model_statistics(
            predicted=predicted,
            measured=self.friction,
            series=self.series,
            stated=self.stated(),
            measurement_uncertainty=self.measurement_uncertainty,
        )


def friction_points(*names: str) -> FrictionPoints:
    """The points of data sets, in ascending order of the Reynolds number."""
    return joined(*(_points_of(measurements(name), prefix=f"{name}: ") for name in names))


def joined(*parts: FrictionPoints) -> FrictionPoints:
    """All points, in ascending order of the Reynolds number."""
    every = FrictionPoints(
        **{key: np.concatenate([getattr(part, key) for part in parts]) for key in vars(parts[0])}
    )
    return every.where(np.argsort(every.reynolds, kind="stable"))


def _points_of(data: Measurements, *, prefix: str = "") -> FrictionPoints:
    none = np.zeros(len(data))
    return FrictionPoints(
        reynolds=data.columns["reynolds"],
        relative_roughness=data.columns.get("relative_roughness", none),
        laminar_ratio=laminar_ratio(data.columns.get("aspect_ratio", none)),
        friction=data.columns["friction_factor"],
        measurement_uncertainty=data.uncertainty,
        series=np.char.add(prefix, data.series),
    )


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
    aspect = data.columns.get("aspect_ratio", np.zeros(len(data)))
    if not np.all((aspect == 0) | ((aspect >= 1) & (aspect <= _WIDEST))):
        raise MeasurementsError(f"aspect_ratio must be 0 or from 1 to {_WIDEST} in every row")
    points = _points_of(data)
    return Prediction(value=points.predicted(), stated=points.stated())


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
