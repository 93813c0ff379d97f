"""Defaults that follow from other values of the scene."""

from __future__ import annotations

import math
from collections.abc import Mapping
from pathlib import PurePath

from ringbalance.scene.keys.reading import Reading
from ringbalance.scene.keys.schema import LIQUID_RING
from ringbalance.scene.path import shortest_path


def completed(reading: Reading) -> Reading:
    """Fill in the defaults that follow from other values, as far as those are known.

    A rule finds what it needs, because a key is declared after those that it follows from.
    """
    if reading.lacks("name"):
        reading = reading.adding({"name": PurePath(reading.file).stem or "scene"})
    for name, table in reading.schema.tables.items():
        for key, declared in table.keys.items():
            path, rule, needs = f"{name}.{key}", declared.presence.rule, declared.presence.needs
            if rule is not None and reading.lacks(path) and reading.known(*needs):
                result = rule(*(reading.values[need] for need in needs))
                reading = reading.adding({} if result is None else {path: result})
    return reading.adding(_shortest_length(reading)) if reading.schema is LIQUID_RING else reading


def _shortest_length(reading: Reading) -> Mapping[str, float]:
    """With a given k the length matters for the liquid's inertia only: that of the shortest tube is used."""
    hump_settled = reading.known("tube.hump_radius") or reading.lacks("tube.hump_radius")
    settled = reading.known("tube.drag_coefficient", "tube.port_radius") and hump_settled
    if not settled or not reading.lacks("tube.length"):
        return {}
    port_radius, hump_radius = reading.values["tube.port_radius"], reading.values.get("tube.hump_radius")
    if hump_radius is not None and hump_radius >= port_radius:
        return {}
    length = shortest_path(port_radius=port_radius, hump_radius=hump_radius, separation=math.pi)
    return {"tube.length": length}
