"""Pressure that drives liquid through a whole straight tube at rest, beside the program's terms of k."""

from __future__ import annotations

from typing import Final

import numpy as np

from ringbalance.identification.data.measurements import Measurements, MeasurementsError
from ringbalance.physics.tube.ends import entrance_loss, exit_loss
from ringbalance.physics.tube.friction import friction_factor, friction_uncertainty
from ringbalance.scene.arrays import FloatArray
from ringbalance.scene.models import Tube
from ringbalance.verification.validation.kinds import Kind, Prediction

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
