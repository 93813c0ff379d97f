"""Other laws of the tube's flow and of eccentric masses, which data are asked to tell from the fitted one."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from types import MappingProxyType
from typing import Final

import numpy as np

from ringbalance.reduced_model.law.calibrated_law import CalibratedLaw
from ringbalance.reduced_model.tables.fit import table_from_samples
from ringbalance.reduced_model.tables.hermite import HermiteTable
from ringbalance.scene.arrays import FloatArray

LAMINAR: Final = "laminar flow (a loss in proportion to the velocity)"
TURBULENT: Final = "turbulent flow (a loss in proportion to its square)"
UNBROKEN: Final = "a column that never separates over the crest"
BROKEN: Final = "a column that separates at ambient pressure"
UNSPILT: Final = "a column that runs full without spilling first"
EXPONENTS: Final[Mapping[str, float]] = MappingProxyType({LAMINAR: 1.0, TURBULENT: 2.0})
"""Of the loss over the velocity, of those of these laws that are powers."""
_OF_THE_CREST: Final = (UNBROKEN, BROKEN, UNSPILT)

WITHOUT: Final[Mapping[str, tuple[str, tuple[str, ...]]]] = MappingProxyType(
    {
        "a rotor without damping": ("run_up", ("rotor.damping",)),
        "masses without friction": ("positioning", ("masses.friction_arm[0]", "masses.friction_arm[1]")),
        "a motor without back EMF": ("positioning", ("motor.back_emf_constant",)),
    }
)
"""Of eccentric masses: the kind of data that an effect moves, and the values that are zero without it."""


def power_of(law: CalibratedLaw, velocity: float, exponent: float) -> CalibratedLaw:
    """Heads in proportion to a power of the velocity, those of the law at one velocity, m/s."""
    heads = law.heads
    near, far = heads.hump_head, heads.return_hump_head
    return replace(
        law,
        heads=replace(
            heads,
            head=_straight(heads.head, velocity, exponent),
            hump_head=None if near is None else _straight(near, velocity, exponent),
            return_hump_head=None if far is None else _straight(far, velocity, exponent),
        ),
    )


def _straight(table: HermiteTable, velocity: float, exponent: float) -> HermiteTable:
    nodes: FloatArray = table.nodes
    at = float(np.clip(np.log(velocity), nodes[0], nodes[-1]))
    value = table(at) + exponent * (nodes - at)
    return table_from_samples(start=float(nodes[0]), stop=float(nodes[-1]), value=value)


def other_law(law: CalibratedLaw, *, name: str, velocity: float) -> CalibratedLaw:
    """The other law of a name, from the fitted one; a power has the same loss at a velocity, m/s."""
    if name in EXPONENTS:
        return power_of(law, velocity, EXPONENTS[name])
    if name == UNBROKEN:
        heads = replace(law.heads, hump_head=None, return_hump_head=None)
        return replace(law, path=replace(law.path, hump_pressure=None), heads=heads)
    if name == BROKEN:
        return replace(law, path=replace(law.path, vapour_pressure=0.0, released=0.0))
    if name == UNSPILT:
        return replace(law, path=replace(law.path, froude_velocity=0.0))
    raise ValueError(f"{name!r} is no other law")


def laws_to_compare(law: CalibratedLaw) -> tuple[str, ...]:
    """Names of those that mean something for a law: a tube without crest has no column to break."""
    return (*EXPONENTS, *(() if law.path.hump_pressure is None else _OF_THE_CREST))
