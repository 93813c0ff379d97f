"""Figures of one run, whichever balancer made it."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from types import MappingProxyType
from typing import Any, Final

from ringbalance.controller.document import simulation_document
from ringbalance.controller.eccentric_mass.run import locked_run
from ringbalance.controller.eccentric_mass.run_record import EccentricRun
from ringbalance.controller.eccentric_mass.scene_records import EccentricScene
from ringbalance.controller.simulation import Simulation
from ringbalance.reports.figures.eccentric import eccentric_figures
from ringbalance.reports.figures.loop import run_amplitude, run_figures
from ringbalance.reports.figures.style import Drawing
from ringbalance.scene.origins import SceneFile


def figures_of(scene: SceneFile, run: Any) -> list[Drawing]:
    """What is drawn of a run of a scene; of a balancer without figures of its own the amplitude over time."""
    drawn = _OWN.get(scene.balancer)
    return [run_amplitude(run.to_dict())] if drawn is None else drawn(scene, run)


def _ring(_: SceneFile, run: Simulation) -> list[Drawing]:
    return run_figures(simulation_document(run))


def _masses(scene: EccentricScene, run: EccentricRun) -> list[Drawing]:
    return eccentric_figures(scene, run.to_dict(), locked_run(scene).to_dict())


_OWN: Final[Mapping[str, Callable[..., list[Drawing]]]] = MappingProxyType(
    {"liquid_ring": _ring, "eccentric_mass": _masses}
)
