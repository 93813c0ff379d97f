"""Physical terms of a scene: the change by neglecting each, and its model.

Every term that has a model is modelled, whatever the tolerance: none adds a noticeable run time. A new term
is one `Term` of its part below; its model belongs to the part that it changes.  Every command takes
`models_used` from here, so that all of them report the same list for the same scene.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType
from typing import Final, NamedTuple

import numpy as np

from ringbalance.mesh.geometry import chamber_volume, surface_radius
from ringbalance.physics.gas import HEAT_CAPACITY_RATIO
from ringbalance.physics.sloshing import FREQUENCY_UNCERTAINTY
from ringbalance.physics.tube.friction import turbulent_share
from ringbalance.reduced_model import estimates, paper
from ringbalance.reduced_model.chamber.contributions import (
    amplification,
    capillary_share,
    chamber_fills,
    gravity_shares,
    percent,
    range_fills,
    wall_layers,
)
from ringbalance.reduced_model.chamber.values import chamber_pressure
from ringbalance.reduced_model.crater import Crater, jet_text
from ringbalance.reduced_model.gas_line import line_ends
from ringbalance.reduced_model.law.flow_law import CALIBRATED
from ringbalance.reduced_model.tube.path import crest_middle, share_at_radius
from ringbalance.scene.models import Scene

INERTIA: Final = "tube inertia"
FILLING: Final = "gas filling"
LAG: Final = "valve lag"
HELD: Final = "liquid held in the tube"
IN_INJECTIONS: Final = (INERTIA, FILLING, LAG, HELD)
"""Terms that a closed-loop run models beyond its flow law."""
LEFT_OUT: Final = "left out"
NOT_MODELLED: Final = "not modelled in this version"
_NOTHING_FLOWS: Final = "nothing flows"


class Term(NamedTuple):
    """One physical term of a scene."""

    name: str
    group: str
    """Dimensionless group that the contribution grows with."""
    model: str
    """Model of the term; empty without one."""
    value: float | None
    """Relative change by leaving the term out, at the worst fill; None where the scene gives no basis."""
    formula: str
    """Formula of the estimate, with its numbers."""
    remark: str = ""
    """Further reason, or the settings of the scene that the model uses."""
    needed: bool | None = None
    """True if there is anything to model; None: where the estimate is above zero."""
    without: str = LEFT_OUT
    """Name of the substitute where there is nothing to model."""
    unknown: str = "the scene gives no basis for an estimate"
    """Text in place of a missing value."""

    def reason(self, tolerance: float = 0.0) -> str:
        """Formula and value; without a model, compared with the tolerance."""
        text = self.unknown if self.value is None else percent(self.value)
        if self.value is not None and tolerance and not self.model:
            side = "above" if self.value > tolerance else "below"
            text = f"{text} is {side} the tolerance of {percent(tolerance)}"
        return f"{self.formula}; {text}"


def terms_of(scene: Scene, *, injections_only: bool = False) -> Iterator[Term]:
    """Estimate every term of a scene, those of chamber, tube and injection, in the order of `models_used`.

    Those of chamber and tube are part of a flow law; those of an injection go beyond it.
    """
    if not injections_only:
        yield from _chamber_terms(scene)
        yield from _tube_terms(scene)
    deciding = estimates.injection_time(scene)
    yield from _injection_terms(scene, deciding)
    yield _lifted_liquid(scene, deciding)
    if not injections_only:
        yield _gas_jet(scene)


def _chamber_terms(scene: Scene) -> Iterator[Term]:
    disc, fills, gravity = scene.disc, chamber_fills(scene), gravity_shares(scene)
    fills = fills if fills.size else range_fills(scene)
    # Eqs. 1 and 2: S_c = theta (R2^2 - R1^2)/2, without plates.
    bare = disc.axial_width * disc.central_angle / 2 * (disc.outer_radius**2 - disc.inner_radius**2)
    volume, group = chamber_volume(disc=disc), "1 - V/(B theta (R2^2 - R1^2)/2)"
    simpler = "flat strips" if disc.geometry is None else "a plain sector"
    off = percent(abs(paper.chamber_volume_paper(disc=disc) / volume - 1))
    off = f"{simpler} would be {off} off in volume"
    yield Term("plates between the chambers", group, "exact geometry", 1 - volume / bare, group, off, True)
    model = "quasi-static, free surface found, mean over a turn"
    text = "free surface |r + g/omega^2| = b against a concentric one, at the worst fill of the range"
    yield Term("gravity, mean over a turn", "(g/(omega^2 a))^2", model, gravity.mean, text)
    group, model = "g/(omega^2 a) |1/(1 - 1/s^2)|", "apart, as waves; means over a turn do not hold it"
    text = "on a vertical shaft gravity does not turn in the disc's frame"
    if scene.environment.shaft != "vertical":
        text = (
            "first order in g/(omega^2 a), times 1 + 2 max(1, n) in the wall pressure, where the liquid's "
            f"swing at 1x makes n = |1/(1 - 1/s^2)| up to {np.max(amplification(scene, fills).largest):.2g} "
            f"over the range of fills, s being known to {percent(FREQUENCY_UNCERTAINTY)}"
        )
    apart = "it vanishes in the mean over a turn"
    yield Term("gravity ripple at 1x and sloshing", group, model, gravity.swing, text, apart)
    tension = float(np.max(capillary_share(scene, fills)["pressures"]))
    text = "sigma (2/B + 1/(a alpha) + 1/a)/P, an inverse Bond number"
    yield Term("surface tension", "sigma/(P B)", "", tension, text)
    layers, ekman = wall_layers(scene, fills[-1])
    group = "g/(omega^2 a) sqrt(nu/(omega R2^2))"
    text = f"g/(omega^2 a) sqrt(Ek), Ek = nu/(omega R2^2) = {ekman:.1e}"
    yield Term("friction at the walls of a chamber", group, "", float(layers), text)


_TUBE: Final[Mapping[str, tuple[str, str, str]]] = {
    "whole": ("loss of the tube", "k", "k(u), friction by Churchill's formula and what follows"),
    "roughness": ("roughness of the tube's wall", "eps/d", "in Churchill's formula"),
    "rotation": (
        "friction by rotation",
        "omega d^2/nu",
        "finite-element table laminar, correlation turbulent",
    ),
    "bends": ("bends of the tube", "K/k", "finite elements laminar, correlation turbulent"),
    "ends": ("entrance and exit of the tube", "K/k", "finite elements laminar, constants turbulent"),
}
"""Name, group and model, by part of the loss."""


def _tube_terms(scene: Scene) -> Iterator[Term]:
    tube, flow = scene.tube, estimates.range_flow(scene)
    name, group = "priming over the siphon crest", "(p_A + P_A - D_m)/(p_A + P_A - P_C)"
    model, without = "four regimes", "always a full siphon"
    if tube.hump_radius is None:
        text = "the scene gives no hump_radius"
        remark = "Eq. 18, which levels the chambers out while the gas is off"
        yield Term(name, group, model, None, text, remark, False, without)
    else:
        driven = flow.siphon > 0
        lost = np.maximum(1 - flow.separated[driven] / flow.siphon[driven], 0.0)
        value: float | None = 1.0 if np.any(driven & ~flow.primes) else float(np.max(lost, initial=0.0))
        text = "1 - u_separated/u_siphon, or 1 where the column to the siphon crest outweighs the gas"
        moved = float(chamber_pressure(scene=scene, fill_ratio=scene.disc.max_fill_ratio / 2)) / 1e6
        gas = "vapour" if scene.liquid.dissolved_gas == "none" else "vapour or released gas"
        remark = (
            f"{tube.hump_shape}, {tube.hump_gas} gas, cavity of {gas}; "
            f"vented or trapped moves the threshold by up to {moved:.3g} MPa"
        )
        yield Term(name, group, model, value, text, remark, True, without)
    free, (velocity, changes) = tube.drag_coefficient is None, estimates.tube_changes(scene)
    for part, (name, group, model) in _TUBE.items():
        value, text = changes.get(part), _NOTHING_FLOWS if free else "the scene prescribes k"
        if changes:
            simpler = f"k = {paper.PAPER_DRAG_COEFFICIENT:g}" if part == "whole" else "leaving it out"
            over = f"over {velocity[0]:.2g} to {velocity[-1]:.2g} m/s"
            text = f"{simpler} changes k, or the head up to the siphon crest, {over}"
        # A tube in which nothing flows has its models as well.
        needed, without = free and value != 0.0, "constant k" if part == "whole" else LEFT_OUT
        yield Term(name, group, model, value, text, "", needed, without)


def _injection_terms(scene: Scene, deciding: float) -> Iterator[Term]:
    """Start of the column, filling and lag of the gas line, over the shortest injection that matters, s."""
    gas, flow = scene.gas, estimates.range_flow(scene)
    within = f"in the shortest injection that matters, {1e3 * deciding:.3g} ms"
    value, text = None, _NOTHING_FLOWS
    if np.any(flow.starts):
        re = abs(flow.equal) * scene.tube.bore / scene.liquid.kinematic_viscosity
        laminar = float(1 - turbulent_share(reynolds=np.array(re)))
        velocity, driving = flow.velocity[flow.starts], flow.driving[flow.starts]
        # A column that never moves costs nothing to start.
        slowest = max(float(np.max(scene.liquid.density * scene.tube.length * velocity / driving)), 1e-12)
        value = estimates.start_up_loss(start_up=slowest, gas_time=deciding, laminar=laminar)
        text = f"start-up time 2 L/((k + 1) u) up to {1e3 * slowest:.3g} ms over the range of fills, {within}"
    model = "rho L du/dt of the liquid in the tube, in injections"
    yield Term(INERTIA, "2 L/((k + 1) u T)", model, value, text)
    ends = (line_ends(scene)[-1], line_ends(scene)[0])  # fast and slow
    volume, supply = chamber_volume(disc=scene.disc) + (gas.dead_volume or 0.0), ends[1].line.supply_pressure
    fill = [float(end.line.filling_time(supply, volume=volume)) for end in ends]
    vent = [float(end.line.venting_time(supply, volume=volume)) for end in ends]
    longer, lags = [max(pair) for pair in zip(fill, vent, strict=True)], [end.valve_lag for end in ends]
    heat = "estimated isothermal, modelled without heat from the walls, which takes less"
    if gas.process != "adiabatic":
        sooner = 1e3 * longer[1] * (1 - 1 / HEAT_CAPACITY_RATIO)
        heat = f"isothermal: without heat from the walls it would take up to {sooner:.3g} ms less"

    def span(times: Sequence[float]) -> str:
        return " to ".join(dict.fromkeys(f"{1e3 * time:.3g}" for time in times))

    filling = f"an empty chamber fills in {span(fill)} ms and vents in {span(vent)} ms, {within}"
    for name, group, model, times, prescribed, text, remark in (
        (FILLING, "V/(C p_0 T)", "ISO 6358, in injections", longer, gas.conductance, filling, heat),
        (LAG, "t/T", "pure delay, in injections", lags, gas.valve_lag, f"{span(lags)} ms {within}", ""),
    ):
        fast, slow = (min(time / deciding, 1.0) for time in times)
        if prescribed is not None:
            yield Term(name, group, model, slow, text, remark)
        else:
            both = " to ".join(dict.fromkeys((percent(fast), percent(slow))))
            unknown = f"not in the scene: {both} over a default range"
            yield Term(name, group, model, None, text, unknown=unknown)


def _lifted_liquid(scene: Scene, deciding: float) -> Term:
    """Liquid that is lifted to the crest and falls back, as in a run, at the lowest level of the range."""
    flow, tube, value, text = estimates.range_flow(scene), scene.tube, None, _NOTHING_FLOWS
    slowest = float(np.min(flow.velocity[flow.starts], initial=np.inf))
    if tube.hump_radius is None:
        value, text = 0.0, "a tube without a crest stays full"
    elif np.isfinite(slowest):
        lowest_fill = estimates.FILL_SHARES[0] * scene.disc.max_fill_ratio
        level = float(surface_radius(disc=scene.disc, fill_ratio=lowest_fill))
        near = share_at_radius(tube=tube, radius=level, far_leg=False)
        length = tube.length * (crest_middle(tube) - near)
        value = min(length / max(slowest, 1e-300) / deciding, 1.0)
        text = (
            f"at most what fills {1e3 * length:.3g} mm of tube, from the level to the crest's middle, falls "
            f"back after venting, over the liquid moved in the shortest injection that matters, "
            f"{1e3 * deciding:.3g} ms, at the worst fill"
        )
    model = "lifted from the level to the crest unless the tube is primed, in injections"
    return Term(HELD, "l/(u T)", model, value, text)


def _gas_jet(scene: Scene) -> Term:
    """Crater of the gas jet in the ring as a valve opens, over the ring's depth, at equal fills."""
    name, group = "gas jet on the ring", "q/(rho omega^2 a (R2 - a))"
    if scene.disc.gas_hole_diameter is None:
        return Term(name, group, "", None, "n/(R2 - a)", unknown=jet_text(scene))
    ratio = Crater.of(scene, scene.disc.max_fill_ratio / 2).ratio
    return Term(name, group, "", float(ratio), "n/(R2 - a)", jet_text(scene))


@dataclass(frozen=True, kw_only=True)
class ModelUsed:
    """Model used for one term of a scene."""

    term: str
    model: str
    """The model used, "left out", or "not modelled in this version"."""
    why: str
    """Formula of the estimate, its value, and further reasons."""
    estimated_contribution: float | None
    """Relative contribution, estimated before solving; None without a basis for an estimate."""

    @property
    def modelled(self) -> bool:
        """True if the term is modelled."""
        return self.model not in (LEFT_OUT, NOT_MODELLED)


def models_used(
    scene: Scene,
    *,
    law: str = CALIBRATED,
    obstacles: Mapping[str, str] = MappingProxyType({}),
    selected: Collection[str] | None = None,
    injections_only: bool = False,
) -> tuple[ModelUsed, ...]:
    """Model of every term of a scene, with the reason: chamber, tube, injection.

    Args:
        law: name of the flow law; any but the calibrated one has its own models of chamber and tube.
        obstacles: reason why the flow law cannot model a term of an injection, by term.
        selected: the terms of an injection to model; None: all.
        injections_only: true if the terms of chamber and tube are neither estimated nor listed.
    """
    rows = []
    for term in terms_of(scene, injections_only=injections_only):
        remark, counts = term.remark, term.value is not None and term.value > 0
        if not term.model:
            counts = term.value is not None and term.value > scene.tolerance
            model = NOT_MODELLED if counts else LEFT_OUT
        else:
            model = term.model if (counts if term.needed is None else term.needed) else term.without
        if term.name not in IN_INJECTIONS:
            if law != CALIBRATED:
                model, remark = f"as in the law “{law}”", ""
        elif selected is not None:
            model, remark = (term.model if term.name in selected else LEFT_OUT), "the caller's choice"
        elif model != LEFT_OUT and term.name in obstacles:
            model, remark = NOT_MODELLED, obstacles[term.name]
        why = "; ".join(filter(None, (term.reason(scene.tolerance), remark)))
        rows.append(ModelUsed(term=term.name, model=model, why=why, estimated_contribution=term.value))
    return tuple(rows)


@dataclass(frozen=True, kw_only=True)
class _Neglected:
    """Terms of an injection that a run does not model, and a bound on them."""

    terms: tuple[str, ...]
    bound: float
    """Sum of their contributions, relative to the liquid moved by the shortest injection that matters."""
    unknown: tuple[str, ...]
    """Terms that the scene gives no basis for an estimate of; not part of the bound."""
    text: str


def neglected_in_injections(used: Sequence[ModelUsed]) -> _Neglected:
    """Terms of an injection that a run neglects, with a bound on their sum.

    Source: errors of one sign at worst; each estimate is an upper bound.
    """
    rows = [row for row in used if row.term in IN_INJECTIONS and not row.modelled]
    estimated = {r.term: r.estimated_contribution for r in rows if r.estimated_contribution is not None}
    unknown = tuple(row.term for row in rows if row.estimated_contribution is None)
    bound = float(sum(estimated.values()))
    numbers = " that the scene gives numbers for" if unknown else ""
    text = f"no term of an injection{numbers} is neglected"
    if estimated:
        text = (
            f"neglected terms ({', '.join(estimated)}) change the liquid moved by the shortest injection "
            f"that matters by {f'at most {percent(bound)}' if bound else 'nothing'}"
        )
    # Without values in the scene these two have a default range.
    ranges = [term for term in unknown if term in (FILLING, LAG)]
    others = [term for term in unknown if term not in ranges]
    text += f"; not in the scene, see the gas line's default range: {', '.join(ranges)}" if ranges else ""
    text += f"; not estimated, for lack of numbers in the scene: {', '.join(others)}" if others else ""
    return _Neglected(terms=tuple(estimated), bound=bound, unknown=unknown, text=text)
