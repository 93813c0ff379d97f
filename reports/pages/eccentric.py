"""Two eccentric masses: the report of their scene, and their section in that of a liquid ring."""

from __future__ import annotations

import math
from typing import Final

import numpy as np

from ringbalance.reports import summary
from ringbalance.reports.mass_figures import mass_angles, over_time, run_up
from ringbalance.reports.pages import measured
from ringbalance.reports.pages.plain import decision, decision_view
from ringbalance.reports.pages.standing import CASES, CREDIBILITY, DEFAULTS, DOCUMENT, PARAMETERS
from ringbalance.reports.section import Record, Section
from ringbalance.scene.uncertain import NORMAL_95


def _run(_own: Record, evidence: Record) -> Record:
    run, locked = evidence["closed_loop"]["balanced"], evidence["locked"]
    varies = max(run["speed_rad_s"]) > min(run["speed_rad_s"])
    ends = np.interp([stage["end_s"] for stage in run["stages"]], run["time_s"], run["amplitude_m"])
    return {
        "over_speed": run_up(run, locked, evidence["rotor"], evidence["drawn"]) if varies else [],
        "over_time": over_time(run, locked, evidence["drawn"]),
        "stages": [{"index": index, "amplitude_m": float(end)} for index, end in enumerate(ends)],
    }


def _estimates(_own: Record, evidence: Record) -> Record:
    """Final estimates with their 95 % half-widths beside the true values, errors in standard deviations."""
    run, truth = evidence["closed_loop"]["balanced"], evidence["truth"]
    estimates, arms = run["estimates"], truth["friction_arm_m"]
    true = truth["unbalance_kg_m"] * np.array([math.cos(truth["phase_rad"]), math.sin(truth["phase_rad"])])
    covariance = np.asarray(estimates["imbalance_covariance"][-1])
    covariance = covariance + np.asarray(estimates["imbalance_rotor_covariance"])
    imbalance = [row[-1] for row in estimates["imbalance_kg_m"]]
    friction = [row[-1] for row in estimates["friction_arm_m"]]
    variances = [(width / NORMAL_95) ** 2 for width in estimates["friction_half_width_m"]]
    entries = [
        ("imbalance along x", "kg m", imbalance[0], covariance[0, 0], true[0]),
        ("imbalance along y", "kg m", imbalance[1], covariance[1, 1], true[1]),
        ("friction arm of mass 1", "m", friction[0], variances[0], arms[0]),
        ("friction arm of mass 2", "m", friction[1], variances[1], arms[1]),
    ]
    rows = [
        {
            "name": name,
            "unit": unit,
            "value": float(value),
            "width": NORMAL_95 * math.sqrt(variance) or None,
            "plant": float(right),
            "deviations": float(value - right) / math.sqrt(variance) if variance > 0 else None,
        }
        for name, unit, value, variance, right in entries
    ]
    return {"rows": rows}


BALANCER: Final = "eccentric_mass"
SECTIONS: Final = (
    Section(
        name="summary",
        title="Decision",
        document="report",
        collect=decision,
        show=decision_view,
        template="masses_summary.html",
    ),
    Section(name="run", title="Run-up and stages", document="report", show=_run, template="masses_run.html"),
    Section(
        name="estimates",
        title="Estimates",
        document="report",
        show=_estimates,
        template="masses_estimates.html",
    ),
    Section(
        name="loops",
        title="Drives: margins and what they do",
        document="report",
        show=lambda _own, evidence: {"angles": mass_angles(evidence["closed_loop"]["balanced"])},
        template="masses_loops.html",
    ),
    Section(
        name="claims",
        title="Claims of the eccentric-mass paper",
        document="report",
        of_paper=True,
        show=lambda _own, evidence: {
            "counts": summary.verdict_counts(summary.claims(evidence), summary.CLAIM_VERDICTS)
        },
        template="masses_claims.html",
    ),
    CREDIBILITY,
    PARAMETERS,
    DOCUMENT,
    CASES,
    measured.SECTION,
    DEFAULTS,
    Section(name="scene", title="Scene file"),
)
