"""The first page says what drawn devices say, warns of what would fail, and names what it rests on."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import pytest

from ringbalance.reports.evidence import _ring_study
from ringbalance.reports.judged import settings_lines
from ringbalance.reports.page import terminal_lines
from ringbalance.reports.pages.first_page import SECTION, SETTINGS, _over_pressure, _requirement_record
from ringbalance.reports.prose import opening
from ringbalance.scene import Scene
from ringbalance.scene.toml import read_toml
from scenes import with_tables

Record = dict[str, Any]
Said = Callable[[Record, str], str]


def view(evidence: Record) -> Record:
    shown = SECTION.view(evidence)
    assert shown is not None
    return shown


def recommended(evidence: Record) -> Record:
    """Evidence with other settings under which every drawn device settles."""
    judged = evidence["summary"]["own"]
    every = {"value": 1.0, "low": 0.94, "high": 1.0, "count": 64, "of": 64}
    required = [{**each, "fraction": every, "verdict": "met"} for each in judged["required"]]
    better = {**judged, "fraction": every, "verdict": "met", "required": required}
    return {**evidence, "summary": {**evidence["summary"], "recommended": better}}


def test_the_fraction_of_devices_stands_first(evidence: Record, said: Said) -> None:
    page = said(evidence, "summary")
    assert "107 of 128 drawn devices" in page
    assert "an ideal valve" in page
    lines = terminal_lines(recommended(evidence))
    assert [line.rpartition(": ")[2] for line in lines[:2]] == ["not met.", "met."]
    assert lines[0].startswith("With the scene’s settings 84 % of 128 drawn devices")
    assert "64 of 64 drawn devices" in said(recommended(evidence), "summary")


def test_each_step_says_what_it_reaches(evidence: Record, said: Said) -> None:
    judged = evidence["summary"]["own"]
    remedy = {
        "code": "bore",
        "name": "",
        "changes": {"tube.bore": 0.7e-3},
        "settings": {},
        "fraction": {"value": 0.97, "low": 0.93, "high": 0.99, "count": 124, "of": 128},
        "verdict": "met",
        "half_settle_s": 5.0,
        "ninety_percent_settle_s": 9.0,
    }
    evidence["summary"].update(remedies=[remedy], measures=[{"text": "measure the flow"}])
    page = said(evidence, "summary")
    assert "Bore 0.7 mm: 97 % of devices (93 % to 99 %), nine tenths within 9.0 s: met." in page
    assert "Measure the flow." in page
    assert judged["verdict"] in page


def test_the_gas_pressure_is_drawn_where_it_was_tried(evidence: Record) -> None:
    fraction = evidence["summary"]["own"]["fraction"]
    level = {
        "fraction": fraction,
        "verdict": "not met",
        "settling_time_s": {"p50": 3.0, "p90": None},
        "usable_moment_kg_m": {"p10": 7e-4, "p50": 9e-4, "p90": 1.1e-3},
    }
    assert view(evidence)["pressure"] is None
    levels = [{**level, "value": pressure} for pressure in (5e5, 6e5, 7e5)]
    evidence["summary"]["along"]["levels"] = levels
    figure = view(evidence)["pressure"]
    assert figure is not None
    assert "gas pressure in MPa" in figure.svg


def test_the_settings_are_a_block_of_the_scene_file(paper_scene: Scene) -> None:
    lines = [[f"[{each['table']}]", *each["lines"]] for each in settings_lines(paper_scene, SETTINGS)]
    block = read_toml("\n".join(line for table in lines for line in table))
    assert block["gas"] == {"pressure": "0.7 MPa"}
    assert block["controller"]["proportional"] == "0.08 s/um"
    settings = {f"{table}.{key}": value for table, of in block.items() for key, value in of.items()}
    assert paper_scene.with_values(settings).controller == paper_scene.controller


def test_a_chamber_that_runs_dry_is_a_warning(evidence: Record, said: Said) -> None:
    assert "chamber dry" not in said(evidence, "summary")
    evidence["closed_loop"]["calibrated"]["injections"][0]["event"] = "empty"
    assert "One injection runs its chamber dry (A)" in said(evidence, "summary")
    evidence["closed_loop"]["calibrated"]["gas"] = {
        "warning": "3 injections ran their chamber dry: up to 2 normal litres",
        "normal_litres": 12.3,
        "compression_energy_J": 1234.0,
        "injections_run_dry": 3,
    }
    assert "up to 2 normal litres." in said(evidence, "summary")
    page = said(evidence, "loop")
    assert "Gas consumed, normal litres | 12 |" in page
    assert "Injections that run a chamber dry | 3 |" in page


def test_the_residual_s_grade_follows_from_the_mass(paper_scene: Scene) -> None:
    assert (
        _requirement_record(paper_scene, limit=paper_scene.controller.limit)["grade_at_residual_m_s"] is None
    )
    heavy = with_tables(paper_scene, rotor={"mass": 10.0})
    record = _requirement_record(heavy, limit=heavy.controller.limit)
    # U omega/m by hand: 0.05 um over 0.0108 um/(g mm) at 10 000 rpm on 10 kg.
    assert record["grade_at_residual_m_s"] == pytest.approx(0.05 / 0.0108 * 1e-6 * 1047.2 / 10, rel=1e-4)


def valve_choice(**changed: Any) -> Record:
    fraction = {"value": 1.0, "low": 0.94, "high": 1.0, "count": 64, "of": 64}
    changes = {"gas.conductance": 2.3e-8, "gas.critical_ratio": 0.36, "gas.valve_lag": 0.02}
    times = {"half_settle_s": 5.8, "ninety_percent_settle_s": 11.0}
    choice = {"name": "Valve A", "changes": changes, "settings": {}, "fraction": fraction, "verdict": "met"}
    return {**choice, **times, "assumed": "valve lag of 20 ms", **changed}


def test_a_verdict_that_rests_on_an_assumed_lag_says_so(evidence: Record, said: Said) -> None:
    assumed, stated = valve_choice(), valve_choice(assumed="")
    condition = "Valve A, if it has the valve lag of 20 ms that this program assumes, "
    for choice, says in ((assumed, True), (stated, False)):
        evidence["summary"].update(choices=[choice], best_choice=choice, valve_given=False)
        text = said(evidence, "summary")
        assert ("With " + condition + "64 of 64" in text) is says
        assert ("With Valve A, 64 of 64" in text) is not says
        assert ("Ask the seller for its lag, which is assumed" in text) is says
        assert ("no data sheet prints the lags" in text) is says
        assert ("With " + condition + "100 %" in terminal_lines(evidence)[0]) is says
        assert "Valve A | 2.3 l/(s bar) | 20 ms" in text


def test_pressures_and_the_ends_of_other_devices_are_in_words() -> None:
    levels = [
        {"value": 3e5, "verdict": "not met", "ended": {"stalled": 60, "settled": 4}},
        {"value": 4e5, "verdict": "undecided", "ended": {"settled": 58, "hovering": 6}},
        {"value": 5e5, "verdict": "met", "ended": {"settled": 63, "diverging": 1}},
        {"value": 6e5, "verdict": "met", "ended": {"settled": 64}},
        {"value": 7e5, "verdict": "undecided", "ended": {"settled": 57, "capacity_exceeded": 7}},
    ]
    view = _over_pressure({"along": {"levels": levels}, "recommended_pressure_Pa": 5e5})
    # Ranges of different verdicts do not overlap.
    assert view["spans"] == [("undecided", 4e5, 4e5), ("met", 5e5, 6e5), ("undecided", 7e5, 7e5)]
    assert view["causes"] == {"below": "stalled", "above": "capacity_exceeded"}


def test_a_scene_without_a_gain_is_shown_with_the_recommended_settings(paper_scene: Scene) -> None:
    """The paper's scene stands for one without; others have a limit that needs no injection."""
    best = paper_scene.with_values({"controller.limit": "1 mm"})
    for own, injections in ((None, False), ({"verdict": "met"}, True)):
        loops = _ring_study(paper_scene, {"judged": {"own": own}, "scene": best})["closed_loop"]
        assert {bool(run["injections"]) for run in loops.values()} == {injections}


def test_a_scene_without_a_gain_has_one_column_of_runs(evidence: Record, said: Said) -> None:
    evidence["summary"]["run"] = {"verdict": "settled"}
    both = said(evidence, "loop")
    assert "the scene’s gain" in both
    assert "recommended settings" in both
    judged = recommended(evidence)["summary"]
    alone = said({**evidence, "summary": {**judged, "own": None, "run": None}}, "loop")
    assert "the scene’s gain" not in alone
    assert "recommended settings" in alone


@pytest.mark.parametrize(
    ("limit", "line"),
    [("0.1145916 um", "0.114 um"), ("0.05 um", "0.05 um"), ("0.29 um", "0.29 um"), ("1.999 um", "1.99 um")],
)
def test_a_limit_is_rounded_down(paper_scene: Scene, limit: str, line: str) -> None:
    (table,) = settings_lines(paper_scene.with_values({"controller.limit": limit}), ["controller.limit"])
    assert table["lines"] == [f'limit = "{line}"']


def test_the_inputs_that_decide_most_come_first(evidence: Record, said: Said) -> None:
    rows = [("tube.bore", 0.3, False), ("", 0.2, True), ("rotor.lag_angle", 0.02, False)]
    evidence["summary"]["ranking"] = [
        {
            "path": path,
            "name": "model: loss",
            "index": index,
            "noise": 0.05,
            "common": common,
            "outcome": "settling_time",
        }
        for path, index, common in rows
    ]
    text = said(evidence, "summary")
    first = "Bore of the tube (assumed): 30 %, varies between devices"
    second = "Error of the model, loss: 20 %, not known, but common to all devices"
    assert f"settling time. {first}; {second}; the rest" in text


def test_the_bore_and_the_other_reading_are_named(evidence: Record, said: Said) -> None:
    assert "The bore of 1.5 mm, on which" in said(evidence, "summary")
    evidence["summary"]["other_reading"] = {
        "bore_m": 0.896e-3,
        "k": 5.7,
        "fraction": {"value": 0.98},
    }
    text = said(evidence, "summary")
    assert "Bore 1.5 mm, by Fig. 7" in text
    assert "0.896 mm" in text
    assert "98 % of devices settle there" in text
    evidence["summary"].update(other_reading=None, bore_uncertainty_stated=True)
    assert "on which k and every velocity rest" not in said(evidence, "summary")


def test_what_is_taken_of_the_valve_is_named_with_how_to_judge_it(evidence: Record, said: Said) -> None:
    row = {"group": "Gas", "note": "", "uncertainty": ""}
    lag = {**row, "quantity": "valve lag", "path": "gas.valve_lag", "value": "20 ms", "origin": "assumed"}
    ratio = {**row, "quantity": "b", "path": "gas.critical_ratio", "value": "0.3", "origin": "default"}
    evidence["scene"]["table"] += [lag, ratio]
    assert "taken by this program" not in said(evidence, "summary")
    evidence["summary"]["valve_given"] = True
    named = "Not stated, and taken by this program: valve lag 20 ms and critical ratio 0.3. Ask the seller; "
    exact = "they are exact here: valve_lag and critical_ratio in [uncertainty] let the verdict cover their"
    assert named + exact in said(evidence, "summary")
    lag["origin"], ratio["uncertainty"] = "given", "0.05"
    judged = "by this program: critical ratio 0.3. Ask the seller; their [uncertainty] is in the verdict"
    assert judged in said(evidence, "summary")


def test_what_the_scene_leaves_to_the_paper_s_rotor_is_named(evidence: Record, said: Said) -> None:
    assert "so those of the paper’s rotor" not in said(evidence, "summary")
    evidence["scene"]["origins"]["rotor.influence_coefficient"] = "default"
    named = "Taken from the paper’s rotor: influence coefficient; unbalance"
    assert named in said(evidence, "summary")


def test_what_is_met_without_uncertainties_is_met_if_the_parts_are_exact(
    evidence: Record, said: Said
) -> None:
    for each in (evidence["summary"]["own"], evidence["summary"]["recommended"]):
        if each:
            each["verdict"] = "met"
    stated = said(evidence, "summary")
    assert "if the parts are exact" not in stated
    assert "Parts are exact" not in stated
    evidence["scene"]["states_uncertainty"] = False
    unstated = said(evidence, "summary")
    assert "The verdict holds if the parts are exact" in unstated
    assert "Parts are exact: the scene states no [uncertainty]" in unstated


def test_page_one_answers_the_papers_question_by_the_library_too(evidence: Record, said: Said) -> None:
    names = {
        "claim_06": "claim_06_wall_pressure",
        "claim_09": "claim_09_drag_coefficient",
        "claim_11": "claim_11_lambda",
    }
    cases = evidence["verification"]
    for case in cases:
        case["id"] = names.get(case["id"], case["id"])
    assert "library" not in said(evidence, "summary")
    cases.append(
        {**cases[-1], "id": "k_by_fluids", "numbers": {"k_low": 2.9, "k_high": 3.2}, "verdict": "passed"}
    )
    verdict = next(case["verdict"] for case in cases if case["id"] == names["claim_09"])
    row = "k of this tube at rest, by the formulas of the library fluids alone | about 50 | 2.90 to 3.20 | "
    assert row + verdict in said(evidence, "summary")


def test_a_symbol_at_the_head_of_a_caption_stays_as_it_is() -> None:
    assert opening("k against the velocity") == "k against the velocity"
    assert opening("a tube") == "A tube"
    assert opening("loss") == "Loss"


def test_a_fraction_is_never_said_instead_of_itself(evidence: Record, said: Said) -> None:
    """Equal in print: as many devices, and the times decide; else both fractions."""
    changed = recommended(evidence)
    own, best = changed["summary"]["own"], changed["summary"]["recommended"]
    assert "100 % of devices settle instead of 84 %" in said(changed, "summary")
    own["fraction"] = best["fraction"]
    best["settling_time_s"] = {"p50": 1.0, "p90": 2.0}
    own["settling_time_s"] = {"p50": 1.0, "p90": 3.0}
    page = said(changed, "summary")
    assert "instead of 100 %" not in page
    assert "nine tenths within 2.0 s; as many, but later, with the scene’s own." in page
    own["settling_time_s"] = best["settling_time_s"]
    assert "but later" not in said(changed, "summary")
