"""ringbalance: are the closed formulas of a liquid-ring balancer to be trusted, for your disc?

The names below are loaded when they are first used, so that `import ringbalance` costs nothing.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from ringbalance.face import compare as compare
    from ringbalance.face import simulate as simulate
    from ringbalance.face import tune as tune
    from ringbalance.reduced_model.calibration import calibrate as calibrate
    from ringbalance.reduced_model.law.loading import load_law as load_law
    from ringbalance.reduced_model.law.paper_law import paper_law as paper_law
    from ringbalance.reports.report import write_report as write_report
    from ringbalance.scene import SceneError as SceneError
    from ringbalance.scene import bundled_scene as bundled_scene
    from ringbalance.scene import load_scene as load_scene
    from ringbalance.verification.runner import run_cases as run_cases

__version__ = "0.1.0"

_HOME = {
    "SceneError": "ringbalance.scene",
    "bundled_scene": "ringbalance.scene",
    "calibrate": "ringbalance.reduced_model.calibration",
    "compare": "ringbalance.face",
    "load_law": "ringbalance.reduced_model.law.loading",
    "load_scene": "ringbalance.scene",
    "paper_law": "ringbalance.reduced_model.law.paper_law",
    "run_cases": "ringbalance.verification.runner",
    "simulate": "ringbalance.face",
    "tune": "ringbalance.face",
    "write_report": "ringbalance.reports.report",
}


def __getattr__(name: str) -> object:
    if name not in _HOME:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(import_module(_HOME[name]), name)


def __dir__() -> list[str]:
    return sorted({*globals(), *_HOME})
