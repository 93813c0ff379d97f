"""k of the tube by the library `fluids` alone, as a designer without this program would calculate it.

k = f L/d + K_entrance + sum of K_bend + extra + (K_exit - 1), each part by every method of `fluids` in its
range, the tube at rest. The library covers no rotation, and no laminar loss of an entrance or a bend.

A method is used within the range that its source claims, by rules set before the results:

* friction: the range that `fluids` states, and in it at most 5 % from Colebrook's equation, which all of
  them approximate;
* bends: the angles, radii and Re of the source. Crane's are multiples of the friction of commercial steel
  pipes, from 15 mm on. Miller's chart begins at Re = 1e4, Ito's measurements at 2e4; Swamee's formula has
  no Re. So only the program's own formula covers Re below 1e4, and nothing is judged there;
* an entrance that projects: the methods that need the thickness of the wall, which no scene gives, are used
  with a thin edge and with a twentieth of the bore.

The program's own methods are shown among them, but it is judged by the others alone: by the middle between
the smallest and the largest, all between being equally likely. A comparison with an uncertainty above its
limit proves nothing. Limits: for friction 15 %, one and a half times the claim of its chart for real walls;
for bends 75 %, half the spread of handbooks plus the program's own 25 %; for k 25 %, exceeded by an exit that
is counted twice where k is below 4.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace
from typing import Final

import numpy as np
from fluids import fittings
from fluids.friction import friction_factor, friction_factor_methods

from ringbalance.physics.tube.local_losses import straight_length
from ringbalance.physics.tube.loss import VELOCITIES, FlowState, model_parts, tube_loss
from ringbalance.physics.tube.state import TubeState, tube_state_at
from ringbalance.reduced_model.chamber.values import chamber_pressure
from ringbalance.reduced_model.paper import PAPER_DRAG_COEFFICIENT
from ringbalance.reduced_model.tube.flow import TubeFlow
from ringbalance.results.numbers import MISSING
from ringbalance.scene.arrays import FloatArray
from ringbalance.scene.designs import Designs
from ringbalance.scene.models import Bend, Scene, Tube
from ringbalance.verification.evidence import (
    CaseTable,
    Evidence,
    FigureCurve,
    Found,
    Level,
    NotRunError,
    Reference,
    figure,
    from_range,
)

_JUDGED_FROM_RE: Final = 1e4
_TURBULENT_FROM_RE: Final = 4000.0
_MAX_FROM_COLEBROOK: Final = 0.05
"""Largest relative departure from Colebrook's equation."""
_EDGES_OF_BORE: Final = (0.0, 0.05)
"""Thickness of the wall over the bore."""
_BENDS: Final[Mapping[str, tuple[float, float, float, float, float]]] = {
    "Rennels": (0.0, 0.0, 180.0, 0.5, math.inf),
    "Miller": (1e4, 10.0, 180.0, 0.5, 10.0),
    "Ito": (2e4, 45.0, 180.0, 1.0, 50.0),
    "Swamee": (0.0, 0.0, 180.0, 1.0, math.inf),
}
"""Smallest Re, angles in degrees from and to, r/d from and to; Crane's are for steel pipes alone."""
_PROGRAM_METHODS: Final = {
    "friction": ("Churchill_1977",),
    "bends": ("Rennels",),
    "entrance": ("Rennels", "Crane, any edge"),
}
"""Methods that the program itself calculates with."""
_CAUSES: Final[Mapping[str, tuple[str, ...]]] = {"friction": ("friction correlation",), "bends": ("bends",)}
"""Keys of `model_parts`, by part of k."""
_SHOWN_VELOCITIES: Final = (0.1, 0.2, 0.5, 1.0, 2.0, 5.0, 10.0, 20.0)
"""Velocities of the table, m/s."""
_CURVE_POINTS: Final = 33
Parts = dict[str, dict[str, float]]
"""Parts of k by every method, by part and method."""


def by_fluids(tube: Tube, reynolds: float, *, without: frozenset[str] = frozenset()) -> Parts:
    """Parts of k of a tube at rest by every method of `fluids` that holds at a Reynolds number.

    Args: `without`: methods for friction that depart from Colebrook's equation.
    Raises: ValueError: arcs longer than the tube.
    """
    rough, bore = tube.roughness / tube.bore, tube.bore
    slenderness = straight_length(tube=tube) / bore
    friction = {
        name: slenderness * friction_factor(reynolds, rough, Method=name)
        for name in friction_factor_methods(reynolds, rough)
        if name not in without and name != "laminar"
    }
    if not friction:
        friction = {"laminar": slenderness * friction_factor(reynolds, rough)}
    bends = {}
    for name in fittings.bend_rounded_methods:
        if all(_bend_holds(tube, bend, reynolds, name) for bend in tube.bends):
            losses = (
                fittings.bend_rounded(
                    Di=bore,
                    angle=math.degrees(bend.angle),
                    rc=bend.radius,
                    Re=reynolds,
                    roughness=tube.roughness,
                    method=name,
                )
                for bend in tube.bends
            )
            bends[name] = float(sum(losses))
    if tube.entrance == "sharp":
        entrance = {name: fittings.entrance_sharp(method=name) for name in fittings.entrance_sharp_methods}
    elif tube.entrance == "rounded":
        entrance = {
            name: fittings.entrance_rounded(bore, tube.entrance_radius, method=name)
            for name in fittings.entrance_rounded_methods
        }
    else:
        entrance = {
            f"{name}, edge {edge:g} d": fittings.entrance_distance(bore, edge * bore, method=name)
            for name in fittings.entrance_distance_methods
            for edge in _EDGES_OF_BORE
            if name != "Crane"
        }
        entrance["Crane, any edge"] = fittings.entrance_distance(bore, method="Crane")
    # The "+1" of k + 1 is the exit of turbulent flow.
    return {
        "friction": friction,
        "bends": bends,
        "entrance": entrance,
        "exit": {"normal": fittings.exit_normal() - 1},
        "extra": {"scene": tube.extra_loss},
    }


def _bend_holds(tube: Tube, bend: Bend, reynolds: float, method: str) -> bool:
    if method not in _BENDS:
        return False
    least, first, last, tightest, widest = _BENDS[method]
    angle, radius = math.degrees(bend.angle) / (1 + 1e-9), bend.radius / tube.bore
    return reynolds >= least and first <= angle <= last and tightest <= radius <= widest


def _range(parts: Parts, *names: str, others: bool = False) -> tuple[float, float]:
    """Smallest and largest sum of some parts. Args: `others`: True without the program's own methods."""
    ends = np.zeros(2)
    for part in names or parts:
        excluded = _PROGRAM_METHODS.get(part, ()) if others else ()
        values = [k for name, k in parts[part].items() if name not in excluded]
        ends += (min(values), max(values))
    return float(ends[0]), float(ends[1])


def k_by_fluids(scene: Scene, level: Level, defect: str | None = None) -> Evidence:
    """k by `fluids` alone and by the program, at rest and turning."""
    tube = replace(scene.tube, drag_coefficient=None)
    per_velocity = tube.bore / scene.liquid.kinematic_viscosity
    slowest = max(VELOCITIES[0], _JUDGED_FROM_RE / per_velocity * (1 + 1e-9))
    if slowest >= VELOCITIES[1]:
        raise NotRunError(
            f"up to {VELOCITIES[1]:g} m/s this tube stays below Re = {_JUDGED_FROM_RE:,.0f}, "
            "from which on methods of fluids for bends hold"
        )
    if not all(_bend_holds(tube, bend, _JUDGED_FROM_RE, "Miller") for bend in tube.bends):
        raise NotRunError("a bend lies outside 10 to 180 degrees or 0.5 to 10 bores, where methods hold")
    reynolds = np.geomspace(slowest, VELOCITIES[1], _CURVE_POINTS) * per_velocity
    # Friction methods beyond the allowed departure from Colebrook's equation, with their largest departure.
    rough, worst = tube.roughness / tube.bore, dict[str, float]()
    for re in map(float, reynolds[reynolds >= _TURBULENT_FROM_RE]):
        exact = friction_factor(re, rough, Method="Clamond")
        for name in friction_factor_methods(re, rough):
            away = abs(friction_factor(re, rough, Method=name) / exact - 1)
            worst[name] = max(away, worst.get(name, 0.0))
    departs = {name: away for name, away in worst.items() if away > _MAX_FROM_COLEBROOK}
    without = frozenset(departs)
    at_rest = _program(tube, reynolds, defect)
    library = [by_fluids(tube, float(re), without=without) for re in at_rest.reynolds]
    turning = replace(scene, tube=tube)
    loss = tube_loss(turning, np.geomspace(*VELOCITIES, _CURVE_POINTS))
    low, high = _spread(turning, loss.reynolds, without)
    fifty = np.full(low.shape, PAPER_DRAG_COEFFICIENT)
    return Evidence(
        quantities={
            "friction": _worst(tube, at_rest, library, "friction"),
            "bends": _worst(tube, at_rest, library, "bends"),
            "k": _worst(tube, at_rest, library),
        },
        numbers=_at_equal_fills(turning, slowest, without),
        series=(
            figure(
                "loss coefficient by the library and by the program",
                ("velocity", "m/s", loss.velocity),
                FigureCurve("fluids, all methods", "1", (low + high) / 2, "reference", (high - low) / 2),
                FigureCurve("program, at rest", "1", _program(turning.tube, loss.reynolds, None).k, "points"),
                FigureCurve("program, turning", "1", loss.k.value, uncertainty=loss.k.uncertainty),
                FigureCurve("50", "1", fifty, "paper"),
                log=True,
            ),
        ),
        tables=(_over_velocity(turning, without), _methods(tube, float(at_rest.reynolds[-1]), departs)),
    )


def _program(tube: Tube, reynolds: FloatArray, defect: str | None) -> TubeState:
    """The program's terms of the tube at rest."""
    state = tube_state_at(tube=tube, reynolds=reynolds, rotation_reynolds=np.zeros(reynolds.shape))
    terms = dict(state.terms)
    if defect == "fanning_factor":
        terms["friction"] = terms["friction"] / 4
    elif defect == "bends_left_out":
        terms["bends"] = np.zeros(reynolds.shape)
    elif defect == "exit_counted_twice":
        terms["exit"] = terms["exit"] + 1
    return replace(state, terms=terms)


def _half_width(tube: Tube, state: TubeState, *causes: str) -> FloatArray:
    """Expanded uncertainty (95 %) of the program's k at rest, or of some of its parts, by its models."""
    parts = model_parts(tube=tube, state=state)
    return np.asarray(np.sqrt(sum(parts[cause] ** 2 for cause in causes or parts)))


def _worst(tube: Tube, state: TubeState, library: list[Parts], part: str = "") -> Found:
    """The program's number with the largest departure from the library's, over their joint uncertainty."""
    values = state.terms[part] if part else state.k
    widths = _half_width(tube, state, *_CAUSES.get(part, ()))
    names = (part,) if part else ()
    numbers, departures = [], []
    for value, half_width, parts in zip(values, widths, library, strict=True):
        ends = _range(parts, *names, others=True)
        reference = Reference(value=sum(ends) / 2, uncertainty=from_range(ends))
        number = Found.within(value, half_width).against(reference)
        deviation = number.compared(reference)
        numbers.append(number)
        departures.append(abs(deviation.error) / deviation.half_width)
    return numbers[departures.index(max(departures))]


def _at_equal_fills(scene: Scene, slowest: float, without: frozenset[str]) -> dict[str, float]:
    """Numbers for the text at the velocity of equal fills under the scene's gas, within what is judged."""
    tube = TubeFlow.of(Designs(scene=scene, size=1))
    wall = chamber_pressure(scene=scene, fill_ratio=np.array([scene.disc.max_fill_ratio / 2]))
    flow = tube.flow(tube.ends(wall, wall), primed=True)
    velocity = float(np.clip(flow.velocity[0], slowest, VELOCITIES[1]))
    loss = tube_loss(scene, np.array([velocity]))
    at_rest = _program(scene.tube, loss.reynolds, None)
    parts = by_fluids(scene.tube, float(loss.reynolds[0]), without=without)
    low, high = _range(parts)
    return {
        "velocity": velocity,
        "reynolds": loss.reynolds[0],
        "k_low": low,
        "k_high": high,
        "k_rest": at_rest.k[0],
        "k_rest_half_width": _half_width(scene.tube, at_rest)[0],
        "k": loss.k.value[0],
        "k_half_width": loss.k.uncertainty[0],
        "rotation": loss.k.value[0] - at_rest.k[0],
        "times_50": PAPER_DRAG_COEFFICIENT / high,
        "frictions": len(parts["friction"]),
        "bends": len(parts["bends"]),
        "entrances": len(parts["entrance"]),
        "left_out": len(without),
    }


def _spread(scene: Scene, reynolds: FloatArray, without: frozenset[str]) -> FloatArray:
    """Smallest and largest k by the library at each Re, shape (2, n)."""
    ends = [_range(by_fluids(scene.tube, float(re), without=without)) for re in reynolds]
    return np.array(ends).T


def _over_velocity(scene: Scene, without: frozenset[str]) -> CaseTable:
    loss = tube_loss(scene, np.array(_SHOWN_VELOCITIES))
    low, high = _spread(scene, loss.reynolds, without)
    columns = {
        "velocity": loss.velocity,
        "Reynolds number": loss.reynolds,
        "fluids, least": low,
        "fluids, most": high,
        "program, at rest": _program(scene.tube, loss.reynolds, None).k,
        "program, turning": loss.k.value,
        "half-width": loss.k.uncertainty,
    }
    elements = "finite elements"
    return CaseTable(
        name="loss coefficient over velocity; below Re = 10,000 no measured bend stands behind the library's",
        columns={
            **{name: values.tolist() for name, values in columns.items()},
            "program by": [elements if s == FlowState.LAMINAR else "correlations" for s in loss.flow_state],
        },
        units={"velocity": "m/s"},
    )


def _methods(tube: Tube, reynolds: float, departs: Mapping[str, float]) -> CaseTable:
    """Every method of the library at one Re, those left out with the reason."""
    parts, rough = by_fluids(tube, reynolds, without=frozenset(departs)), tube.roughness / tube.bore
    rows: list[tuple[str, str, float | str, str]] = [
        (part, name, k, "the program’s own" if name in _PROGRAM_METHODS.get(part, ()) else "")
        for part in ("friction", "bends", "entrance")
        for name, k in parts[part].items()
    ]
    stated = friction_factor_methods(reynolds, rough)
    for name in friction_factor_methods(reynolds, rough, check_ranges=False):
        if name in departs:
            why = f"left out: {100 * departs[name]:.0f} % from Colebrook’s equation"
            rows.append(("friction", name, MISSING, why))
        elif name not in stated and name != "laminar":
            rows.append(("friction", name, MISSING, "left out: beyond its stated Re or roughness"))
    for name in fittings.bend_rounded_methods:
        if name not in parts["bends"]:
            steel = "left out: friction of steel pipes from 15 mm on, for all bores"
            why = "left out: beyond the angles, radii or Re of its source" if name in _BENDS else steel
            rows.append(("bends", name, MISSING, why))
    heads = ("part", "method", "share of k", "remark")
    return CaseTable(
        name=f"methods of fluids at Re = {reynolds:,.0f}",
        columns=dict(zip(heads, map(list, zip(*rows, strict=True)), strict=True)),
    )
