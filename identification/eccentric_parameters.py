"""What can be fitted of a scene with eccentric masses: every quantity that may be uncertain, by its path."""

from __future__ import annotations

import math
from functools import partial
from typing import Final

from ringbalance.identification.parameters import FitError, Parameter, unknown_name
from ringbalance.scene.eccentric_models import EccentricScene
from ringbalance.scene.keys.eccentric_schema import ECCENTRIC_MASS
from ringbalance.scene.uncertain import NORMAL_95, eccentric_value, eccentric_with

_REACH: Final = 30.0
"""Factor up to which a value is looked for."""


def fitted_names(scene: EccentricScene) -> tuple[str, ...]:
    """All that can be fitted."""
    found: list[str] = []
    for table, content in ECCENTRIC_MASS.tables.items():
        for key in (name for name, declared in content.keys.items() if declared.uncertain):
            value = getattr(getattr(scene, table), key)
            found += (
                [f"{table}.{key}[{i}]" for i in (0, 1)] if isinstance(value, tuple) else [f"{table}.{key}"]
            )
    return tuple(found)


def eccentric_parameter(scene: EccentricScene, name: str) -> Parameter:
    """A quantity by its path, such as "rotor.damping"; a list's entries by "masses.friction_arm[0]".

    Raises: FitError: no such quantity, or a value that is zero.
    """
    if name not in fitted_names(scene):
        raise unknown_name(name, fitted_names(scene))
    start, is_angle = eccentric_value(scene, name), name == "imbalance.phase"
    if start <= 0 and not is_angle:
        raise FitError(f"{name} is zero: give a value above zero to fit it")
    width = eccentric_widths(scene).get(name)
    low, high = (start - math.pi, start + math.pi) if is_angle else (start / _REACH, start * _REACH)
    return Parameter(
        name=name,
        symbol=name,
        start=start,
        lowest=low,
        highest=high,
        prior=width / NORMAL_95 if width else None,
        scale=1.0 if is_angle else None,
        change=partial(eccentric_with, name=name),
    )


def eccentric_widths(scene: EccentricScene) -> dict[str, float]:
    """Expanded uncertainties (95 %) that the scene states, SI."""
    stated = {each.quantity: each for each in scene.uncertainty}
    widths = {
        name: stated[path].absolute(eccentric_value(scene, name))
        for name in fitted_names(scene)
        if (path := name.split("[")[0]) in stated
    }
    return {name: width for name, width in widths.items() if width > 0}


def eccentric_shifted(scene: EccentricScene, name: str, change: float) -> EccentricScene:
    """The scene with one value changed, as far as a machine can have it."""
    value = eccentric_value(scene, name)
    moved = value + change if name == "imbalance.phase" else max(value + change, 0.1 * value)
    return eccentric_with(scene, moved, name=name)
