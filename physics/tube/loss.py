"""Loss coefficient k(u) of the connecting tube, k = 2 (H_A - H_C)/u^2 - 1, from laminar to turbulent flow,
and where its correlations are used outside what their sources state."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from enum import StrEnum
from typing import Final

import numpy as np
import numpy.typing as npt

from ringbalance.physics.results import Estimate, Status, StatusCode
from ringbalance.physics.tube.bends import bend_in_range
from ringbalance.physics.tube.ends import LAMINAR_ENTRY_LENGTH
from ringbalance.physics.tube.rotation import STRAIGHT_CRITICAL_REYNOLDS
from ringbalance.physics.tube.rotation_table import rotation_table_covers
from ringbalance.physics.tube.state import TubeState, tube_state
from ringbalance.physics.tube.uncertainty import uncertainty_parts, with_errors
from ringbalance.scene.arrays import BoolArray, FloatArray
from ringbalance.scene.models import Scene, Tube

FULLY_TURBULENT_REYNOLDS: Final = 4000.0
"""Re above which a straight tube's flow is taken as turbulent."""
LARGEST_REYNOLDS: Final = 1e6
"""End of the data that the friction formula is compared with."""
LARGEST_ROUGHNESS: Final = 0.05
"""eps/d up to which the friction formula is compared with data, rounded up from 0.033."""
VELOCITIES: Final = (0.1, 20.0)
"""m/s: range for which k is calibrated."""


class FlowState(StrEnum):
    """State of the flow in the tube."""

    LAMINAR = "laminar"
    TRANSITIONAL = "transitional"
    TURBULENT = "turbulent"


@dataclass(frozen=True, kw_only=True)
class TubeLoss:
    """Loss coefficient of the tube over an array of velocities."""

    velocity: FloatArray
    """u, m/s, positive."""
    reynolds: FloatArray
    """Re."""
    rotation_reynolds: float
    """R_Om."""
    k: Estimate
    """k with its expanded uncertainty (95 %), all parts combined as the root of the sum of their squares."""
    terms: Mapping[str, FloatArray]
    """What k is the sum of: entrance, friction, rotation, bends, exit, extra; or "decree" alone."""
    uncertainty_parts: Mapping[str, FloatArray]
    """What k's half-width is made of."""
    flow_state: npt.NDArray[np.str_]
    """Values of `FlowState`."""
    in_range: BoolArray
    """False wherever a correlation is used outside the range that its source states."""
    range_notes: Mapping[str, BoolArray]
    """Why not: a sentence, and where it holds."""
    state: TubeState
    """Of the same velocities."""


def tube_loss(scene: Scene, velocity: npt.ArrayLike) -> TubeLoss:
    """Loss coefficient k(u) of a full tube between two chambers.

    k + 1 = f L/d + rotation + K_entrance + K_bends + extra + (1 + K_exit); the "1" is the exit loss of
    turbulent flow, so K_exit holds only what a laminar exit adds.  k is smooth in u and (k + 1) u^2 grows
    with u, so that a head has one velocity.
    Args: `velocity`: u, mean over the bore, m/s, any shape, positive.
    Raises: ValueError: a velocity that is not positive and finite, or arcs longer than the tube.
    Range: calibrated from 0.1 to 20 m/s; `in_range` and `range_notes` say where a correlation is stretched.
    Source: definition of k from Eq. 14 of the liquid-ring paper; the sources of the terms stand with them.
    """
    u = np.asarray(velocity, dtype=np.float64)
    if not np.all(np.isfinite(u) & (u > 0)):
        raise ValueError("velocity must be positive and finite")
    state = tube_state(scene, u)
    right = with_errors(tube=scene.tube, state=state)
    parts = uncertainty_parts(scene, velocity=u, state=state)
    notes = range_notes(tube=scene.tube, state=state, velocity=u)
    outside = np.any(np.array([np.zeros(u.shape, dtype=np.bool_), *notes.values()]), axis=0)
    return TubeLoss(
        velocity=u,
        reynolds=state.reynolds,
        rotation_reynolds=float(state.rotation_reynolds),
        k=_estimate(right, parts, bool(np.any(outside))),
        terms=dict(right.terms),
        uncertainty_parts=dict(parts),
        flow_state=flow_states(state),
        in_range=np.asarray(~outside),
        range_notes=dict(notes),
        state=right,
    )


def _estimate(state: TubeState, parts: Mapping[str, FloatArray], stretched: bool) -> Estimate:
    half_width = np.sqrt(np.asarray(sum(p**2 for p in parts.values()), dtype=np.float64))
    if not stretched:
        return Estimate(value=state.k, uncertainty=half_width)
    text = "a correlation is used outside its stated range at some velocities: see in_range and range_notes"
    return Estimate(
        value=state.k,
        uncertainty=half_width,
        status=Status(code=StatusCode.OUT_OF_RANGE, text=text),
    )


def flow_states(state: TubeState) -> npt.NDArray[np.str_]:
    """Laminar, transitional or turbulent, by the critical Re of the turning tube: values of `FlowState`."""
    critical = state.critical_ratio * STRAIGHT_CRITICAL_REYNOLDS
    turbulent = state.critical_ratio * FULLY_TURBULENT_REYNOLDS
    return np.select(
        [state.reynolds < critical, state.reynolds < turbulent],
        [FlowState.LAMINAR.value, FlowState.TRANSITIONAL.value],
        FlowState.TURBULENT.value,
    ).astype(np.str_)


def range_notes(*, tube: Tube, state: TubeState, velocity: FloatArray) -> dict[str, BoolArray]:
    """For each sentence that holds anywhere on why a correlation is stretched, where it holds."""
    re, rotation = state.reynolds, state.rotation_reynolds
    laminar = re < state.critical_ratio * STRAIGHT_CRITICAL_REYNOLDS
    unsteady = ~laminar & (re < state.critical_ratio * FULLY_TURBULENT_REYNOLDS)
    low, high = VELOCITIES
    notes = {"velocity outside 0.1 to 20 m/s": (velocity < low * (1 - 1e-9)) | (velocity > high * (1 + 1e-9))}
    if tube.drag_coefficient is None:
        shapes = [bend_in_range(bend=b, bore=tube.bore) for b in tube.bends]
        untested = ~rotation_table_covers(reynolds=re, rotation_reynolds=rotation)
        developing = LAMINAR_ENTRY_LENGTH * re * tube.bore > tube.length
        notes |= {
            "friction: Re above 1e6": re > LARGEST_REYNOLDS,
            "friction: relative roughness above 0.05": np.broadcast_to(
                tube.roughness > LARGEST_ROUGHNESS * tube.bore, re.shape
            ),
            "rotation: laminar factor beyond Kl = 1e7 or R_Om = 1e5": (laminar | unsteady) & untested,
            "rotation: critical Re extrapolated beyond R_Om = 2000": unsteady & (rotation > 2000),
            "bends: scaled from one computed shape in laminar flow": (laminar | unsteady) & bool(tube.bends),
            "bends: angle above 180 deg or radius below d/2": np.broadcast_to(
                ~np.all(np.broadcast_arrays(True, *shapes), axis=0), re.shape
            ),
            "ends: tube too short for a developed laminar profile": laminar & developing,
        }
    return {text: where for text, where in notes.items() if np.any(where)}
