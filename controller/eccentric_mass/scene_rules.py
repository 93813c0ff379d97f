"""Rules for two eccentric masses."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from itertools import pairwise
from typing import Final

from ringbalance.controller.eccentric_mass.scene_records import ECCENTRIC_MASS, SpeedPoint
from ringbalance.scene.keys.declaration import Entries
from ringbalance.scene.keys.schema import ORIGIN
from ringbalance.scene.kinds import SceneKind
from ringbalance.scene.rules.check import Check, Finding, Rule, check, limit_above_noise, reader_of, written

_ROUNDING = 1e-9


def _imbalance_in_rotor(imbalance: float, rotor: float) -> Finding | None:
    """m_im <= m_r, since the imbalance is a part of the rotor."""
    if imbalance <= rotor:
        return None
    whole = written(rotor, "kg")
    return Finding(
        problem=f"the imbalance is a part of the rotor's mass ({whole}), so it cannot be heavier",
        allowed=f"at least 0 kg and at most {whole}",
    )


def _masses_fit_track(arc: float, radius: float) -> Finding | None:
    """Both masses fit on the track: l <= pi r_b."""
    limit = math.pi * radius
    if arc <= limit * (1 + _ROUNDING):
        return None
    return Finding(
        problem="two masses of this length do not fit on the track",
        allowed=f"above 0 mm and at most pi * guide_radius = {written(limit, 'mm')}",
    )


def _masses_apart(angles: tuple[float, float], arc: float, radius: float) -> Finding | None:
    """The masses do not overlap at the start: |phi_1 - phi_2| >= l / r_b around the circle."""
    apart, least = abs(math.remainder(angles[0] - angles[1], 2 * math.pi)), arc / radius
    if apart >= least * (1 - _ROUNDING):
        return None
    width = written(least, "deg")
    return Finding(
        problem=f"the masses overlap: they are {written(apart, 'deg')} apart, each {width} wide",
        allowed=f"angles at least arc_length / guide_radius = {width} apart",
    )


def _profile_in_order(profile: tuple[SpeedPoint, ...]) -> Finding | None:
    """The profile has a corner, and its times increase."""
    allowed = "at least one { time, speed }, in order of time, each time once"
    if not profile:
        return Finding(problem="it has no entry", allowed=allowed)
    for place, (before, after) in enumerate(pairwise(profile), start=2):
        if after.time <= before.time:
            late, early = written(after.time, "s"), written(before.time, "s")
            problem = f"entry {place} ({late}) does not come after the one before ({early})"
            return Finding(problem=problem, allowed=allowed)
    return None


def _step_is_multiple(step: float, base: float) -> Finding | None:
    """A step is a whole multiple of the sensor's."""
    times = round(step / base)
    if times >= 1 and abs(step / base - times) <= 1e-6 * times:
        return None
    first, second, third = (written(count * base, "s") for count in (1, 2, 3))
    return Finding(
        problem=f"it is not a whole multiple of the step of [sensor] ({first})",
        allowed=f"{first}, {second}, {third} ...",
    )


def _moves_in_order(stop: float, step: float) -> Finding | None:
    """The smallest trial move is not longer than the first."""
    if stop <= step:
        return None
    return Finding(
        problem=f"the smallest trial move must not be longer than the first, step ({written(step, 'deg')})",
        allowed=f"above 0 deg and at most {written(step, 'deg')}",
    )


def _widths_below(names: tuple[str, ...]) -> Rule:
    """No stated uncertainty is larger than its quantity, of those whose values follow the widths."""

    def below(
        widths: Mapping[str, tuple[float, bool]], *values: float | tuple[float, float]
    ) -> Finding | None:
        for name, value in zip(names, values, strict=True):
            width, relative = widths.get(name, (0.0, True))
            if not relative and width > min(value if isinstance(value, tuple) else (value,)):
                return Finding(
                    problem=f"the uncertainty of {name} is larger than {name} itself",
                    allowed="at most the quantity itself, or below 100 %",
                )
        return None

    return below


def _width_checks() -> Iterator[Check]:
    """An angle may be less than its uncertainty."""
    for table, key in ECCENTRIC_MASS.tables["uncertainty"].keys.items():
        if table != ORIGIN and isinstance(key.takes, Entries):
            names = tuple(name for name in key.takes.keys if name != "phase")
            paths = (f"{table}.{name}" for name in names)
            yield check(_widths_below(names), f"uncertainty.{table}", *paths)


_ARC, _GUIDE = "masses.arc_length", "masses.guide_radius"
_STEPS = ("imbalance_filter.step", "friction_filter.step", "lqr.step")

CHECKS: tuple[Check, ...] = (
    check(_profile_in_order, "rotor.speed_profile"),
    check(_imbalance_in_rotor, "imbalance.mass", "rotor.mass"),
    check(_masses_fit_track, _ARC, _GUIDE),
    check(_masses_apart, "masses.initial_angle", _ARC, _GUIDE, moot=(_masses_fit_track,)),
    *(check(_step_is_multiple, step, "sensor.step") for step in _STEPS),
    check(_moves_in_order, "fine_tuning.stop", "fine_tuning.step"),
    check(limit_above_noise("position_noise", "mm"), "supervisor.limit", "sensor.position_noise"),
    *_width_checks(),
)

KIND: Final = SceneKind(
    schema=ECCENTRIC_MASS,
    read=reader_of(ECCENTRIC_MASS, CHECKS),
    main=(
        ("rotor.mass", "rotor.stiffness", "rotor.damping"),
        ("imbalance.mass", "imbalance.radius", "masses.mass", "masses.guide_radius"),
        ("supervisor.limit", "run.seed"),
    ),
    usual_units={"angle": "deg", "length": "mm"},
)
"""Scenes whose balancer is two eccentric masses."""
