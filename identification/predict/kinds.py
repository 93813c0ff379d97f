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


@dataclass(frozen=True, kw_only=True)
class PredictedKind:
    """How one kind of data is predicted; a vibration counts as its real and its imaginary part."""

    predict: Callable[[Any, Observations, Any], FloatArray]
    """Scene, observations and models to what was measured."""
    measured: Callable[[Observations], FloatArray]
    covariance: Callable[[Observations], FloatArray]
    """Of the errors of `measured`; unit where the noise is to be estimated."""
    noise_given: Callable[[Observations], bool]
    free: Callable[[Observations], FloatArray]
    """Effect of unknowns that are no parameters, such as the vibration without trial weight, one column
    each."""
    column: Callable[[Observations], str]
    """The measured column whose noise it is."""
    too_long: Callable[[Any, Observations], str]
    """Scene and observations to why predictions would take too long; empty where they do not."""
    informs: Callable[[Observations], tuple[str, ...]]
    """Parameters that are fitted to such data where the user names none."""


def _always(*names: str) -> Callable[[Observations], tuple[str, ...]]:
    return lambda _: names


def _scalar_covariance(observations: Observations, column: str) -> FloatArray:
    """Of errors that are independent from row to row, shape (n, n); unit where their noise is not given."""
    given = observations.uncertainty.get(column)
    return np.diag(np.ones(len(observations)) if given is None else (given / NORMAL_95) ** 2)


def _never(_scene: Any, _observations: Observations) -> str:
    return ""


def _by_scene_alone(predict: Callable[[Any, Observations], FloatArray]) -> Callable[..., FloatArray]:
    """A prediction that takes no models."""
    return lambda scene, observations, _: predict(scene, observations)


def _nothing_free(numbers_per_row: int) -> Callable[[Observations], FloatArray]:
    """Nothing beside the parameters is fitted."""
    return lambda observations: np.zeros((numbers_per_row * len(observations), 0))


def _numbers(
    predict: Callable[..., FloatArray],
    column: Callable[[Observations], str],
    informs: Callable[[Observations], tuple[str, ...]],
    too_long: Callable[[Any, Observations], str] = _never,
) -> PredictedKind:
    """One measured number a row, its errors independent from row to row."""
    return PredictedKind(
        predict=predict,
        measured=lambda observations: observations.columns[column(observations)],
        covariance=lambda observations: _scalar_covariance(observations, column(observations)),
        noise_given=lambda observations: column(observations) in observations.uncertainty,
        free=_nothing_free(1),
        column=column,
        too_long=too_long,
        informs=informs,
    )


def _vibrations(
    predict: Callable[[Any, Observations], FloatArray],
    informs: Callable[[Observations], tuple[str, ...]],
    free: Callable[[Observations], FloatArray],
) -> PredictedKind:
    """One measured vibration a row."""
    return PredictedKind(
        predict=_by_scene_alone(predict),
        measured=lambda observations: parts(vectors(observations)),
        covariance=lambda observations: spread_out(
            vector_covariance(observations, given="amplitude" in observations.uncertainty)
        ),
        noise_given=lambda observations: "amplitude" in observations.uncertainty,
        free=free,
        column=lambda _: "amplitude",
        too_long=_never,
        informs=informs,
    )


PREDICTED: Final[Mapping[str, PredictedKind]] = MappingProxyType(
    {
        "trial_weight": _vibrations(
            trial_weights.predict, _always("influence_coefficient", "lag_angle"), trial_weights.free
        ),
        "trial_amplitude": _numbers(
            _by_scene_alone(trial_weights.amplitudes),
            lambda _: "amplitude",
            _always("influence_coefficient", "initial_amplitude", "initial_phase"),
        ),
        "injection": PredictedKind(
            predict=injections.predict,
            measured=injections.measured,
            covariance=injections.covariance,
            noise_given=injections.noise_given,
            free=_nothing_free(2),
            column=lambda _: "amplitude_after",
            too_long=_never,
            informs=_always("lambda_factor", "bore", "extra_loss"),
        ),
        "transfer": _numbers(transfers.predict, transfers.column, _always("bore", "extra_loss")),
        "flow": _numbers(flows.predict, lambda _: "flow_rate", _always("bore", "extra_loss")),
        "pressure": _numbers(_by_scene_alone(pressures.predict), lambda _: "pressure", _always("density")),
        "run_up": _vibrations(
            run_ups.predict,
            _always("rotor.stiffness", "rotor.damping", "imbalance.mass", "imbalance.phase"),
            _nothing_free(2),
        ),
        "positioning": _numbers(
            _by_scene_alone(positionings.predict),
            lambda _: "angle",
            positionings.informs,
            too_long=positionings.too_long,
        ),
    }
)


def rows_of(observations: Observations, values: FloatArray) -> FloatArray:
    """Values of `measured`, one row of numbers for each row of the file, shape (n, 1) or (n, 2)."""
    return np.reshape(values, (-1, len(observations))).T
