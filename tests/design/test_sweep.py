"""A sweep's rows: those of a calibration and of the balancers' runs, by whomever they are computed."""

from __future__ import annotations

import csv
import io
import math
import pickle
from collections import Counter
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import ringbalance as rb
from ringbalance.controller.balancer import Draws, balancer_of, quick_balancer
from ringbalance.controller.judging.judge import FIRST_VERDICT_DEVICE, judged_all
from ringbalance.design.static import EMPTY, UNITS, _row
from ringbalance.reduced_model.law.flow_law import Regime
from ringbalance.results.requirements import MET, MISSED, OPEN, Proportion
from ringbalance.scene.models import Scene


def table(sweep: rb.Sweep) -> list[dict[str, str]]:
    return list(csv.DictReader(io.StringIO(sweep.to_csv())))


@pytest.mark.parametrize(
    "name",
    [
        "liquid_ring_paper",
        "spindle_design",
        *(
            pytest.param(each, marks=pytest.mark.heavy)
            for each in ("six_chamber", "perfluorinated_oil", "silicone_oil_100cst")
        ),
    ],
)
def test_static_rows_are_those_of_a_calibration(name: str) -> None:
    """On ten drawn designs of each scene, without gravity; intervals by the inputs too."""
    scene = rb.load_scene(rb.bundled_scene(name)).with_values({"environment.gravity": 0.0})
    assert isinstance(scene, rb.Scene)
    spans = {
        "tube.bore": (scene.tube.bore, 0.7, 1.5),
        "rotor.speed": (scene.rotor.speed, 0.85, 1.1),
        "gas.pressure": (scene.gas.pressure, 0.9, 1.4),
    }
    units = {"tube.bore": "m", "rotor.speed": "rad/s", "gas.pressure": "Pa"}
    vary = {
        path: f"{low * value:.6g}{units[path]}:{high * value:.6g}{units[path]}"
        for path, (value, low, high) in spans.items()
    }
    sweep = rb.sweep(scene, vary, sample="latin:10", check=2)
    compared = 0
    for row in range(10):
        quantities = rb.calibrate(sweep.point_scene(row)).quantities
        assert sweep.static[row]["sha256"] == sweep.point_scene(row).sha256
        for quantity, (value, width) in sweep.static[row]["values"].items():
            if quantity in quantities and value is not None:
                compared += 1
                parts = quantities[quantity].parts
                assert parts is not None
                assert value == pytest.approx(quantities[quantity].value, rel=3e-6, abs=1e-9), quantity
                assert width == pytest.approx(parts.input, rel=1e-3, abs=1e-9), quantity
    assert compared >= 60
    assert {each["quantity"] for each in sweep.errors} >= {"lambda", "velocity", "usable_moment"}
    assert all(each["error"] < 1e-4 for each in sweep.errors)


def test_runs_are_those_of_the_balancer(paper_scene: Scene) -> None:
    sweep = rb.sweep(paper_scene, {"gas.pressure": ["0.42 MPa", "0.7 MPa"]}, runs=8, intervals=False)
    for row, run in enumerate(sweep.driven):
        balancer = balancer_of(sweep.point_scene(row))
        outcomes = balancer.run({}, Draws.block(FIRST_VERDICT_DEVICE, 8))
        met = np.all([each.met(outcomes) for each in balancer.demands()], axis=0)
        assert run["fraction"] == np.mean(met)
    assert sweep.driven[0]["fraction"] < sweep.driven[1]["fraction"]
    assert sweep.verdicts[0] == "not met"
    # Made once: rows, tables and figures ask for them point by point.
    assert sweep.verdicts is sweep.verdicts
    assert sweep.feasible is sweep.feasible


def test_runs_that_end_early_meet_the_same() -> None:
    """Devices of drawn designs that are above the limit at twice the settling time meet nothing later."""
    scene = rb.load_scene(rb.bundled_scene("spindle_design"))
    vary = {"tube.bore": "0.6mm:1.2mm", "controller.proportional": "0.02s/um:0.2s/um"}
    sample, met = rb.sweep(scene, vary, sample="latin:8", intervals=False), []
    for row in range(8):
        balancer = quick_balancer(sample.point_scene(row))
        demands = balancer.demands()
        full, early = (
            balancer.run_all([{}], Draws.block(FIRST_VERDICT_DEVICE, 16, complete=False, deadline=until))[0]
            for until in (math.inf, 2 * demands[0].required)
        )
        for demand in demands:
            assert demand.met(early).tolist() == demand.met(full).tolist()
        met += demands[0].met(early).tolist()
    assert {*met} == {True, False}


def test_where_nothing_flows_there_is_no_drag_coefficient(paper_scene: Scene) -> None:
    """Just below the pressure that starts a flow, and where a primed tube would run, k has no value."""
    sweep = rb.sweep(paper_scene, {"gas.pressure": [0.301e6, 0.3336e6, 0.35e6]}, check=3)
    columns = sweep.columns()
    assert [velocity > 0 for velocity in columns["velocity [m/s]"]] == [False, False, True]
    for name in ("drag_coefficient [1]", "drag_coefficient input half-width [1]"):
        assert [value is None for value in columns[name]] == [True, True, False]
    assert [row["drag_coefficient [1]"] == "" for row in table(sweep)] == [True, True, False]


def test_round_off_is_no_interval_of_a_sweep(paper_scene: Scene) -> None:
    size = len(UNITS)
    row = _row(np.array([Regime.SEPARATED, *size * [10.75625], *size * [5.7e-14]], dtype=float))
    assert row["values"]["velocity"] == [10.75625, 0.0]
    sweep = rb.sweep(paper_scene, {"tube.bore": [1e-3]})
    row["values"]["velocity"] = [10.75625, 5.7e-14]
    shown = replace(sweep, static=({**sweep.static[0], "values": row["values"]},)).rows()
    (best,) = [each.rows for each in shown.tables if each.caption.startswith("Best")]
    assert ("velocity", "10.76\u202fm/s") in best


def test_the_best_row_says_that_it_stands_at_the_end(paper_scene: Scene) -> None:
    ends = rb.sweep(paper_scene, {"tube.bore": "0.6mm:2mm:15"}, intervals=False)
    values = [each.values for each in ends.rows().findings if each.code == "sweep_edge"]
    assert values == [{"path": "tube.bore", "end": "0.6 mm"}]
    (best,) = [each.text for each in ends.rows().findings if each.code == "sweep_best"]
    assert "nothing was run" in best
    inside = rb.sweep(paper_scene, {"gas.pressure": "0.3MPa:5MPa:10"}, intervals=False)
    assert inside.best not in (0, 9)
    assert "sweep_edge" not in {each.code for each in inside.rows().findings}


def test_a_sweep_can_be_pickled(paper_scene: Scene) -> None:
    table = rb.sweep(paper_scene, {"tube.bore": [1e-3, 2e-3]}, intervals=False)
    assert pickle.loads(pickle.dumps(table)).to_dict() == table.to_dict()


def test_one_design_is_answered_as_a_row_of_a_sweep(paper_scene: Scene) -> None:
    changes = {"gas.pressure": 0.42e6}
    answer = rb.objective(paper_scene, changes, runs=64)
    row = rb.sweep(paper_scene, {"gas.pressure": [0.42e6]}, runs=64, intervals=False)
    assert answer["usable_moment"] == row.static[0]["values"]["usable_moment"][0]
    assert answer["fraction"] == row.driven[0]["fraction"]
    # Four devices of which none settles decide.
    assert (answer["verdict"], answer["devices"]) == ("not met", 4)
    assert rb.objective(paper_scene, {"tube.hump_radius": 0.5}, runs=64)["status"] == "point_refused"


def test_eccentric_masses_have_their_own_rows() -> None:
    scene = rb.load_scene(rb.bundled_scene("driven_masses_small"))
    sweep = rb.sweep(scene, {"masses.mass": np.array([1.0, 1.1]) * scene.masses.mass}, runs=1)  # type: ignore[attr-defined]
    reach = [row["values"]["reach"][0] for row in sweep.static]
    assert reach[1] == pytest.approx(1.1 * reach[0])
    assert all(0 <= run["fraction"] <= 1 for run in sweep.driven)


def test_masses_without_runs_are_not_judged_and_their_ceilings_are_named_so() -> None:
    scene = rb.load_scene(rb.bundled_scene("washing_machine"))
    sweep = rb.sweep(scene, {"masses.mass": [0.4, 0.8]})
    assert [each.code for each in sweep.rows().findings] == ["sweep_not_judged"]
    assert sweep.best is None
    settings = {"lqr.state_weight", "friction_filter.speed_gain", "friction_filter.pair_gain", "voltage_hold"}
    names = {name.partition(" [")[0] for name in sweep.columns()}
    assert {f"{each}, at most" for each in settings} <= names
    assert not settings & names


def test_a_point_that_is_refused_is_a_row(paper_scene: Scene) -> None:
    sweep = rb.sweep(paper_scene, {"tube.hump_radius": ["30 mm", "500 mm"]}, runs=1)
    assert [row["status"] for row in sweep.static] == ["ok", "point_refused"]
    assert "hump_radius" in sweep.failures[1]
    assert table(sweep)[1]["velocity [m/s]"] == ""
    assert sweep.best in (0, None)


def test_devices_out_of_reach_are_not_run_and_count_all_the_same(paper_scene: Scene) -> None:
    """Fraction and codes of devices that lack capacity are those of runs to their ends."""
    scene = paper_scene.with_values({"rotor.initial_vibration.amplitude": "24 um"})
    (row,) = rb.sweep(scene, {"gas.pressure": [0.7e6]}, runs=16, intervals=False).driven
    same = balancer_of(scene.with_values({"gas.pressure": 0.7e6}))
    (full,) = judged_all(same, [{}], first=row["devices"], most=row["devices"])
    assert row["fraction"] == full.fraction.value
    assert row["ended"] == dict(Counter(full.outcomes.ended))
    assert row["ended"]["capacity_exceeded"] > 0


def test_rows_that_err_by_more_than_the_tolerance_are_named(paper_scene: Scene) -> None:
    strict = paper_scene.with_values({"accuracy.tolerance": 1e-10})
    for scene, coarse in ((paper_scene, set()), (strict, {"velocity"})):
        sweep = rb.sweep(scene, {"tube.bore": [1e-3]}, intervals=False, check=1)
        findings = sweep.rows().findings
        named = {each.values["quantity"] for each in findings if each.code == "sweep_too_coarse"}
        assert named >= coarse
        assert bool(named) == bool(coarse)
        (worst,) = (each for each in findings if each.code == "sweep_left_out")
        assert worst.values["error"] == max(each["error"] for each in sweep.errors)
        # The size of the models' errors is that of each quantity.
        assert all(each["quantity"] in worst.text for each in sweep.errors)


def test_where_no_point_serves_enough_devices_the_nearest_is_named(paper_scene: Scene) -> None:
    scene = paper_scene.with_values({"requirement.fraction": 0.999})
    sweep = rb.sweep(scene, {"gas.pressure": ["0.42 MPa", "0.62 MPa"]}, runs=16, intervals=False)
    assert (sweep.best, sweep.nearest) == (None, 1)
    assert "sweep_nearest" in {each.code for each in sweep.rows().findings}
    assert sweep.rows().tables[1].caption == "Nearest: row 1"


def test_rows_that_runs_do_not_tell_from_the_best_are_named(paper_scene: Scene) -> None:
    """Those that settle by the upper bound of its time; of the nearest, those that may serve as many."""
    sweep = rb.sweep(paper_scene, {"gas.pressure": [5e5, 6e5, 7e5, 8e5]}, runs=4, intervals=False)
    best = {"verdict": MET, "settling_time_high": 9.0}
    rows = [{**best, "settling_time": time} for time in (5.0, 9.0, 9.1)]
    missed = {**best, "verdict": MISSED, "settling_time": 6.0}

    def said(driven: list[dict[str, object]]) -> list[str]:
        changed = replace(sweep, driven=tuple({**sweep.driven[0], **each} for each in driven))
        return [each.text for each in changed.rows().findings if each.code == "sweep_alike"]

    assert said([*rows, missed]) == [
        "row 0 is not told from row 1 by these runs: they differ by less than the interval (95 %) of its "
        "settling time"
    ]
    assert not said([rows[0], *rows[2:], missed, missed])
    shares = [{"verdict": MISSED, "fraction": 0.5, "high": high} for high in (0.6, 0.4, 0.49)]
    assert not said([*shares, {**shares[1], "fraction": 0.1}])
    (text,) = said([*shares, {**shares[0], "fraction": 0.45}])
    assert "row 0 is not told from row 3" in text
    assert text.endswith("of its fraction")


def test_intervals_of_a_sweep_say_that_they_are_of_inputs_alone(paper_scene: Scene) -> None:
    sweep = rb.sweep(paper_scene, {"tube.bore": ["1.2 mm"]})
    width = sweep.columns()["velocity input half-width [m/s]"][0]
    whole = rb.calibrate(paper_scene.with_values({"tube.bore": "1.2 mm"})).quantities["velocity"]
    assert whole.parts is not None
    assert width == pytest.approx(whole.parts.input, rel=0.05)
    assert width < 0.5 * whole.parts.total
    codes = [each["code"] for each in sweep.to_dict()["findings"]]
    assert "sweep_intervals" in codes
    bare = rb.sweep(paper_scene, {"tube.bore": ["1.2 mm"]}, intervals=False)
    assert "sweep_intervals" not in {each.code for each in bare.rows().findings}


def test_a_printed_sweep_has_all_findings(paper_scene: Scene) -> None:
    sweep = rb.sweep(paper_scene, {"tube.bore": ["1.2 mm", "1.4 mm"]}, check=1)
    findings = sweep.to_dict()["findings"]
    assert {"sweep_best", "sweep_left_out", "sweep_intervals"} <= {each["code"] for each in findings}
    assert [line.strip() for line in repr(sweep).splitlines()[1:]] == [each["text"] for each in findings]


def test_too_few_devices_to_meet_a_fraction_are_named_before_they_run(
    paper_scene: Scene, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    """35 of 35 have a lower bound above 90 %, 34 of 34 one below; for 95 % 73."""
    before: list[list[str]] = []

    def run_row(*_: object, **__: object) -> dict[str, object]:
        before.append([*caplog.messages])
        return {**EMPTY, "verdict": OPEN}

    monkeypatch.setattr("ringbalance.design.runs.run_row", run_row)
    for required, least in ((0.9, 35), (0.95, 73)):
        assert Proportion(count=least, of=least).verdict(required) == MET
        assert Proportion(count=least - 1, of=least - 1).verdict(required) == OPEN
        scene = paper_scene.with_values({"requirement.fraction": required})
        for runs in (16, least - 1, least):
            caplog.clear()
            before.clear()
            rb.sweep(scene, {"tube.bore": [1e-3]}, intervals=False, runs=runs)
            assert before == [caplog.messages]
            assert [f"take {least} or more" in each for each in caplog.messages] == [True] * (runs < least)


def test_a_result_of_one_value_or_of_one_point_has_no_shares_and_says_so(paper_scene: Scene) -> None:
    """Warnings are errors: where all devices, few or none of a point meet what is required."""
    vary = {"tube.bore": "1mm:2mm", "gas.pressure": "0.6MPa:0.8MPa"}
    still = rb.sweep(paper_scene, vary, sample="sobol:64", intervals=False)
    for fractions in (np.ones(64), np.zeros(64), np.arange(64) == 5, np.arange(64) / 64):
        driven = tuple({**EMPTY, "devices": 8, "fraction": float(each)} for each in fractions)
        sweep = replace(still, runs=8, driven=driven)
        varies = len({*fractions.tolist()}) > 2
        for shares in (sweep.sensitivity(), sweep.sensitivity(total=True)):
            assert ("fraction" in shares) == varies
            assert "devices" not in shares
            values = [part for axes in shares.values() for pair in axes.values() for part in pair]
            assert np.isfinite(values).all()
        named = "sweep_no_shares" in {each.code for each in sweep.rows().findings}
        assert named == (not varies)


def test_the_summary_of_a_sample_says_what_decides(paper_scene: Scene, valves: Path) -> None:
    """One share for each axis, a list of valves among them."""
    vary = {"tube.bore": "1mm:2mm", "gas": valves}
    sweep = rb.sweep(paper_scene, vary, sample="sobol:64", intervals=False)
    (shares,) = sweep.to_dict()["sensitivity"].values()
    assert set(shares) == {"tube.bore", "gas.name"}
    assert shares["tube.bore"][0] > 0.9
    assert shares["gas.name"][0] < shares["gas.name"][1]
    assert sweep.sensitivity()["reach"] == shares
