"""The flow law distilled from a chamber's free surface and the tube's loss, with all its regimes.

Beside it the moment of a pair of chambers, from the same chamber.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from ringbalance.reduced_model.law.flow_law import Conditions, Flow, Regime, law_text, save_record
from ringbalance.reduced_model.tables import HermiteTable
from ringbalance.reduced_model.tube.directed_flow import DirectedFlow, Drive, DriveUncertainty, siphon_margin
from ringbalance.reduced_model.tube.heads import TubeHeads, velocity_of
from ringbalance.reduced_model.tube.regime import TubeEnds, TubePath
from ringbalance.scene.arrays import BoolArray, ComplexArray, FloatArray


@dataclass(frozen=True, kw_only=True, eq=False)
class CalibratedMoment:
    """U(x) of one chamber along its middle, and W(x) across it; a pair's is U(x_A) - U(x_C), W alike."""

    chamber_moment: HermiteTable
    """U, kg m, over the fill ratio."""
    half_width: HermiteTable
    """Expanded uncertainty (95 %) of U, kg m, over the fill ratio: numerical, interpolation and left-out
    terms."""
    across: HermiteTable | None = None
    """W, kg m, over the fill ratio, in the sense of the rotation; None for a symmetric chamber."""

    def pair_moment(self, *, fill_ratio: npt.ArrayLike, opposite_fill_ratio: npt.ArrayLike) -> FloatArray:
        return np.asarray(self.chamber_moment(fill_ratio) - self.chamber_moment(opposite_fill_ratio))

    def pair_vector(self, *, fill_ratio: npt.ArrayLike, opposite_fill_ratio: npt.ArrayLike) -> ComplexArray:
        along = self.pair_moment(fill_ratio=fill_ratio, opposite_fill_ratio=opposite_fill_ratio)
        if self.across is None:
            return np.asarray(along, dtype=np.complex128)
        return np.asarray(along + 1j * (self.across(fill_ratio) - self.across(opposite_fill_ratio)))


@dataclass(frozen=True, kw_only=True, eq=False)
class CalibratedLaw:
    """Flow of the tube for any fills, gas pressure and history: blocked, siphon, separated or reverse.

    The velocity is continuous in fills and pressure, except where the physics jumps: when a column separates
    at rest, and when a chamber's liquid leaves the port open.

    `table()` holds `log_velocity` (ln m/s), `log_head`, `log_hump_head` and `log_return_hump_head`
    (ln m^2/s^2; the last two only with a crest), `fill_ratio`, `hydrostatic_pressure` (Pa), and, of shape
    (1,), `density`, `port_pressure`, `hump_pressure` (only with a crest), `vapour_pressure` (gauge, Pa), and
    `released` and `froude_velocity` (m/s) of `SiphonCrest`.
    """

    name: str
    """ "calibrated"."""
    max_fill_ratio: float
    """Liquid of the pair as a share of one chamber's volume."""
    ambient_pressure: float
    """Absolute, Pa."""
    chamber_volume: float
    """V, m^3."""
    tube_area: float
    """S, m^2."""
    hydrostatic_pressure: HermiteTable
    """Of a chamber's liquid at the outer radius R2, rho omega^2 (R2^2 - a^2)/2, Pa, over its fill ratio."""
    hydrostatic_pressure_uncertainty: HermiteTable
    """Its expanded uncertainty (95 %), Pa, over the fill ratio."""
    path: TubePath
    """Radii of the tube, as pressures."""
    heads: TubeHeads
    """Loss of the tube."""
    inputs: DriveUncertainty
    """Half-widths of what drives the flow."""
    moment: CalibratedMoment
    """The moment that goes with this law."""
    gas_factor: float = 1.0
    """Gas pressure on the liquid over the one at the place of measurement, which all arguments are."""

    variants: tuple[CalibratedLaw, ...] = ()
    """Laws without uncertainties of a device that is lower, then higher, by the expanded uncertainty (95 %)
    along each direction of the inputs that were fitted together; `inputs` and the rest have the others."""

    def __repr__(self) -> str:
        return law_text(self)

    @property
    def density(self) -> float:
        return self.path.density

    def evaluate(
        self,
        *,
        fill_ratio: npt.ArrayLike,
        opposite_fill_ratio: npt.ArrayLike | None = None,
        gas_pressure: npt.ArrayLike,
        primed: npt.ArrayLike = False,
    ) -> Flow:
        asked = Conditions.checked(
            max_fill_ratio=self.max_fill_ratio,
            ambient_pressure=self.ambient_pressure,
            fill_ratio=fill_ratio,
            opposite_fill_ratio=opposite_fill_ratio,
            gas_pressure=gas_pressure,
            primed=primed,
        )
        forward = self._directed(asked, reverse=False)
        if np.all(forward.velocity > 0):
            return _joined(forward, forward, np.zeros_like(asked.primed))
        backward = self._directed(asked, reverse=True)
        return _joined(forward, backward, (backward.velocity > 0) & ~(forward.velocity > 0))

    def ends(
        self,
        *,
        fill_ratio: npt.ArrayLike,
        opposite_fill_ratio: npt.ArrayLike | None = None,
        gas_pressure: npt.ArrayLike = 0.0,
    ) -> TubeEnds[FloatArray]:
        """Pressures at the tube's ends for flow out of the driven chamber; not checked."""
        x = np.asarray(fill_ratio, dtype=np.float64)
        y = self.max_fill_ratio - x if opposite_fill_ratio is None else opposite_fill_ratio
        gas, own, other = np.broadcast_arrays(
            self.gas_factor * np.asarray(gas_pressure, dtype=np.float64),
            np.maximum(self.hydrostatic_pressure(x), 0.0),
            np.maximum(self.hydrostatic_pressure(y), 0.0),
        )
        return TubeEnds(
            upstream_gas=gas,
            downstream_gas=np.zeros_like(gas),
            upstream_hydrostatic=own,
            downstream_hydrostatic=other,
            port_pressure=self.path.port_pressure,
        )

    def holds(self, fill_ratio: float) -> bool:
        """Whether a chamber of that fill keeps it against a lower one with the gas off."""
        return self.path.holds(max(float(self.hydrostatic_pressure(fill_ratio)), 0.0))

    def drive(self, asked: Conditions, *, reverse: bool) -> Drive:
        """What acts on the tube in one direction; `reverse`: out of the opposite chamber."""
        own, other = asked.fill_ratio, asked.opposite_fill_ratio
        ends = self.ends(fill_ratio=own, opposite_fill_ratio=other, gas_pressure=asked.gas_pressure)
        return Drive(
            ends=ends.reversed() if reverse else ends,
            upstream_uncertainty=self.hydrostatic_pressure_uncertainty(other if reverse else own),
            downstream_uncertainty=self.hydrostatic_pressure_uncertainty(own if reverse else other),
            primed=asked.primed,
        )

    def _directed(self, asked: Conditions, *, reverse: bool) -> DirectedFlow:
        flow = DirectedFlow.of(
            path=self.path,
            heads=self.heads,
            hump_head=self.heads.to_crest(reverse=reverse),
            inputs=self.inputs,
            drive=self.drive(asked, reverse=reverse),
        )
        sides = [variant._directed(asked, reverse=reverse) for variant in self.variants]
        return flow.widened(sides[::2], sides[1::2])

    def save(self, path: Path | str) -> Path:
        return save_record(path=Path(path), record=self)

    def table(self) -> Mapping[str, FloatArray]:
        """Plain arrays for compiled code, named in the class's docstring.

        Returns: Copies, so that nothing can change the law.
        """
        heads = {
            "log_head": self.heads.head,
            "log_hump_head": self.heads.hump_head,
            "log_return_hump_head": self.heads.return_hump_head,
        }
        scalars = {
            "density": self.path.density,
            "port_pressure": self.path.port_pressure,
            "hump_pressure": self.path.hump_pressure,
            "vapour_pressure": self.path.vapour_pressure,
            "released": self.path.released,
            "froude_velocity": self.path.froude_velocity,
        }
        return (
            {"log_velocity": self.heads.head.nodes}
            | {name: table.value.copy() for name, table in heads.items() if table is not None}
            | {
                "fill_ratio": self.hydrostatic_pressure.nodes,
                "hydrostatic_pressure": self.hydrostatic_pressure.value.copy(),
            }
            | {name: np.array([value]) for name, value in scalars.items() if value is not None}
        )


def _joined(forward: DirectedFlow, backward: DirectedFlow, reverse: BoolArray) -> Flow:
    """One flow from both directions, of which at most one flows."""
    ahead = forward.velocity > 0
    regime = np.select(
        [ahead & forward.undecided, ahead & forward.separated, ahead, reverse],
        [Regime.UNDECIDED, Regime.SEPARATED, Regime.SIPHON, Regime.REVERSE],
    )
    return Flow(
        velocity=np.where(reverse, -backward.velocity, forward.velocity),
        regime=np.asarray(np.where(ahead | reverse, regime, Regime.BLOCKED), dtype=np.int64),
        uncertainty=np.where(reverse, backward.half_width, forward.half_width),
        primed=np.where(reverse, backward.primed, forward.primed),
    )


@dataclass(frozen=True, kw_only=True)
class DirectedState:
    """One state of the tube, in one direction of flow."""

    reverse: bool
    """Whether the opposite chamber is upstream."""
    conditions: Conditions
    drive: Drive
    """What acts on the tube in that direction, arrays of shape ()."""

    @classmethod
    def of(
        cls, *, law: CalibratedLaw, fills: tuple[float, float], gas_pressure: float, reverse: bool
    ) -> DirectedState:
        """Take a state in one direction of flow."""
        x, y, p = (np.asarray(v, dtype=np.float64) for v in (*fills, gas_pressure))
        asked = Conditions(fill_ratio=x, opposite_fill_ratio=y, gas_pressure=p, primed=np.asarray(True))
        return cls._at(asked, law=law, reverse=reverse)

    @classmethod
    def _at(cls, asked: Conditions, *, law: CalibratedLaw, reverse: bool) -> DirectedState:
        return cls(reverse=reverse, conditions=asked, drive=law.drive(asked, reverse=reverse))

    @property
    def ends(self) -> TubeEnds[Any]:
        """Pressures at the tube's ends."""
        return self.drive.ends

    def margin(self, *, law: CalibratedLaw) -> tuple[float, float] | tuple[None, None]:
        """`siphon_margin` over the cavity of a primed tube, Pa; both None without a crest.

        The state is that in the direction of the driving pressure.
        """
        crest, head = law.path.crest, law.heads.to_crest(reverse=self.reverse)
        if crest is None or head is None:
            return None, None
        driving, (low, high) = np.asarray(self.ends.driving_pressure()), crest.possible_cavity(self.ends)
        margin, width = siphon_margin(
            path=law.path,
            heads=law.heads,
            hump_head=head,
            inputs=law.inputs,
            drive=self.drive,
            at_rest=np.asarray(crest.separation_margin(self.ends)),
            spread=np.asarray(max(crest.released, 1 - crest.released) * (high - low)),
            velocity=velocity_of(table=law.heads.head, head=driving / law.density, where=driving > 0),
        )
        sides = [
            self._at(self.conditions, law=each, reverse=self.reverse).margin(law=each)[0] or 0.0
            for each in law.variants
        ]
        by_fitted = ((high - low) / 2 for low, high in zip(sides[::2], sides[1::2], strict=True))
        return float(margin), math.hypot(float(width), *by_fitted)
