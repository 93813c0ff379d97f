"""Whether the report's rows and its runs agree on what a valve reaches."""

from __future__ import annotations

import pytest

from ringbalance.reports.pages.first_page import loop_sentences
from ringbalance.reports.pages.requirements import requirements, smallest_row
from ringbalance.reports.summary import line_verdict, what_enlarges
from ringbalance.reports.traced import untraced


@pytest.mark.parametrize(
    ("given", "runs", "smallest", "verdict"),
    [
        (True, 200, 9e-8, "met"),
        (True, 0, 9e-8, "not met"),
        (True, 0, 6e-8, "met"),
        (False, 200, 9e-8, "not met"),
    ],
)
def test_runs_with_the_scenes_own_valve_decide_before_its_smallest_correction(
    given: bool, runs: int, smallest: float, verdict: str
) -> None:
    ends = [{"smallest_correction_m": smallest}]
    tuning = {"runs": runs, "fraction_settled": 0.96, "fraction_settled_95": [0.92, 0.98]} if runs else {}
    line = {"given": given, "limit_m": 5e-8, "largest_correction_m": 7e-8, "ends": ends}
    evidence = {"calibration": {"gas_line": line}, "summary": {"tuning": tuning}}
    assert line_verdict(evidence) == verdict
    row = smallest_row(evidence)
    assert row is not None
    assert row.verdict == ("none stated" if smallest > 7e-8 and verdict == "met" else verdict)
    assert ("too large for the limit" in what_enlarges(evidence)) == (verdict != "met")
    if given and runs:
        tuning |= {"fraction_settled": 0.4, "fraction_settled_95": [0.3, 0.5]}
        assert line_verdict(evidence) == "not met"


def test_each_end_of_the_default_range_keeps_its_name_whichever_corrects_by_less() -> None:
    ends = [{"end": "slow", "smallest_correction_m": 1e-7}, {"end": "fast", "smallest_correction_m": 2e-7}]
    line = {"given": False, "limit_m": 5e-8, "largest_correction_m": 7e-8, "ends": ends}
    row = smallest_row({"calibration": {"gas_line": line}, "summary": {"tuning": {}}})
    assert row is not None
    told = untraced(row.result)
    assert told.index("0.10") < told.index("slow valve") < told.index("0.20") < told.index("fast valve")


@pytest.mark.parametrize(("factor", "verdict"), [(1.0, "met"), (1.3, "undecided"), (1.8, "not met")])
def test_the_scenes_gain_is_judged_with_the_uncertainty_of_the_loop_factor(
    factor: float, verdict: str
) -> None:
    run = {"loop_factor": factor, "largest_staying_loop_factor": 1.37, "loop_factor_limit": 2.0}
    evidence = {
        "calibration": {},
        "closed_loop": {"calibrated": run},
        "operating_point": {"stall_pressure_Pa": 1e5, "stall_uncertainty": 1e3, "gas_pressure_Pa": 7e5},
        "scene": {"origins": {}},
        "summary": {"tuning": {"margins": {"gain_uncertainty": 0.15}}},
    }
    row = next(row for row in requirements(evidence) if row.name.startswith("Loop factor with the scene"))
    assert row.verdict == verdict
    assert row.uncertainty == pytest.approx(0.15 * factor)


@pytest.mark.parametrize(
    ("settled", "share", "told"),
    [(True, 0.99, False), (True, 0.7, True), (False, 0.0, False), (False, 0.9, True)],
)
def test_the_drawn_runs_are_told_where_the_scenes_own_run_does_not_stand_for_them(
    settled: bool, share: float, told: bool
) -> None:
    ensemble = {"members": 500, "probability": {"not_settled": {"value": 1 - share}}}
    run = {"settled": settled, "settling_time_s": 2.0}
    evidence = {
        "calibration": {},
        "closed_loop": {"calibrated": run},
        "consequences": {"ensembles": [ensemble] * 3},
    }
    sentences = " ".join(loop_sentences(evidence))
    assert ("Of 500 runs over the uncertain inputs" in sentences) == told
