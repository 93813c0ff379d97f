"""Settings that a panel changes: range and scene's value of each control, valves, designs."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any, Final, cast

import numpy as np

from ringbalance.controller.judging.remedies import coarse_settings
from ringbalance.controller.liquid_ring.balancer import LiquidRingBalancer
from ringbalance.controller.liquid_ring.offers import valve_choices
from ringbalance.design.axes import Point, plan_of_texts
from ringbalance.design.space import Space
from ringbalance.export import disc
from ringbalance.export.blocks import disc_block
from ringbalance.export.compact import CompactLaw
from ringbalance.panels.devices import lost_times
from ringbalance.reduced_model.law.calibrated_law import CalibratedLaw
from ringbalance.reduced_model.pieces import point
from ringbalance.scene.describe import setting_text
from ringbalance.scene.faults import SceneError
from ringbalance.scene.models import Scene
from ringbalance.scene.narrowing import liquid_ring_scene
from ringbalance.scene.origins import with_values_at

MOST_DESIGNS: Final = 9
"""Largest number of designs in one page."""
_DESIGNS_OF_SCENE: Final = 5
_LEAST_RADIUS: Final = 0.7
"""Number of outer radii up to that of `[design]`, and the least one over that."""
_REACH: Final = 10.0
"""Factor to either side of the scene's value up to which gain, integral time and limit are tried."""
_LEAST_LEAK: Final = 3e-9
"""Least upper end of the conductance of a leak, m^3/(s Pa)."""
_LINE: Final = (disc.LINE, disc.PASSING, disc.CRITICAL, disc.LAG, disc.LONGEST)
"""Constants of the exported disc that belong to its valve and line."""


def ranges_of(
    scene: Scene, valves: Sequence[Mapping[str, Any]]
) -> dict[str, tuple[float, float, float | None]]:
    """Lower end, upper end and scene's value of every control, SI; None: the scene has no such part."""
    gas, settings, rotor, sensor = scene.gas, scene.controller, scene.rotor, scene.sensor
    start, runout, turn = rotor.initial_amplitude, sensor.runout_amplitude or 0.0, 2 * math.pi
    leak, period, integral = gas.leak_to_ambient or 0.0, settings.period, settings.integral_time
    offset = max(settings.offsets(scene.disc.chambers))
    longest = max([0.05, 3 * offset, *(2 * each["settings"]["offset"] for each in valves)])
    gains = [settings.proportional, *(each["settings"]["gain"] for each in valves)]
    middle = integral or 10 * period
    return {
        "amplitude": (0.05 * start, 2.5 * start, start),
        "phase": (0.0, turn, rotor.initial_phase % turn),
        "noise": (0.0, max(10 * sensor.amplitude_noise, 2 * settings.limit), sensor.amplitude_noise),
        "phase_noise": (0.0, max(10 * sensor.phase_noise, 0.1), sensor.phase_noise),
        "runout": (0.0, max(3 * runout, 0.2 * start), runout),
        "pressure": (0.2 * gas.pressure, 3 * gas.pressure, gas.pressure),
        "leak": (0.0, max(_LEAST_LEAK, 3 * leak), leak),
        "gain": (min(gains) / _REACH, max(gains) * _REACH, settings.proportional),
        "integral": (min(middle / _REACH, period), middle * _REACH, integral),
        "derivative": (0.0, max(4 * settings.derivative_time, period), settings.derivative_time),
        "offset": (0.0, longest, offset),
        "limit": (settings.limit / _REACH, settings.limit * _REACH, settings.limit),
    }


def valves_of_panel(balancer: LiquidRingBalancer, compact: CompactLaw) -> list[dict[str, Any]]:
    """Valves at hand, or some that can be bought, for the page.

    Of each the constants of the disc that change, and the settings that suit it, chosen by runs of drawn
    devices on a coarse grid.
    """
    scene, law = balancer.scene, cast(CalibratedLaw, balancer.model.flow)
    valves = []
    for valve in valve_choices(scene):
        changes = dict(valve.changes)
        fitted = LiquidRingBalancer(liquid_ring_scene(scene.with_values(changes)))
        block = disc_block(fitted.scene, law, compact=compact)
        d = int(block.constants[point.BLOCK])
        valves.append(
            {
                "name": valve.name,
                "changes": {path: setting_text(path, value) for path, value in changes.items()},
                "constants": {d + index: block.constants[d + index] for index in _LINE},
                "settings": _suited(fitted),
                "lost": lost_times(fitted.scene, balancer.model),
            }
        )
    return valves


def _suited(balancer: LiquidRingBalancer) -> dict[str, Any]:
    """Gain, integral time and offset that suit most devices, SI."""
    scene: Scene = with_values_at(balancer.scene, coarse_settings(balancer))
    offset = max(scene.controller.offsets(scene.disc.chambers))
    return {
        "gain": scene.controller.proportional,
        "integral": scene.controller.integral_time,
        "offset": offset,
    }


def design_points(scene: Scene, vary: Sequence[str]) -> tuple[tuple[str, ...], list[Point]]:
    """Axes in words and points of a grid of designs, from `--vary` or the scene's `[design]`.

    Raises: SceneError: an axis that cannot be used, or more than `MOST_DESIGNS` points.
    """
    if vary:
        plan = plan_of_texts(scene, vary)
        points = list(plan.points())
        if len(points) > MOST_DESIGNS:
            problem, text = f"{len(points)} designs", " ".join(vary)
            allowed = f"at most {MOST_DESIGNS}, such as tube.bore=1mm:2mm:5"
            raise SceneError.of_option(option="--vary", value=text, problem=problem, allowed=allowed)
        return plan.paths, points
    widest = scene.design.outer_radius
    if widest is None:
        return (), []
    space = Space.of(scene)
    radii = np.linspace(_LEAST_RADIUS, 1.0, _DESIGNS_OF_SCENE) * widest
    paths = ("disc.outer_radius",)
    return paths, [dict(space.followed({"disc.outer_radius": float(f"{r:.3g}")})) for r in radii.tolist()]
