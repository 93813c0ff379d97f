"""The first page says what the runs say, warns of what would fail, and names what it rests on."""

from __future__ import annotations

from typing import Any

import pytest

from ringbalance.reports.pages.first_page import SECTION, loop_sentences

Record = dict[str, Any]


def view(evidence: Record) -> Record:
    found = SECTION.view(evidence)
    assert found is not None
    return found


def with_consequences(evidence: Record, *, settled: bool = True) -> Record:
    """With the run and the ensembles of the recommended gain."""
    run = {
        "name": "calibrated_retuned",
        "verdict": "settled" if settled else "hovering",
        "settled": settled,
        "settling_time_s": 3.45 if settled else None,
        "proportional_s_per_m": 0.0238e6,
        "loop_factor": 0.57,
        "injections": 8,
        "overshoots": 0,
        "misadjustments": 0,
    }
    own = {"name": "calibrated", "proportional_s_per_m": 0.08e6}
    ensembles = [{"members": 500, "probability": {"not_settled": {"value": p}}} for p in (0.0, 0.44, 0.01)]
    tuning = {"settling_time_s": {"p95": 4.2}, "runs": 20, "fraction_settled": 1.0, "status": "tuned"}
    record = {**evidence, "consequences": {"runs": [own, run], "ensembles": ensembles}}
    record["summary"] = {**evidence["summary"], "tuning": {**tuning, "fraction_settled_95": [0.84, 1.0]}}
    return record


@pytest.mark.parametrize(
    ("verdict", "said"),
    [
        ("settled", "settles in 3.4\u202fs"),
        ("hovering", "hovers about its limit"),
        ("not settled", "does not settle"),
        ("unstable", "is unstable"),
    ],
)
def test_the_verdict_is_named_with_the_loop_factor(evidence: Record, verdict: str, said: str) -> None:
    run = evidence["closed_loop"]["calibrated"]
    run.update(verdict=verdict, loop_factor=1.93, settled=verdict == "settled")
    lead = loop_sentences(evidence)[0]
    assert said in lead
    assert "1.93 times a small residual" in lead
    assert "2.00 times on it grows" in lead


def test_no_run_is_compared_with_another_by_a_ratio(evidence: Record) -> None:
    assert "times the" not in " ".join(view(with_consequences(evidence))["loop_lead"])


def test_the_recommended_gain_stands_beside_the_scene_s(evidence: Record) -> None:
    found = view(with_consequences(evidence))
    told = " ".join(found["loop_lead"])
    assert "Recommended gain: 0.024\u202fs/µm (the scene has 0.080\u202fs/µm)" in told
    assert "56\u202f% have settled by 120\u202fs" in told
    assert "84\u202f% to 100\u202f%" in told
    assert next(row for row in found["loop"].rows if row[0].startswith("Loop factor"))[2] == "0.570"


def test_a_gain_under_which_the_loop_does_not_stay_is_not_praised(evidence: Record) -> None:
    told = " ".join(view(with_consequences(evidence, settled=False))["loop_lead"])
    assert "With it this run hovers about its limit" in told


def test_a_chamber_that_runs_dry_is_a_warning(evidence: Record) -> None:
    assert view(evidence)["alerts"] == []
    evidence["closed_loop"]["calibrated"]["injections"][0]["event"] = "empty"
    (warning,) = view(evidence)["alerts"]
    assert warning.startswith("1 injection runs its chamber dry (A)")
    evidence["closed_loop"]["calibrated"]["gas"] = {
        "warning": "3 injections ran their chamber dry: up to 2 normal litres",
        "normal_litres": 12.3,
        "compression_energy_J": 1234.0,
        "injections_run_dry": 3,
    }
    found = view(evidence)
    assert "up to 2 normal litres" in found["alerts"][0]
    cells = {row[0]: row[1] for row in found["loop"].rows}
    assert (cells["Gas consumed, normal litres"], cells["Injections that run a chamber dry"]) == ("12", "3")


@pytest.mark.parametrize(
    ("needed", "said"), [(700e-6, ""), (926e-6, "cannot be told"), (1100e-6, "is beyond the")]
)
def test_an_unbalance_beyond_reach_is_a_warning(evidence: Record, needed: float, said: str) -> None:
    evidence["summary"]["needed_moment_kg_m"] = needed
    assert said in " ".join(view(evidence)["alerts"])
    assert bool(view(evidence)["alerts"]) is bool(said)


def test_the_bore_and_the_other_reading_are_named(evidence: Record) -> None:
    assert "bore of 1.5\u202fmm" in view(evidence)["rests"][0]
    evidence["summary"]["other_reading"] = {
        "bore_m": 0.896e-3,
        "k": 5.7,
        "loop_factor": 0.58,
        "verdict": "settled",
        "settled": True,
        "settling_time_s": 6.0,
    }
    told = view(evidence)["rests"][0]
    assert "assumes 1.5\u202fmm" in told
    assert "0.896\u202fmm" in told
    assert "is not known" in told
    evidence["summary"].update(other_reading=None, bore_uncertainty_stated=True)
    assert "bore" not in " ".join(view(evidence)["rests"])


def test_that_nothing_was_measured_is_said(evidence: Record) -> None:
    assert any("No measurement" in text for text in view(evidence)["rests"])
