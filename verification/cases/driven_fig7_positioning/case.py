"""Two imbalances balanced at constant speed: positioning (Fig. 7), and with fine tuning after it (Fig. 8)."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from ringbalance.controller.eccentric_mass.run import simulate_eccentric
from ringbalance.controller.eccentric_mass.run_record import EccentricRun
from ringbalance.controller.eccentric_mass.scene_records import EccentricScene
from ringbalance.verification.cases.driven_fig9_run_up.case import _amplitude_figure
from ringbalance.verification.eccentric_scenes import at_constant_speed, changed, thinned
from ringbalance.verification.evidence import Curve, Evidence, Level, Series, as_found, figure

_SHOWN = 12.0
"""s."""
_PAPER_PLACES = (45.0, 135.0)
"""Phases of the imbalance in Figs. 7 and 8, deg."""
_PAPER_ERROR = math.radians(10.0)
"""Of the masses' places in Fig. 8, rad."""


def compute(scene: EccentricScene, level: Level, defect: str | None = None) -> Evidence:
    """Amplitudes before, on the way and after."""
    found = BalancingFigure.seven(scene) if defect is None else BalancingFigure.eight(scene, time_limit=30.0)
    ratios = np.divide(found.positioned, found.before)
    arrived = [stage.end for run in found.runs for stage in run.stages if stage.name == "positioning"]
    return Evidence(
        found=as_found(ratio=ratios.max()),
        numbers={
            "before": found.before[0],
            "first": found.positioned[0],
            "second": found.positioned[1],
            "arrived": max(arrived),
        },
        series=(found.amplitudes(until=_SHOWN), _angles(found)),
    )


def _angles(found: BalancingFigure) -> Series:
    run = found.runs[0]
    shown = run.time <= _SHOWN
    angles = zip(("mass 1", "mass 2"), run.mass_angle, strict=True)
    return figure(
        f"angles of the masses, imbalance at {found.phases[0]:.0f} degrees",
        ("time", "s", thinned(run.time[shown])),
        *(Curve(name, "rad", thinned(angle[shown])) for name, angle in angles),
    )


@dataclass(frozen=True, kw_only=True)
class BalancingFigure:
    """Runs for several phases of the imbalance."""

    phases: tuple[float, ...]
    """deg."""
    runs: tuple[EccentricRun, ...]
    before: tuple[float, ...]
    """Steady amplitude before anything is moved, m."""
    positioned: tuple[float, ...]
    """Mean amplitude in the last second of the check, m."""
    after: tuple[float, ...]
    """Mean amplitude in the last second of the run, m."""

    @classmethod
    def seven(cls, scene: EccentricScene, *, time_limit: float = 30.0) -> BalancingFigure:
        """Balance the two imbalances of the paper's Fig. 7 at constant speed."""
        return _balanced(at_constant_speed(scene, time_limit=time_limit))

    @classmethod
    def eight(cls, scene: EccentricScene, *, time_limit: float = 400.0) -> BalancingFigure:
        """The same with masses that stop 10 degrees beside their targets, then trials alone: Fig. 8."""
        level = at_constant_speed(scene, time_limit=time_limit)
        error = (_PAPER_ERROR, _PAPER_ERROR)
        return _balanced(changed(level, "supervisor", target_error=error, correction="trials"))

    def amplitudes(self, *, until: float = math.inf) -> Series:
        """Amplitude over time of every run."""
        names = [f"imbalance at {phase:.0f} degrees" for phase in self.phases]
        return _amplitude_figure("amplitude", dict(zip(names, self.runs, strict=True)), until=until)


def _balanced(scene: EccentricScene) -> BalancingFigure:
    turned = [changed(scene, "imbalance", phase=math.radians(phase)) for phase in _PAPER_PLACES]
    runs = tuple(simulate_eccentric(one) for one in turned)
    return BalancingFigure(
        phases=_PAPER_PLACES,
        runs=runs,
        before=tuple(run.unbalanced_amplitude for run in runs),
        positioned=tuple(_in_check(run) for run in runs),
        after=tuple(run.final_amplitude for run in runs),
    )


def _in_check(run: EccentricRun) -> float:
    """Mean amplitude over the last second of the check; infinite without one."""
    ends = [stage.end for stage in run.stages if stage.name == "check"]
    if not ends:
        return math.inf
    during = (run.time > ends[0] - 1.0) & (run.time <= ends[0])
    return float(np.mean(run.amplitude[during]))
