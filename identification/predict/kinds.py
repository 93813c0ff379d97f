"""Every kind of measurement that is predicted, by its name in the data."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import Any, Final

import numpy as np

from ringbalance.identification.data.observations import Observations
from ringbalance.identification.predict import (
    flows,
    injections,
    positionings,
    pressures,
    run_ups,
    transfers,
    trial_weights,
)
from ringbalance.identification.predict.vibration import parts, spread_out, vector_covariance, vectors
from ringbalance.scene.arrays import FloatArray
from ringbalance.scene.uncertain import NORMAL_95


def _never(_scene: Any, _observations: Observations) -> str:
    return ""


@dataclass(frozen=True, kw_only=True)
class PredictedKind:
    """How one kind of data is predicted; a vibration counts as its real and its imaginary part."""

    predict: Callable[[Any, Observations, Any], FloatArray]
    """Scene, observations and models to what was measured."""
    measured: Callable[[Observations], FloatArray]
    covariance: Callable[[Observations], FloatArray]
    """Of the errors of `measured`; unit where the noise is to be estimated."""
    noise_given: Callable[[Observations], bool]
    column: Callable[[Observations], str]
    """The measured column whose noise it is."""
    informs: Callable[[Observations], tuple[str, ...]]
    """Parameters that are fitted to such data where the user names none."""
    free: Callable[[Observations], FloatArray] | None = None
    """Effect of unknowns that are no parameters, such as the vibration without trial weight, one column
    each."""
    too_long: Callable[[Any, Observations], str] = _never
    """Scene and observations to why predictions would take too long; empty where they do not."""


def _always(*names: str) -> Callable[[Observations], tuple[str, ...]]:
    return lambda _: names


def _by_scene_alone(predict: Callable[[Any, Observations], FloatArray]) -> Callable[..., FloatArray]:
    """A prediction that takes no models."""
    return lambda scene, observations, _: predict(scene, observations)


def _scalar_covariance(observations: Observations, column: str) -> FloatArray:
    """Of errors that are independent from row to row, shape (n, n); unit where their noise is not given."""
    given = observations.uncertainty.get(column)
    return np.diag(np.ones(len(observations)) if given is None else (given / NORMAL_95) ** 2)


def _numbers(column: Callable[[Observations], str], **declared: Any) -> PredictedKind:
    """One measured number a row, its errors independent from row to row."""
    return PredictedKind(
        measured=lambda observations: observations.columns[column(observations)],
        covariance=lambda observations: _scalar_covariance(observations, column(observations)),
        noise_given=lambda observations: column(observations) in observations.uncertainty,
        column=column,
        **declared,
    )


def _vibrations(predict: Callable[[Any, Observations], FloatArray], **declared: Any) -> PredictedKind:
    """One measured vibration a row."""
    return PredictedKind(
        predict=_by_scene_alone(predict),
        measured=lambda observations: parts(vectors(observations)),
        covariance=lambda observations: spread_out(
            vector_covariance(observations, given="amplitude" in observations.uncertainty)
        ),
        noise_given=lambda observations: "amplitude" in observations.uncertainty,
        column=lambda _: "amplitude",
        **declared,
    )


PREDICTED: Final[Mapping[str, PredictedKind]] = MappingProxyType(
    {
        "trial_weight": _vibrations(
            trial_weights.predict,
            informs=_always("influence_coefficient", "lag_angle"),
            free=trial_weights.free,
        ),
        "trial_amplitude": _numbers(
            lambda _: "amplitude",
            predict=_by_scene_alone(trial_weights.amplitudes),
            informs=_always("influence_coefficient", "initial_amplitude", "initial_phase"),
        ),
        "injection": PredictedKind(
            predict=injections.predict,
            measured=injections.measured,
            covariance=injections.covariance,
            noise_given=injections.noise_given,
            column=lambda _: "amplitude_after",
            informs=_always("lambda_factor", "bore", "extra_loss"),
        ),
        "transfer": _numbers(
            transfers.column, predict=transfers.predict, informs=_always("bore", "extra_loss")
        ),
        "flow": _numbers(lambda _: "flow_rate", predict=flows.predict, informs=_always("bore", "extra_loss")),
        "pressure": _numbers(
            lambda _: "pressure", predict=_by_scene_alone(pressures.predict), informs=_always("density")
        ),
        "run_up": _vibrations(
            run_ups.predict,
            informs=_always("rotor.stiffness", "rotor.damping", "imbalance.mass", "imbalance.phase"),
        ),
        "positioning": _numbers(
            lambda _: "angle",
            predict=_by_scene_alone(positionings.predict),
            informs=positionings.informs,
            too_long=positionings.too_long,
        ),
    }
)


def rows_of(observations: Observations, values: FloatArray) -> FloatArray:
    """Values of `measured`, one row of numbers for each row of the file, shape (n, 1) or (n, 2)."""
    return np.reshape(values, (-1, len(observations))).T
