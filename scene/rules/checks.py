"""Cross-checks: values that are each possible but cannot be true together.

A check names the values it needs and is left out while one of them is unknown, so that one fault does not
raise others.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass

from ringbalance.scene.faults import Fault
from ringbalance.scene.keys.reading import Reading
from ringbalance.scene.rules import eccentric as eccentric_rules
from ringbalance.scene.rules import shape as shape_rules
from ringbalance.scene.rules import working as working_rules
from ringbalance.scene.rules.finding import Finding
from ringbalance.scene.uncertain import UNCERTAIN_QUANTITIES

_INNER, _OUTER, _ANGLE = "disc.inner_radius", "disc.outer_radius", "disc.central_angle"
_PLATE = "disc.plate_thickness"
_PORT, _HUMP, _LENGTH, _BORE = "tube.port_radius", "tube.hump_radius", "tube.length", "tube.bore"
_VAPOUR, _AMBIENT = "liquid.vapour_pressure", "gas.ambient_pressure"
_GAS_TIMES = ("controller.minimum_gas_time", "controller.maximum_gas_time")


@dataclass(frozen=True, kw_only=True)
class Check:
    """One cross-check; the first of its values is the one to be changed."""

    rule: Callable[..., Finding | None]
    needs: tuple[str, ...]
    """Paths of the rule's arguments."""
    when: Callable[[Reading], bool] = lambda _: True
    """Whether the rule applies to a scene."""
    moot: tuple[Callable[..., Finding | None], ...] = ()
    """Rules above whose failure makes this one pointless."""


def _without_chambers(reading: Reading) -> bool:
    return not reading.given("disc.chambers")


def _vapour_given(reading: Reading) -> bool:
    return reading.given(_VAPOUR)


def _vapour_looked_up(reading: Reading) -> bool:
    return not reading.given(_VAPOUR)


def _by_trial(reading: Reading) -> bool:
    return bool(reading.values.get("controller.kind") == "trial")


CHECKS: tuple[Check, ...] = (
    Check(rule=shape_rules.radii_in_order, needs=(_INNER, _OUTER)),
    Check(rule=shape_rules.chamber_has_depth, needs=(_INNER, _OUTER), moot=(shape_rules.radii_in_order,)),
    Check(rule=shape_rules.plates_leave_room, needs=(_PLATE, _INNER, _ANGLE)),
    Check(
        rule=shape_rules.chamber_wide_enough,
        needs=(_ANGLE, _PLATE, _INNER, _OUTER),
        moot=(shape_rules.radii_in_order, shape_rules.plates_leave_room),
    ),
    Check(
        rule=shape_rules.fill_has_depth,
        needs=("disc.max_fill_ratio", _INNER, _OUTER),
        moot=(shape_rules.radii_in_order, shape_rules.chamber_has_depth),
    ),
    Check(rule=shape_rules.chambers_fit, needs=(_ANGLE, "disc.chambers")),
    Check(rule=shape_rules.chambers_even, needs=(_ANGLE,), when=_without_chambers),
    Check(rule=shape_rules.fills_share_the_liquid, needs=("disc.initial_fill", "disc.max_fill_ratio")),
    Check(
        rule=shape_rules.port_in_chamber, needs=(_PORT, _INNER, _OUTER), moot=(shape_rules.radii_in_order,)
    ),
    Check(rule=shape_rules.hump_in_disc, needs=(_HUMP, _OUTER)),
    Check(
        rule=shape_rules.hump_inside_port,
        needs=(_HUMP, _PORT),
        moot=(shape_rules.port_in_chamber, shape_rules.hump_in_disc),
    ),
    Check(rule=shape_rules.bore_fits_bends, needs=(_BORE, "tube.bends")),
    Check(
        rule=shape_rules.bore_fits_chamber,
        needs=(_BORE, "disc.axial_width", _INNER, _OUTER),
        moot=(shape_rules.radii_in_order,),
    ),
    Check(rule=shape_rules.roughness_fits_bore, needs=("tube.roughness", _BORE)),
    Check(rule=shape_rules.length_holds_bends, needs=(_LENGTH, "tube.bends")),
    Check(
        rule=shape_rules.length_reaches_over_hump,
        needs=(_LENGTH, _ANGLE, _PORT, _HUMP),
        moot=(shape_rules.port_in_chamber, shape_rules.hump_in_disc, shape_rules.hump_inside_port),
    ),
    Check(
        rule=shape_rules.length_reaches,
        needs=(_LENGTH, _ANGLE, _PORT),
        moot=(shape_rules.port_in_chamber, shape_rules.length_reaches_over_hump),
    ),
    Check(rule=shape_rules.entrance_has_radius, needs=("tube.entrance_radius", "tube.entrance")),
    Check(rule=working_rules.liquid_stays_liquid, needs=(_VAPOUR, _AMBIENT), when=_vapour_given),
    Check(
        rule=working_rules.temperature_below_boiling,
        needs=("liquid.temperature", _VAPOUR, _AMBIENT),
        when=_vapour_looked_up,
    ),
    Check(rule=working_rules.gas_times_in_order, needs=_GAS_TIMES),
    Check(rule=working_rules.period_covers_lag, needs=("controller.period", "gas.valve_lag")),
    Check(rule=working_rules.limit_above_noise, needs=("controller.limit", "sensor.amplitude_noise")),
    *(
        Check(
            rule=working_rules.trial_time_executed,
            needs=(f"controller.{step}", *_GAS_TIMES),
            when=_by_trial,
            moot=(working_rules.gas_times_in_order,),
        )
        for step in ("first_trial", "long_step", "short_step")
    ),
    Check(
        rule=working_rules.steps_in_order,
        needs=("controller.short_step", "controller.long_step"),
        when=_by_trial,
    ),
    Check(rule=working_rules.sequence_complete, needs=("controller.sequence", "disc.chambers")),
)

ECCENTRIC_CHECKS: tuple[Check, ...] = (
    Check(rule=eccentric_rules.profile_in_order, needs=("rotor.speed_profile",)),
    Check(rule=eccentric_rules.imbalance_in_rotor, needs=("imbalance.mass", "rotor.mass")),
    Check(rule=eccentric_rules.masses_fit_track, needs=("masses.arc_length", "masses.guide_radius")),
    Check(
        rule=eccentric_rules.masses_apart,
        needs=("masses.initial_angle", "masses.arc_length", "masses.guide_radius"),
        moot=(eccentric_rules.masses_fit_track,),
    ),
    *(
        Check(rule=eccentric_rules.step_is_multiple, needs=(f"{table}.step", "sensor.step"))
        for table in ("imbalance_filter", "friction_filter", "lqr")
    ),
    Check(rule=eccentric_rules.moves_in_order, needs=("fine_tuning.stop", "fine_tuning.step")),
    Check(
        rule=eccentric_rules.limit_above_position_noise, needs=("supervisor.limit", "sensor.position_noise")
    ),
)


def cross_faults(reading: Reading) -> tuple[Fault, ...]:
    """Run every cross-check whose values are known.

    Args: `reading`: what is known of the file, defaults included.
    Returns: One fault for each that fails.
    """
    return (*failed_checks(reading, CHECKS), *_spread_faults(reading))


def failed_checks(reading: Reading, checks: tuple[Check, ...]) -> Iterator[Fault]:
    """Run some cross-checks, each as far as its values are known.

    Args: `reading`: what is known of the file, defaults included. `checks`: in order; a check comes after
        those whose failure makes it pointless.
    Yields: One fault for each that fails.
    """
    failed: set[Callable[..., Finding | None]] = set()
    for check in checks:
        if not reading.known(*check.needs) or not check.when(reading) or failed & set(check.moot):
            continue
        finding = check.rule(*(reading.values[path] for path in check.needs))
        if finding is not None:
            failed.add(check.rule)
            yield reading.fault(check.needs[0], problem=finding.problem, allowed=finding.allowed)


def _spread_faults(reading: Reading) -> Iterator[Fault]:
    for key, table in UNCERTAIN_QUANTITIES.items():
        path, own = f"uncertainty.{key}", f"{table}.{key}"
        if not reading.known(path):
            continue
        width, relative = reading.values[path]
        if reading.lacks(own) and _may_be_unused(reading, own):
            problem = f"[{table}] has no {key} that could be uncertain"
            yield reading.fault(path, problem=problem, allowed=f"a scene with [{table}] {key}")
        elif reading.known(own) and not relative and key != "lag_angle" and width > reading.values[own]:
            problem = f"the uncertainty is larger than {key} itself"
            yield reading.fault(path, problem=problem, allowed="at most the quantity itself, or below 100 %")


def _may_be_unused(reading: Reading, path: str) -> bool:
    return reading.schema.key_at(tuple(path.split("."))).presence.kind == "unused"
