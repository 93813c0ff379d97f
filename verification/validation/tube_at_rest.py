"""Straight tubes and ducts at rest as the program predicts them for measurements: their friction factor, and
the pressure that drives liquid through a whole tube."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Final

import numpy as np

from ringbalance.identification.data.measurements import Measurements, MeasurementsError
from ringbalance.physics.tube.ends import entrance_loss, exit_loss
from ringbalance.physics.tube.friction import friction_factor, friction_uncertainty
from ringbalance.scene.arrays import FloatArray
from ringbalance.scene.models import Tube
from ringbalance.verification.validation.kinds import Kind, Prediction

_WIDEST: Final = 20
"""Long over short side of a duct that is accepted."""
_TERMS: Final = 100
"""Up to which odd terms of a series are summed that fall like 1/n^5."""
CALIBRATING: Final = (
    "tube 1 (bore)",
    "tube 2 (bore)",
    "tube 3 (bore)",
    "tube 4 (bore)",
    "tube 5 (bore)",
    "cut (bore)",
)
"""Points of Eisenklam that gave the bore of their tube, and are not judged."""
_LAMINAR: Final = 100.0
"""Critical Re over the usual one, for flow that is known to be laminar."""


def laminar_ratio(aspect_ratio: FloatArray) -> FloatArray:
    """Laminar friction of rectangular ducts over that of a tube of their hydraulic diameter; 0 for tubes.

    f Re = 96/[(1 + 1/a)^2 (1 - 192/(pi^5 a) sum tanh(n pi a/2)/n^5)] over odd n, against 64.
    Source: Fourier series of the velocity across the short side.
    """
    a, n = np.maximum(aspect_ratio, 1.0), np.arange(1, _TERMS, 2)
    terms = np.sum(np.tanh(np.pi / 2 * n * a[:, None]) / n**5, axis=1)
    ratio = 1.5 / ((1 + 1 / a) ** 2 * (1 - 192 / (np.pi**5 * a) * terms))
    return np.where(aspect_ratio > 0, ratio, 1.0)


def _friction(data: Measurements) -> Prediction:
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
    predict=_friction,
)


def _predict(data: Measurements) -> Prediction:
    """(rho u^2/2) (k + 1) with k of friction, entrance and exit; no bend, no rotation."""
    columns = {"laminar": np.zeros(len(data)), **data.columns}
    if not np.all(np.isin(columns["laminar"], (0.0, 1.0))):
        raise MeasurementsError("laminar must be 0 or 1 in every row")
    reynolds, slenderness = tube_numbers(data)
    critical = np.where(columns["laminar"] > 0, _LAMINAR, 1.0)
    rows = zip(slenderness, reynolds, critical, strict=True)
    k, half_width = np.array([tube_loss(*(float(value) for value in row)) for row in rows]).T
    velocity = reynolds * columns["kinematic_viscosity"] / columns["bore"]
    dynamic = columns["density"] * velocity**2 / 2
    return Prediction(value=dynamic * (k + 1), stated=dynamic * half_width)


def tube_numbers(data: Measurements) -> tuple[FloatArray, FloatArray]:
    """Re and L/d of each point."""
    columns = data.columns
    velocity = columns["flow"] / (np.pi / 4 * columns["bore"] ** 2)
    return velocity * columns["bore"] / columns["kinematic_viscosity"], columns["length"] / columns["bore"]


def tube_loss(slenderness: float, reynolds: float, critical: float) -> tuple[float, float]:
    """k of a smooth tube with a rounded entrance, and its expanded uncertainty (95 %).

    Args: `slenderness`: L/d. `critical`: critical Re over the usual one.
    """
    tube = _tube(slenderness)
    friction = {"reynolds": reynolds, "relative_roughness": 0.0, "critical_ratio": critical}
    terms: list[tuple[FloatArray, FloatArray]] = [
        (slenderness * friction_factor(**friction), slenderness * friction_uncertainty(**friction)),
        entrance_loss(tube=tube, reynolds=reynolds, critical_ratio=critical),
        exit_loss(tube=tube, reynolds=reynolds, critical_ratio=critical),
    ]
    values, half_widths = np.array(terms, dtype=np.float64).T
    return float(np.sum(values)), float(np.linalg.norm(half_widths))


def _tube(slenderness: float) -> Tube:
    return Tube(
        bore=1.0,
        port_radius=0.0,
        hump_radius=None,
        hump_position=0.5,
        hump_shape="arc",
        hump_gas="vented",
        length=slenderness,
        roughness=0.0,
        entrance="rounded",
        entrance_radius=1.0,
        bends=(),
        extra_loss=0.0,
        drag_coefficient=None,
    )


TUBE_AT_REST: Final = Kind(
    title="pressure that drives liquid through a straight smooth tube at rest",
    measured="pressure",
    columns={
        "flow": "volume of liquid in a time",
        "bore": "of the tube",
        "length": "of the tube, whose entrance is rounded and whose outlet is open",
        "density": "of the liquid",
        "kinematic_viscosity": "of the liquid",
    },
    optional={"laminar": "1 where flow is known to be laminar, whatever Re; 0 without this column"},
    predict=_predict,
)
