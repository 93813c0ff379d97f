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
    trial_amplitudes,
    trial_weights,
)
from ringbalance.scene.arrays import FloatArray


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
    informs: tuple[str, ...]
    """Parameters that are fitted to such data where the user names none."""


def _named(name: str) -> Callable[[Observations], str]:
    return lambda _: name


def _never(_scene: Any, _observations: Observations) -> str:
    return ""


def _closed_form(predict: Callable[[Any, Observations], FloatArray]) -> Callable[..., FloatArray]:
    """A prediction that takes no models."""
    return lambda scene, observations, _: predict(scene, observations)


def _kind(
    module: Any, column: str | Callable[[Observations], str], *informs: str, by_law: bool = True
) -> PredictedKind:
    return PredictedKind(
        predict=module.predict if by_law else _closed_form(module.predict),
        measured=module.measured,
        covariance=module.covariance,
        noise_given=module.noise_given,
        free=module.free,
        column=_named(column) if isinstance(column, str) else column,
        too_long=getattr(module, "too_long", _never),
        informs=informs,
    )


PREDICTED: Final[Mapping[str, PredictedKind]] = MappingProxyType(
    {
        "trial_weight": _kind(trial_weights, "amplitude", "influence_coefficient", "lag_angle", by_law=False),
        "trial_amplitude": _kind(
            trial_amplitudes,
            "amplitude",
            "influence_coefficient",
            "initial_amplitude",
            "initial_phase",
            by_law=False,
        ),
        "injection": _kind(injections, "amplitude_after", "lambda_factor", "bore", "extra_loss"),
        "transfer": _kind(transfers, transfers.column, "bore", "extra_loss"),
        "flow": _kind(flows, "flow_rate", "bore", "extra_loss"),
        "pressure": _kind(pressures, "pressure", "density", by_law=False),
        "run_up": _kind(
            run_ups,
            "amplitude",
            "rotor.stiffness",
            "rotor.damping",
            "imbalance.mass",
            "imbalance.phase",
            by_law=False,
        ),
        "positioning": _kind(
            positionings,
            "angle",
            "masses.friction_arm[0]",
            "motor.torque_constant",
            "motor.back_emf_constant",
            by_law=False,
        ),
    }
)


def rows_of(observations: Observations, values: FloatArray) -> FloatArray:
    """Values of `measured`, one row of numbers for each row of the file, shape (n, 1) or (n, 2)."""
    return np.reshape(values, (-1, len(observations))).T
