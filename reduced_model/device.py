"""A device at given inputs, solved at its operating point: what a calibration tabulates, at single states."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import partial
from typing import Final

import numpy as np

from ringbalance.mesh.geometry import chamber_volume, liquid_area
from ringbalance.physics.gas import pressure_factor
from ringbalance.physics.tube.draw_down import port_depth
from ringbalance.physics.tube.uncertainty import TUBE_INPUTS
from ringbalance.reduced_model.chamber.inputs import chamber_pressure, measured_closed_forms
from ringbalance.reduced_model.law.building import tube_path
from ringbalance.reduced_model.operating.residual import NEARLY_EMPTY, first_stalled
from ringbalance.reduced_model.tube.heads import log_heads
from ringbalance.reduced_model.tube.regime import (
    ColumnFlow,
    Pressure,
    TubeEnds,
    TubePath,
    can_flow,
    column_flow,
)
from ringbalance.scene.arrays import BoolArray, FloatArray
from ringbalance.scene.models import Scene

HEAD_INPUTS: Final = frozenset({*TUBE_INPUTS, "hump_position", "hump_radius", "port_radius"})
"""Inputs that change the tube's heads; for others they may be passed on."""
_SPAN: Final = (-5.0, 2.5)
"""Of the tabulated velocities, ln(u/near)."""
_NODES: Final = 121
_ROUNDS: Final = 2
"""Of the fixed point of the residual fill, each of which leaves a tenth of the error or less."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Device:
    """Chamber by closed forms without gravity, tube by its loss, at single states."""

    scene: Scene
    path: TubePath
    gas_factor: float
    near: float
    """Velocity that the heads are tabulated around, m/s."""
    near_fill: float
    """Residual fill that its own is looked for from."""
    heads: tuple[FloatArray, ...]
    """Those of `log_heads`."""

    def values(self) -> dict[str, float]:
        """The quantities of an uncertainty budget, SI; those of a flow only where there is one."""
        disc = self.scene.disc
        fills = np.array([0.0, disc.max_fill_ratio / 2, disc.max_fill_ratio])
        wall, moment, ratio = measured_closed_forms(scene=self.scene, fill_ratio=fills)
        empty, half, full = (float(p) for p in chamber_pressure(scene=self.scene, fill_ratio=fills))
        equal, uneven = self._ends(half, half), self._ends(empty, full)
        least, usable = self._usable()
        found = {
            "chamber_volume": chamber_volume(disc=disc),
            "wall_pressure": float(wall[2]),
            "moment": float(moment[2]),
            "lambda": float(ratio[1]),
            "least_fill_ratio": least,
            "usable_moment": usable,
            "stall_pressure": max(uneven.stall_pressure(), 0.0) / self.gas_factor,
        }
        crest = self.path.crest
        if crest is not None:
            vented, trapped = (replace(crest, trapped=kept) for kept in (False, True))
            found["priming_pressure_vented"] = vented.priming_pressure(uneven) / self.gas_factor
            found["priming_pressure_trapped"] = trapped.priming_pressure(equal) / self.gas_factor
        return found | self._flow_values(equal)

    def _flow_values(self, ends: TubeEnds[float]) -> dict[str, float]:
        flow = self._flow(ends, primed=False)
        found = {"velocity": flow.velocity}
        u = flow.velocity or self._flow(ends, primed=True).velocity
        if u > 0:
            found["drag_coefficient"] = 2 * self._head(0, u) / u**2 - 1
        crest = self.path.crest
        if flow.velocity > 0 and crest is not None:
            rho, rest = self.path.density, crest.resting_pressure(ends)
            found["crest_pressure"] = rest - rho * self._head(3, flow.velocity)
            full = rest - rho * self._head(1, flow.siphon_velocity)
            found["cavitation_margin"] = full - crest.cavity_pressure(ends)
        return found

    def _ends(self, own: Pressure, other: Pressure, *, driven: bool = True) -> TubeEnds[Pressure]:
        """For hydrostatic pressures of the two chambers; `driven`: with the gas on."""
        gas = self.gas_factor * self.scene.gas.pressure if driven else 0.0
        return TubeEnds(
            upstream_gas=0 * own + gas,
            downstream_gas=0 * own,
            upstream_hydrostatic=own,
            downstream_hydrostatic=other,
            port_pressure=self.path.port_pressure,
        )

    def _flow(self, ends: TubeEnds[float], *, primed: bool) -> ColumnFlow[float]:
        return column_flow(
            ends=ends,
            crest=self.path.crest,
            primed=primed,
            siphon=partial(self._velocity, 0),
            separation=partial(self._velocity, 1),
        )

    def _velocity(self, which: int, pressure: float, where: bool) -> float:
        if not where or pressure <= 0:
            return 0.0
        log_head = math.log(pressure / self.path.density)
        return math.exp(float(np.interp(log_head, self.heads[which], _log_velocities(self.near))))

    def _head(self, which: int, velocity: float) -> float:
        return math.exp(float(np.interp(math.log(velocity), _log_velocities(self.near), self.heads[which])))

    def _usable(self) -> tuple[float, float]:
        """Least fill and largest moment of a pair, kg m, as `ResidualLiquid`."""
        top = self.scene.disc.max_fill_ratio
        least = min(max(self._residual_fill(), self._stalled_fill()), top / 2)
        _, moment, _ = measured_closed_forms(scene=self.scene, fill_ratio=np.array([top - least, least]))
        return least, float(moment[0] - moment[1])

    def _residual_fill(self) -> float:
        disc, top = self.scene.disc, self.scene.disc.max_fill_ratio
        area = float(liquid_area(disc=disc, surface_radius=disc.inner_radius))
        x = self.near_fill
        for _ in range(_ROUNDS):
            pressure = chamber_pressure(scene=self.scene, fill_ratio=np.array([x, top - x]))
            u = self._flow(self._ends(float(pressure[0]), float(pressure[1])), primed=True).velocity
            depth = float(port_depth(self.scene, flow_rate=self.scene.tube.area * u))
            level = min(max(self.scene.tube.port_radius - depth, disc.inner_radius), disc.outer_radius)
            x = min(float(liquid_area(disc=disc, surface_radius=level)) / area, top)
        return x

    def _stalled_fill(self) -> float:
        """As `stalled_fill_ratio`; zero where the gas drives a chamber empty."""
        top, crest = self.scene.disc.max_fill_ratio, self.path.crest

        def moves(fills: FloatArray) -> BoolArray:
            own, other = (
                measured_closed_forms(scene=self.scene, fill_ratio=x)[0] for x in (fills, top - fills)
            )
            rest = self._ends(own, other, driven=False)
            # Only over a crest may a column be held while the gas is off.
            held = crest is not None and (
                np.asarray(can_flow(ends=rest, crest=crest, primed=True))
                | can_flow(ends=rest.reversed(), crest=crest, primed=True)
            )
            return np.asarray(can_flow(ends=self._ends(own, other), crest=crest, primed=held))

        return first_stalled(moves, start=top / 2, end=NEARLY_EMPTY * top) or 0.0


def device_of(
    scene: Scene, *, near: float, near_fill: float = 0.0, heads: tuple[FloatArray, ...] | None = None
) -> Device:
    """Set a device up from a scene.

    Args: `near`: velocity around which the heads are tabulated, m/s. `near_fill`: of the residual liquid,
        about. `heads`: those of a device that differs in none of `HEAD_INPUTS`.
    """
    if heads is None:
        heads = tuple(head(_log_velocities(near)) for head in log_heads(scene))
    return Device(
        scene=scene,
        path=tube_path(scene),
        gas_factor=pressure_factor(scene),
        near=near,
        near_fill=near_fill,
        heads=heads,
    )


def _log_velocities(near: float) -> FloatArray:
    return math.log(near) + np.linspace(*_SPAN, _NODES)
