"""The verdict on one drag coefficient: k over bore and viscosity at the device's own operating point.

At equal fills the operating point follows from the gas head p/rho and, where the column is separated, from
the crest: a denser liquid under proportionally more gas has the same heads, so one map serves all densities
but for the vapour pressure.  Under the same gas it has a smaller head, or does not start at all.

Where the column is separated, someone who reads k off Eq. 18 finds a drag that falls as 1/u^2.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Final

import numpy as np
import numpy.typing as npt
from scipy.interpolate import PchipInterpolator

from ringbalance.reduced_model import paper
from ringbalance.reduced_model.calibration_record import Calibration, priming_pressure
from ringbalance.reduced_model.law.calibrated_law import CalibratedLaw
from ringbalance.reduced_model.tube.regime import (
    crest_margins,
    driving_pressure,
)
from ringbalance.reports.pages.drag_point import DragPoint
from ringbalance.scene.arrays import BoolArray, FloatArray
from ringbalance.scene.designs import Designs
from ringbalance.scene.liquids import known_liquids, liquid_at
from ringbalance.scene.models import HumpGas, Liquid, Scene

BORES: Final = (0.2e-3, 5e-3)
"""m: the map's range, widened when the scene's own bore lies near its edge."""
VISCOSITIES: Final = (2e-7, 5e-4)
"""m^2/s: the same, from below liquid gallium to above silicone oil of 350 cSt."""
BORE_POINTS: Final = 41
VISCOSITY_POINTS: Final = 49
_ROOM: Final = 1.5
_ROOM_TEMPERATURE: Final = 293.15
_NU: Final = "liquid.kinematic_viscosity"


@dataclass(frozen=True, kw_only=True, eq=False)
class DragMap:
    """Operating points over bore and viscosity, everything else as in the scene; k is never prescribed."""

    bore: FloatArray
    """d, m, rising, shape (n,)."""
    kinematic_viscosity: FloatArray
    """nu, m^2/s, rising, shape (m,)."""
    density: float
    """rho of the scene's liquid, kg/m^3."""
    gas_pressure: float
    """The scene's, gauge, Pa."""
    point: DragPoint
    """Arrays of shape (n, m)."""
    velocity_paper: float
    """Eq. 19 with k = 50 at equal fills, m/s: the same everywhere."""

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
        Raises: ValueError: values that are not positive, finite and rising, or arcs of bends longer than the
        tube.
        Range: as `tube_loss`; `point.in_range` says where a correlation is stretched.
        Source: `DragPoint.of` at every point.
        """
        scene = calibration.scene
        d = _axis(bore, "bore", BORES, BORE_POINTS, scene.tube.bore)
        nu = _axis(
            kinematic_viscosity,
            "kinematic_viscosity",
            VISCOSITIES,
            VISCOSITY_POINTS,
            scene.liquid.kinematic_viscosity,
        )
        rho, law = scene.liquid.density, calibration.flow_law
        point = DragPoint.of(
            _designs(scene, {"tube.bore": np.repeat(d, nu.size), _NU: np.tile(nu, d.size)}),
            scene=scene,
            law=law,
            relative_density=law.inputs.relative_density,
        )
        return cls(
            bore=d,
            kinematic_viscosity=nu,
            density=rho,
            gas_pressure=scene.gas.pressure,
            point=point.reshaped(d.size, nu.size),
            velocity_paper=float(_velocity_paper(rho, scene.gas.pressure)),
        )

    def contour(
        self, *, k: float = paper.PAPER_DRAG_COEFFICIENT, apparent: bool = False
    ) -> tuple[FloatArray, FloatArray]:
        """Where on the map k has one value, for each of the map's viscosities.

        Args: `k`: the value, positive.
        Returns: Viscosities, m^2/s, and bores, m, of one shape; empty where the map does not reach the value.
        Raises: ValueError: a k that is not positive and finite.
        Source: monotone cubic interpolation of ln k over ln d between the map's bores.
        """
        if not (np.isfinite(k) and k > 0):
            raise ValueError("k must be positive and finite")
        values = self.point.apparent_k if apparent else self.point.k
        crossings = [
            (nu, float(np.exp(root)))
            for nu, column, runs in zip(self.kinematic_viscosity, values.T, self.point.runs.T, strict=True)
            if np.all(runs & (column > 0)) and self.bore.size > 1
            for root in _roots(self.bore, column, k)
        ]
        pairs = np.array(crossings, dtype=np.float64).reshape(-1, 2)
        return pairs[:, 0], pairs[:, 1]


@dataclass(frozen=True, kw_only=True, eq=False)
class LiquidVerdicts:
    """Liquids in the scene's tube; arrays of shape (m,)."""

    liquids: tuple[Liquid, ...]
    """The scene's own first."""
    at_scene: DragPoint
    """Under the scene's gas pressure."""
    at_equal_head: DragPoint
    """Under `equal_head_pressure`."""
    equal_head_pressure: FloatArray
    """The scene's gas pressure times rho over that of the scene's liquid, gauge, Pa."""
    starting_pressure: FloatArray
    """Gauge pressure above which an empty tube starts to flow at equal fills, Pa; zero without a crest."""
    velocity_paper_at_scene: FloatArray
    """Eq. 19 with k = 50, m/s."""
    velocity_paper_at_equal_head: FloatArray
    """The same under `equal_head_pressure`."""
    bore_for_paper: FloatArray
    """Bore at which k is the paper's at equal heads, m; zero where there is none between BORES."""

    @classmethod
    def of(cls, *, calibration: Calibration, liquids: Sequence[Liquid] | None = None) -> LiquidVerdicts:
        """Hold k = 50 against liquids in the scene's own tube.

        Args: `liquids`: those to ask; default the known ones at 20 degC or the next temperature with data.
        Returns: LiquidVerdicts; the scene's own liquid stands first, another of its name is left out.
        Source: `DragPoint.of` for each liquid, its density and the spread of its properties included.
        """
        scene, law = calibration.scene, calibration.flow_law
        asked = _default_liquids() if liquids is None else tuple(liquids)
        chosen = (scene.liquid, *(q for q in asked if q.name != scene.liquid.name))
        rho = np.array([q.density for q in chosen])
        equal = scene.gas.pressure * rho / scene.liquid.density
        spread = np.array([q.density_uncertainty for q in chosen])
        spread[0] = law.inputs.relative_density
        viscosity_spread = _viscosity_uncertainty(scene, chosen)

        def points(pressure: FloatArray, bore: FloatArray) -> DragPoint:
            """Of all liquids in a tube of each bore, shape (bores, liquids)."""
            of_liquids = {
                _NU: np.array([q.kinematic_viscosity for q in chosen]),
                "liquid.density": rho,
                "liquid.vapour_pressure": np.array([q.vapour_pressure for q in chosen]),
                "gas.pressure": pressure,
            }
            values = {path: np.tile(value, bore.size) for path, value in of_liquids.items()}
            return DragPoint.of(
                _designs(scene, {"tube.bore": np.repeat(bore, rho.size), **values}),
                scene=scene,
                law=law,
                relative_density=np.tile(spread, bore.size),
                relative_viscosity=np.tile(viscosity_spread, bore.size),
            )

        own = np.array([scene.tube.bore])
        share = rho / law.density
        bores = np.geomspace(*BORES, BORE_POINTS)
        return cls(
            liquids=chosen,
            at_scene=points(np.full(rho.shape, scene.gas.pressure), own),
            at_equal_head=points(equal, own),
            equal_head_pressure=equal,
            starting_pressure=share * _starting_pressure(calibration),
            velocity_paper_at_scene=_velocity_paper(rho, scene.gas.pressure),
            velocity_paper_at_equal_head=_velocity_paper(rho, equal),
            bore_for_paper=_bore_for_paper(bores, points(equal, bores).reshaped(bores.size, rho.size)),
        )

    def velocity_errors(self) -> tuple[FloatArray, FloatArray]:
        """How far Eq. 19 with k = 50 is off for each liquid, relative to the operating point's velocity.

        Returns: u_paper/u - 1 under the scene's gas pressure and at equal heads, shape (m,); zero where
        nothing flows.
        Source: Eq. 19 of the liquid-ring paper.
        """
        return (
            _over(self.velocity_paper_at_scene, self.at_scene),
            _over(self.velocity_paper_at_equal_head, self.at_equal_head),
        )


def _over(paper_velocity: npt.ArrayLike, point: DragPoint) -> FloatArray:
    speed = np.where(point.runs, point.velocity, 1.0)
    return np.where(point.runs, np.asarray(paper_velocity, dtype=np.float64) / speed - 1, 0.0)


def _roots(bore: FloatArray, k: FloatArray, wanted: float) -> FloatArray:
    table = PchipInterpolator(np.log(bore), np.log(k), extrapolate=False)
    found = np.asarray(table.solve(np.log(wanted), extrapolate=False), dtype=np.float64)
    return found[np.isfinite(found)]


def _viscosity_uncertainty(scene: Scene, liquids: tuple[Liquid, ...]) -> FloatArray:
    """Relative half-widths; what the scene states is of its own liquid, the first."""
    uncertainty_95 = np.array([q.viscosity_uncertainty for q in liquids])
    for stated in scene.uncertainty:
        if stated.quantity == "kinematic_viscosity":
            nu = liquids[0].kinematic_viscosity
            uncertainty_95[0] = stated.absolute(nu) / nu
    return uncertainty_95


def _starting_pressure(calibration: Calibration) -> float:
    """Of the scene's liquid, at equal fills, by the law's own kind of crest gas."""
    law = calibration.flow_law
    half = law.max_fill_ratio / 2
    gas: HumpGas = "trapped" if law.path.trapped else "vented"
    pressure = priming_pressure(law=law, fill_ratio=half, opposite_fill_ratio=half, hump_gas=gas)
    return 0.0 if pressure is None else max(float(pressure), 0.0)


def _default_liquids() -> tuple[Liquid, ...]:
    """Each known liquid at room temperature, or at the nearest temperature that there are data for."""
    return tuple(
        liquid_at(
            name=each.name,
            temperature=min(max(_ROOM_TEMPERATURE, each.temperatures[0]), each.temperatures[-1]),
        )
        for each in known_liquids()
    )


def _bore_for_paper(bores: FloatArray, points: DragPoint) -> FloatArray:
    def largest(column: FloatArray, runs: BoolArray) -> float:
        roots = _roots(bores, column, paper.PAPER_DRAG_COEFFICIENT) if np.all(runs) else np.empty(0)
        return float(np.exp(roots.max())) if roots.size else 0.0

    return np.array([largest(k, runs) for k, runs in zip(points.k.T, points.runs.T, strict=True)])


def _designs(scene: Scene, values: Mapping[str, FloatArray]) -> Designs:
    """Of a scene whose k is not prescribed."""
    return Designs.of(replace(scene, tube=replace(scene.tube, drag_coefficient=None)), values)


def _velocity_paper(density: npt.ArrayLike, gas_pressure: npt.ArrayLike) -> FloatArray:
    """Eq. 19 at equal fills, where its level terms cancel."""
    head = np.asarray(gas_pressure, dtype=np.float64) / np.asarray(density, dtype=np.float64)
    return paper.velocity_from_pressures(
        density=1.0, drag_coefficient=paper.PAPER_DRAG_COEFFICIENT, pressure_difference=head
    )


def _axis(
    given: npt.ArrayLike | None, name: str, limits: tuple[float, float], count: int, own: float
) -> FloatArray:
    if given is None:
        return np.geomspace(min(limits[0], own / _ROOM), max(limits[1], own * _ROOM), count)
    values = np.asarray(given, dtype=np.float64)
    if values.ndim != 1 or not values.size or not np.all(np.isfinite(values) & (values > 0)):
        raise ValueError(f"{name} must be a row of positive, finite numbers")
    if np.any(np.diff(values) <= 0):
        raise ValueError(f"{name} must rise")
    return values


@dataclass(frozen=True, kw_only=True, eq=False)
class ApparentDrag:
    """Loss coefficients by k := 2 (H_A - H_C)/u^2 - 1 over the velocity; arrays of one shape."""

    velocity: FloatArray
    """u, m/s."""
    siphon: FloatArray
    """k(u) of the full siphon."""
    separated: FloatArray
    """What a separated siphon of that velocity would read."""
    read: FloatArray
    """What is read: the larger of the two, since the tube runs at the smaller velocity."""
    lower_bound: FloatArray
    """alpha + k_up - 1, to which `separated` falls."""
    excess_head: float
    """C, m^2/s^2, in separated = lower_bound + 2 C/u^2; not above zero, the siphon never separates."""

    @classmethod
    def of(cls, *, law: CalibratedLaw, velocity: npt.ArrayLike, opposite_fill_ratio: float) -> ApparentDrag:
        """Read Eq. 18 off a separated siphon.

        Separated, (alpha + k_up) u^2/2 = (p_A - p_c + P_A - D_m)/rho, while Eq. 18 counts the head
        H_A - H_C = (p_A - p_C + P_A - P_C)/rho. Their difference C = (D_m + p_c - P_C - p_C)/rho does not
        depend on what drives the flow, so k = alpha + k_up - 1 + 2 C/u^2: at one fill of the opposite chamber
        the excess falls exactly as 1/u^2, whatever the gas pressure and the driven chamber's fill.
        Args: `velocity`: u, m/s, any shape, positive.
        Raises: ValueError: a law without a crest, or a velocity that is not positive and finite.
        Source: Eq. 18 of the liquid-ring paper and the crest's energy balance.
        """
        crest_head = law.heads.hump_head
        if crest_head is None:
            raise ValueError("a tube without a siphon crest does not separate: give tube.hump_radius")
        u = np.asarray(velocity, dtype=np.float64)
        if not np.all(np.isfinite(u) & (u > 0)):
            raise ValueError("velocity must be positive and finite")
        ends = law.ends(fill_ratio=0.0, opposite_fill_ratio=opposite_fill_ratio)
        excess = float(driving_pressure(law.path, ends) - crest_margins(law.path, ends)[0]) / law.density
        siphon, lower_bound = (
            2 * np.exp(table(np.log(u))) / u**2 - 1 for table in (law.heads.head, crest_head)
        )
        separated = lower_bound + 2 * excess / u**2
        return cls(
            velocity=u,
            siphon=siphon,
            separated=separated,
            read=np.maximum(siphon, separated),
            lower_bound=lower_bound,
            excess_head=excess,
        )
