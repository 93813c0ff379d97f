"""The liquid column in the tube of one pair, as a flow law describes it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ringbalance.reduced_model.law.calibrated_law import CalibratedLaw
from ringbalance.reduced_model.law.flow_law import FlowLaw
from ringbalance.reduced_model.law.paper_law import PaperLaw
from ringbalance.reduced_model.tables.hermite import HermiteTable
from ringbalance.reduced_model.tube.heads import entrance_fraction
from ringbalance.reduced_model.tube.path import crest_span
from ringbalance.reduced_model.tube.regime import SiphonCrest
from ringbalance.scene.models import Scene, Tube


@dataclass(frozen=True, kw_only=True)
class Lift:
    """The tube from a port to the crest, as liquid fills it."""

    straight: float
    """c of D_m - D = (D_m - D_p)(c o + (1 - c) o^2) with o from 0 at the crest to 1 at the port."""
    entrance: float
    """Fraction of the loss up to the crest's end that is lost at the entrance."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Column:
    """What `compiled_column` takes its forces from: a law's own tables."""

    density: float
    """rho, kg/m^3."""
    length: float
    """L, m."""
    crest_ends: tuple[float, float]
    """Fraction of the path to the end of the crest's arc, for flow out of chamber 0 and out of chamber 1."""
    tables: tuple[HermiteTable, ...]
    """P(x), Pa, over the fill; ln((k + 1) u^2/2) over ln u; with a crest ln((alpha + k_up) u^2/2) for flow
    out of chamber 0 and out of chamber 1."""
    port_pressure: float
    """D_p, Pa."""
    crest: SiphonCrest[float] | None
    one_way: bool
    """Whether liquid leaves only a chamber that has gas, as in the paper's Eq. 19."""
    gas_off: float
    """Gauge, Pa, at or below which a chamber counts as without gas in a tube without a crest."""
    gas_factor: float = 1.0
    """Gas pressure on the liquid over the one at the place of measurement."""


def column_of(*, law: FlowLaw, tube: Tube, gas_off: float = 0.0) -> Column | None:
    """The column that a flow law describes; None for a law that gives velocities and no forces."""
    if isinstance(law, CalibratedLaw):
        return _calibrated(law, tube, gas_off)
    return _paper(law, tube, gas_off) if isinstance(law, PaperLaw) else None


def lift_of(scene: Scene, *, law: FlowLaw) -> Lift | None:
    """What liquid meets on its way up to the crest; None without a crest, or under a law that has none."""
    tube = scene.tube
    if tube.hump_radius is None or not isinstance(law, CalibratedLaw) or law.path.crest is None:
        return None
    half = law.max_fill_ratio / 2
    flow = law.evaluate(fill_ratio=half, gas_pressure=scene.gas.pressure, primed=True)
    straight = (
        0.0 if tube.hump_shape == "arc" else 2 * tube.hump_radius / (tube.port_radius + tube.hump_radius)
    )
    return Lift(straight=straight, entrance=entrance_fraction(scene, float(flow.velocity) or 1.0))


def _calibrated(law: CalibratedLaw, tube: Tube, gas_off: float) -> Column:
    ahead, back = law.heads.hump_head, law.heads.return_hump_head
    to_crest = (ahead, back) if ahead and back and law.path.crest else ()
    return Column(
        density=law.density,
        length=tube.length,
        crest_ends=(crest_span(tube)[1], 1 - crest_span(tube)[0]),
        tables=(law.wall_pressure, law.heads.head, *to_crest),
        port_pressure=law.path.port_pressure,
        crest=law.path.crest if to_crest else None,
        one_way=False,
        gas_off=gas_off,
        gas_factor=law.gas_factor,
    )


def _paper(law: PaperLaw, tube: Tube, gas_off: float) -> Column:
    loss = np.log((law.drag_coefficient + 1) / 2)
    return Column(
        density=law.density,
        length=tube.length,
        crest_ends=(1.0, 1.0),
        tables=(_straight(0.0, law.pressure_per_fill_difference), _straight(float(loss), 2.0)),
        port_pressure=0.0,
        crest=None,
        one_way=True,
        gas_off=gas_off,
    )


def _straight(value: float, slope: float) -> HermiteTable:
    """value + slope x."""
    return HermiteTable(
        start=0.0,
        step=1.0,
        value=np.array([value, value + slope]),
        slope=np.full(2, slope),
        curvature=np.zeros(2),
    )
