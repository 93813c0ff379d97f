"""The tube's operating point for many liquids at once: where a head balances the loss, and how surely.

Both chambers hold equal fills, so that their hydrostatic pressures cancel in a full siphon and the gas alone
drives it.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import Final

import numpy as np
import numpy.typing as npt

from ringbalance.physics.tube.loss import flow_states, range_notes
from ringbalance.physics.tube.state import TubeState, tube_state_at
from ringbalance.physics.tube.uncertainty import input_parts, model_parts
from ringbalance.reduced_model.law.calibrated_law import CalibratedLaw
from ringbalance.reduced_model.law.flow_law import Regime
from ringbalance.reduced_model.tube.heads import TABLE_VELOCITIES
from ringbalance.reduced_model.tube.path import crest_span, head_behind_crest
from ringbalance.reduced_model.tube.regime import SiphonCrest, TubeEnds, can_flow
from ringbalance.scene.arrays import BoolArray, FloatArray, IntArray
from ringbalance.scene.joint import without_fitted
from ringbalance.scene.models import Scene, Tube
from ringbalance.scene.origins import InputUncertainty

_STEP: Final = 1e-5
"""Of ln u, for slopes."""
_CLOSE: Final = 1e-12
"""Of ln head, where the search ends."""
_MOST_STEPS: Final = 80


@dataclass(frozen=True, kw_only=True, eq=False)
class LiquidBatch:
    """The liquids that are asked for and the gas on them; arrays of one shape (m,)."""

    kinematic_viscosity: FloatArray
    """nu, m^2/s."""
    density: FloatArray
    """rho, kg/m^3."""
    gas_pressure: FloatArray
    """Gauge, Pa."""
    vapour_pressure: FloatArray
    """Gauge, Pa."""
    relative_density: FloatArray
    """Expanded uncertainty (95 %) of the density over the density."""
    relative_viscosity: FloatArray
    """Expanded uncertainty (95 %) of the viscosity over the viscosity."""


@dataclass(frozen=True, kw_only=True, eq=False)
class DragPoint:
    """The operating point of a primed tube; arrays of one shape.

    Where nothing flows every number is zero and `runs` is False.
    """

    regime: IntArray
    """Values of `Regime`: siphon or separated, and blocked where the gas starts no flow in an empty tube."""
    runs: BoolArray
    """Whether a primed tube flows: only there have the numbers a meaning."""
    separated: BoolArray
    """Whether that flow is separated."""
    separation_excess: FloatArray
    """ln of siphon velocity over separation velocity: positive where separated; without a crest -1."""
    velocity: FloatArray
    """u, m/s."""
    velocity_uncertainty: FloatArray
    """Expanded uncertainty (95 %), m/s."""
    k: FloatArray
    """Loss coefficient of the tube at u."""
    k_uncertainty: FloatArray
    """Expanded uncertainty (95 %) of k at just this u."""
    k_point_uncertainty: FloatArray
    """Expanded uncertainty (95 %) of k at the operating point, whose u moves with k and with what drives the
    flow."""
    apparent_k: FloatArray
    """2 p/(rho u^2) - 1: the k that Eq. 18 reads off this velocity; above k where the column is separated."""
    reynolds: FloatArray
    flow_state: npt.NDArray[np.str_]
    """Values of `FlowState`."""
    in_range: BoolArray
    """False where a correlation is stretched, as in `TubeLoss`."""

    @classmethod
    def of(cls, *, scene: Scene, law: CalibratedLaw, tube: Tube, batch: LiquidBatch) -> DragPoint:
        """Find the tube's operating point at equal fills for each liquid.

        siphon: (k + 1) u^2/2 = p/rho; separated: (alpha + k_up) u^2/2 = (p - p_c + P - D_m)/rho; of both the
        smaller u.
        Args: `tube`: the tube, which need not be the scene's. `batch`: liquids and gas pressures, shape (m,).
        Returns: DragPoint, arrays of shape (m,).
        Raises: ValueError: arcs of bends longer than the tube.
        Source: Eqs. 13 to 18 of the liquid-ring paper, extended to the tube's crest; as `column_flow`.
        """
        drive = _drive(law, batch)
        speed, excess = _velocity(scene, tube, batch, drive)
        separated = np.asarray(drive.runs & (excess > 0))
        shown = np.where(drive.runs, speed, 1.0)
        state = _state(scene, tube, batch, shown)
        parts = _parts(scene, tube, batch, shown, state)
        width = np.sqrt(np.asarray(sum(p**2 for p in parts.values()), dtype=np.float64))
        k = state.k
        of_velocity, of_k = _half_widths(scene, tube, batch, drive, state, shown, separated, width)
        notes = range_notes(tube=tube, state=state, velocity=shown)
        outside = np.any(np.array([np.zeros(k.shape, dtype=np.bool_), *notes.values()]), axis=0)
        flows = np.where(separated, Regime.SEPARATED, Regime.SIPHON)

        def kept(values: FloatArray) -> FloatArray:
            return np.where(drive.runs, values, 0.0)

        return cls(
            regime=np.asarray(np.where(drive.starts, flows, Regime.BLOCKED), dtype=np.int64),
            runs=drive.runs,
            separated=separated,
            separation_excess=kept(excess),
            velocity=kept(speed),
            velocity_uncertainty=kept(of_velocity),
            k=kept(k),
            k_uncertainty=kept(width),
            k_point_uncertainty=kept(of_k),
            apparent_k=kept(2 * batch.gas_pressure / (batch.density * shown**2) - 1),
            reynolds=kept(state.reynolds),
            flow_state=flow_states(state),
            in_range=np.asarray(~outside),
        )


@dataclass(frozen=True, kw_only=True, eq=False)
class _Drive:
    """Heads that drive the full and the separated column, m^2/s^2, with relative expanded uncertainties (95
    %)."""

    siphon: FloatArray
    siphon_uncertainty: FloatArray
    separation: FloatArray | None
    """None without a crest."""
    separation_uncertainty: FloatArray
    runs: BoolArray
    starts: BoolArray


def _drive(law: CalibratedLaw, batch: LiquidBatch) -> _Drive:
    """Heads at equal fills; hydrostatic pressures scale with the density."""
    inputs, ratio = law.inputs, batch.density / law.density
    ends, crest = _ends(law, batch, ratio), _crest(law, batch, ratio)
    gas, hydrostatic = ends.upstream_gas, ends.upstream_hydrostatic
    uncertainty_95 = ratio * np.sqrt(2) * float(law.hydrostatic_pressure_uncertainty(law.max_fill_ratio / 2))
    gas_uncertainty = np.hypot(batch.relative_density, inputs.relative_gas_pressure) * gas
    full = _Drive(
        siphon=gas / batch.density,
        siphon_uncertainty=np.hypot(uncertainty_95, gas_uncertainty) / np.maximum(np.abs(gas), 1e-100),
        separation=None,
        separation_uncertainty=np.zeros_like(gas),
        runs=np.asarray(can_flow(ends=ends, crest=crest, primed=True)),
        starts=np.asarray(can_flow(ends=ends, crest=crest, primed=False)),
    )
    if crest is None:
        return full
    margin, (low, high) = crest.separation_margin(ends), crest.cavity_bounds(ends)
    squares = (
        uncertainty_95**2
        + (batch.relative_density * (gas - batch.vapour_pressure)) ** 2
        + (inputs.relative_gas_pressure * gas) ** 2
        + (2 * inputs.relative_speed * (hydrostatic - crest.column_pressure)) ** 2
        + (ratio * inputs.hump_pressure) ** 2
        + inputs.vapour_pressure**2
        + (max(crest.released, 1 - crest.released) * (high - low)) ** 2
    )
    return replace(
        full,
        separation=margin / batch.density,
        separation_uncertainty=np.sqrt(squares) / np.maximum(margin, 1e-100),
    )


def _ends(law: CalibratedLaw, batch: LiquidBatch, ratio: FloatArray) -> TubeEnds[FloatArray]:
    gas, hydrostatic = (
        law.gas_factor * batch.gas_pressure,
        ratio * float(law.hydrostatic_pressure(law.max_fill_ratio / 2)),
    )
    return TubeEnds(
        upstream_gas=gas,
        downstream_gas=np.zeros_like(gas),
        upstream_hydrostatic=hydrostatic,
        downstream_hydrostatic=hydrostatic,
        port_pressure=ratio * law.path.port_pressure,
    )


def _crest(law: CalibratedLaw, batch: LiquidBatch, ratio: FloatArray) -> SiphonCrest[FloatArray] | None:
    if law.path.hump_pressure is None:
        return None
    return SiphonCrest(
        column_pressure=ratio * law.path.hump_pressure,
        vapour_pressure=batch.vapour_pressure,
        trapped=law.path.trapped,
        released=law.path.released,
    )


def _state(scene: Scene, tube: Tube, batch: LiquidBatch, velocity: FloatArray) -> TubeState:
    nu = batch.kinematic_viscosity
    return tube_state_at(
        tube=tube,
        reynolds=velocity * tube.bore / nu,
        rotation_reynolds=np.broadcast_to(abs(scene.rotor.speed) * tube.bore**2 / nu, velocity.shape),
    )


def _siphon_factor(_tube: Tube, state: TubeState) -> FloatArray:
    return np.asarray(state.k + 1, dtype=np.float64)


def _separation_factor(tube: Tube, state: TubeState) -> FloatArray:
    """As the head up to the lowest pressure, over u^2/2; R_Om/Re d is omega/u."""
    turns = (state.rotation_reynolds / state.reynolds / tube.bore) ** 2
    behind = head_behind_crest(tube=tube, along=state.along, square=2 * turns)
    up = state.upstream_loss(crest_span(tube)[1])
    return np.asarray(state.kinetic_factor + up + behind, dtype=np.float64)


def _velocity(scene: Scene, tube: Tube, batch: LiquidBatch, drive: _Drive) -> tuple[FloatArray, FloatArray]:
    """The smaller of siphon and separation velocity, and how much larger the siphon's is, as a logarithm."""

    def solved(head: FloatArray, factor: Callable[[Tube, TubeState], FloatArray]) -> FloatArray:
        def log_head(log_u: FloatArray) -> FloatArray:
            return np.asarray(np.log(factor(tube, _state(scene, tube, batch, np.exp(log_u))) / 2) + 2 * log_u)

        return np.exp(_inverse(log_head, np.log(np.where(drive.runs, head, 1.0))))

    siphon = solved(drive.siphon, _siphon_factor)
    if drive.separation is None:
        return siphon, np.full(siphon.shape, -1.0)
    separation = solved(drive.separation, _separation_factor)
    return np.minimum(siphon, separation), np.log(siphon / separation)


def _inverse(function: Callable[[FloatArray], FloatArray], wanted: FloatArray) -> FloatArray:
    """Where a growing function has wanted values: Newton's method, kept within a shrinking bracket."""
    low, high = (np.full(wanted.shape, np.log(v)) for v in TABLE_VELOCITIES)
    x = np.clip((wanted - 1) / 2, low, high)
    for _ in range(_MOST_STEPS):
        value, beside = function(np.array([x, x + _STEP]))
        gap = wanted - value
        low, high = np.where(gap > 0, x, low), np.where(gap > 0, high, x)
        far = np.abs(gap) >= _CLOSE
        if not np.any(far):
            break
        step = x + gap * _STEP / np.maximum(beside - value, 1e-3 * _STEP)
        inside = np.where((step > low) & (step < high), step, (low + high) / 2)
        # What has arrived stays, while the others still move.
        x = np.where(far, inside, x)
    return x


def _parts(
    scene: Scene, tube: Tube, batch: LiquidBatch, velocity: FloatArray, state: TubeState
) -> Mapping[str, FloatArray]:
    """Half-widths of k at a fixed velocity, one per cause; a bore or viscosity of the scene is not one."""
    stated = tuple(i for i in scene.uncertainty if i.quantity not in {"bore", "kinematic_viscosity"})
    parts = model_parts(tube=tube, state=state)

    def k_of(t: Tube, nu: FloatArray, speed: float, at: FloatArray) -> FloatArray:
        return tube_state_at(
            tube=t, reynolds=at * t.bore / nu, rotation_reynolds=abs(speed) * t.bore**2 / nu
        ).k

    nu = batch.kinematic_viscosity

    at_hand = without_fitted(replace(scene, tube=tube, uncertainty=(*stated, _EXACT_VISCOSITY)))
    parts |= input_parts(
        at_hand,
        k_of=lambda moved: k_of(
            moved.scene.tube, nu[..., None], moved.scene.rotor.speed, velocity[..., None]
        ),
    )
    if np.any(batch.relative_viscosity > 0):
        factors = (np.maximum(1 - batch.relative_viscosity, 0.1), 1 + batch.relative_viscosity)
        sides = [k_of(tube, nu * factor, scene.rotor.speed, velocity) for factor in factors]
        parts["input: kinematic_viscosity"] = np.max(np.abs(np.array(sides) - state.k), axis=0)
    return parts


_EXACT_VISCOSITY: Final = InputUncertainty(quantity="kinematic_viscosity", half_width=0.0, relative=True)
"""Viscosities are those of the charge, each with its own uncertainty."""


def _half_widths(
    scene: Scene,
    tube: Tube,
    batch: LiquidBatch,
    drive: _Drive,
    state: TubeState,
    velocity: FloatArray,
    separated: BoolArray,
    width: FloatArray,
) -> tuple[FloatArray, FloatArray]:
    """Half-widths of u and of k at the operating point; k's own uncertainty moves u, and u moves k."""
    beside = _state(scene, tube, batch, velocity * np.exp(_STEP))

    def slope(factor: Callable[[Tube, TubeState], FloatArray]) -> FloatArray:
        """d ln head/d ln u."""
        return np.asarray(2 + np.log(factor(tube, beside) / factor(tube, state)) / _STEP)

    siphon = slope(_siphon_factor)
    ahead = np.where(separated, slope(_separation_factor), siphon)
    up = np.where(
        state.k > 0,
        state.upstream_loss(crest_span(tube)[1]) / np.where(state.k > 0, state.k, 1.0),
        1.0,
    )
    of_head = width * np.where(separated, up / _separation_factor(tube, state), 1 / (state.k + 1))
    driven = np.where(separated, drive.separation_uncertainty, drive.siphon_uncertainty)
    # dk/d ln u, along which every move of u takes k.
    along = (state.k + 1) * (siphon - 2)
    of_k = np.hypot(width - along * of_head / ahead, along * driven / ahead)
    return velocity / ahead * np.hypot(of_head, driven), of_k
