"""The page of two eccentric masses: exported strategy and plant, what a reader can change, drawn devices."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any, Final

import numpy as np

from ringbalance.controller.balancer import AS_GIVEN, Draws
from ringbalance.controller.eccentric_mass.balancer import EccentricMassBalancer
from ringbalance.controller.eccentric_mass.devices import device
from ringbalance.controller.eccentric_mass.memory import CAUSE_NAMES, STAGE_NAMES
from ringbalance.controller.eccentric_mass.plant import ANGLE, FLAG, TURN, PlantParameters
from ringbalance.controller.eccentric_mass.run import Machine
from ringbalance.controller.eccentric_mass.scene_records import EccentricScene
from ringbalance.controller.eccentric_mass.settings import StrategySettings
from ringbalance.controller.judging.judge import FIRST_VERDICT_DEVICE
from ringbalance.export.flatten import Layout, numbers_of
from ringbalance.export.hosts import js_files
from ringbalance.export.masses import PLANT, plant_block, strategy_block
from ringbalance.panels.document import MASS_MODULES, document_of
from ringbalance.scene.origins import value_at

DEVICES: Final = 16
"""Number of drawn devices that can be watched."""
_REACH: Final = 5.0
"""Factor up to which a positive setting is tried, to either side of the scene's where zero is none."""
_FURTHEST_IMBALANCE: Final = 2.5
"""Largest imbalance over the scene's, or over what both masses cancel."""
_ARM_FRACTION: Final = 0.05
"""Upper end of a friction arm where the scene has none, over the radius of the track."""
_KEYS: Final = {
    "limit": "supervisor.limit",
    "wait": "fine_tuning.wait",
    "drive_speed": "friction_filter.drive_speed",
}
"""Keys of a scene that change the strategy's constants in proportion alone, not its matrices F and Q."""
_PLACES: Final = {
    "imbalance": "plant.unbalance",
    "phase": "plant.phase",
    "arm_1": "plant.friction_arm.0",
    "arm_2": "plant.friction_arm.1",
}


def masses_document(
    scene: EccentricScene, *, devices: int = DEVICES, progress: Callable[[str], None] = lambda _: None
) -> str:
    """HTML document of the page. Args: as of `masses_content`.

    Raises: SceneError: a scene whose strategy cannot be exported.
    """
    progress("strategy ...")
    blocks = mass_blocks(scene)
    content = masses_content(scene, devices=devices, progress=progress)
    return document_of(content, page="masses.html", modules=MASS_MODULES, own_modules={"mass_blocks": blocks})


def mass_blocks(scene: EccentricScene) -> str:
    """Module of the exported blocks, as `export` writes them in JavaScript."""
    parts = []
    for block in (strategy_block(scene), plant_block(scene)):
        text = js_files(block, block.kind)[f"{block.kind}.mjs"]
        text = text.replace("export {", "return {")
        parts.append(f"export const {block.kind} = (() => {{\n{text}}})();\n")
    return "".join(parts)


def masses_content(
    scene: EccentricScene, *, devices: int = DEVICES, progress: Callable[[str], None] = lambda _: None
) -> dict[str, Any]:
    """Numbers and texts of the page, for JSON.

    Args: `devices`: number of drawn devices, the first of those that `tune` judges. `progress`: called with a
        text.
    """
    balancer, packed = EccentricMassBalancer(scene), []
    for number in range(-1, devices):
        progress(f"device {number + 1} of {devices} ...")
        first = FIRST_VERDICT_DEVICE + number
        outcomes = balancer.run({}, AS_GIVEN if number < 0 else Draws.block(first, 1))
        settled = float(outcomes.settling_time[0])
        packed.append(
            {
                **_constants(scene if number < 0 else device(scene, first).scene),
                "settled": settled if math.isfinite(settled) else None,
            }
        )
    row = Layout.of(np.zeros(1, dtype=PLANT)[0])
    return {
        "name": scene.name,
        "step": scene.sensor.step,
        "samples": scene.samples,
        "start": scene.supervisor.start,
        "controls": _controls(scene),
        "stages": STAGE_NAMES,
        "causes": CAUSE_NAMES,
        "devices": packed,
        "places": {
            "row": row.index("row.0"),
            "flags": row.index(f"row.{FLAG}"),
            "angles": row.index(f"row.{ANGLE}"),
            "rates": row.index(f"row.{TURN}"),
        },
    }


def _constants(plant: EccentricScene) -> dict[str, Any]:
    """Numbers of a device: first constants of its plant, angles at the start, noise of its sensors."""
    sensor, parameters = plant.sensor, PlantParameters.of(plant)
    noise = sensor.position_noise, sensor.velocity_noise, sensor.encoder_noise, sensor.encoder_rate_noise
    return {
        "constants": numbers_of(Machine.of(plant)),
        "angles": plant.masses.initial_angle,
        "noise": noise,
        "moment": parameters.moment,
        "drive": [parameters.drive_gain, parameters.drive_damping],
    }


def _controls(scene: EccentricScene) -> dict[str, dict[str, Any]]:
    """Range and scene's value of every control, SI, with the constants that it sets in proportion."""
    plant, sensor = PlantParameters.of(scene), scene.sensor
    arms, longest = scene.masses.friction_arm, _ARM_FRACTION * scene.masses.guide_radius
    turn = 2 * math.pi
    ranges: dict[str, tuple[float, float, float]] = {
        "imbalance": (0.0, _FURTHEST_IMBALANCE * max(plant.unbalance, plant.moment), plant.unbalance),
        "phase": (0.0, turn, plant.phase % turn),
        **{f"arm_{i}": (0.0, _REACH * arm or longest, arm) for i, arm in enumerate(arms, start=1)},
        "noise": (0.0, 2 * _REACH, 1.0),
    }
    if not any(
        (sensor.position_noise, sensor.velocity_noise, sensor.encoder_noise, sensor.encoder_rate_noise)
    ):
        del ranges["noise"]
    for name, key in _KEYS.items():
        value = value_at(scene, key)
        ranges[name] = (0.0 if name == "wait" else value / _REACH, _REACH * value or 1.0, value)
    machine, before = Layout.of(Machine.of(scene)), numbers_of(StrategySettings.of(scene))
    controls: dict[str, dict[str, Any]] = {
        name: {"range": each, "places": [], "of": "plant"} for name, each in ranges.items()
    }
    for name, path in _PLACES.items():
        controls[name]["places"] = [machine.index(path)]
    for name, key in _KEYS.items():
        # A page keeps the averaging time, which the program derives from the limit.
        changes = {"fine_tuning.average": scene.fine_tuning.average, key: 2.0 * ranges[name][2] or 1.0}
        after = numbers_of(StrategySettings.of(scene.with_values(changes)))
        places = [i for i, (a, b) in enumerate(zip(before, after, strict=True)) if a != b]
        controls[name] |= {"places": places, "of": "strategy"}
    return controls
