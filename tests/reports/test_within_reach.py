"""Whether the report's rows and its runs agree on what a valve reaches."""

from __future__ import annotations

import pytest

from ringbalance.reports.pages.requirements import smallest_row
from ringbalance.reports.summary import line_verdict, what_enlarges


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
