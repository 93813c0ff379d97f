"""k over bore and viscosity, and of liquids in one tube, at the device's own operating point.

At equal fills the operating point follows from the gas head p/rho and, where the column is separated, from
the crest: a denser liquid under proportionally more gas has the same heads, so one map serves all densities
but for the vapour pressure.  Under the same gas it has a smaller head, or does not start at all.

Where the column is separated, the k calculated from Eq. 18 falls as 1/u^2.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import Any, Final, cast

import numpy as np
import numpy.typing as npt
from scipy.interpolate import PchipInterpolator

from ringbalance.physics.tube.loss import corrected_state, flow_states, range_notes
from ringbalance.reduced_model import paper
from ringbalance.reduced_model.calibration_record import Calibration
from ringbalance.reduced_model.chamber.values import chamber_pressure
from ringbalance.reduced_model.law.calibrated_law import CalibratedLaw
from ringbalance.reduced_model.law.flow_law import Regime
from ringbalance.reduced_model.tube.flow import TubeFlow
from ringbalance.reduced_model.tube.heads import roots_of
from ringbalance.reduced_model.tube.regime import (
    ColumnFlow,
    TubeEnds,
    can_flow,
    crest_margins,
    driving_pressure,
)
from ringbalance.scene.arrays import BoolArray, FloatArray, IntArray
from ringbalance.scene.designs import Designs, changes_of
from ringbalance.scene.errors import Uncertainty, larger, of_flow, of_input
from ringbalance.scene.liquids import liquids_at_room_temperature
from ringbalance.scene.models import HumpGas, Liquid, Scene
from ringbalance.scene.uncertain import (
    NORMAL_95,
    independent_half_widths,
    without_fitted,
)

_MAP_INPUTS: Final = ("bore", "kinematic_viscosity")
_LIQUID_UNCERTAINTIES: Final = {
    "density": "density_uncertainty",
    "kinematic_viscosity": "viscosity_uncertainty",
}
"""Attributes of a liquid with the relative uncertainty of each property."""
_UNCERTAINTY_NODES: Final = 13
"""Points of either axis with half-widths; between them the ratio of half-width and value is interpolated."""


@dataclass(frozen=True, kw_only=True, eq=False)
class _DragPoint:
    """The operating point of a primed tube; arrays of one shape.

    Where nothing flows every number is zero and `runs` is False.
    """

    regime: IntArray
    """Values of `Regime`: siphon or separated, and blocked where the gas starts no flow in an empty tube."""
    runs: BoolArray
    """True if a primed tube flows; else the numbers have no meaning."""
    separation_excess: FloatArray
    """ln of siphon velocity over separation velocity: positive where separated; without a crest -1."""
    velocity: FloatArray
    """u, m/s."""
    velocity_uncertainty: FloatArray
    """Expanded uncertainty (95 %), m/s; zero without errors."""
    k: FloatArray
    """Loss coefficient of the tube at u."""
    k_uncertainty: FloatArray
    """Expanded uncertainty (95 %) of k at a velocity that varies with it; zero without errors."""
    apparent_k: FloatArray
    """2 p/(rho u^2) - 1, the k by Eq. 18 at this velocity; above k where the column is separated."""
    reynolds: FloatArray
    flow_state: npt.NDArray[np.str_]
    """Values of `FlowState`."""
    in_range: BoolArray
    """False where a correlation is used beyond its range, as in `TubeLoss`."""

    @classmethod
    def of(cls, designs: Designs, errors: Sequence[Uncertainty] = ()) -> _DragPoint:
        """Solve the operating point of each design.

        Args: `errors`: for the half-widths.
        Returns: _DragPoint, arrays of shape (n,).
        Raises: ValueError: arcs of bends longer than the tube.
        Source: Eqs. 13 to 18 of the liquid-ring paper, extended to the tube's crest; as `column_flow`.
        """
        varied = designs.scene
        tube, ends, column = _flow(designs)
        path = tube.path
        runs = np.asarray(can_flow(path, ends, True))
        starts = np.asarray(can_flow(path, ends, False))
        u = np.where(runs, column.velocity, 1.0)
        excess = np.full(designs.size, -1.0)
        if path.crest:
            both = (np.where(runs, v, 1.0) for v in (column.siphon_velocity, column.separation_velocity))
            excess = np.log(next(both)) - np.log(next(both))
        separated = runs & (excess > 0)
        state = corrected_state(varied, u)
        widths = np.zeros((2, designs.size))
        if errors:
            # A single design would be taken as plain numbers.
            rows = np.resize(np.arange(designs.size), max(designs.size, 2))
            moved = changes_of(designs.take(rows).scene, _velocity_and_k, errors, each=rows.size)[1]
            widths = np.sqrt(np.sum(np.nan_to_num(larger(moved)) ** 2, axis=0))[:, : designs.size]
        notes = range_notes(tube=varied.tube, state=state, velocity=u)
        outside = np.any(np.array([np.zeros(u.shape, dtype=np.bool_), *notes.values()]), axis=0)

        def zero_at_rest(values: FloatArray) -> FloatArray:
            return np.where(runs, values, 0.0)

        flows = np.where(separated, Regime.SEPARATED, Regime.SIPHON)
        return cls(
            regime=np.asarray(np.where(starts, flows, Regime.BLOCKED), dtype=np.int64),
            runs=runs,
            separation_excess=zero_at_rest(excess),
            velocity=zero_at_rest(u),
            velocity_uncertainty=zero_at_rest(widths[0]),
            k=zero_at_rest(state.k),
            k_uncertainty=zero_at_rest(widths[1]),
            apparent_k=zero_at_rest(2 * varied.gas.pressure / (varied.liquid.density * u**2) - 1),
            reynolds=zero_at_rest(state.reynolds),
            flow_state=flow_states(state),
            in_range=np.asarray(~outside),
        )

    def at(self, i: int) -> dict[str, Any]:
        """Point number i as plain values in SI."""
        keys = {"velocity": "velocity_m_s", "velocity_uncertainty": "velocity_uncertainty"}
        keys |= {name: name for name in ("k", "k_uncertainty", "apparent_k", "reynolds")}
        return {
            "regime": Regime(int(self.regime[i])).label,
            "runs": bool(self.runs[i]),
            "flow_state": str(self.flow_state[i]),
            "in_range": bool(self.in_range[i]),
            **{key: float(getattr(self, name)[i]) for name, key in keys.items()},
        }

    def reshaped(self, *shape: int) -> _DragPoint:
        """The points with arrays of another shape."""
        return _DragPoint(**{name: values.reshape(shape) for name, values in vars(self).items()})


def _flow(designs: Designs) -> tuple[TubeFlow, TubeEnds, ColumnFlow[FloatArray]]:
    """Flow of primed tubes at equal fills."""
    tube, scene = TubeFlow.of(designs), designs.scene
    level = chamber_pressure(scene=scene, fill_ratio=scene.disc.max_fill_ratio / 2) * np.ones(designs.size)
    ends = tube.ends(level, level)
    return tube, ends, tube.flow(ends, primed=True)


def _velocity_and_k(designs: Designs) -> FloatArray:
    """Velocity, m/s, and k there, NaN where nothing flows."""
    tube, _, column = _flow(designs)
    return np.array([column.velocity, tube.drag_coefficient(column.velocity)])


def _errors(scene: Scene, *, over: Sequence[str] = _MAP_INPUTS) -> list[Uncertainty]:
    """Uncertainties of a scene that act on the flow. Args: `over`: inputs taken as exact, axes of a map."""
    return [each for each in of_flow(without_fitted(scene)) if each.name not in over]


BORES: Final = (0.2e-3, 5e-3)
"""Range of the map, m, widened when the scene's own bore lies near its edge."""
_VISCOSITIES: Final = (2e-7, 5e-4)
"""Range of the map, m^2/s, from below liquid gallium to above silicone oil of 350 cSt."""
_BORE_POINTS: Final = 41
_VISCOSITY_POINTS: Final = 49
_EDGE_FACTOR: Final = 1.5
_FIFTY: Final = paper.PAPER_DRAG_COEFFICIENT


@dataclass(frozen=True, kw_only=True, eq=False)
class DragMap:
    """Operating points over bore and viscosity, everything else as in the scene; k is never prescribed."""

    bore: FloatArray
    """d, m, rising, shape (n,)."""
    kinematic_viscosity: FloatArray
    """nu, m^2/s, rising, shape (m,)."""
    point: _DragPoint
    """Arrays of shape (n, m)."""

    @classmethod
    def of(
        cls,
        *,
        calibration: Calibration,
        bore: npt.ArrayLike | None = None,
        kinematic_viscosity: npt.ArrayLike | None = None,
    ) -> DragMap:
        """Map k over bore and viscosity, each point at the device's own operating point.

        Every point solves the flow at equal fills under the scene's gas pressure: siphon or separated, and,
        where that gas does not prime the tube, the flow of a primed one.
        Args: `bore`: d, m, rising, shape (n,); default 41 from 0.2 to 5 mm. `kinematic_viscosity`: nu, m^2/s,
        rising, shape (m,); default 49 from 0.2 to 500 mm^2/s.
        Raises: ValueError: arcs of bends longer than the tube.
        Range: as `tube_loss`; `point.in_range` is False where a correlation is used beyond its range.
        """
        scene = calibration.scene
        d = _axis(bore, BORES, _BORE_POINTS, scene.tube.bore)
        nu = _axis(kinematic_viscosity, _VISCOSITIES, _VISCOSITY_POINTS, scene.liquid.kinematic_viscosity)
        nodes = [np.unique(np.linspace(0, each.size - 1, _UNCERTAINTY_NODES).astype(int)) for each in (d, nu)]

        def points(d: FloatArray, nu: FloatArray, errors: Sequence[Uncertainty]) -> _DragPoint:
            varied = {"tube.bore": np.repeat(d, nu.size), "liquid.kinematic_viscosity": np.tile(nu, d.size)}
            return _DragPoint.of(_designs(scene, varied), errors).reshaped(d.size, nu.size)

        coarse, point = points(d[nodes[0]], nu[nodes[1]], _errors(scene)), points(d, nu, ())
        widths = {}
        for name in ("velocity", "k"):
            value, width = getattr(coarse, name), getattr(coarse, f"{name}_uncertainty")
            share = width / np.where(value > 0, value, 1.0)
            for axis, (every, at) in enumerate(zip((d, nu), nodes, strict=True)):
                line = partial(np.interp, np.log(every), np.log(every[at]))
                share = np.apply_along_axis(line, axis, share)
            widths[f"{name}_uncertainty"] = share * getattr(point, name)
        return cls(bore=d, kinematic_viscosity=nu, point=replace(point, **widths))

    def bores_for(self, k: FloatArray) -> list[float | None]:
        """For each viscosity the largest bore, m, at which a k on the map, shape (n, m), is the paper's.

        Returns: None where there is none on the map. Source: monotone cubic interpolation of ln k over ln d.
        """
        return [_bore_of(self.bore, *column) for column in zip(k.T, self.point.runs.T, strict=True)]


def _velocity_paper(density: float, gas_pressure: float) -> float:
    """Eq. 19 with k = 50 at equal fills, where its level terms cancel, m/s."""
    return float(
        paper.velocity_from_pressures(
            density=density, drag_coefficient=_FIFTY, pressure_difference=gas_pressure
        )
    )


def liquids_in_tube(
    calibration: Calibration, liquids: Sequence[Liquid] | None = None
) -> list[dict[str, Any]]:
    """Liquids in the scene's tube, primed, at equal fills; SI.

    Under the scene's gas pressure where that starts the flow, else at the pressure of equal head.
    Args: `liquids`: default the known ones at 20 degC or the next temperature with data.
    Returns: Records by liquid, the scene's own first, another of its name left out.
    Source: `_DragPoint.of`, density and the spread of the properties included.
    """
    scene, law = calibration.scene, calibration.flow_law
    others = liquids_at_room_temperature() if liquids is None else liquids
    chosen = (scene.liquid, *(liquid for liquid in others if liquid.name != scene.liquid.name))
    density = np.array([liquid.density for liquid in chosen])
    equal = scene.gas.pressure * density / scene.liquid.density
    bores = np.geomspace(*BORES, _BORE_POINTS)
    at_scene = _in_tube(calibration, chosen, np.full(density.shape, scene.gas.pressure))
    at_equal = _in_tube(calibration, chosen, equal)
    over_bores = _in_tube(calibration, chosen, equal, bores)
    # The scene's liquid starts to flow at this pressure, at equal fills, by the law's own kind of crest gas.
    half, gas = law.max_fill_ratio / 2, "trapped" if law.path.trapped else "vented"
    priming = law.priming_pressure(fill_ratio=half, opposite_fill_ratio=half, hump_gas=cast(HumpGas, gas))
    start = 0.0 if priming is None else max(float(priming), 0.0)
    records = []
    for i, liquid in enumerate(chosen):
        starts = bool(at_scene.regime[i] != Regime.BLOCKED)
        pressure = float(scene.gas.pressure if starts else equal[i])
        point, printed = (at_scene if starts else at_equal).at(i), _velocity_paper(liquid.density, pressure)
        records.append(
            {
                "name": liquid.name,
                "temperature_K": liquid.temperature,
                "density_kg_m3": liquid.density,
                "kinematic_viscosity_m2_s": liquid.kinematic_viscosity,
                "starts_at_scene_pressure": starts,
                "starting_pressure_Pa": start * liquid.density / law.density,
                "gas_pressure_Pa": pressure,
                **point,
                "velocity_paper_m_s": printed,
                "velocity_error": printed / point["velocity_m_s"] - 1 if point["runs"] else 0.0,
                "bore_for_paper_m": _bore_of(bores, over_bores.k[:, i], over_bores.runs[:, i]),
            }
        )
    return records


def _in_tube(
    calibration: Calibration,
    liquids: Sequence[Liquid],
    gas_pressure: FloatArray,
    bores: FloatArray | None = None,
) -> _DragPoint:
    """Operating points of liquids, shape (m,), or, without half-widths, in a tube of each bore, (n, m)."""
    scene = calibration.scene
    times, bore = (1, scene.tube.bore) if bores is None else (bores.size, bores)
    values: dict[str, Any] = {"gas.pressure": gas_pressure}
    for key in ("kinematic_viscosity", "density", "vapour_pressure"):
        values[f"liquid.{key}"] = [getattr(q, key) for q in liquids]
    tiled = {path: np.tile(np.asarray(each), times) for path, each in values.items()}
    designs = _designs(scene, {"tube.bore": np.repeat(bore, len(liquids)), **tiled})
    if bores is not None:
        return _DragPoint.of(designs).reshaped(times, len(liquids))
    errors = [each for each in _errors(scene, over=()) if each.name not in _LIQUID_UNCERTAINTIES]
    stated = independent_half_widths(scene)
    for name, spread in _LIQUID_UNCERTAINTIES.items():
        widths = np.array([getattr(q, spread) * getattr(q, name) for q in liquids])
        # Uncertainties that the scene states apply to its own liquid alone.
        widths[0] = stated.get(name, widths[0])
        change: dict[str, Any] = {name: widths / NORMAL_95}
        errors.append(replace(of_input(name, 0.0), change=change))
    return _DragPoint.of(designs, errors)


def read_by_eq_18(
    law: CalibratedLaw, velocity: npt.ArrayLike, *, opposite_fill_ratio: float
) -> tuple[FloatArray, FloatArray]:
    """k := 2 (H_A - H_C)/u^2 - 1 of a full siphon at velocities, m/s, and of a separated one.

    Separated, (alpha + k_up) u^2/2 = (p_A - p_c + P_A - D_m)/rho, while Eq. 18 counts the head
    H_A - H_C = (p_A - p_C + P_A - P_C)/rho. Their difference C = (D_m + p_c - P_C - p_C)/rho does not
    depend on what drives the flow, so k = alpha + k_up - 1 + 2 C/u^2: at one fill of the opposite chamber
    the excess falls exactly as 1/u^2, whatever the gas pressure and the driven chamber's fill.
    The larger of the two k applies, since the tube runs at the smaller velocity.
    Args: `velocity`: u, m/s, any shape, positive.
    Raises: ValueError: a law without a crest, whose column does not separate.
    Source: Eq. 18 of the liquid-ring paper and the crest's energy balance.
    """
    if law.heads.hump is None:
        raise ValueError("a tube without a siphon crest does not separate: give tube.hump_radius")
    u = np.asarray(velocity, dtype=np.float64)
    ends = law.ends(fill_ratio=0.0, opposite_fill_ratio=opposite_fill_ratio)
    excess = float(driving_pressure(law.path, ends) - crest_margins(law.path, ends)[0]) / law.density
    siphon, lower_bound = (
        2 * roots_of(table, u) ** 8 / u**2 - 1 for table in (law.heads.siphon, law.heads.hump)
    )
    return siphon, lower_bound + 2 * excess / u**2


def _bore_of(bore: FloatArray, k: FloatArray, runs: Any) -> float | None:
    if bore.size < 2 or not np.all(runs & (k > 0)):
        return None
    table = PchipInterpolator(np.log(bore), np.log(k), extrapolate=False)
    roots = np.asarray(table.solve(math.log(_FIFTY), extrapolate=False), dtype=np.float64)
    return float(np.exp(roots[np.isfinite(roots)]).max(initial=0.0)) or None


def _designs(scene: Scene, values: Mapping[str, FloatArray]) -> Designs:
    """Designs of a scene whose k is not prescribed."""
    return Designs.of(replace(scene, tube=replace(scene.tube, drag_coefficient=None)), values)


def _axis(
    values: npt.ArrayLike | None, limits: tuple[float, float], count: int, nominal: float
) -> FloatArray:
    if values is None:
        return np.geomspace(
            min(limits[0], nominal / _EDGE_FACTOR), max(limits[1], nominal * _EDGE_FACTOR), count
        )
    return np.asarray(values, dtype=np.float64)
