"""What other laws predict for the same data: other machines, laminar or turbulent tubes, no siphon crest."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import replace
from functools import partial
from types import MappingProxyType
from typing import Any, Final

import numpy as np

from ringbalance.controller.eccentric_mass.scene_records import EccentricScene
from ringbalance.identification.device import Device
from ringbalance.identification.likelihood import Problem
from ringbalance.reduced_model.law.calibrated_law import CalibratedLaw
from ringbalance.scene.arrays import FloatArray
from ringbalance.scene.models import Scene
from ringbalance.scene.origins import with_values_at

_BY_LAW: Final = ("injection", "transfer", "flow")
"""Kinds that the law of the tube's flow decides on."""
LAMINAR: Final = "laminar flow (a loss in proportion to the velocity)"
TURBULENT: Final = "turbulent flow (a loss in proportion to its square)"
UNBROKEN: Final = "a column that never separates over the crest"
BROKEN: Final = "a column that separates at ambient pressure"
_UNSPILT: Final = "a column that runs full without spilling first"
_EXPONENTS: Final[Mapping[str, float]] = MappingProxyType({LAMINAR: 1.0, TURBULENT: 2.0})
"""Of the loss over the velocity, of those of these laws that are powers."""
_PATHS: Final[Mapping[str, Mapping[str, Any]]] = MappingProxyType(
    {
        UNBROKEN: {"hump_pressure": None},
        BROKEN: {"vapour_pressure": 0.0, "released": 0.0},
        _UNSPILT: {"froude_velocity": 0.0},
    }
)
"""Values of the path that make the others, which mean something for a tube with a crest alone."""

_WITHOUT: Final[Mapping[str, tuple[str, tuple[str, ...]]]] = MappingProxyType(
    {
        "a rotor without damping": ("run_up", ("rotor.damping",)),
        "masses without friction": ("positioning", ("masses.friction_arm[0]", "masses.friction_arm[1]")),
        "a motor without back EMF": ("positioning", ("motor.back_emf_constant",)),
    }
)
"""Of eccentric masses: the kind of data that an effect moves, and the values that are zero without it."""


def by_other_machines(problem: Problem, scene: EccentricScene) -> Iterator[tuple[str, FloatArray]]:
    """Without one of the effects that move the data, unless its size is fitted: then its interval tells."""
    fitted = {parameter.name for parameter in problem.parameters}
    kinds = {block.observations.kind for block in problem.blocks}
    for name, (kind, paths) in _WITHOUT.items():
        if kind in kinds and not fitted & set(paths):
            yield name, problem.predicted(with_values_at(scene, dict.fromkeys(paths, 0.0)))


def by_other_tubes(problem: Problem, scene: Scene) -> Iterator[tuple[str, FloatArray]]:
    """By other laws of the tube's flow, where data depend on it."""
    blocks = [b for b in problem.blocks if b.observations.kind in _BY_LAW]
    if not blocks:
        return
    law, x = Device.of(scene, problem.models).law, scene.disc.initial_fill
    pressures = [b.observations.columns["pressure"] for b in blocks if "pressure" in b.observations.columns]
    pressure = float(np.median(np.concatenate(pressures))) if pressures else scene.gas.pressure
    flow = law.evaluate(fill_ratio=x, opposite_fill_ratio=x, gas_pressure=pressure, primed=True)
    velocity = abs(float(flow.velocity)) or 1.0
    for name in (*_EXPONENTS, *(() if law.path.hump_pressure is None else _PATHS)):
        models = replace(problem.models, other=partial(_other_law, name=name, velocity=velocity))
        predicted = []
        for block in problem.blocks:
            values, exponent = block.predicted(scene, models), _EXPONENTS.get(name)
            if block.observations.kind == "flow" and exponent is not None:
                # At rest a power of the pressure through its middle value.
                drop = block.observations.columns["pressure_difference"]
                middle = int(np.argsort(drop)[drop.size // 2])
                values = values[middle] * (drop / drop[middle]) ** (1 / exponent)
            predicted.append(block.whiten @ values)
        yield name, np.concatenate(predicted)


def _other_law(law: CalibratedLaw, *, name: str, velocity: float) -> CalibratedLaw:
    """The other law of a name, from the fitted one; a power has the same loss at a velocity, m/s."""
    if name in _EXPONENTS:
        return replace(law, heads=law.heads.power(velocity=velocity, exponent=_EXPONENTS[name]))
    return replace(law, path=replace(law.path, **_PATHS[name]))
