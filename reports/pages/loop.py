"""The loop and its tuning: one run under each law and gain, and how likely each is to settle."""

from __future__ import annotations

from typing import Final

from ringbalance.reports.figures.operation import residual_polar, settling_histogram
from ringbalance.reports.pages.first_page import RETUNED, place_of_run
from ringbalance.reports.section import Record, Section, Work
from ringbalance.reports.summary import runs_settled, tuning_of

_GAINS: Final = {1: "with the scene’s gain", 2: "with the recommended settings"}
"""Titles of the calibrated law's ensembles, by their place in the evidence."""


def _reach(work: Work) -> Record:
    """What a pair cancels at the most, as a vibration; where the first pair's lies, by the sensor's phase."""
    scene, moment = work.scene, work.calibration.residual.usable_pair_moment
    return {
        "pairs": scene.disc.chambers // 2,
        "vibration_m": moment * scene.rotor.influence_coefficient,
        "direction_rad": -scene.rotor.lag_angle,
        "time_limit_s": scene.run.time_limit,
    }


def _view(found: Record, evidence: Record) -> Record:
    run = evidence["closed_loop"].get("calibrated")
    tuning = tuning_of(evidence)
    reached = tuning.get("fraction_settled") is not None
    return {
        "retuned": place_of_run(evidence, RETUNED),
        "runs_settled": runs_settled(tuning) if reached else "",
        "polar": residual_polar(run, found) if run and found else None,
        "settling": settling_histogram(_samples(found, evidence)) if found else None,
    }


def _samples(found: Record, evidence: Record) -> list[Record]:
    ensembles = (evidence.get("consequences") or {}).get("ensembles", [])
    return [
        {
            "title": title,
            "edges_s": ensembles[place]["settling_time_s"]["edges"],
            "counts": ensembles[place]["settling_time_s"]["counts"],
            "runs": ensembles[place]["members"],
            "not_settled": ensembles[place]["probability"]["not_settled"]["value"],
            "time_limit_s": found["time_limit_s"],
        }
        for place, title in _GAINS.items()
        if place < len(ensembles)
    ]


SECTION: Final = Section(
    name="loop", title="Loop and tuning", place="report", collect=_reach, show=_view, always=True
)
