"""Calibration and the paper's law for Python, without loading the closed loop."""

from __future__ import annotations

from ringbalance.interface import checked
from ringbalance.reduced_model.calibration import calibrate as calibrate_scene
from ringbalance.reduced_model.law.paper_law import paper_law as paper_law_of

calibrate = checked(calibrate_scene, module=__name__)
paper_law = checked(paper_law_of, module=__name__)
