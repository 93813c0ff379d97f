"""The tube's flow at one operating point of many designs: velocity, k, and how well both are known."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any, Final

import numpy as np
import numpy.typing as npt

from ringbalance.physics.tube.loss import TUBE_INPUTS, corrected_state, flow_states, model_parts, range_notes
from ringbalance.physics.tube.state import TubeState
from ringbalance.reduced_model.chamber.values import chamber_pressure
from ringbalance.reduced_model.law.calibrated_law import CalibratedLaw
from ringbalance.reduced_model.law.flow_law import Regime
from ringbalance.reduced_model.tube.flow import TubeFlow
from ringbalance.reduced_model.tube.heads import crest_head
from ringbalance.reduced_model.tube.path import crest_span
from ringbalance.reduced_model.tube.regime import (
    TubeEnds,
    can_flow,
    cavity_bounds,
    crest_margins,
)
from ringbalance.scene.arrays import BoolArray, FloatArray, IntArray
from ringbalance.scene.designs import Designs
from ringbalance.scene.models import Scene
from ringbalance.scene.uncertain import UNCERTAIN_QUANTITIES, input_sides, nominal_value, without_fitted

_STEP: Final = 1e-5
"""Of ln u, for slopes."""
_CHARGED: Final = ("bore", "kinematic_viscosity")
"""Of `TUBE_INPUTS` those that designs are chosen by; a viscosity has its own uncertainty."""


@dataclass(frozen=True, kw_only=True, eq=False)
class DragPoint:
    """The operating point of a primed tube; arrays of one shape.

    Where nothing flows every number is zero and `runs` is False.
    """

    regime: IntArray
    """Values of `Regime`: siphon or separated, and blocked where the gas starts no flow in an empty tube."""
    runs: BoolArray
    """Whether a primed tube flows: only there have the numbers a meaning."""
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
    def of(
        cls,
        designs: Designs,
        *,
        scene: Scene,
        law: CalibratedLaw,
        relative_density: FloatArray | float,
        relative_viscosity: FloatArray | float = 0.0,
    ) -> DragPoint:
        """Find the operating point of each design.

        Args: `scene`: whose inputs are uncertain. `law`: its calibrated one, which says how surely the rest
            is known. `relative_density`, `relative_viscosity`: expanded uncertainties (95 %) of the liquids.
        Returns: DragPoint, arrays of shape (n,).
        Raises: ValueError: arcs of bends longer than the tube.
        Source: Eqs. 13 to 18 of the liquid-ring paper, extended to the tube's crest; as `column_flow`.
        """
        tube, varied = TubeFlow.of(designs), designs.scene
        level = chamber_pressure(scene=varied, fill_ratio=varied.disc.max_fill_ratio / 2) * np.ones(
            designs.size
        )
        ends, path = tube.ends(level, level), tube.path
        column = tube.flow(ends, primed=True)
        runs = np.asarray(can_flow(path, ends, True))
        starts = np.asarray(can_flow(path, ends, False))
        u = np.where(runs, column.velocity, 1.0)
        excess = np.full(designs.size, -1.0)
        if path.crest:
            both = (np.where(runs, v, 1.0) for v in (column.siphon_velocity, column.separation_velocity))
            excess = np.log(next(both)) - np.log(next(both))
        separated = runs & (excess > 0)
        state = corrected_state(varied, u)
        width = _width(designs, scene, state, u, relative_viscosity)
        driven = _drive_width(law, tube, ends, separated, relative_density)
        of_velocity, of_k = _half_widths(varied, state, u, separated, width, driven)
        notes = range_notes(tube=varied.tube, state=state, velocity=u)
        outside = np.any(np.array([np.zeros(u.shape, dtype=np.bool_), *notes.values()]), axis=0)

        def kept(values: FloatArray) -> FloatArray:
            return np.where(runs, values, 0.0)

        flows = np.where(separated, Regime.SEPARATED, Regime.SIPHON)
        return cls(
            regime=np.asarray(np.where(starts, flows, Regime.BLOCKED), dtype=np.int64),
            runs=runs,
            separation_excess=kept(excess),
            velocity=kept(u),
            velocity_uncertainty=kept(of_velocity),
            k=kept(state.k),
            k_uncertainty=kept(width),
            k_point_uncertainty=kept(of_k),
            apparent_k=kept(2 * varied.gas.pressure / (varied.liquid.density * u**2) - 1),
            reynolds=kept(state.reynolds),
            flow_state=flow_states(state),
            in_range=np.asarray(~outside),
        )

    def at(self, i: int) -> dict[str, Any]:
        """One of the points, plain values in SI."""
        keys = {"velocity": "velocity_m_s", "k_point_uncertainty": "k_uncertainty"}
        keys |= {name: name for name in ("velocity_uncertainty", "k", "apparent_k", "reynolds")}
        return {
            "regime": Regime(int(self.regime[i])).label,
            "runs": bool(self.runs[i]),
            "flow_state": str(self.flow_state[i]),
            "in_range": bool(self.in_range[i]),
            **{key: float(getattr(self, name)[i]) for name, key in keys.items()},
        }

    def reshaped(self, *shape: int) -> DragPoint:
        """The same with arrays of another shape."""
        return DragPoint(**{name: values.reshape(shape) for name, values in vars(self).items()})


def _width(
    designs: Designs, scene: Scene, state: TubeState, velocity: FloatArray, viscosity: FloatArray | float
) -> FloatArray:
    """Half-width of k at a fixed velocity, by models and inputs."""
    varied = designs.scene
    squares = sum(part**2 for part in model_parts(tube=varied.tube, state=state).values())
    among = [name for name in TUBE_INPUTS if name not in _CHARGED]
    moved = []
    for name, sides in input_sides(without_fitted(scene), among=among).items():
        table = UNCERTAIN_QUANTITIES[name]
        values = [nominal_value(scene=side, quantity=name) for side in sides]
        moved.append(
            [replace(varied, **{table: replace(getattr(varied, table), **{name: v})}) for v in values]
        )
    nu = varied.liquid.kinematic_viscosity
    factors = (np.maximum(1 - np.asarray(viscosity), 0.1), 1 + np.asarray(viscosity))
    moved.append(
        [replace(varied, liquid=replace(varied.liquid, kinematic_viscosity=nu * f)) for f in factors]  # type: ignore[arg-type]
    )
    for sides_of_one in moved:
        changes = [corrected_state(side, velocity).k - state.k for side in sides_of_one]
        squares = squares + np.max(np.abs(changes), axis=0) ** 2
    return np.sqrt(np.asarray(squares, dtype=np.float64))


def _drive_width(
    law: CalibratedLaw,
    tube: TubeFlow,
    ends: TubeEnds,
    separated: BoolArray,
    density: FloatArray | float,
) -> FloatArray:
    """Expanded uncertainty (95 %) of the head that drives the column, relative to it."""
    inputs, ratio = law.inputs, np.asarray(tube.path.density) / law.density
    gas, level = ends.upstream_gas, ends.upstream_hydrostatic
    levels = ratio * np.sqrt(2) * float(law.hydrostatic_pressure_uncertainty(law.max_fill_ratio / 2))
    of_gas = np.hypot(density, inputs.relative_gas_pressure) * gas
    siphon = np.hypot(levels, of_gas) / np.maximum(np.abs(gas), 1e-100)
    path = tube.path
    if not path.crest:
        return np.asarray(siphon)
    low, high = cavity_bounds(path, ends)
    squares = (
        levels**2
        + (density * (gas - path.vapour_pressure)) ** 2
        + (inputs.relative_gas_pressure * gas) ** 2
        + (2 * inputs.relative_speed * (level - path.column_pressure)) ** 2
        + (ratio * inputs.hump_pressure) ** 2
        + inputs.vapour_pressure**2
        + (max(path.released, 1 - path.released) * (high - low)) ** 2
    )
    over = np.sqrt(squares) / np.maximum(crest_margins(path, ends)[0], 1e-100)
    return np.asarray(np.where(separated, over, siphon), dtype=np.float64)


def _half_widths(
    varied: Scene,
    state: TubeState,
    velocity: FloatArray,
    separated: BoolArray,
    width: FloatArray,
    driven: FloatArray,
) -> tuple[FloatArray, FloatArray]:
    """Half-widths of u and of k at the operating point; k's own uncertainty moves u, and u moves k."""
    beside_u = velocity * np.exp(_STEP)
    beside = corrected_state(varied, beside_u)
    siphon = 2 + np.log((beside.k + 1) / (state.k + 1)) / _STEP
    ahead, of_head = siphon, width / (state.k + 1)
    if varied.tube.hump_radius is not None:
        to_crest = crest_head(scene=varied, tube=varied.tube, state=state, velocity=velocity)
        further = crest_head(scene=varied, tube=varied.tube, state=beside, velocity=beside_u)
        ahead = np.where(separated, np.log(further / to_crest) / _STEP, siphon)
        upstream = state.upstream_loss(crest_span(varied.tube)[1])
        share = np.where(state.k > 0, upstream / np.where(state.k > 0, state.k, 1.0), 1.0)
        of_head = np.where(separated, width * share * velocity**2 / 2 / to_crest, of_head)
    # dk/d ln u, along which every move of u takes k.
    along = (state.k + 1) * (siphon - 2)
    of_k = np.hypot(width - along * of_head / ahead, along * driven / ahead)
    return velocity / ahead * np.hypot(of_head, driven), of_k
