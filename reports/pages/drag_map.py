"""k over bore and viscosity, and of liquids in one tube, at the device's own operating point.

At equal fills the operating point follows from the gas head p/rho and, where the column is separated, from
the crest: a denser liquid under proportionally more gas has the same heads, so one map serves all densities
but for the vapour pressure.  Under the same gas it has a smaller head, or does not start at all.

Where the column is separated, someone who reads k off Eq. 18 finds a drag that falls as 1/u^2.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, Final

import numpy as np
import numpy.typing as npt
from scipy.interpolate import PchipInterpolator

from ringbalance.reduced_model import paper
from ringbalance.reduced_model.calibration_record import Calibration, priming_pressure
from ringbalance.reduced_model.law.calibrated_law import CalibratedLaw
from ringbalance.reduced_model.law.flow_law import Regime
from ringbalance.reduced_model.tube.heads import roots_of
from ringbalance.reduced_model.tube.regime import crest_margins, driving_pressure
from ringbalance.reports.pages.drag_point import DragPoint
from ringbalance.scene.arrays import FloatArray
from ringbalance.scene.designs import Designs
from ringbalance.scene.liquids import known_liquids, liquid_at
from ringbalance.scene.models import HumpGas, Liquid, Scene

BORES: Final = (0.2e-3, 5e-3)
"""m: the map's range, widened when the scene's own bore lies near its edge."""
_VISCOSITIES: Final = (2e-7, 5e-4)
"""m^2/s: the same, from below liquid gallium to above silicone oil of 350 cSt."""
_BORE_POINTS: Final = 41
_VISCOSITY_POINTS: Final = 49
_ROOM: Final = 1.5
_ROOM_TEMPERATURE: Final = 293.15
_FIFTY: Final = paper.PAPER_DRAG_COEFFICIENT


@dataclass(frozen=True, kw_only=True, eq=False)
class DragMap:
    """Operating points over bore and viscosity, everything else as in the scene; k is never prescribed."""

    bore: FloatArray
    """d, m, rising, shape (n,)."""
    kinematic_viscosity: FloatArray
    """nu, m^2/s, rising, shape (m,)."""
    point: DragPoint
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
        Range: as `tube_loss`; `point.in_range` says where a correlation is stretched.
        """
        scene, law = calibration.scene, calibration.flow_law
        d = _axis(bore, BORES, _BORE_POINTS, scene.tube.bore)
        own = scene.liquid.kinematic_viscosity
        nu = _axis(kinematic_viscosity, _VISCOSITIES, _VISCOSITY_POINTS, own)
        varied = {
            "tube.bore": np.repeat(d, nu.size),
            "liquid.kinematic_viscosity": np.tile(nu, d.size),
        }
        point = DragPoint.of(
            _designs(scene, varied), scene=scene, law=law, relative_density=law.inputs.relative_density
        )
        return cls(bore=d, kinematic_viscosity=nu, point=point.reshaped(d.size, nu.size))

    def bores_for(self, k: FloatArray) -> list[float | None]:
        """For each viscosity the largest bore, m, at which a k on the map, shape (n, m), is the paper's.

        Returns: None where there is none on the map. Source: monotone cubic interpolation of ln k over ln d.
        """
        return [_bore_of(self.bore, *column) for column in zip(k.T, self.point.runs.T, strict=True)]


def velocity_paper(density: float, gas_pressure: float) -> float:
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
    Args: `liquids`: those to ask; default the known ones at 20 degC or the next temperature with data.
    Returns: By liquid, the scene's own first, another of its name left out.
    Source: `DragPoint.of`, density and the spread of the properties included.
    """
    scene, law = calibration.scene, calibration.flow_law
    asked = _default_liquids() if liquids is None else liquids
    chosen = (scene.liquid, *(q for q in asked if q.name != scene.liquid.name))
    density = np.array([q.density for q in chosen])
    equal = scene.gas.pressure * density / scene.liquid.density
    bores = np.geomspace(*BORES, _BORE_POINTS)
    at_scene = _in_tube(calibration, chosen, np.full(density.shape, scene.gas.pressure))
    at_equal = _in_tube(calibration, chosen, equal)
    over_bores = _in_tube(calibration, chosen, equal, bores)
    start = _starting_pressure(calibration)
    records = []
    for i, liquid in enumerate(chosen):
        starts = bool(at_scene.regime[i] != Regime.BLOCKED)
        pressure = float(scene.gas.pressure if starts else equal[i])
        point, printed = (at_scene if starts else at_equal).at(i), velocity_paper(liquid.density, pressure)
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
) -> DragPoint:
    """Of liquids, shape (m,), or in a tube of each bore, shape (n, m)."""
    scene, law = calibration.scene, calibration.flow_law
    times, own = (1, scene.tube.bore) if bores is None else (bores.size, bores)
    values: dict[str, Any] = {"gas.pressure": gas_pressure}
    for key in ("kinematic_viscosity", "density", "vapour_pressure"):
        values[f"liquid.{key}"] = [getattr(q, key) for q in liquids]
    spread = np.array([(q.density_uncertainty, q.viscosity_uncertainty) for q in liquids])
    # What the scene states is of its own liquid.
    spread[0, 0] = law.inputs.relative_density
    stated = [each for each in scene.uncertainty if each.quantity == "kinematic_viscosity"]
    nu = scene.liquid.kinematic_viscosity
    spread[0, 1] = stated[0].absolute(nu) / nu if stated else spread[0, 1]
    tiled = {path: np.tile(np.asarray(each), times) for path, each in values.items()}
    point = DragPoint.of(
        _designs(scene, {"tube.bore": np.repeat(own, len(liquids)), **tiled}),
        scene=scene,
        law=law,
        relative_density=np.tile(spread[:, 0], times),
        relative_viscosity=np.tile(spread[:, 1], times),
    )
    return point if bores is None else point.reshaped(times, len(liquids))


def read_by_eq_18(
    law: CalibratedLaw, velocity: npt.ArrayLike, *, opposite_fill_ratio: float
) -> tuple[FloatArray, FloatArray]:
    """k := 2 (H_A - H_C)/u^2 - 1 of a full siphon at velocities, m/s, and of a separated one.

    Separated, (alpha + k_up) u^2/2 = (p_A - p_c + P_A - D_m)/rho, while Eq. 18 counts the head
    H_A - H_C = (p_A - p_C + P_A - P_C)/rho. Their difference C = (D_m + p_c - P_C - p_C)/rho does not
    depend on what drives the flow, so k = alpha + k_up - 1 + 2 C/u^2: at one fill of the opposite chamber
    the excess falls exactly as 1/u^2, whatever the gas pressure and the driven chamber's fill.
    What is read is the larger of the two, since the tube runs at the smaller velocity.
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


def _starting_pressure(calibration: Calibration) -> float:
    """Of the scene's liquid, at equal fills, by the law's own kind of crest gas, Pa."""
    law = calibration.flow_law
    half = law.max_fill_ratio / 2
    gas: HumpGas = "trapped" if law.path.trapped else "vented"
    pressure = priming_pressure(law=law, fill_ratio=half, opposite_fill_ratio=half, hump_gas=gas)
    return 0.0 if pressure is None else max(float(pressure), 0.0)


def _default_liquids() -> tuple[Liquid, ...]:
    """Each known liquid at room temperature, or at the nearest temperature that there are data for."""
    temperatures = {q.name: (q.temperatures[0], q.temperatures[-1]) for q in known_liquids()}
    return tuple(
        liquid_at(name=name, temperature=min(max(_ROOM_TEMPERATURE, low), high))
        for name, (low, high) in temperatures.items()
    )


def _designs(scene: Scene, values: Mapping[str, FloatArray]) -> Designs:
    """Of a scene whose k is not prescribed."""
    return Designs.of(replace(scene, tube=replace(scene.tube, drag_coefficient=None)), values)


def _axis(given: npt.ArrayLike | None, limits: tuple[float, float], count: int, own: float) -> FloatArray:
    if given is None:
        return np.geomspace(min(limits[0], own / _ROOM), max(limits[1], own * _ROOM), count)
    return np.asarray(given, dtype=np.float64)
