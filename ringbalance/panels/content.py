"""Content of a panel: numbers and texts of one scene, for the modules of the page."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any, Final, cast

from ringbalance.controller.algorithms import target_steps, trial_steps
from ringbalance.controller.algorithms.law_based import controller_of
from ringbalance.controller.balancer import WATCH_TIME_S, Draws
from ringbalance.controller.judging.judge import FIRST_VERDICT_DEVICE, Judgement
from ringbalance.controller.liquid_ring.balancer import LiquidRingBalancer
from ringbalance.controller.loop_plan import ALLOWED, IDLE_OPERATIONS
from ringbalance.controller.simulation import NOISE_DEVIATIONS, ROUND_OFF
from ringbalance.design.axes import Point
from ringbalance.export import disc, law_based
from ringbalance.export.blocks import PART_OF_TIME_CONSTANT, Block, controller_block
from ringbalance.export.compact import compact_law
from ringbalance.panels.devices import (
    PRESSURE_FACTORS,
    PackedDevice,
    drawn_devices,
    lost_times,
    nominal_device,
    packed_blocks,
)
from ringbalance.panels.settings import design_points, ranges_of, valves_of_panel
from ringbalance.physics.gas import REFERENCE_PRESSURE_PA, REFERENCE_TEMPERATURE_K, applied_pressure
from ringbalance.reduced_model.law.calibrated_law import CalibratedLaw
from ringbalance.reduced_model.pieces import point
from ringbalance.reduced_model.terms import HELD, INERTIA
from ringbalance.scene.describe import setting_text, usual_name
from ringbalance.scene.loop_models import ControllerKind
from ringbalance.scene.models import Scene
from ringbalance.scene.narrowing import liquid_ring_scene
from ringbalance.scene.origins import raw_value_at

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
