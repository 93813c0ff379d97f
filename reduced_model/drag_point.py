"""The tube's operating point for many liquids at once: where a head balances the loss, and how surely.

Both chambers hold equal fills, so that their levels cancel in a full siphon and the gas alone drives it.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Final

import numpy as np
import numpy.typing as npt

from ringbalance.physics.tube_loss import flow_states
from ringbalance.physics.tube_range import range_notes
from ringbalance.physics.tube_state import TubeState, tube_state_at, upstream_loss
from ringbalance.physics.tube_uncertainty import input_parts, model_parts
from ringbalance.reduced_model.calibrated_law import CalibratedLaw
from ringbalance.reduced_model.flow_law import Regime
from ringbalance.reduced_model.tube_heads import TABLE_VELOCITIES
from ringbalance.scene.models import InputUncertainty, Liquid, Scene, Tube

FloatArray = npt.NDArray[np.float64]
BoolArray = npt.NDArray[np.bool_]

_STEP: Final = 1e-5
"""Of ln u, for slopes."""
_CLOSE: Final = 1e-12
"""Of ln head, where the search ends."""
_MOST_STEPS: Final = 80


@dataclass(frozen=True, kw_only=True, eq=False)
class Charge:
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
    """95 % half-width of the density over the density."""
    relative_viscosity: FloatArray
    """95 % half-width of the viscosity over the viscosity."""


@dataclass(frozen=True, kw_only=True, eq=False)
class DragPoint:
    """The tube's operating point, an empty tube beforehand; arrays of one shape.

    Where nothing flows, not even in a primed tube, every number is zero and `runs` is False.
    """

    regime: npt.NDArray[np.int64]
    """Values of `Regime`: blocked, siphon or separated."""
    runs: BoolArray
    """Whether a primed tube flows: only there have the numbers a meaning."""
    torn: BoolArray
    """Whether that flow is separated; where `regime` is blocked, of the primed tube."""
    tearing: FloatArray
    """ln of the full siphon's velocity over that of a torn column: positive where torn; without a hump -1."""
    velocity: FloatArray
    """u, m/s; where blocked, that of a primed tube."""
    velocity_uncertainty: FloatArray
    """95 % half-width, m/s."""
    k: FloatArray
    """Loss coefficient of the tube at u."""
    k_uncertainty: FloatArray
    """95 % half-width of k at just this u."""
    k_point_uncertainty: FloatArray
    """95 % half-width of k at the operating point, whose u moves with k and with what drives the flow."""
    apparent_k: FloatArray
    """2 p/(rho u^2) - 1: the k that Eq. 18 reads off this velocity; above k where the column is torn."""
    reynolds: FloatArray
    flow_state: npt.NDArray[np.str_]
    """Values of `FlowState`."""
    in_range: BoolArray
    """False where a correlation is stretched, as in `TubeLoss`."""


@dataclass(frozen=True, kw_only=True, eq=False)
class _Drive:
    """What drives siphon and torn column, as heads (m^2/s^2), and how surely (relative 95 % half-width)."""

    siphon: FloatArray
    siphon_spread: FloatArray
    torn: FloatArray | None
    """None without a hump."""
    torn_spread: FloatArray
    runs: BoolArray
    starts: BoolArray


def drag_point(*, scene: Scene, law: CalibratedLaw, tube: Tube, charge: Charge) -> DragPoint:
    """Find the tube's operating point at equal fills for each liquid.

    siphon: (k + 1) u^2/2 = p/rho; separated: (alpha + k_up) u^2/2 = (p - p_c + P - D_m)/rho, the smaller u.

    Args:
        scene: the disc, the speed and the uncertain inputs.
        law: the calibrated law; its level at equal fills and its path are taken, per density.
        tube: the tube, which need not be the scene's.
        charge: liquids and gas pressures, shape (m,).

    Returns:
        DragPoint, arrays of shape (m,).

    Raises:
        ValueError: arcs of bends longer than the tube.

    Source: Eqs. 13 to 18 of the liquid-ring paper, extended to the tube's hump; as `directed_flow`.
    """
    drive = _drive(law, charge)
    speed, tearing = _velocity(scene, tube, charge, drive)
    torn = np.asarray(drive.runs & (tearing > 0))
    shown = np.where(drive.runs, speed, 1.0)
    state = _state(scene, tube, charge, shown)
    parts = _parts(scene, tube, charge, shown, state)
    width = np.sqrt(np.asarray(sum(p**2 for p in parts.values()), dtype=np.float64))
    k = state.k
    of_velocity, of_k = _half_widths(scene, tube, charge, drive, state, shown, torn, width)
    notes = range_notes(tube=tube, state=state, velocity=shown)
    outside = np.any(np.array([np.zeros(k.shape, dtype=np.bool_), *notes.values()]), axis=0)
    flows = np.where(torn, Regime.SEPARATED, Regime.SIPHON)

    def kept(values: FloatArray) -> FloatArray:
        return np.where(drive.runs, values, 0.0)

    return DragPoint(
        regime=np.asarray(np.where(drive.starts, flows, Regime.BLOCKED), dtype=np.int64),
        runs=drive.runs,
        torn=torn,
        tearing=kept(tearing),
        velocity=kept(speed),
        velocity_uncertainty=kept(of_velocity),
        k=kept(k),
        k_uncertainty=kept(width),
        k_point_uncertainty=kept(of_k),
        apparent_k=kept(2 * charge.gas_pressure / (charge.density * shown**2) - 1),
        reynolds=kept(state.reynolds),
        flow_state=flow_states(state),
        in_range=np.asarray(~outside),
    )


def _drive(law: CalibratedLaw, charge: Charge) -> _Drive:
    """Heads at equal fills: levels and columns scale with the density."""
    x, path, inputs = law.max_fill_ratio / 2, law.path, law.inputs
    share = charge.density / law.density
    level, port = share * float(law.wall_pressure(x)), share * path.port_pressure
    spread = share * np.sqrt(2) * float(law.wall_pressure_spread(x))
    gas, rho = charge.gas_pressure, charge.density
    own = np.hypot(charge.relative_density, inputs.relative_gas_pressure) * gas
    floor = np.maximum(np.abs(gas), 1e-100)
    runs = (gas > 0) & (level >= port)
    siphon, siphon_spread = gas / rho, np.hypot(spread, own) / floor
    if path.hump_pressure is None:
        return _Drive(
            siphon=siphon,
            siphon_spread=siphon_spread,
            torn=None,
            torn_spread=np.zeros_like(gas),
            runs=runs,
            starts=runs,
        )
    hump = share * path.hump_pressure
    margin = gas - charge.vapour_pressure + level - hump
    push = np.maximum(level - port, 0.0) if path.trapped else 0.0
    squares = (
        spread**2
        + (charge.relative_density * (gas - charge.vapour_pressure)) ** 2
        + (inputs.relative_gas_pressure * gas) ** 2
        + (2 * inputs.relative_speed * (level - hump)) ** 2
        + (share * inputs.hump_pressure) ** 2
        + inputs.vapour_pressure**2
    )
    runs &= margin > 0
    return _Drive(
        siphon=siphon,
        siphon_spread=siphon_spread,
        torn=margin / rho,
        torn_spread=np.sqrt(squares) / np.maximum(margin, 1e-100),
        runs=runs,
        starts=np.asarray(runs & (gas + level - hump - push > 0)),
    )


def _state(scene: Scene, tube: Tube, charge: Charge, velocity: FloatArray) -> TubeState:
    nu = charge.kinematic_viscosity
    return tube_state_at(
        tube=tube,
        reynolds=velocity * tube.bore / nu,
        rotation_reynolds=np.broadcast_to(abs(scene.rotor.speed) * tube.bore**2 / nu, velocity.shape),
    )


def _siphon_factor(_tube: Tube, state: TubeState) -> FloatArray:
    return np.asarray(state.k + 1, dtype=np.float64)


def _torn_factor(tube: Tube, state: TubeState) -> FloatArray:
    return np.asarray(state.kinetic_factor + upstream_loss(tube=tube, state=state), dtype=np.float64)


def _velocity(scene: Scene, tube: Tube, charge: Charge, drive: _Drive) -> tuple[FloatArray, FloatArray]:
    """The smaller of siphon and torn velocity, and how much larger the siphon's is, as a logarithm."""

    def solved(head: FloatArray, factor: Callable[[Tube, TubeState], FloatArray]) -> FloatArray:
        def log_head(log_u: FloatArray) -> FloatArray:
            return np.asarray(
                np.log(factor(tube, _state(scene, tube, charge, np.exp(log_u))) / 2) + 2 * log_u
            )

        return np.exp(_inverse(log_head, np.log(np.where(drive.runs, head, 1.0))))

    siphon = solved(drive.siphon, _siphon_factor)
    if drive.torn is None:
        return siphon, np.full(siphon.shape, -1.0)
    torn = solved(drive.torn, _torn_factor)
    return np.minimum(siphon, torn), np.log(siphon / torn)


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
    scene: Scene, tube: Tube, charge: Charge, velocity: FloatArray, state: TubeState
) -> Mapping[str, FloatArray]:
    """Half-widths of k at a fixed velocity, one per cause; a bore or viscosity of the scene is not one."""
    stated = tuple(i for i in scene.uncertainty if i.quantity not in {"bore", "kinematic_viscosity"})
    parts = {} if tube.drag_coefficient is not None else model_parts(tube=tube, state=state)

    def k_of(t: Tube, nu: FloatArray, speed: float) -> FloatArray:
        return tube_state_at(
            tube=t, reynolds=velocity * t.bore / nu, rotation_reynolds=abs(speed) * t.bore**2 / nu
        ).k

    nu = charge.kinematic_viscosity

    def by_input(t: Tube, _liquid: Liquid, speed: float) -> FloatArray:
        return k_of(t, nu, speed)

    parts |= input_parts(
        tube=tube,
        liquid=scene.liquid,
        angular_velocity=scene.rotor.speed,
        inputs=(*stated, _EXACT_VISCOSITY),
        k_of=by_input,
        k=state.k,
    )
    if np.any(charge.relative_viscosity > 0):
        sides = [
            k_of(tube, nu * factor, scene.rotor.speed) for factor in _either_way(charge.relative_viscosity)
        ]
        parts["input: kinematic_viscosity"] = np.max(np.abs(np.array(sides) - state.k), axis=0)
    return parts


_EXACT_VISCOSITY: Final = InputUncertainty(quantity="kinematic_viscosity", half_width=0.0, relative=True)
"""Viscosities are those of the charge, each with its own spread."""


def _either_way(relative: FloatArray) -> tuple[FloatArray, FloatArray]:
    return np.maximum(1 - relative, 0.1), 1 + relative


def _half_widths(
    scene: Scene,
    tube: Tube,
    charge: Charge,
    drive: _Drive,
    state: TubeState,
    velocity: FloatArray,
    torn: BoolArray,
    width: FloatArray,
) -> tuple[FloatArray, FloatArray]:
    """Half-widths of u and of k at the operating point; k's own spread moves u, and u moves k."""
    beside = _state(scene, tube, charge, velocity * np.exp(_STEP))

    def slope(factor: Callable[[Tube, TubeState], FloatArray]) -> FloatArray:
        """d ln head/d ln u."""
        return np.asarray(2 + np.log(factor(tube, beside) / factor(tube, state)) / _STEP)

    siphon = slope(_siphon_factor)
    ahead = np.where(torn, slope(_torn_factor), siphon)
    up = np.where(
        state.k > 0, upstream_loss(tube=tube, state=state) / np.where(state.k > 0, state.k, 1.0), 1.0
    )
    of_head = width * np.where(torn, up / _torn_factor(tube, state), 1 / (state.k + 1))
    driven = np.where(torn, drive.torn_spread, drive.siphon_spread)
    # dk/d ln u, along which every move of u takes k.
    along = (state.k + 1) * (siphon - 2)
    of_k = np.hypot(width - along * of_head / ahead, along * driven / ahead)
    return velocity / ahead * np.hypot(of_head, driven), of_k
