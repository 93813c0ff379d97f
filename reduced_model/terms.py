"""The registry of physical terms: estimate, dimensionless group and model of each, and what a scene uses.

Every term that has a model is modelled, whatever the tolerance: none of them costs what a user could feel.  A
new term is one entry of `TERMS`; its estimate is a function in `estimates` and its model lives with the part
that it changes.  Every command takes `models_used` from here, so that all of them report the same list for
the same scene.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from types import MappingProxyType
from typing import Final, Literal, get_args

from ringbalance.mesh.geometry import chamber_volume
from ringbalance.physics.gas import HEAT_CAPACITY_RATIO
from ringbalance.reduced_model import estimates, paper
from ringbalance.reduced_model.chamber.contributions import Contribution, percent
from ringbalance.reduced_model.chamber.values import chamber_pressure
from ringbalance.reduced_model.law.flow_law import CALIBRATED
from ringbalance.scene.models import Scene

INERTIA: Final = "tube inertia"
FILLING: Final = "gas filling"
LAG: Final = "valve lag"
HELD: Final = "liquid held in the tube"
LEFT_OUT: Final = "left out"
NOT_MODELLED: Final = "not modelled in this version"


def _counts(_: Scene, estimate: Contribution) -> bool:
    return estimate.above(0.0)


def _always(*_: object) -> bool:
    return True


def _has_crest(scene: Scene, _: Contribution) -> bool:
    return scene.tube.hump_radius is not None


def _has_loss(scene: Scene, estimate: Contribution) -> bool:
    """Unless the scene prescribes k; also of a tube in which nothing flows."""
    return scene.tube.drag_coefficient is None and estimate.value != 0.0


Part = Literal["chamber", "tube", "injection"]
PARTS: Final[tuple[Part, ...]] = get_args(Part)


@dataclass(frozen=True, kw_only=True)
class Term:
    """One physical term."""

    name: str
    part: Part
    """Those of chamber and tube are part of a flow law; those of an injection go beyond it."""
    group: str
    """Dimensionless group that its contribution grows with."""
    estimate: Callable[[Scene], Contribution]
    """What leaving it out changes, relative, at the worst fill."""
    model: str = ""
    """Empty where none holds it."""
    without: str = LEFT_OUT
    """What stands in its place where there is nothing to model."""
    needed: Callable[[Scene, Contribution], bool] = _counts
    """Whether a scene has anything to model; the size of the estimate never decides."""
    remark: Callable[[Scene, Contribution], str] = lambda *_: ""
    """Further reason, or what the scene makes of the model."""

    def model_of(self, scene: Scene, estimate: Contribution) -> str:
        """The model that serves a scene; none where the scene gives no numbers or nothing to model."""
        if not self.model:
            return NOT_MODELLED if estimate.above(scene.tolerance) else self.without
        return self.model if self.needed(scene, estimate) else self.without


@dataclass(frozen=True, kw_only=True)
class ModelUsed:
    """The model that serves one term of a scene, as `models_used` lists it."""

    term: str
    model: str
    """The model used, "left out", or "not modelled in this version"."""
    why: str
    """Formula of the estimate, its value, and further reasons."""
    estimated_contribution: float | None
    """Relative, before solving; None where the scene gives no basis for an estimate."""

    @property
    def modelled(self) -> bool:
        """Whether a model holds the term."""
        return self.model not in (LEFT_OUT, NOT_MODELLED)


def models_used(
    scene: Scene,
    *,
    law: str = CALIBRATED,
    obstacles: Mapping[str, str] = MappingProxyType({}),
    asked: Collection[str] | None = None,
    parts: Collection[str] = PARTS,
) -> tuple[ModelUsed, ...]:
    """Model of every term of a scene, with the reason: chamber, tube, injection.

    Args:
        law: name of the flow law; any but the calibrated one has its own models of chamber and tube.
        obstacles: why the flow law cannot carry a term of an injection, by term.
        asked: the terms of an injection to model; None: all.
        parts: those whose terms are listed.
    """
    rows = []
    for term in (each for each in TERMS if each.part in parts):
        estimate = term.estimate(scene)
        model, more = _model(term, scene, estimate, law=law, obstacles=obstacles, asked=asked)
        reason = estimate.reason(None if term.model else scene.tolerance)
        rows.append(
            ModelUsed(
                term=term.name,
                model=model,
                why=f"{reason}; {more}" if more else reason,
                estimated_contribution=estimate.value,
            )
        )
    return tuple(rows)


def _model(
    term: Term,
    scene: Scene,
    estimate: Contribution,
    *,
    law: str,
    obstacles: Mapping[str, str],
    asked: Collection[str] | None,
) -> tuple[str, str]:
    """Model and further reason."""
    if term.part != "injection":
        if law != CALIBRATED:
            return f"as in the law “{law}”", ""
        return term.model_of(scene, estimate), term.remark(scene, estimate)
    if asked is not None:
        return (term.model if term.name in asked else LEFT_OUT), "the caller's choice"
    model = term.model_of(scene, estimate)
    if model != LEFT_OUT and term.name in obstacles:
        return NOT_MODELLED, obstacles[term.name]
    return model, term.remark(scene, estimate)


@dataclass(frozen=True, kw_only=True)
class _Neglected:
    """Terms of an injection that a run does not model, and a bound on them."""

    terms: tuple[str, ...]
    bound: float
    """Sum of their contributions, relative to the liquid that the shortest injection that matters moves."""
    unknown: tuple[str, ...]
    """Those that the scene gives no basis for an estimate of; not part of the bound."""
    text: str


def neglected_in_injections(used: Sequence[ModelUsed]) -> _Neglected:
    """What a run neglects beyond its flow law.

    Source: errors of one sign at worst; each estimate is an upper bound.
    """
    rows = [row for row in used if row.term in IN_INJECTIONS and not row.modelled]
    known = {r.term: r.estimated_contribution for r in rows if r.estimated_contribution is not None}
    unknown = tuple(row.term for row in rows if row.estimated_contribution is None)
    bound = float(sum(known.values()))
    # Without their numbers in the scene these two are a default range.
    ranges = [term for term in unknown if term in (FILLING, LAG)]
    others = [term for term in unknown if term not in ranges]
    more = f"; not in the scene, see the gas line's default range: {', '.join(ranges)}" if ranges else ""
    more += f"; not estimated, for lack of numbers in the scene: {', '.join(others)}" if others else ""
    return _Neglected(
        terms=tuple(known),
        bound=bound,
        unknown=unknown,
        text=f"{_change(known, bound, unknown)}{more}",
    )


def _change(terms: Collection[str], bound: float, unknown: Collection[str]) -> str:
    if not terms:
        numbers = " that the scene gives numbers for" if unknown else ""
        return f"no term of an injection{numbers} is neglected"
    return (
        f"neglected terms ({', '.join(terms)}) change the liquid moved by the shortest injection that "
        f"matters by {f'at most {percent(bound)}' if bound else 'nothing'}"
    )


def _off_in_volume(scene: Scene, _: Contribution) -> str:
    strips, exact = paper.chamber_volume_paper(disc=scene.disc), chamber_volume(disc=scene.disc)
    simpler = "flat strips" if scene.disc.geometry is None else "a plain sector"
    return f"{simpler} would be {percent(abs(strips / exact - 1))} off in volume"


def _crest(scene: Scene, _: Contribution) -> str:
    if scene.tube.hump_radius is None:
        return "Eq. 18, which levels the chambers out while the gas is off"
    moved = float(chamber_pressure(scene=scene, fill_ratio=scene.disc.max_fill_ratio / 2)) / 1e6
    gas = "vapour" if scene.liquid.dissolved_gas == "none" else "vapour or released gas"
    return (
        f"{scene.tube.hump_shape}, {scene.tube.hump_gas} gas, cavity of {gas}; "
        f"vented or trapped moves the threshold by up to {moved:.3g} MPa"
    )


def _heat(scene: Scene, estimate: Contribution) -> str:
    """How far heat from the walls of a chamber moves the estimate."""
    if estimate.time is None:
        return ""
    if scene.gas.process == "adiabatic":
        return "estimated isothermal, modelled without heat from the walls, which takes less"
    sooner = 1e3 * estimate.time * (1 - 1 / HEAT_CAPACITY_RATIO)
    return f"isothermal: without heat from the walls it would take up to {sooner:.3g} ms less"


TERMS: Final = (
    Term(
        name="plates between the chambers",
        part="chamber",
        group="1 - V/(B theta (R2^2 - R1^2)/2)",
        estimate=estimates.plates,
        model="exact geometry",
        needed=_always,
        remark=_off_in_volume,
    ),
    Term(
        name="gravity, mean over a turn",
        part="chamber",
        group="(g/(omega^2 a))^2",
        estimate=estimates.gravity_mean,
        model="quasi-static, free surface found, mean over a turn",
    ),
    Term(
        name="gravity ripple at 1x and sloshing",
        part="chamber",
        group="g/(omega^2 a) |1/(1 - 1/s^2)|",
        estimate=estimates.ripple_and_sloshing,
        model="apart, as waves; means over a turn do not hold it",
        remark=lambda *_: "it vanishes in the mean over a turn",
    ),
    Term(
        name="surface tension",
        part="chamber",
        group="sigma/(P B)",
        estimate=estimates.surface_tension,
    ),
    Term(
        name="friction at the walls of a chamber",
        part="chamber",
        group="g/(omega^2 a) sqrt(nu/(omega R2^2))",
        estimate=estimates.wall_friction,
    ),
    Term(
        name="priming over the siphon crest",
        part="tube",
        group="(p_A + P_A - D_m)/(p_A + P_A - P_C)",
        estimate=estimates.crest,
        model="four regimes",
        needed=_has_crest,
        without="always a full siphon",
        remark=_crest,
    ),
    Term(
        name="loss of the tube",
        part="tube",
        group="k",
        estimate=partial(estimates.tube_part, part=estimates.WHOLE),
        model="k(u), friction by Churchill's formula and what follows",
        needed=_has_loss,
        without="constant k",
    ),
    Term(
        name="roughness of the tube's wall",
        part="tube",
        group="eps/d",
        estimate=partial(estimates.tube_part, part="roughness"),
        model="in Churchill's formula",
        needed=_has_loss,
    ),
    Term(
        name="friction by rotation",
        part="tube",
        group="omega d^2/nu",
        estimate=partial(estimates.tube_part, part="rotation"),
        model="finite-element table laminar, correlation turbulent",
        needed=_has_loss,
    ),
    Term(
        name="bends of the tube",
        part="tube",
        group="K/k",
        estimate=partial(estimates.tube_part, part="bends"),
        model="finite elements laminar, correlation turbulent",
        needed=_has_loss,
    ),
    Term(
        name="entrance and exit of the tube",
        part="tube",
        group="K/k",
        estimate=partial(estimates.tube_part, part="ends"),
        model="finite elements laminar, constants turbulent",
        needed=_has_loss,
    ),
    Term(
        name=INERTIA,
        part="injection",
        group="2 L/((k + 1) u T)",
        estimate=estimates.inertia,
        model="rho L du/dt of the liquid in the tube, in injections",
    ),
    Term(
        name=FILLING,
        part="injection",
        group="V/(C p_0 T)",
        estimate=estimates.filling,
        model="ISO 6358, in injections",
        remark=_heat,
    ),
    Term(
        name=LAG,
        part="injection",
        group="t/T",
        estimate=estimates.lag,
        model="pure delay, in injections",
    ),
    Term(
        name=HELD,
        part="injection",
        group="l/(u T)",
        estimate=estimates.held,
        model="lifted from the level to the crest unless the tube is primed, in injections",
    ),
)
"""All physical terms, in the order of every `models_used`."""
IN_INJECTIONS: Final = tuple(term.name for term in TERMS if term.part == "injection")
"""Terms that a closed-loop run models beyond its flow law."""
