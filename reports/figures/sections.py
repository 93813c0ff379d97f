"""The figures of the report's sections, from the evidence."""

from __future__ import annotations

from typing import Any

from ringbalance.reports.figures.chamber import moment, pressure_error, pressure_profile, transfer_lambda
from ringbalance.reports.figures.loop import amplitude, early_amplitude, early_time, fill_ratios, regimes
from ringbalance.reports.figures.tube import drag, drag_terms, flow_laws

Record = dict[str, Any]


def page_figures(evidence: Record) -> Record:
    """The figures of the sections, by name; one whose evidence is missing is None.

    Args: `evidence`: the document of `collect_evidence`.
    Returns: Drawings; `flow_laws` is a list.
    """
    calibration, paper, runs = evidence["calibration"], evidence["paper"], evidence["closed_loop"]
    return {
        "pressure_profile": pressure_profile(evidence["pressure"]["profile"]),
        "pressure_error": pressure_error(calibration["chamber"]),
        "moment": moment(calibration["chamber"]),
        "transfer_lambda": transfer_lambda(calibration["chamber"], calibration["lambda"], paper),
        "drag": drag(calibration["tube"], evidence["operating_point"], paper),
        "drag_terms": drag_terms(calibration["tube"]),
        "flow_laws": flow_laws(evidence["flow_law"]),
        "amplitude": amplitude(runs, evidence["limit_m"]) if runs else None,
        "early_amplitude": early_amplitude(runs, evidence["limit_m"]) if runs else None,
        "regimes": regimes(runs["calibrated"]) if "calibrated" in runs else None,
        "fill_ratios": fill_ratios(runs["calibrated"], early_time(runs)) if "calibrated" in runs else None,
    }
