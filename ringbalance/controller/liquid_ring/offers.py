"""Trials that a liquid ring offers: settings, changes of its scene, and valves to choose.

Settings are relative to the loop's rate and the valve's dead time at a pressure.  Runs alone show which
change helps where too few devices meet the demands; this module lists changes that can be built and make
sense.  The gas pressure is not among them: the search of the settings covers it.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import replace
from functools import cache, partial
from types import MappingProxyType
from typing import Any, Final

from ringbalance.controller.balancer import Remedy
from ringbalance.controller.liquid_ring.loop_factor import loop_rate
from ringbalance.controller.terms import dead_time, least_period
from ringbalance.controller.trials import MEASURE_INPUT, DrawnInput, Point, SearchAxis, Trials, rounded
from ringbalance.physics.gas import applied_pressure
from ringbalance.reduced_model.law.flow_law import BalancerModel
from ringbalance.reduced_model.residual_liquid import Holding, residual_fill_ratio, stalled_fill_ratio
from ringbalance.scene.errors import (
    FITTED_DIRECTION,
    LOSS,
    MODEL_ERRORS,
    MODEL_KINDS,
    MOMENT,
    NOT_KNOWN,
    of_input,
)
from ringbalance.scene.fitted import MODEL
from ringbalance.scene.keys.derivations import shortest_path
from ringbalance.scene.models import Scene
from ringbalance.scene.origins import raw_value_at
from ringbalance.scene.uncertain import UNCERTAIN_QUANTITIES
from ringbalance.scene.valves import Valve, known_valves

PRESSURE: Final = "gas.pressure"
_GAIN: Final = SearchAxis(
    name="loop factor", levels=(0.06, 0.1, 0.16, 0.25, 0.4, 0.6, 0.8, 1.0, 1.25, 1.6, 1.9), first=(3, 5, 7, 9)
)
_OFFSET: Final = SearchAxis(
    name="offset over dead time",
    levels=(0.0, 0.25, 0.5, 0.75, 1.0, 1.25, 1.5, 1.75, 2.0, 2.25, 2.5, 3.0),
    first=(0, 4, 8),
)
_INTEGRAL: Final = SearchAxis(
    name="period over integral time", levels=(0.0, 0.03, 0.05, 0.1, 0.2, 0.35, 0.5, 0.7), first=(2, 4, 6)
)
_SERIES: Final = "10 11 12 13 15 16 18 20 22 24 27 30 33 36 39 43 47 51 56 62 68 75 82 91"
_PRESSURES: Final = tuple(
    rounded(int(each) * 10.0**power) for power in range(1, 8) for each in _SERIES.split()
)
"""Levels, Pa, alike for all scenes: the series E24 of IEC 60063, of steps of about a tenth."""
_REACH: Final = 3.2
"""Largest ratio to the scene's pressure, up and down, of the levels that may be tried."""
_FIRST_REACH: Final = 1.8
"""Largest ratio to the scene's pressure, up and down, of the levels that are tried first."""
_OFFSET_STEP_S: Final = 1e-4
"""Step to which an offset is rounded."""
_OWN: Final = {"target_vector": (_GAIN, _OFFSET, _INTEGRAL), "law_based": (_OFFSET,), "trial": ()}
_INSTEAD: Final = {"target_vector": ("law_based",), "law_based": ("target_vector",), "trial": ()}
"""Further kinds of controller to try, by the scene's kind."""


def trials(scene: Scene, model: BalancerModel, *, limit: float) -> tuple[Trials, ...]:
    """Settings to try, those of the scene's kind of controller first.

    Args: `limit`: amplitude by which runs are judged, m.
    """

    nominal, available, controller = scene.gas.pressure, scene.design.pressure, scene.controller

    @cache
    def rate_and_dead_time(pressure: float) -> tuple[float, float]:
        """b of `loop_factor`, m/s, and dead time, s, under a gas pressure."""
        supplied = replace(scene, gas=replace(scene.gas, pressure=pressure))
        rate = loop_rate(supplied, model)
        return rate, dead_time(supplied, model, rate=rate)

    def settings(kind: str, point: Point) -> Mapping[str, Any] | None:
        pressure = point.get(PRESSURE, nominal)
        rate, dead = rate_and_dead_time(pressure)
        if rate <= 0.0:
            return None
        values: dict[str, Any] = {
            PRESSURE: pressure,
            "controller.kind": kind,
            "controller.limit": min(limit, controller.limit),
        }
        if _GAIN.name in point:
            values["controller.proportional"] = rounded(point[_GAIN.name] / rate)
            part = point[_INTEGRAL.name]
            values["controller.integral_time"] = rounded(controller.period / part) if part else None
        if _OFFSET.name in point:
            offset = round(point[_OFFSET.name] * dead / _OFFSET_STEP_S) * _OFFSET_STEP_S
            values["controller.gas_time_offset"] = (round(offset, 6),) if offset else None
        return {path: value for path, value in values.items() if value != raw_value_at(scene, path)}

    # The scene's pressure and levels around it, up to the highest that is available.
    pressures = {nominal, *(each for each in _PRESSURES if nominal / _REACH <= each <= nominal * _REACH)}
    if available is not None:
        pressures = {available, *(each for each in pressures if each < available)}
    levels = tuple(sorted(pressures))
    first = tuple(
        at for at, each in enumerate(levels) if nominal / _FIRST_REACH <= each <= nominal * _FIRST_REACH
    )
    pressure_axis = SearchAxis(name=PRESSURE, levels=levels, first=first or (len(levels) - 1,), unit="Pa")
    gain = scene.origin_of("controller.proportional")
    stated = gain != "default" or controller.kind != "target_vector"
    kind_stated = scene.origin_of("controller.kind") == "given"
    return tuple(
        Trials(
            kind=kind,
            axes=_OWN[kind],
            settings=partial(settings, kind),
            stated=stated,
            kind_stated=kind_stated,
            scan_axis=pressure_axis,
        )
        for kind in (controller.kind, *_INSTEAD[controller.kind])
    )


_NARROWER_BORES: Final = (0.7, 0.5, 0.35, 0.25)
_WIDER_BORES: Final = (1.4, 2.0)
"""Factors on the bore."""
_SLOW_FRACTION: Final = 0.25
"""Fraction of a run's time that valves open for the initial vibration, above which wider bores are tried."""
_FASTER: Final = (2.0, 4.0)
"""Factors on the valve's conductance, and divisors of its lag; of a slower one, divisors of the former."""
_LARGER_HOLES: Final = (1.5, 2.0, 3.0)
"""Factors on the diameter of the gas hole."""
_LIMITS: Final = (2.0, 4.0, 6.0)
_CRESTS: Final = (1.0, 0.96, 0.92)
"""Factors on the largest radius of a crest that holds the liquid."""
_SOLD: Final = ("Festo MHA2-MS1H-3/2", "SMC SY3000", "CKD M4GA2 R")
"""Valves of the catalogue to try; their lags are assumed, as their sources print none."""
_MEASURED: Mapping[str, str] = MappingProxyType(
    dict.fromkeys((LOSS, *MODEL_ERRORS), "measure_flow")
    | {MOMENT: "measure_moment", "draw_down_factor": "measure_residual"}
)
"""Codes of the measurements that replace an error of a model."""


def remedies_of(scene: Scene, model: BalancerModel) -> Iterator[Remedy]:
    """Yield single changes of a scene, those of one kind with the smallest first."""
    disc, tube, gas, law = scene.disc, scene.tube, scene.gas, model.flow
    # Higher crests where liquid runs back, or other ones where gas does not lift the liquid to the crest.
    held, total = Holding.of(scene, fill_ratio=disc.max_fill_ratio), 2 * disc.initial_fill
    stalled = stalled_fill_ratio(law=law, total=total, gas_pressure=applied_pressure(gas))
    lifted = stalled <= residual_fill_ratio(scene, law=law)
    if held.largest_hump_radius is not None and not (held.holds and lifted):
        for factor in _CRESTS:
            # Rounded down to a tenth of a millimetre, where a crest holds the liquid.
            radius = math.floor(1e4 * factor * held.largest_hump_radius * (1 + 1e-12)) / 1e4
            path = shortest_path(
                port_radius=tube.port_radius,
                hump_radius=radius,
                separation=max(math.pi - disc.central_angle, 0.0),
            )
            changes = {"tube.hump_radius": radius}
            if path > tube.length:
                changes["tube.length"] = math.ceil(1e3 * path) / 1e3
            yield Remedy(code="crest", changes=changes)
    yield from (Remedy(code="bore", changes={"tube.bore": each * tube.bore}) for each in _NARROWER_BORES)
    # Valve-open time in which the full tube would correct the initial vibration, s.
    rate = loop_rate(scene, model)
    open_time = scene.rotor.initial_amplitude / rate if rate > 0.0 else math.inf
    if open_time > _SLOW_FRACTION * (scene.requirement.settling_time or scene.run.time_limit):
        for factor in _WIDER_BORES:
            yield Remedy(code="wider_bore", changes={"tube.bore": factor * tube.bore})
    for factor in _FASTER:
        changes = {}
        if gas.conductance is not None:
            changes["gas.conductance"] = factor * gas.conductance
        if gas.valve_lag:
            changes["gas.valve_lag"] = gas.valve_lag / factor
        if changes:
            yield Remedy(code="faster_valve", changes=changes)
    yield from _of_jet(scene)
    period, least = scene.controller.period, least_period(scene, model)
    yield Remedy(
        code="period", changes={"controller.period": rounded(least) if period < least else period / 2}
    )
    # Higher limits would miss a residual that the scene requires.
    if scene.requirement.residual is None and scene.requirement.grade is None:
        for factor in _LIMITS:
            changes = {"controller.limit": factor * scene.controller.limit}
            yield Remedy(code="limit", changes=changes, continuous=True)


def valves_on_sale() -> tuple[Valve, ...]:
    """Some valves of the catalogue, with assumed lags."""
    catalogue = known_valves()
    return tuple(Valve(name=name, conductance=rounded(catalogue[name].iso_6358[0], 2)) for name in _SOLD)


def valves_of(scene: Scene) -> tuple[Remedy, ...]:
    """Valves at hand, or some that can be bought; empty for a scene that gives its valve."""
    return valve_choices(scene, lag=scene.gas.valve_lag) if scene.gas.conductance is None else ()


def valve_choices(scene: Scene, *, lag: float | None = None) -> tuple[Remedy, ...]:
    """Valves at hand, or some that can be bought. Args: `lag`: in place of their own, s; None: their own."""
    remedies = []
    for valve in (each.completed for each in scene.design.valves or valves_on_sale()):
        conductance, ratio = valve.iso_6358
        changes = {
            "gas.conductance": conductance,
            "gas.critical_ratio": ratio,
            "gas.valve_lag": valve.lag if lag is None else lag,
        }
        assumed = ("gas.valve_lag",) if lag is None and valve.assumes_lag else ()
        remedies.append(Remedy(code="valve", name=valve.name, changes=changes, assumed=assumed))
    return tuple(remedies)


def drawn_input(name: str) -> DrawnInput:
    """Kind of an input of drawn devices, by its name."""
    if name in UNCERTAIN_QUANTITIES:
        kind = of_input(name, 0.0)
        measure = _MEASURED.get(name, MEASURE_INPUT)
        return DrawnInput(common=kind.varies == NOT_KNOWN, measure=measure, path=kind.acts_on)
    if name.startswith(MODEL):
        cause = MODEL_ERRORS.get(name)
        common = cause is None or MODEL_KINDS[cause].varies == NOT_KNOWN
        group = name if cause is None else f"{MODEL}{cause}"
        return DrawnInput(common=common, measure=_MEASURED.get(name, ""), name=group)
    if name.startswith(FITTED_DIRECTION):
        return DrawnInput(common=True, measure="measure_fitted")
    return DrawnInput(common=False, measure="", path=name)


def _of_jet(scene: Scene) -> Iterator[Remedy]:
    """Milder gas jets, where the scene limits the crater: a larger or turned hole, a slower valve."""
    disc, gas = scene.disc, scene.gas
    if scene.requirement.crater is None or disc.gas_hole_diameter is None:
        return
    for factor in _LARGER_HOLES:
        changes = {"disc.gas_hole_diameter": factor * disc.gas_hole_diameter}
        yield Remedy(code="gas_hole", changes=changes, continuous=True)
    if disc.gas_hole_direction != "axial":
        yield Remedy(code="turned_gas_hole", changes={"disc.gas_hole_direction": "axial"})
    if gas.conductance is not None:
        for factor in _FASTER:
            changes = {"gas.conductance": gas.conductance / factor}
            yield Remedy(code="slower_valve", changes=changes, continuous=True)
