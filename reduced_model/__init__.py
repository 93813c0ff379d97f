"""From physics to what a user calibrates with: lambda, k(u), the flow law and its uncertainty."""

from ringbalance.reduced_model.apparent_drag import ApparentDrag, apparent_drag
from ringbalance.reduced_model.calibrated_law import CalibratedLaw
from ringbalance.reduced_model.calibration import Calibration, calibrate
from ringbalance.reduced_model.documents import calibration_document
from ringbalance.reduced_model.drag_map import DragMap, drag_contour, drag_map, liquid_verdicts
from ringbalance.reduced_model.flow_law import Flow, FlowLaw, Regime
from ringbalance.reduced_model.gravity import check_ring
from ringbalance.reduced_model.hump_profile import HumpProfile, hump_profile
from ringbalance.reduced_model.ladder import Term, models_used
from ringbalance.reduced_model.loading import load_law, load_model
from ringbalance.reduced_model.model import BalancerModel, CompleteLaw, MomentCurve, balancer_model
from ringbalance.reduced_model.paper_law import PaperLaw, paper_law, paper_model
from ringbalance.reduced_model.thresholds import priming_pressure, siphon_stall_pressure

__all__ = [
    "ApparentDrag",
    "BalancerModel",
    "CalibratedLaw",
    "Calibration",
    "CompleteLaw",
    "DragMap",
    "Flow",
    "FlowLaw",
    "HumpProfile",
    "MomentCurve",
    "PaperLaw",
    "Regime",
    "Term",
    "apparent_drag",
    "balancer_model",
    "calibrate",
    "calibration_document",
    "check_ring",
    "drag_contour",
    "drag_map",
    "hump_profile",
    "liquid_verdicts",
    "load_law",
    "load_model",
    "models_used",
    "paper_law",
    "paper_model",
    "priming_pressure",
    "siphon_stall_pressure",
]
