"""Friction factors of straight tubes as measured, beside what the program predicts for the same tubes."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final, Protocol

import numpy as np

from ringbalance.physics.tube.friction import friction_factor, friction_uncertainty
from ringbalance.scene.arrays import BoolArray, FloatArray, IntArray, StringArray
from ringbalance.verification.validation.kinds import Kind, Prediction
from ringbalance.verification.validation.measurements import Measurements, measurements
from ringbalance.verification.validation.model_bias import ModelStatistics, model_statistics


class Formula(Protocol):
    """A friction factor, or its uncertainty, over the Reynolds number."""

    def __call__(self, *, reynolds: FloatArray, relative_roughness: float) -> FloatArray: ...


@dataclass(frozen=True, kw_only=True)
class FrictionPoints:
    """Measured Darcy friction factors of straight tubes at rest; all fields of one length."""

    reynolds: FloatArray
    relative_roughness: FloatArray
    """ks/d."""
    friction: FloatArray
    measurement_uncertainty: FloatArray
    """U_D (95 %), relative."""
    series: StringArray

    def where(self, chosen: slice | BoolArray | IntArray) -> FrictionPoints:
        """Some of the points."""
        return FrictionPoints(**{name: column[chosen] for name, column in vars(self).items()})

    def predicted(self) -> FloatArray:
        """The program's friction factor of each point."""
        return predicted_friction(self.reynolds, self.relative_roughness)

    def stated(self) -> FloatArray:
        """Expanded uncertainty (95 %) that the program states for it."""
        return _each(friction_uncertainty, self.reynolds, self.relative_roughness)

    def statistics(self, predicted: FloatArray) -> ModelStatistics:
        """How predicted friction factors stand to the measured ones."""
        return model_statistics(
            predicted=predicted,
            measured=self.friction,
            series=self.series,
            stated=self.stated(),
            measurement_uncertainty=self.measurement_uncertainty,
        )


def predicted_friction(reynolds: FloatArray, relative_roughness: FloatArray) -> FloatArray:
    """The program's friction factor of several straight tubes at rest, one a point."""
    return _each(friction_factor, reynolds, relative_roughness)


def _each(formula: Formula, reynolds: FloatArray, relative_roughness: FloatArray) -> FloatArray:
    found = np.empty_like(reynolds)
    for wall in np.unique(relative_roughness):
        here = relative_roughness == wall
        found[here] = formula(reynolds=reynolds[here], relative_roughness=float(wall))
    return found


def friction_points(*names: str) -> FrictionPoints:
    """The points of data sets, those of a tube in ascending order of the Reynolds number."""
    sets = [measurements(name) for name in names]
    joined = FrictionPoints(
        reynolds=np.concatenate([each.columns["reynolds"] for each in sets]),
        relative_roughness=np.concatenate(
            [each.columns.get("relative_roughness", np.zeros(len(each))) for each in sets]
        ),
        friction=np.concatenate([each.columns["friction_factor"] for each in sets]),
        measurement_uncertainty=np.concatenate([each.uncertainty for each in sets]),
        series=np.concatenate(
            [np.char.add(f"{name}: ", each.series) for name, each in zip(names, sets, strict=True)]
        ),
    )
    return joined.where(np.argsort(joined.reynolds, kind="stable"))


def _predict(data: Measurements) -> Prediction:
    reynolds = data.columns["reynolds"]
    wall = data.columns.get("relative_roughness", np.zeros(len(data)))
    return Prediction(
        value=predicted_friction(reynolds, wall), stated=_each(friction_uncertainty, reynolds, wall)
    )


FRICTION: Final = Kind(
    title="Darcy friction factor of a long straight tube at rest",
    measured="friction_factor",
    columns={"reynolds": "Reynolds number with the bore and the mean velocity"},
    optional={"relative_roughness": "ks/d, grain of the wall over the bore; smooth without this column"},
    predict=_predict,
)
