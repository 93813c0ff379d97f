"""Loss coefficient k(u) of the connecting tube, k = 2 (H_A - H_C)/u^2 - 1, and its uncertainty.

The uncertainty combines the spread of each correlation and the effect of each uncertain input; notes report
where correlations are used outside the range of their sources.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from enum import StrEnum
from typing import Final

import numpy as np
import numpy.typing as npt

from ringbalance.physics.results import Estimate, Status, StatusCode
from ringbalance.physics.tube.friction import (
    STRAIGHT_CRITICAL_REYNOLDS,
    friction_factor,
    friction_uncertainty,
    turbulent_friction_ratio,
    turbulent_ratio_uncertainty,
    turbulent_share,
)
from ringbalance.physics.tube.local_losses import (
    LAMINAR_ENTRY_LENGTH,
    bend_in_range,
    bend_uncertainty,
    entrance_uncertainty,
    exit_uncertainty,
    straight_length,
)
from ringbalance.physics.tube.rotation_table import rotating_friction_ratio, rotation_table_covers
from ringbalance.physics.tube.state import TubeState, tube_state
from ringbalance.scene.arrays import BoolArray, FloatArray
from ringbalance.scene.designs import changes_of
from ringbalance.scene.errors import by_group, uncertainties
from ringbalance.scene.models import Scene, Tube
from ringbalance.scene.uncertain import NORMAL_95, fitted_causes

INPUT_PART: Final = "input: "
"""Prefix of the names of parts by inputs."""
MODEL_CAUSES: Final[Mapping[str, str]] = {
    "friction correlation": "friction",
    "rotation model": "rotation",
    "rotation entry": "rotation",
    "ends": "entrance",
    "bends": "bends",
}
"""Causes of `model_parts`, each with the term of k that its error changes."""
BUILT_CAUSES: Final[Mapping[str, tuple[str, float]]] = {
    "friction as built": ("friction", 0.04),
    "rotation as built": ("rotation", 0.4),
    "entrance as built": ("entrance", 0.2),
    "bends as built": ("bends", 0.4),
}
"""Departures of a tube as it was built: the term of k, and its expanded uncertainty (95 %), relative.

Correlations are for straight round tubes and clean edges.  A tube that follows the circle of the crest has a
secondary flow of its own, not small against that of rotation; a bore out of round changes f by some percent;
an edge broken by 2 % of the bore takes a fifth off K; handbooks give K of one bend with a spread of half of
it. They apply to parameters fitted to a built tube; the uncertainty of k for a design has none of them.
"""
TUBE_INPUTS: Final = (
    "bore",
    "length",
    "roughness",
    "extra_loss",
    "drag_coefficient",
    "kinematic_viscosity",
    "speed",
)
"""Quantities of a scene that k depends on."""
_TERMS: Final = {**MODEL_CAUSES, **{cause: term for cause, (term, _) in BUILT_CAUSES.items()}}
_CREEPING: Final = 0.2
_INERTIAL: Final = 57.0
_EKMAN: Final = 47.21
_LARGEST_ERROR_SHARE: Final = 0.5
"""Largest error of a constant k, over k."""
_LEAST_SHARE: Final = 0.1
"""Least fraction of a k by correlations that the errors of its models leave."""
DEVELOPMENT_SHARE: Final = 1.0
"""Half-width of the loss by developing flow, over rotation's extra friction on one developing length.

The value 1 stands for a secondary flow that begins only after that length.  Three-dimensional solutions
of the inlet, a parabola or a blunt profile, at (Re, R) = (100, 100), (200, 50) and (20, 200), gave from -0.70
to +0.20, beyond the loss of the same inlet at rest: a blunt one loses less where rotation keeps flow blunt.
"""


def uncertainty_parts(scene: Scene, *, velocity: FloatArray, state: TubeState) -> Mapping[str, FloatArray]:
    """Expanded uncertainties (95 %) of k by cause; independent, so they combine as root sum of squares.

    Args: `state`: the terms of k of the scene's tube at these velocities.
    Returns: Half-width of k by cause, each the shape of `velocity`; "input: fitted" is that of all inputs
        that were fitted together. Parts that vanish everywhere are kept.
    Source: ASME V&V 20-2009, input uncertainty by sensitivity; model spreads are given with the correlations.
    """
    errors = uncertainties(scene, among=TUBE_INPUTS, models=False)
    _, changes = changes_of(scene, lambda each: corrected_state(each.scene, velocity[..., None]).k, errors)
    effects = by_group(errors, changes)
    by_input = {f"{INPUT_PART}{name}": effect for name, effect in effects.items()}
    by_model = model_parts(tube=scene.tube, state=state)
    # The scene's joint distribution holds the errors of these causes.
    fitted = fitted_causes(scene)
    return {cause: part for cause, part in by_model.items() if cause not in fitted} | by_input


def model_parts(*, tube: Tube, state: TubeState) -> dict[str, FloatArray]:
    """Expanded uncertainties (95 %) of k by the correlations and tables themselves.

    Returns: Half-width of k by cause, each the shape of the state's arrays; none of a prescribed k.
    Source: the spreads are given with the correlations.
    """
    if tube.drag_coefficient is not None:
        return {}
    re, rough, ratio = state.reynolds, tube.roughness / tube.bore, state.critical_ratio
    straight = straight_length(tube=tube) / tube.bore
    numbers = {"reynolds": re, "rotation_reynolds": state.rotation_reynolds}
    lam, turbulent = rotating_friction_ratio(**numbers), turbulent_friction_ratio(**numbers)
    friction = friction_uncertainty(
        reynolds=re,
        relative_roughness=rough,
        laminar_ratio=lam.value,
        turbulent_ratio=turbulent,
        critical_ratio=ratio,
    )
    higher = friction_factor(
        reynolds=re,
        relative_roughness=rough,
        laminar_ratio=lam.value + lam.uncertainty,
        turbulent_ratio=turbulent + turbulent_ratio_uncertainty(**numbers),
        critical_ratio=ratio,
    )
    ends = (
        entrance_uncertainty(tube=tube, reynolds=re, critical_ratio=ratio),
        exit_uncertainty(tube=tube, reynolds=re, critical_ratio=ratio, friction_ratio=lam.value),
    )
    smooth = friction_factor(reynolds=re, relative_roughness=rough)
    bends = (
        bend_uncertainty(bend=bend, bore=tube.bore, friction_factor=smooth, critical_ratio=ratio, **numbers)
        for bend in tube.bends
    )
    development = _development_uncertainty(
        length=tube.length,
        bore=tube.bore,
        developing=developing_length(friction_ratio=lam.value, **numbers),
        rotation_loss=state.terms["rotation"],
    )
    laminar = 1 - turbulent_share(reynolds=re, critical_ratio=ratio)
    return {
        "friction correlation": straight * friction,
        "rotation model": tube.length / tube.bore * (higher - state.rotating_friction),
        "rotation entry": laminar * development,
        "ends": np.sqrt(sum(e**2 for e in ends)),
        # One cause, so those of all bends add up.
        "bends": np.asarray(sum(bends, start=np.zeros(state.reynolds.shape))),
    }


def with_errors(*, tube: Tube, state: TubeState) -> TubeState:
    """State of the tube with the errors of its models that `Tube.model_errors` assumes.

    e(Re) = (U/1.96) (n cos ln Re + m sin ln Re) of each cause, n and m its two parts: a random function of
    standard deviation U/1.96 at every Re, with the correlation cos(ln Re - ln Re') between two of them.  Over
    a small range that is a level and a slope of U/1.96 per e-fold of Re, which is what the residuals of
    measured smooth tubes have.
    Errors of a constant k are limited to half of it, and errors of another k leave at least a tenth: no error
    turns a loss into a gain.
    """
    if not tube.model_errors:
        return state
    terms, bends = dict(state.terms), state.bends
    # By the models, and by what differs in a tube that was built.
    built = {
        cause: share * np.abs(state.terms[term])
        for cause, (term, share) in BUILT_CAUSES.items()
        if term in state.terms
    }
    parts = model_parts(tube=tube, state=state) | built
    angle, lumped = np.log(state.reynolds), np.zeros(state.k.shape)
    for each in tube.model_errors:
        if each.cause not in parts:
            continue
        width = parts[each.cause]
        error = width / NORMAL_95 * (each.even * np.cos(angle) + each.odd * np.sin(angle))
        if "decree" in terms:
            lumped = lumped + error
            continue
        term = _TERMS[each.cause]
        if term == "bends":
            bends = tuple(k * (1 + error / terms[term]) for k in bends)
        terms[term] = terms[term] + error
    if "decree" in terms:
        # Below the largest error, and unchanged while it is small against that.
        largest = _LARGEST_ERROR_SHARE * state.k
        terms["decree"] = terms["decree"] + lumped * (1 + (lumped / largest) ** 4) ** -0.25
    # One factor makes all errors smaller where they leave too little of k.
    wrong = replace(state, terms=terms, bends=bends)
    most, change = (1 - _LEAST_SHARE) * state.k, state.k - wrong.k
    if not np.any(change > most):
        return wrong
    part = np.where(change > most, most / np.where(change > most, change, 1.0), 1.0)
    terms = {name: term + part * (terms[name] - term) for name, term in state.terms.items()}
    bends = tuple(k + part * (with_error - k) for k, with_error in zip(state.bends, bends, strict=True))
    return replace(state, terms=terms, bends=bends)


def corrected_state(scene: Scene, velocity: npt.ArrayLike) -> TubeState:
    """`tube_state` with the scene's corrections of its models."""
    return with_errors(tube=scene.tube, state=tube_state(scene, velocity))


def developing_length(
    *, reynolds: npt.ArrayLike, rotation_reynolds: npt.ArrayLike, friction_ratio: npt.ArrayLike
) -> FloatArray:
    """Bound of the length on which the slowest disturbance of laminar rotating flow falls by e, in diameters.

    l/d = 0.2 + Re/(57 F) + sqrt(R)/47.21

    The three terms are the creeping end effect; the convection of vorticity, 0.0175 Re without rotation; and
    the exact limit of fast rotation without inertia, geostrophic flow over the section's depth that friction
    in its Ekman layers damps.
    Args: `friction_ratio`: F of developed laminar flow there, broadcasts.
    Returns: l/d, of the broadcast shape: at least the length of the section's eigenproblem, at most 3 times
        it.
    Range: compared with the decay rates of the case `developing_flow` for Re up to 2000, R up to 1e4, R Re
        up to 3e5.
    Source: our bound of computed decay rates, with exact limits.
    """
    re, rotation, ratio = (
        np.asarray(v, dtype=np.float64) for v in (reynolds, rotation_reynolds, friction_ratio)
    )
    return np.asarray(_CREEPING + re / (_INERTIAL * ratio) + np.sqrt(rotation) / _EKMAN)


def _development_uncertainty(
    *, length: float, bore: float, developing: npt.ArrayLike, rotation_loss: npt.ArrayLike
) -> FloatArray:
    """Half-width of k for flow that is not developed yet: rotation's share on the developing length.

    k_rot (l/L) (1 - exp(-L/l))
    Args: `length`: L of the tube, m. `bore`: d, m. `developing`: l/d, any shape. `rotation_loss`: k_rot,
        rotation's extra friction on the whole tube, broadcasts.
    Returns: expanded uncertainty (95 %), of the broadcast shape.
    Source: the share is `DEVELOPMENT_SHARE`; the exponential is that of the slowest disturbance.
    """
    share = np.asarray(developing, dtype=np.float64) * bore / length
    way = -share * np.expm1(-1 / share)
    return np.asarray(DEVELOPMENT_SHARE * way * np.abs(np.asarray(rotation_loss, dtype=np.float64)))


FULLY_TURBULENT_REYNOLDS: Final = 4000.0
"""Re above which a straight tube's flow is taken as turbulent."""
LARGEST_REYNOLDS: Final = 1e6
"""End of the data that the friction formula is compared with."""
LARGEST_ROUGHNESS: Final = 0.05
"""eps/d up to which the friction formula is compared with data, rounded up from 0.033."""
VELOCITIES: Final = (0.1, 20.0)
"""Range of velocities for which k is calibrated, m/s."""


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
    """Reynolds number Re."""
    rotation_reynolds: float
    """Rotation Reynolds number R_Om."""
    k: Estimate
    """k with its expanded uncertainty (95 %), all parts combined as the root of the sum of their squares."""
    terms: Mapping[str, FloatArray]
    """Summands of k: entrance, friction, rotation, bends, exit, extra; or "decree" alone."""
    uncertainty_parts: Mapping[str, FloatArray]
    """Expanded uncertainties (95 %) of k, by cause."""
    flow_state: npt.NDArray[np.str_]
    """Values of `FlowState`."""
    in_range: BoolArray
    """False wherever a correlation is used outside the range that its source states."""
    range_notes: Mapping[str, BoolArray]
    """Reason as a sentence, and the velocities at which it applies."""
    state: TubeState
    """State of the tube at these velocities."""


def tube_loss(scene: Scene, velocity: npt.ArrayLike) -> TubeLoss:
    """Loss coefficient k(u) of a full tube between two chambers.

    k + 1 = f L/d + rotation + K_entrance + K_bends + extra + (1 + K_exit); the "1" is the exit loss of
    turbulent flow, so K_exit holds only what a laminar exit adds.  k is smooth in u and (k + 1) u^2 grows
    with u, so that a head has one velocity.
    Args: `velocity`: u, mean over the bore, m/s, any shape, positive.
    Raises: ValueError: a velocity that is not positive and finite, or arcs longer than the tube.
    Range: calibrated from 0.1 to 20 m/s; `in_range` and `range_notes` say where a correlation is stretched.
    Source: definition of k from Eq. 14 of the liquid-ring paper; those of the terms are given with each.
    """
    u = np.asarray(velocity, dtype=np.float64)
    if not np.all(np.isfinite(u) & (u > 0)):
        raise ValueError("velocity must be positive and finite")
    state = tube_state(scene, u)
    right = with_errors(tube=scene.tube, state=state)
    parts = uncertainty_parts(scene, velocity=u, state=state)
    notes = range_notes(tube=scene.tube, state=state, velocity=u)
    outside = np.any(np.array([np.zeros(u.shape, dtype=np.bool_), *notes.values()]), axis=0)
    half_width = np.sqrt(np.asarray(sum(p**2 for p in parts.values()), dtype=np.float64))
    status = Status()
    if np.any(outside):
        text = (
            "a correlation is used outside its stated range at some velocities: see in_range and range_notes"
        )
        status = Status(code=StatusCode.OUT_OF_RANGE, text=text)
    return TubeLoss(
        velocity=u,
        reynolds=state.reynolds,
        rotation_reynolds=float(state.rotation_reynolds),
        k=Estimate(value=right.k, uncertainty=half_width, status=status),
        terms=dict(right.terms),
        uncertainty_parts=dict(parts),
        flow_state=flow_states(state),
        in_range=np.asarray(~outside),
        range_notes=dict(notes),
        state=right,
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
    """Reasons why a correlation is used outside its range, each with the velocities at which it applies."""
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
