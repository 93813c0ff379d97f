"""Answers of the public functions for scenes that run for a few seconds, each made once in a process."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from typing import Any, Final

import ringbalance as rb
from ringbalance.controller.eccentric_mass.scene_records import eccentric_scene
from ringbalance.scene.narrowing import liquid_ring_scene

MEASUREMENTS: Final = rb.bundled_scene("liquid_ring_paper").parent / "measurements"


@cache
def short() -> rb.Scene:
    """The paper's scene, for six seconds."""
    scene = rb.load_scene(rb.bundled_scene("liquid_ring_paper"))
    return liquid_ring_scene(scene).with_values({"run.time_limit": "6 s"})


@cache
def driven() -> rb.EccentricScene:
    """Two eccentric masses, until shortly after the start."""
    scene = eccentric_scene(rb.load_scene(rb.bundled_scene("driven_masses_small")))
    return scene.with_values({"run.time_limit": 2.0})


@cache
def answer(name: str) -> Any:
    """Answer of a function; for the ring under the paper's law where it takes a law."""
    law = rb.paper_law(short())
    functions: dict[str, Callable[[], Any]] = {
        "scene": short,
        "eccentric scene": driven,
        "calibration": lambda: rb.calibrate(short()),
        "law": lambda: rb.calibrate(short()).flow_law,
        "paper's law": lambda: law,
        "run": lambda: rb.simulate(short(), flow_law=law),
        "eccentric run": lambda: rb.simulate(driven()),
        "tuning": lambda: rb.tune(short(), flow_law=law),
        "fit": lambda: rb.fit(short(), MEASUREMENTS / "trial_weight.csv"),
        "comparison": lambda: rb.compare(short(), short()),
    }
    return functions[name]()
