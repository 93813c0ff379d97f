"""ringbalance: are the closed formulas of a liquid-ring balancer to be trusted, for your disc?

Begin with `load_scene`, `calibrate` and `simulate`; then `tune`, `fit`, `compare`, `sweep`, `find_design`,
`trade`, `extremes`, `plot` and `write_report`. `help(ringbalance.calibrate)` shows its arguments, its result
and an example. The names are loaded when they are first used, so that `import ringbalance` costs nothing.
docs/python.md shows them at work.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING

from ringbalance.scene.registry import register as register
from ringbalance.scene.registry import register_function

if TYPE_CHECKING:
    from ringbalance.calibration import calibrate as calibrate
    from ringbalance.calibration import paper_law as paper_law
    from ringbalance.controller.algorithms.algorithm import Command as Command
    from ringbalance.controller.algorithms.algorithm import Controller as Controller
    from ringbalance.controller.algorithms.algorithm import Measurement as Measurement
    from ringbalance.controller.algorithms.algorithm import ValveCommand as ValveCommand
    from ringbalance.controller.compare import Comparison as Comparison
    from ringbalance.controller.eccentric_mass.loop_matrices import EccentricLoop as EccentricLoop
    from ringbalance.controller.eccentric_mass.loop_matrices import eccentric_loop as eccentric_loop
    from ringbalance.controller.eccentric_mass.run_record import EccentricRun as EccentricRun
    from ringbalance.controller.eccentric_mass.scene_records import EccentricScene as EccentricScene
    from ringbalance.controller.judging.tuning import Tuning as Tuning
    from ringbalance.controller.liquid_ring.linear_loop import LinearLoop as LinearLoop
    from ringbalance.controller.liquid_ring.linear_loop import linear_loop as linear_loop
    from ringbalance.controller.rotor import Sensor as Sensor
    from ringbalance.controller.simulation import Simulation as Simulation
    from ringbalance.controller.stepped import scene_controller as scene_controller
    from ringbalance.design.designing import Design as Design
    from ringbalance.design.mass_design import MassDesign as MassDesign
    from ringbalance.design.sweep import Sweep as Sweep
    from ringbalance.designs import objective as objective
    from ringbalance.designs import sweep as sweep
    from ringbalance.face import check_balancer as check_balancer
    from ringbalance.face import compare as compare
    from ringbalance.face import simulate as simulate
    from ringbalance.face import tune as tune
    from ringbalance.fitting import fit as fit
    from ringbalance.identification.documents import Fit as Fit
    from ringbalance.identification.influence import InfluenceTable as InfluenceTable
    from ringbalance.identification.influence import read_influence as read_influence
    from ringbalance.panels.document import Panel as Panel
    from ringbalance.reduced_model.calibration_record import Calibration as Calibration
    from ringbalance.reduced_model.law.files import load_law as load_law
    from ringbalance.reduced_model.law.flow_law import CompleteLaw as CompleteLaw
    from ringbalance.reduced_model.law.flow_law import Flow as Flow
    from ringbalance.reduced_model.law.flow_law import FlowLaw as FlowLaw
    from ringbalance.reduced_model.law.flow_law import MomentCurve as MomentCurve
    from ringbalance.reduced_model.law.flow_law import Regime as Regime
    from ringbalance.reporting import plot as plot
    from ringbalance.reporting import write_report as write_report
    from ringbalance.scene import Scene as Scene
    from ringbalance.scene import SceneError as SceneError
    from ringbalance.scene import bundled_scene as bundled_scene
    from ringbalance.scene import load_scene as load_scene
    from ringbalance.scene.platform.progress_line import ProgressLine as ProgressLine
    from ringbalance.scene.registry import register as register
    from ringbalance.search import find_design as find_design
    from ringbalance.showing import panel as panel
    from ringbalance.studies import extremes as extremes
    from ringbalance.studies import run_cases as run_cases
    from ringbalance.studies import trade as trade
    from ringbalance.verification.extremes.study import Extremes as Extremes
    from ringbalance.verification.trade import TradeStudy as TradeStudy

__version__ = "0.2.0"

# One entry for each kind of balancer.
register(
    "liquid_ring",
    scene="ringbalance.scene.rules.liquid_ring:KIND",
    balancer="ringbalance.controller.liquid_ring.balancer:LiquidRingBalancer",
)
register(
    "eccentric_mass",
    scene="ringbalance.controller.eccentric_mass.scene_records:KIND",
    balancer="ringbalance.controller.eccentric_mass.balancer:EccentricMassBalancer",
)
register_function("run_command", path="ringbalance.running:run_command")
register_function("with_chamber", path="ringbalance.scene.chamber_file.loading:with_chamber")
register_function("with_values", path="ringbalance.scene.changes:with_values")
register_function("sobol", path="ringbalance.design.sobol:sobol")
register_function("answer_each", path="ringbalance.reduced_model.pieces.compiled_point:answer_each")
register_function("line_answers", path="ringbalance.reduced_model.injection.line_answers:line_answers")
register_function("multigrid", path="pyamg:smoothed_aggregation_solver")
register_function("run_row", path="ringbalance.design.runs:run_row")
register_function("left_out", path="ringbalance.design.trade:left_out")
register_function("data_document", path="ringbalance.verification.validation.comparison:data_document")
register_function("sheet", path="ringbalance.reports.figure:sheet")
register_function("figures_of", path="ringbalance.reports.run_figures:figures_of")
register_function("figures_of_result", path="ringbalance.reports.result_figures:figures_of_result")
register_function("sweep_figures", path="ringbalance.reports.sweep_figures:sweep_figures")
register_function("control_state_space", path="control:StateSpace")
register_function("pandas_frame", path="pandas:DataFrame")
register_function("xarray_array", path="xarray:DataArray")
register_function("xarray_dataset", path="xarray:Dataset")
register_function("scene_lines", path="ringbalance.scene.describe:scene_lines")

_NAMES = {
    "calibration": (
        "calibrate",
        "paper_law",
    ),
    "controller.algorithms.algorithm": (
        "Command",
        "Controller",
        "Measurement",
        "ValveCommand",
    ),
    "controller.compare": ("Comparison",),
    "controller.eccentric_mass.loop_matrices": ("EccentricLoop", "eccentric_loop"),
    "controller.eccentric_mass.run_record": ("EccentricRun",),
    "controller.eccentric_mass.scene_records": ("EccentricScene",),
    "controller.liquid_ring.linear_loop": ("LinearLoop", "linear_loop"),
    "controller.rotor": ("Sensor",),
    "controller.simulation": ("Simulation",),
    "controller.stepped": ("scene_controller",),
    "controller.judging.tuning": ("Tuning",),
    "design.designing": ("Design",),
    "design.mass_design": ("MassDesign",),
    "design.sweep": ("Sweep",),
    "designs": ("objective", "sweep"),
    "face": (
        "check_balancer",
        "compare",
        "simulate",
        "tune",
    ),
    "identification.documents": ("Fit",),
    "identification.influence": ("InfluenceTable", "read_influence"),
    "reduced_model.calibration_record": ("Calibration",),
    "reduced_model.law.files": ("load_law",),
    "reduced_model.law.flow_law": (
        "CompleteLaw",
        "Flow",
        "FlowLaw",
        "MomentCurve",
        "Regime",
    ),
    "scene.platform.progress_line": ("ProgressLine",),
    "scene.registry": ("register",),
    "scene": (
        "Scene",
        "SceneError",
        "bundled_scene",
        "load_scene",
    ),
    "search": ("find_design",),
    "fitting": ("fit",),
    "panels.document": ("Panel",),
    "reporting": ("plot", "write_report"),
    "showing": ("panel",),
    "studies": ("extremes", "run_cases", "trade"),
    "verification.extremes.study": ("Extremes",),
    "verification.trade": ("TradeStudy",),
}
_HOME = {name: f"ringbalance.{module}" for module, names in _NAMES.items() for name in names}
__all__ = sorted(_HOME)


def __getattr__(name: str) -> object:
    if name not in _HOME:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(import_module(_HOME[name]), name)


def __dir__() -> list[str]:
    return __all__
