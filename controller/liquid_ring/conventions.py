"""A run of a liquid ring in the quantities and units of balancing shops and of operators of machines."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import replace
from typing import Final

from ringbalance.controller.simulation import GasUse, Simulation
from ringbalance.physics import balancing
from ringbalance.reduced_model.residual_liquid import Holding
from ringbalance.results.rows import Quantity
from ringbalance.scene.models import Scene

_DEVIATIONS: Final = 3.0
_HOUR: Final = 3600.0
_HALVINGS: Final = 30


def conventions(run: Simulation) -> tuple[Quantity, ...]:
    """Unbalances and vibrations of the run as ISO 21940 and ISO 20816 name them, the loop's peak sensitivity,
    gas used, and down to which speed the correction lasts without gas.
    """
    return (*_unbalances(run), *_vibrations(run), *_loop(run), *_gas(run), _lasting(run))


def _unbalances(run: Simulation) -> Iterator[Quantity]:
    scene, before, after = run.scene, float(run.amplitude[0]), float(run.amplitude[-1])
    influence, grade = scene.rotor.influence_coefficient, scene.requirement.grade
    yield _row("residual_unbalance", "residual unbalance at the end", after / influence, "kg m")
    if grade is not None and scene.rotor.mass is not None:
        permissible = balancing.permissible_unbalance(
            grade=grade, mass=scene.rotor.mass, speed=scene.rotor.speed
        )
        name = "permissible residual unbalance (ISO 21940-11)"
        yield _row("permissible_unbalance", name, permissible, "kg m")
    yield _row(
        "unbalance_reduction_ratio",
        "unbalance reduction ratio (ISO 21940-21)",
        balancing.unbalance_reduction_ratio(before=before, after=after) if before > 0 else None,
    )
    yield _row(
        "minimum_achievable_unbalance",
        "minimum achievable residual unbalance (ISO 21940-21)",
        _achievable(run) / influence,
        "kg m",
    )


def _achievable(run: Simulation) -> float:
    """Vibration that is left for sure, m: three standard deviations of what noise sustains, or what the
    shortest injections of two pairs leave, half a step each, where that is more.
    """
    step = run.scene.controller.minimum_gas_time * run.loop.rate
    noise = run.loop.deviation or 0.0
    return max(_DEVIATIONS * noise if math.isfinite(noise) else 0.0, step / math.sqrt(2.0))


def _vibrations(run: Simulation) -> Iterator[Quantity]:
    speed = run.scene.rotor.speed
    for key, name, amplitude in (
        ("initial", "before", float(run.amplitude[0])),
        ("final", "at the end", float(run.amplitude[-1])),
    ):
        velocity = balancing.rms_velocity(amplitude=amplitude, speed=speed)
        yield _row(f"{key}_peak_to_peak", f"vibration {name}, peak to peak", 2 * amplitude, "m")
        yield _row(f"{key}_velocity", f"vibration {name}, velocity, rms", velocity, "m/s")


def _loop(run: Simulation) -> Iterator[Quantity]:
    factor, controller = run.loop.value, run.scene.controller
    if not run.loop.fixed or factor is None or factor >= run.loop.limit:
        return
    peak = balancing.peak_sensitivity(
        loop_factor=factor,
        integral=controller.period / (controller.integral_time or math.inf),
        derivative=controller.derivative_time / controller.period,
    )
    name = f"peak sensitivity of the loop (zone {balancing.zone(peak)} of ISO 14839-3)"
    yield _row("peak_sensitivity", name, peak)


def _gas(run: Simulation) -> Iterator[Quantity]:
    first = min((each.time + each.duration for each in run.injections if each.moved), default=None)
    corrections = len({each.time for each in run.injections})
    per = run.gas.normal_volume / corrections if corrections else None
    yield _row("first_correction", "first correction made after", first, "s")
    yield _row("gas_per_correction", "gas per correction, normal volume", per, "m^3")
    yield _row("gas_per_hour", "gas per hour to hold it, normal volume", _per_hour(run), "m^3")


def _per_hour(run: Simulation) -> float | None:
    """Of the injections after the run has settled, normal m^3 in an hour; None where it has not."""
    since, end = run.settling_time, float(run.time[-1])
    if since is None or end <= since:
        return None
    later = [each for each in run.injections if each.time > since]
    used = GasUse.of(scene=run.scene, model=run.model, injections=later)
    return used.normal_volume / (end - since) * _HOUR


def _lasting(run: Simulation) -> Quantity:
    """Speed down to which the fullest chamber keeps its liquid with the gas off, by hydrostatics."""
    name = "correction lasts without gas down to"
    fill = max(float(each[-1]) for each in run.fill_ratio.values())
    speed = lasting_speed(run.scene, fill)
    if speed is None:
        finding = Holding.of(run.scene, fill_ratio=fill).finding
        return _row("lasting_speed", name, None, "rad/s", status=finding.code if finding else "ok")
    return _row("lasting_speed", name, speed, "rad/s")


def lasting_speed(scene: Scene, fill_ratio: float) -> float | None:
    """Lowest speed at which a full tube parts over the crest before it drains a chamber of a fill, rad/s, the
    gas off; None where it does not part at the scene's.

    Restarts find what the run-down has left: below this speed opposite chambers level out.
    """

    def holds(speed: float) -> bool:
        slower = replace(scene, rotor=replace(scene.rotor, speed=speed))
        return Holding.of(slower, fill_ratio=fill_ratio).holds

    low, high = 0.0, scene.rotor.speed
    if not holds(high):
        return None
    for _ in range(_HALVINGS):
        middle = (low + high) / 2
        low, high = (low, middle) if holds(middle) else (middle, high)
    return high


def _row(key: str, name: str, value: float | None, unit: str = "1", *, status: str = "ok") -> Quantity:
    return Quantity(key=key, name=name, value=value, unit=unit, origin="simulated", status=status, digits=3)
