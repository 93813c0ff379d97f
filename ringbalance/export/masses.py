"""The controller of two eccentric masses, and the rotor with its masses, as blocks that a host can run."""

from __future__ import annotations

import ast
import inspect
import math
import re
from collections.abc import Iterator, Mapping
from typing import Any, Final, Literal, NamedTuple

import numpy as np

from ringbalance.controller.eccentric_mass import friction_filter, imbalance_filter, memory
from ringbalance.controller.eccentric_mass.memory import MEMORY, EccentricMeasurement
from ringbalance.controller.eccentric_mass.plant import (
    LOCKED,
    ROW_SIZE,
    STUCK,
    VOLTAGE,
    plant_row,
    plant_step,
    speed_at,
)
from ringbalance.controller.eccentric_mass.run import SENSOR_NOISES, Machine, measure
from ringbalance.controller.eccentric_mass.scene_records import EccentricScene
from ringbalance.controller.eccentric_mass.settings import StrategySettings
from ringbalance.controller.eccentric_mass.step import begin_strategy, strategy_step
from ringbalance.export.blocks import Block, declared, variables_of
from ringbalance.export.flatten import COMPLEX, Flattening, Layout, numbers_of, parts_of
from ringbalance.scene.arrays import Record
from ringbalance.scene.faults import Fault, SceneError
from ringbalance.scene.platform.compiled import in_place

_INSTANT_S: Final = 1e-9
_MEASURED: Final = [
    *((name, np.float64) for name in ("speed", "speed_rate", "rotor_angle")),
    *((name, np.complex128) for name in ("position", "velocity")),
    *((name, np.float64, (2,)) for name in ("angle", "rate")),
]
"""Fields of `EccentricMeasurement` without its time."""
CONTROLLER: Final = np.dtype([("memory", MEMORY), ("wait", np.float64), *_MEASURED])
"""Row of the controller; `wait` is the time to the next sample, s."""
PLANT: Final = np.dtype(
    [
        *_MEASURED,
        *((name, np.float64) for name in ("energy", "time", "since", "step", "steps")),
        ("voltage", np.float64, (2,)),
        ("row", np.float64, (ROW_SIZE,)),
    ]
)
"""Row of the plant; its time, s, is that of the last change of the step and a whole number of steps."""
_NO_NOISE: Final = (0.0,) * SENSOR_NOISES


class PlantSettings(NamedTuple):
    """Rotor, masses, drives and sensors of a scene."""

    machine: Machine
    laboratory: bool
    """True if the vibration is measured in the fixed frame."""


@in_place
def run_plant(settings: PlantSettings, host: Record, time: float) -> None:
    """Let a time pass, s, with the voltages as they are, and show what exact sensors would."""
    machine, row = settings.machine, host.row
    if time > 0.0:
        row[VOLTAGE], row[VOLTAGE + 1] = host.voltage[0], host.voltage[1]
        speed, speed_rate = speed_at(machine.times, machine.speeds, host.time)
        host.energy = host.energy + plant_step(machine.plant, row, speed, speed_rate, time)
        if time != host.step:
            host.since, host.step, host.steps = host.time, time, 0.0
        host.steps = host.steps + 1.0
        host.time = host.since + host.steps * time
    shown = measure(machine, settings.laboratory, row, host.time, _NO_NOISE)
    host.speed, host.speed_rate, host.rotor_angle = shown.speed, shown.speed_rate, shown.rotor_angle
    host.position, host.velocity = shown.position, shown.velocity
    for i in range(2):
        host.angle[i], host.rate[i] = shown.angle[i], shown.rate[i]


@in_place
def control(settings: StrategySettings, host: Record, time: float) -> None:
    """Let a time pass, s, and take a sample if it is due."""
    host.wait = host.wait - time
    if host.wait > _INSTANT_S:
        return
    host.wait = max(host.wait + settings.step, 0.0)
    memory, angle, rate = host.memory, (host.angle[0], host.angle[1]), (host.rate[0], host.rate[1])
    measurement = EccentricMeasurement(
        memory.sample * settings.step,
        host.speed,
        host.speed_rate,
        host.rotor_angle,
        host.position,
        host.velocity,
        angle,
        rate,
    )
    if memory.sample == 0:
        # Masses whose angles are not known yet cannot be kept where they are.
        if not math.isfinite(angle[0] + angle[1] + rate[0] + rate[1]):
            return
        begin_strategy(settings, memory, measurement)
    strategy_step(settings, memory, measurement)


def strategy_block(scene: EccentricScene) -> Block:
    """The strategy with the scene's settings.

    Raises: SceneError: masses that are locked, or no constant speed at which an imbalance can be estimated.
    """
    if scene.supervisor.strategy == "locked":
        fault = {"key": "strategy", "value": '"locked"', "problem": "locked masses have no controller"}
        raise SceneError([Fault(file=scene.file, table="supervisor", **fault, allowed='"balance"')])
    lowest = scene.supervisor.lowest_speed
    if not np.any(np.abs(scene.rotor.plateaus) >= lowest):
        problem = "rotor.speed_profile keeps no speed at which the strategy estimates the imbalance"
        raise SceneError.of_file(scene.file, problem, f"a constant speed of at least {lowest:.4g} rad/s")
    facts = f"Takes a sample of all inputs every {scene.sensor.step:g} s, the first at once."
    row = np.zeros(1, dtype=CONTROLLER)[0]
    return _block(
        scene, "strategy", "Controller of two eccentric masses", facts, StrategySettings.of(scene), row
    )


def plant_block(scene: EccentricScene) -> Block:
    """Rotor, masses and drives of the scene in time, from a rotor at its centre and masses at rest."""
    locked = scene.supervisor.strategy == "locked"
    row = np.zeros(1, dtype=PLANT)[0]
    row["row"] = plant_row(scene.masses.initial_angle, LOCKED if locked else STUCK)
    settings = PlantSettings(machine=Machine.of(scene), laboratory=scene.sensor.frame == "laboratory")
    run_plant(settings, row, 0.0)
    facts = (
        "Rotor at its centre and masses at rest at the start; what it shows is without the sensors' noise."
    )
    return _block(scene, "plant", "Rotor with two eccentric masses and their drives", facts, settings, row)


def _block(
    scene: EccentricScene, kind: Literal["strategy", "plant"], title: str, facts: str, settings: Any, row: Any
) -> Block:
    entry = control if kind == "strategy" else run_plant
    flat, layout = Flattening.of(entry, settings, row), Layout.of(row)
    start = numbers_of(row)

    def index_of(path: str, part: int | None) -> int:
        return layout.index(path.replace("#", str(part)))

    texts = {}
    for each in (*declared()["measured"], *declared()[kind]):
        text = each["description"].replace("#", " and ".join(each.get("letters", "")))
        unit = each["range"].get("unit")
        texts[each["place"].removesuffix(".#")] = f"{text}, {unit}" if unit else text
    legend = [f"c{line}" for line in _places(settings, texts)] + [f"w{line}" for line in _places(row, texts)]
    measured = variables_of("measured", index_of, inputs=kind == "strategy")
    others = variables_of(kind, index_of)
    # Of one type inputs come first.
    variables = sorted((*measured, *others), key=lambda each: (each.kind != "Real", not each.input))
    return Block(
        kind=kind,
        title=title,
        scene=scene.file,
        facts=f"{facts}\n   Vibration along the axes of the {scene.sensor.frame}.",
        constants=(*numbers_of(settings), *flat.tables),
        start=(*start, *(0.0,) * (flat.row - len(start))),
        steps=entry.__name__,
        variables=tuple(variables),
        period=scene.sensor.step,
        flat=flat.source,
        legend=("Indices, SI; a matrix row by row, a complex number by its two parts.", *legend),
    )


def _places(
    value: Any, texts: Mapping[str, str], path: str = "", at: int = 0, text: str = ""
) -> Iterator[str]:
    """Indices, path and meaning of each number or array in a row. Args: `texts`: meanings by path."""
    names, parts = parts_of(value) if Layout.of(value).parts else ((), [])
    if names in ((), COMPLEX) and not any(isinstance(each, tuple | np.void) for each in parts):
        end, text = at + Layout.of(value).size - 1, texts.get(path, text)
        yield f"[{at}{f'..{end}' * (end > at)}] {path}{f': {text}' * bool(text)}"
        return
    of_fields = _texts_of(value) if names else {}
    for name, part in zip(names or map(str, range(len(parts))), parts, strict=True):
        yield from _places(part, texts, f"{path}.{name}".lstrip("."), at, of_fields.get(name, ""))
        at += Layout.of(part).size


def _texts_of(record: Any) -> dict[str, str]:
    """Meanings of fields: docstrings in a named tuple, comments in the type of an array's element."""
    if not isinstance(record, np.void):
        field = re.compile(r'^    (\w+): [^\n]*\n    """(.*?)\.?(?:"""|\n\n)', re.MULTILINE | re.DOTALL)
        texts = field.findall(inspect.getsource(type(record)))
        return {name: " ".join(text.split()) for name, text in texts}
    for module in (memory, friction_filter, imbalance_filter):
        source, first = inspect.getsource(module), 0
        for node in ast.parse(source).body:
            match node:
                case ast.AnnAssign(target=ast.Name(id=name)) if isinstance(vars(module)[name], np.dtype):
                    lines = source.split("\n")[first : node.end_lineno]
                    if vars(module)[name] == record.dtype:
                        return dict(re.findall(r'"(\w+)".*?# (.*)', "\n".join(lines)))
                    first = node.end_lineno or 0
    return {}


BLOCKS: Final = {"controller": strategy_block, "plant": plant_block}
"""Makers of the blocks of a scene, by name."""
