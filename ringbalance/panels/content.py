"""Content of a panel: numbers, texts and settings of one scene, for the modules of the page."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from typing import Any, Final, cast

import numpy as np

from ringbalance.controller.algorithms import target_steps, trial_steps
from ringbalance.controller.algorithms.law_based import controller_of
from ringbalance.controller.balancer import WATCH_TIME_S, Draws
from ringbalance.controller.judging.judge import FIRST_VERDICT_DEVICE, Judgement
from ringbalance.controller.judging.remedies import coarse_settings
from ringbalance.controller.liquid_ring.balancer import LiquidRingBalancer
from ringbalance.controller.liquid_ring.offers import valve_choices
from ringbalance.controller.loop_plan import ALLOWED, IDLE_OPERATIONS
from ringbalance.controller.simulation import NOISE_DEVIATIONS, ROUND_OFF
from ringbalance.design.axes import Point, plan_of_texts
from ringbalance.design.space import Space
from ringbalance.export import disc, law_based
from ringbalance.export.blocks import PART_OF_TIME_CONSTANT, Block, controller_block, disc_block
from ringbalance.export.compact import CompactLaw, compact_law
from ringbalance.panels.devices import (
    PRESSURE_FACTORS,
    PackedDevice,
    drawn_devices,
    lost_times,
    nominal_device,
    packed_blocks,
)
from ringbalance.physics.gas import REFERENCE_PRESSURE_PA, REFERENCE_TEMPERATURE_K, applied_pressure
from ringbalance.reduced_model.law.calibrated_law import CalibratedLaw
from ringbalance.reduced_model.pieces import point
from ringbalance.reduced_model.terms import HELD, INERTIA
from ringbalance.scene.describe import setting_text, usual_name
from ringbalance.scene.faults import SceneError
from ringbalance.scene.loop_models import ControllerKind
from ringbalance.scene.models import Scene
from ringbalance.scene.narrowing import liquid_ring_scene
from ringbalance.scene.origins import raw_value_at, with_values_at

DEVICES: Final = 64
_DISC: Final = (
    *("SUPPLY", "VOLUME", "DEAD", "PASSING", "RESIDUAL", "LONGEST", "LINE", "LEAK", "START_X", "START_Y"),
    *("INFLUENCE_X", "INFLUENCE_Y", "DIRECTIONS", "TOTAL"),
)
_TARGET: Final = (
    *("LIMIT", "GAIN", "PER_TIME", "DERIVATIVE", "AMPLITUDE_SQUARE", "PHASE_SQUARE", "DIRECTIONS"),
)
_LAW_BASED: Final = ("LIMIT", "LEAST_FILL", "AMPLITUDE_SQUARE", "PHASE_SQUARE", "OFFSETS")
"""Constants of the blocks that the page changes or reads."""
_LEFT_OUT: Final = (INERTIA, HELD)
"""Terms that runs of the program carry and the exported disc does not."""
_KINDS: Final[tuple[ControllerKind, ...]] = ("target_vector", "law_based", "trial")


def content_of(
    scene: Scene,
    *,
    vary: Sequence[str] = (),
    devices: int = DEVICES,
    progress: Callable[[str], None] = lambda _: None,
) -> dict[str, Any]:
    """Numbers and texts of a panel, for JSON.

    Args: `vary`: axes of designs, as `ringbalance sweep --vary` takes them. `devices`: number of drawn
        devices of all designs together. `progress`: called with a text.
    Raises: SceneError: a scene whose disc cannot be exported, or axes that cannot be used.
    """
    paths, points = design_points(scene, vary)
    progress("valves ...")
    balancer = LiquidRingBalancer(scene)
    unchanged = balancer, compact_law(scene=scene, law=_law(balancer))
    valves = valves_of_panel(*unchanged)
    designs, packed, controllers = [], list[PackedDevice](), list[Block]()
    for number, values in enumerate(points or [{}]):
        progress(f"design {number + 1} of {len(points)} ..." if points else "devices ...")
        changed = liquid_ring_scene(scene.with_values(values))
        count = devices // max(len(points), 1)
        balancer, compact = unchanged
        if values:
            balancer = LiquidRingBalancer(changed)
            compact = compact_law(scene=changed, law=_law(balancer))
        law = _law(balancer)
        law_based = liquid_ring_scene(changed.with_values({"controller.kind": "law_based"}))
        designs.append(
            {
                "values": {path: setting_text(path, value) for path, value in values.items()},
                "name": ", ".join(setting_text(path, values[path]) for path in paths),
                "device": len(packed),
                "count": count,
                "velocity": _velocity(changed, law),
                "program": _fraction(balancer, count),
                "lost": lost_times(changed, balancer.model),
            }
        )
        packed += [nominal_device(changed, law, compact), *drawn_devices(balancer, count)]
        # It reads the tables of the design's own law.
        controllers.append(replace(controller_block(law_based, law, compact=compact), tables=None))
    text, lengths = packed_blocks([*(each.block for each in packed), *controllers])
    return {
        "name": scene.name,
        "scene": scene.source,
        "disc": _geometry(scene),
        "ranges": ranges_of(scene, valves),
        "algorithm": scene.controller.kind,
        "valve": None if scene.gas.conductance is None else "the scene's",
        "valves": valves,
        "axes": [usual_name(path) for path in paths],
        "designs": designs,
        "design": _nearest_design(scene, paths, points),
        "devices": [each.facts for each in packed],
        "pressures": [factor * scene.gas.pressure for factor in PRESSURE_FACTORS],
        "numbers": text,
        "lengths": lengths,
        "rules": _rules(unchanged[0]),
        "controllers": {kind: _controller(scene, kind) for kind in ("target_vector", "trial")},
        "places": _places(packed[0].block, controllers[0]),
        "leftOut": [
            each.term for each in unchanged[0].models_used if each.term in _LEFT_OUT and each.modelled
        ],
    }


def _nearest_design(scene: Scene, paths: Sequence[str], points: Sequence[Point]) -> int:
    """Index of the design that is the scene itself, else of the first."""
    own_values = [setting_text(path, raw_value_at(scene, path)) for path in paths]
    texts = [[setting_text(path, each[path]) for path in paths] for each in points]
    return texts.index(own_values) if own_values in texts else 0


def _law(balancer: LiquidRingBalancer) -> CalibratedLaw:
    """Calibrated law of a balancer, which a panel always has."""
    return cast(CalibratedLaw, balancer.model.flow)


def _velocity(scene: Scene, law: CalibratedLaw) -> float:
    """Velocity, m/s, with which the scene's gas drives liquid out of a chamber at equal fills."""
    fill = scene.disc.initial_fill
    flow = law.evaluate(
        fill_ratio=fill, opposite_fill_ratio=fill, gas_pressure=applied_pressure(scene.gas), primed=True
    )
    return float(flow.velocity)


def _fraction(balancer: LiquidRingBalancer, count: int) -> dict[str, Any]:
    """Fraction of devices that settle under the scene's settings, by the program's own runs."""
    draws = Draws.block(FIRST_VERDICT_DEVICE, count)
    judgement = Judgement.of(balancer, {}, balancer.run_all([{}], draws)[0])
    return judgement.fraction_of(judgement.demands[0]).document()


def _geometry(scene: Scene) -> dict[str, Any]:
    """Lengths that the picture of the disc shows, m, and angles, rad."""
    disc, tube = scene.disc, scene.tube
    return {
        "chambers": disc.chambers,
        "inner": disc.inner_radius,
        "outer": disc.outer_radius,
        "angle": disc.central_angle,
        "port": tube.port_radius,
        "crest": tube.hump_radius,
        "bore": tube.bore,
        "speed": scene.rotor.speed,
        "ambient": scene.gas.ambient_pressure,
    }


def _rules(balancer: LiquidRingBalancer) -> dict[str, Any]:
    """Numbers by which a run is judged, as in `LoopPlan`; times in s, amplitudes in m."""
    scene, settings = balancer.scene, balancer.scene.controller
    (demand, *_) = balancer.demands()
    algorithms = {
        kind: controller_of(replace(scene, controller=replace(settings, kind=kind)), balancer.model)
        for kind in _KINDS
    }
    return {
        "period": settings.period,
        "hold": settings.hold_time,
        "watch": WATCH_TIME_S,
        "allowed": ALLOWED * WATCH_TIME_S / settings.period,
        "timeLimit": scene.run.time_limit,
        "idle": IDLE_OPERATIONS + scene.disc.chambers,
        "rises": {kind: each.rises_tolerated for kind, each in algorithms.items()},
        "noiseDeviations": NOISE_DEVIATIONS,
        "roundOff": ROUND_OFF,
        "required": scene.required_amplitude,
        "settlingTime": demand.required,
        "fraction": balancer.required_fraction(),
        "partOfTimeConstant": PART_OF_TIME_CONSTANT,
        "leakPerConductance": REFERENCE_PRESSURE_PA
        * (scene.gas.temperature / REFERENCE_TEMPERATURE_K) ** 0.5,
    }


def _controller(scene: Scene, kind: str) -> dict[str, Any]:
    """Constants and row of an algorithm without a law."""
    block = controller_block(liquid_ring_scene(scene.with_values({"controller.kind": kind})))
    row = {each.name: each.index for each in block.variables}
    return {"constants": block.constants, "start": block.start, "row": row}


def _places(disc_block: Block, law_based_block: Block) -> dict[str, Any]:
    """Indices of constants and of variables in the rows of the blocks."""
    d = int(disc_block.constants[point.BLOCK])
    e = law_based.settings(law_based_block.constants)
    return {
        "disc": {name: d + getattr(disc, name) for name in _DISC},
        "largestFill": point.LARGEST_FILL,
        "row": {each.name: each.index for each in disc_block.variables},
        "pairs": {
            "first": disc.FIRST_PAIR,
            "each": disc.PER_PAIR,
            **{name: getattr(disc, name) for name in ("X", "GAS", "IS_PRIMED", "VALVE", "OPENS", "CLOSES")},
        },
        "target": {name: getattr(target_steps, name) for name in _TARGET},
        "trialLimit": trial_steps.LIMIT,
        "lawBased": {name: e + getattr(law_based, name) for name in _LAW_BASED},
        "lawBasedRow": {each.name: each.index for each in law_based_block.variables},
    }


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
