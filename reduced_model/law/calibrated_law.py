"""The flow law distilled from a chamber's free surface and the tube's loss, with all its regimes.

Beside it the moment of a pair of chambers, from the same chamber.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Final

import numpy as np
import numpy.typing as npt

from ringbalance.mesh.geometry import chamber_volume, moment_across, surface_radius
from ringbalance.physics.gas import pressure_factor
from ringbalance.reduced_model.chamber.calibration import ChamberCalibration, fill_nodes, pressure_tables
from ringbalance.reduced_model.chamber.contributions import gravity_shares
from ringbalance.reduced_model.chamber.values import RingValues, share_across
from ringbalance.reduced_model.law.flow_law import CALIBRATED, Conditions, Flow, Regime, law_text, save_record
from ringbalance.reduced_model.tables import HermiteTable, flat_table, table_from_samples, tables_from_samples
from ringbalance.reduced_model.tube.directed_flow import DirectedFlow, Drive, DriveUncertainty, siphon_margin
from ringbalance.reduced_model.tube.flow import tube_path
from ringbalance.reduced_model.tube.heads import TubeHeads, velocity_of
from ringbalance.reduced_model.tube.regime import (
    TubeEnds,
    TubePath,
    crest_margins,
    driving_pressure,
    possible_cavity,
)
from ringbalance.scene.arrays import BoolArray, ComplexArray, FloatArray
from ringbalance.scene.designs import Designs, alike
from ringbalance.scene.models import Scene
from ringbalance.scene.uncertain import FITTED, direction_sides, independent_half_widths


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
    `released` and `froude_velocity` (m/s) of `TubePath`.
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
    ) -> TubeEnds:
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

    def table(self) -> Mapping[str, FloatArray]:
        heads = {
            "log_head": self.heads.head,
            "log_hump_head": self.heads.hump_head,
            "log_return_hump_head": self.heads.return_hump_head,
        }
        scalars = (
            "density",
            "port_pressure",
            "hump_pressure",
            "vapour_pressure",
            "released",
            "froude_velocity",
        )
        values = {name: getattr(self.path, name) for name in scalars}
        return (
            {"log_velocity": self.heads.head.nodes}
            | {name: table.value.copy() for name, table in heads.items() if table is not None}
            | {
                "fill_ratio": self.hydrostatic_pressure.nodes,
                "hydrostatic_pressure": self.hydrostatic_pressure.value.copy(),
            }
            | {name: np.array([value]) for name, value in values.items() if value is not None}
        )

    def cavity_margin(
        self, *, fills: tuple[float, float], gas_pressure: float, reverse: bool
    ) -> tuple[float, float] | tuple[None, None]:
        """`siphon_margin` over a primed tube's cavity in one direction, Pa; both None without a crest."""
        head, path = self.heads.to_crest(reverse=reverse), self.path
        if head is None:
            return None, None
        x, y, p = (np.asarray(v, dtype=np.float64) for v in (*fills, gas_pressure))
        asked = Conditions(fill_ratio=x, opposite_fill_ratio=y, gas_pressure=p, primed=np.asarray(True))
        drive = self.drive(asked, reverse=reverse)
        driving, (low, high) = driving_pressure(path, drive.ends), possible_cavity(path, drive.ends)
        margin, width = siphon_margin(
            path=path,
            heads=self.heads,
            hump_head=head,
            inputs=self.inputs,
            drive=drive,
            at_rest=np.asarray(crest_margins(path, drive.ends)[0]),
            spread=np.asarray(max(path.released, 1 - path.released) * (high - low)),
            velocity=velocity_of(table=self.heads.head, head=driving / self.density, where=driving > 0),
        )
        sides = [
            each.cavity_margin(fills=fills, gas_pressure=gas_pressure, reverse=reverse)[0] or 0.0
            for each in self.variants
        ]
        by_fitted = ((high - low) / 2 for low, high in zip(sides[::2], sides[1::2], strict=True))
        return float(margin), math.hypot(float(width), *by_fitted)

    def save(self, path: Path | str) -> Path:
        return save_record(path=Path(path), record=self)


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


# Density and speed act on both chambers and on the tube at once, so the law handles them separately.
_SHARED: Final = ("density", "speed")
_VARIED_FILLS: Final = np.array([0.2, 0.5, 0.8])
"""Of the greatest fill ratio: where the velocity's dependence on fitted inputs is looked at."""
_VARIED_PRESSURES: Final = np.array([0.7, 1.0, 1.4])
"""Of the scene's gas pressure."""
_LITTLE: Final = 1e-2
"""Of the largest effect of a direction, below which it is left out: its square counts."""
_NEXT_TO_NOTHING: Final = 1e-4
"""Angle, rad: no mesh of a symmetric chamber is quite symmetric."""


def calibrated_law(
    *, scene: Scene, chamber: ChamberCalibration, heads: TubeHeads, varied: bool = True
) -> CalibratedLaw:
    """Put the flow law together.

    Args: `varied`: whether inputs that were fitted together are varied for the law's uncertainty.

    Source: Eqs. 13 to 18 of the liquid-ring paper, with exact chambers and k(u).
    """
    own = [
        e.hydrostatic_pressure
        for name, e in chamber.input_effects.items()
        if name not in _SHARED and name != FITTED
    ]
    inputs = np.sqrt(sum((e**2 for e in own), start=np.zeros_like(chamber.fill_ratio)))
    no_inputs = np.zeros_like(chamber.fill_ratio)
    law = _put_together(
        scene,
        heads=heads,
        hydrostatic_pressure=chamber.hydrostatic_pressure.table,
        hydrostatic_pressure_uncertainty=chamber.hydrostatic_pressure.uncertainty_table(inputs=inputs),
        inputs=_drive_uncertainty(scene),
        moment=CalibratedMoment(
            chamber_moment=chamber.moment.table,
            half_width=chamber.moment.uncertainty_table(inputs=no_inputs),
            across=_across_table(scene, chamber.moment.table.nodes),
        ),
    )
    return replace(law, variants=_variants(scene)) if varied and scene.fitted.quantities else law


def _variants(scene: Scene) -> tuple[CalibratedLaw, ...]:
    """Nominal laws along the directions of the fitted inputs that the velocity depends on, low and high.

    The directions are turned to the singular vectors of the velocity's changes over fills and pressures.
    """
    gravity = gravity_shares(scene).mean > scene.tolerance

    def laws(turned: FloatArray | None = None) -> tuple[CalibratedLaw, ...]:
        sides = [side for both in direction_sides(scene, turned=turned).values() for side in both]
        made = zip(nominal_laws(sides, gravity=gravity), sides, strict=True)
        return tuple(_variant(scene, law, side) for law, side in made)

    pressure = _VARIED_PRESSURES * scene.gas.pressure
    fill = _VARIED_FILLS[:, None] * scene.disc.max_fill_ratio
    velocities = np.array(
        [law.evaluate(fill_ratio=fill, gas_pressure=pressure, primed=True).velocity.ravel() for law in laws()]
    )
    changes = (velocities[1::2] - velocities[::2]).T
    _, size, turned = np.linalg.svd(changes, full_matrices=False)
    return laws(turned[size > _LITTLE * size[0]].T) if size[0] > 0 else ()


def _variant(scene: Scene, law: CalibratedLaw, side: Scene) -> CalibratedLaw:
    """Law of a scene beside another one; gas pressures are asked for as that has them."""
    asked = scene.gas.pressure
    return replace(law, gas_factor=law.gas_factor * side.gas.pressure / asked) if asked else law


def nominal_law(scene: Scene, *, gravity: bool) -> CalibratedLaw:
    """The calibrated law without finite elements and without uncertainties, in a few milliseconds.

    Its velocities are within 1e-4 of those of `calibrated_law`, by fewer nodes of the heads; half-widths are
    zero.  For the many scenes that differ from a calibrated one in their values, such as those of a fit.
    Args: `gravity`: whether the chamber's values hold gravity, as `calibrate` decides for the scene.
    Raises: ValueError: bends that do not fit into the tube.
    Source: Eqs. 13 to 18 of the liquid-ring paper; `RingValues.of`, `TubeHeads.nominal`.
    """
    return nominal_laws([scene], gravity=gravity)[0]


def nominal_laws(scenes: Sequence[Scene], *, gravity: bool) -> tuple[CalibratedLaw, ...]:
    """The same of many scenes; those that differ in numbers alone, and not in their fills, at once."""
    laws: dict[int, CalibratedLaw] = {}
    for places in alike(scenes):
        some = [scenes[place] for place in places]
        laws |= zip(places, _nominal(some, gravity=gravity), strict=True)
    return tuple(laws[place] for place in range(len(scenes)))


def _nominal(scenes: Sequence[Scene], *, gravity: bool) -> Iterator[CalibratedLaw]:
    """Of scenes that are alike."""
    fills = fill_nodes(largest=scenes[0].disc.max_fill_ratio)[0]
    ends = {"start": 0.0, "stop": float(fills[-1])}
    heads = TubeHeads.nominal(Designs.stacked(scenes))
    rings = [RingValues.of(scene, fill_ratio=fills, gravity=gravity) for scene in scenes]
    moments = [
        scene.disc.moment_factor * ring.moment.value for scene, ring in zip(scenes, rings, strict=True)
    ]
    levels = pressure_tables(scenes, fills, [ring.hydrostatic_pressure.value for ring in rings])
    curves = tables_from_samples(value=np.stack(moments, axis=1), **ends)
    exact = flat_table(**ends)
    for scene, head, level, moment in zip(scenes, heads, levels, curves, strict=True):
        yield _put_together(
            scene,
            heads=head,
            hydrostatic_pressure=level,
            hydrostatic_pressure_uncertainty=exact,
            inputs=DriveUncertainty(),
            moment=CalibratedMoment(
                chamber_moment=moment, half_width=exact, across=_across_table(scene, fills)
            ),
        )


def _put_together(
    scene: Scene,
    *,
    heads: TubeHeads,
    hydrostatic_pressure: HermiteTable,
    hydrostatic_pressure_uncertainty: HermiteTable,
    inputs: DriveUncertainty,
    moment: CalibratedMoment,
) -> CalibratedLaw:
    return CalibratedLaw(
        name=CALIBRATED,
        max_fill_ratio=scene.disc.max_fill_ratio,
        ambient_pressure=scene.gas.ambient_pressure,
        chamber_volume=chamber_volume(disc=scene.disc),
        tube_area=scene.tube.area,
        hydrostatic_pressure=hydrostatic_pressure,
        hydrostatic_pressure_uncertainty=hydrostatic_pressure_uncertainty,
        path=tube_path(scene),
        heads=heads,
        inputs=inputs,
        gas_factor=pressure_factor(scene),
        moment=moment,
    )


def _drive_uncertainty(scene: Scene) -> DriveUncertainty:
    width = independent_half_widths(scene)
    hump = scene.tube.hump_radius or 0.0
    moved = scene.liquid.density * scene.rotor.speed**2 * hump * width.get("hump_radius", 0.0)
    return DriveUncertainty(
        relative_density=width.get("density", 0.0) / scene.liquid.density,
        relative_speed=width.get("speed", 0.0) / abs(scene.rotor.speed),
        relative_gas_pressure=width.get("pressure", 0.0) / scene.gas.pressure if scene.gas.pressure else 0.0,
        hump_pressure=moved,
        vapour_pressure=math.hypot(width.get("vapour_pressure", 0.0), width.get("ambient_pressure", 0.0)),
    )


def _across_table(scene: Scene, fills: FloatArray) -> HermiteTable | None:
    """W(x), the moment across a chamber's middle, kg m; None where it turns moments by next to nothing.

    Gravity is left out, whose mean changes U and W alike in the first place.
    Args: `fills`: nodes, equally spaced from zero.
    Source: rho int y dV over the liquid, times the scene's factor on moments.
    """
    disc = scene.disc
    if np.max(np.abs(share_across(disc, fills))) <= _NEXT_TO_NOTHING:
        return None
    a = surface_radius(disc=disc, fill_ratio=fills)
    value = scene.liquid.density * disc.axial_width * moment_across(disc=disc, surface_radius=a)
    return table_from_samples(start=0.0, stop=float(fills[-1]), value=disc.moment_factor * value)
