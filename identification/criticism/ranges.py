"""Columns of files whose values lie far from what the scene has: mostly a unit, or another machine."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Final

import numpy as np

from ringbalance.identification.data.kinds import KINDS, Column, kinds_of
from ringbalance.identification.likelihood import Problem
from ringbalance.mesh.geometry import chamber_volume
from ringbalance.scene.models import Scene
from ringbalance.scene.units import format_quantity

FAR: Final = 5.0
"""Ratio of a column's median to the nearer end of the scene's range: below the ten of the smallest mistake of
a unit, and beyond what a test rig changes."""
_RANGED: Final = kinds_of("liquid_ring")
_FAR_VIBRATION: Final = 100.0
"""The same of vibrations, which the scene seldom knows better."""


@dataclass(frozen=True, kw_only=True)
class ComparedColumn:
    """One column of one file."""

    file: str
    column: str
    unit: str
    """Of the template; empty for a number without one."""
    ratio: float
    """Median of the column over the nearer end of the scene's range; one within it."""
    fails: bool
    """Whether it lies so far off that a unit is wrong, or the machine another one."""
    text: str


def compared_columns(problem: Problem) -> tuple[ComparedColumn, ...]:
    """Columns against what the scene has; kinds of eccentric masses have no such ranges yet."""
    return tuple(_compared(problem))


def _compared(problem: Problem) -> Iterator[ComparedColumn]:
    for block in problem.blocks:
        observations = block.observations
        ranges = _ranges(problem.scene, observations.kind) if observations.kind in _RANGED else {}
        for column in KINDS[observations.kind].columns:
            values, known = observations.columns.get(column.name), ranges.get(column.name)
            if values is None or known is None or not np.any(values):
                continue
            low, high = known
            middle = float(np.median(np.abs(values[values != 0])))
            ratio = middle / high if middle > high else middle / low if middle < low else 1.0
            limit = _FAR_VIBRATION if column.amplitude else FAR
            yield ComparedColumn(
                file=observations.file,
                column=column.name,
                unit=column.unit,
                ratio=ratio,
                fails=not 1 / limit <= ratio <= limit,
                text=_text(observations.file, column, middle, ratio),
            )


def _text(file: str, column: Column, middle: float, ratio: float) -> str:
    here = f"{column.head} in {Path(file).name} is {_shown(column, middle)} in the middle of its values"
    if ratio == 1.0:
        return f"{here}, as the scene has it"
    return f"{here}, {ratio:.2g} times the {_shown(column, middle / ratio)} of the scene"


def _shown(column: Column, value: float) -> str:
    return format_quantity(value, column.dimension or "", column.unit, digits=3)


def _ranges(scene: Scene, kind: str) -> Mapping[str, tuple[float, float]]:
    """What the scene has of each column, SI; from zero where only an upper end means anything."""
    gas, rotor, disc = scene.gas.pressure, scene.rotor, scene.disc
    fastest = math.sqrt(2 * gas / scene.liquid.density)
    volume = chamber_volume(disc=disc)
    vibration = (scene.controller.limit, max(rotor.initial_amplitude, scene.controller.limit))
    shared = {
        "amplitude": vibration,
        "amplitude_before": vibration,
        "amplitude_after": vibration,
        "unbalance": tuple(v / rotor.influence_coefficient for v in vibration),
        "gas_time": (scene.controller.minimum_gas_time, scene.controller.maximum_gas_time),
        "mass": (0.0, scene.liquid.density * volume),
        "volume": (0.0, volume),
        "flow_rate": (0.0, scene.tube.area * fastest),
        "pressure_difference": (gas * 1e-3, gas),
        "radius": (0.0, disc.outer_radius),
        "surface_radius": (disc.inner_radius, disc.outer_radius),
        "speed": (rotor.speed, rotor.speed),
        "pressure": (gas, gas),
    }
    if kind == "pressure":
        rim = scene.liquid.density * (rotor.speed * disc.outer_radius) ** 2 / 2
        return shared | {"pressure": (0.0, rim)}  # type: ignore[return-value]
    return shared  # type: ignore[return-value]
