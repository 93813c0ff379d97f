"""A sweep's rows: those of a calibration and of the balancers' runs, by whomever they are computed."""

from __future__ import annotations

import csv
import io
import math
import os
import pickle
import re
import shutil
from collections import Counter
from concurrent.futures import Executor, Future, ThreadPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from sweep import on_paper

import ringbalance as rb
from ringbalance.cli import main
from ringbalance.controller.balancer import Draws, balancer_of, quick_balancer
from ringbalance.controller.judging.judge import FIRST_VERDICT_DEVICE, judged_all
from ringbalance.design.static import UNITS, _row
from ringbalance.design.store import Store
from ringbalance.design.work import bundle_size
from ringbalance.reduced_model.law.flow_law import Regime
from ringbalance.results.numbers import format_given
from ringbalance.scene.models import Scene

VARY = {"tube.bore": "0.6mm:2mm:4:log", "gas.pressure": np.linspace(0.3e6, 0.9e6, 3)}


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
    found = rb.sweep(scene, vary, sample="latin:10", check=2)
    compared = 0
    for row in range(10):
        known = rb.calibrate(found.point_scene(row)).quantities
        assert found.static[row]["sha256"] == found.point_scene(row).sha256
        for quantity, (value, width) in found.static[row]["values"].items():
            if quantity in known and value is not None:
                compared += 1
                parts = known[quantity].parts
                assert parts is not None
                assert value == pytest.approx(known[quantity].value, rel=3e-6, abs=1e-9), quantity
                assert width == pytest.approx(parts.input, rel=1e-3, abs=1e-9), quantity
    assert compared >= 60
    assert {each["quantity"] for each in found.errors} >= {"lambda", "velocity", "usable_moment"}
    assert all(each["error"] < 1e-4 for each in found.errors)


def test_runs_are_those_of_the_balancer(paper_scene: Scene) -> None:
    found = rb.sweep(paper_scene, {"gas.pressure": ["0.42 MPa", "0.7 MPa"]}, runs=8, intervals=False)
    for row, run in enumerate(found.driven):
        balancer = balancer_of(found.point_scene(row))
        outcomes = balancer.run({}, Draws.block(FIRST_VERDICT_DEVICE, 8))
        met = np.all([each.met(outcomes) for each in balancer.demands()], axis=0)
        assert run["fraction"] == np.mean(met)
    assert found.driven[0]["fraction"] < found.driven[1]["fraction"]
    assert found.verdicts[0] == "not met"
    # Made once: rows, tables and figures ask for them point by point.
    assert found.verdicts is found.verdicts
    assert found.feasible is found.feasible


def test_runs_that_end_early_meet_the_same() -> None:
    """Of devices of drawn designs: who is above the limit at twice the settling time meets nothing later."""
    scene = rb.load_scene(rb.bundled_scene("spindle_design"))
    vary = {"tube.bore": "0.6mm:1.2mm", "controller.proportional": "0.02s/um:0.2s/um"}
    drawn, met = rb.sweep(scene, vary, sample="latin:8", intervals=False), []
    for row in range(8):
        balancer = quick_balancer(drawn.point_scene(row))
        demands = balancer.demands()
        whole, early = (
            balancer.run_all([{}], Draws.block(FIRST_VERDICT_DEVICE, 16, whole=False, until=until))[0]
            for until in (math.inf, 2 * demands[0].required)
        )
        for demand in demands:
            assert demand.met(early).tolist() == demand.met(whole).tolist()
        met += demands[0].met(early).tolist()
    assert {*met} == {True, False}


def test_where_nothing_flows_there_is_no_drag_coefficient(paper_scene: Scene) -> None:
    """Just below the pressure that starts a flow, and where a primed tube would run, k has no value."""
    found = rb.sweep(paper_scene, {"gas.pressure": [0.301e6, 0.3336e6, 0.35e6]}, check=3)
    columns = found.columns()
    assert [velocity > 0 for velocity in columns["velocity [m/s]"]] == [False, False, True]
    for name in ("drag_coefficient [1]", "drag_coefficient half-width [1]"):
        assert [value is None for value in columns[name]] == [True, True, False]
    assert [row["drag_coefficient [1]"] == "" for row in table(found)] == [True, True, False]


def test_round_off_is_no_interval_of_a_sweep(paper_scene: Scene) -> None:
    size = len(UNITS)
    row = _row(np.array([Regime.SEPARATED, *size * [10.75625], *size * [5.7e-14]], dtype=float))
    assert row["values"]["velocity"] == [10.75625, 0.0]
    found = rb.sweep(paper_scene, {"tube.bore": [1e-3]})
    row["values"]["velocity"] = [10.75625, 5.7e-14]
    shown = replace(found, static=({**found.static[0], "values": row["values"]},)).rows()
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


def test_a_store_says_what_it_answered(paper_scene: Scene, tmp_path: Path) -> None:
    few, more = ({"tube.bore": [1e-3 * bore for bore in bores]} for bores in ([1.0, 1.2], [1.0, 1.2, 1.4]))
    first = rb.sweep(paper_scene, few, runs=1, intervals=False, store=tmp_path)
    assert first.resumed == {}
    again = rb.sweep(paper_scene, more, runs=1, intervals=False, store=tmp_path)
    assert again.to_dict()["resumed"] == {"runs": 2}
    (finding,) = (each for each in again.rows().findings if each.code == "sweep_resumed")
    assert finding.values == {"count": 2, "what": "runs"}
    assert again.driven[:2] == first.driven


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
    found = rb.sweep(scene, {"masses.mass": np.array([1.0, 1.1]) * scene.masses.mass}, runs=1)  # type: ignore[attr-defined]
    reach = [row["values"]["reach"][0] for row in found.static]
    assert reach[1] == pytest.approx(1.1 * reach[0])
    assert all(0 <= run["fraction"] <= 1 for run in found.driven)


def test_masses_without_runs_are_not_judged_and_their_ceilings_are_named_so() -> None:
    scene = rb.load_scene(rb.bundled_scene("washing_machine"))
    found = rb.sweep(scene, {"masses.mass": [0.4, 0.8]})
    assert [each.code for each in found.rows().findings] == ["sweep_not_judged"]
    assert found.best is None
    settings = {"lqr.state_weight", "friction_filter.speed_gain", "friction_filter.pair_gain", "voltage_hold"}
    names = {name.partition(" [")[0] for name in found.columns()}
    assert {f"{each}, at most" for each in settings} <= names
    assert not settings & names


def test_a_point_that_is_refused_is_a_row(paper_scene: Scene) -> None:
    found = rb.sweep(paper_scene, {"tube.hump_radius": ["30 mm", "500 mm"]}, runs=1)
    assert [row["status"] for row in found.static] == ["ok", "point_refused"]
    assert "hump_radius" in found.failures[1]
    assert table(found)[1]["velocity [m/s]"] == ""
    assert found.best in (0, None)


def test_axes_of_every_kind_make_the_same_points(paper_scene: Scene, tmp_path: Path) -> None:
    (tmp_path / "valves.csv").write_text(
        "name,conductance,critical_ratio,valve_lag\nslow,0.5 l/(s*bar),0.3,5 ms\nfast,2 l/(s*bar),0.3,2 ms\n"
    )
    rows = [
        {"conductance": f"{each} l/(s*bar)", "critical_ratio": 0.3, "valve_lag": lag}
        for each, lag in (("0.5", "5 ms"), ("2", "2 ms"))
    ]
    by_file = rb.sweep(paper_scene, {"gas": tmp_path / "valves.csv"}, intervals=False)
    by_rows = rb.sweep(paper_scene, {"gas": rows}, intervals=False)
    assert [row["values"] for row in by_file.static] == [row["values"] for row in by_rows.static]
    assert by_file.point_scene(1).gas.valve_lag == 2e-3  # type: ignore[attr-defined]
    linked = rb.sweep(
        paper_scene, {("tube.bore", "tube.length"): (["1 mm", "2 mm"], [0.3, 0.4])}, intervals=False
    )
    assert [dict(point) for point in linked.points] == [
        {"tube.bore": 1e-3, "tube.length": 0.3},
        {"tube.bore": 2e-3, "tube.length": 0.4},
    ]
    sobol = rb.sweep(
        paper_scene,
        {"tube.bore": "1mm:2mm", "gas.pressure": "0.4MPa:0.8MPa"},
        sample="sobol:8",
        intervals=False,
    )
    places = np.array([[p["tube.bore"] / 1e-3 - 1, p["gas.pressure"] / 0.4e6 - 1] for p in sobol.points])
    assert all(sorted((8 * column).astype(int)) == list(range(8)) for column in places.T)


@pytest.mark.parametrize(
    ("vary", "sample", "problem"),
    [
        ({"tube.bor": "1mm:2mm:3"}, "", "did you mean"),
        ({"tube.bore": "1mm:2kg:3"}, "", "unit of mass"),
        ({"tube.bore": "1mm:2mm"}, "", "steps"),
        ({"tube.bore": "1mm:2mm:x"}, "", "no range"),
        ({"tube.bore": "1mm:2mm"}, "halton:8", "no sample"),
        (
            {"tube.bore": [0.7, 1.5, 2.5]},
            "",
            "bare numbers are in m, and all are far from the scene's 1.5 mm",
        ),
        ({"gas.pressure": [0.5, 0.7]}, "", 'as "0.7 MPa"'),
        ({"gas": "nowhere.csv"}, "", "there is no such file"),
        ({"tube.bore": "1mm:2mm:1000", "gas.pressure": "1MPa:2MPa:1001"}, "", "1001000 points"),
        ({}, "", "nothing varies"),
        ({("tube.bore", "tube.length"): (["1 mm"], ["1 m", "2 m"])}, "", "number of values"),
    ],
)
def test_a_bad_axis_is_one_clear_error(
    paper_scene: Scene, vary: dict[Any, Any], sample: str, problem: str
) -> None:
    with pytest.raises(rb.SceneError, match=problem):
        rb.sweep(paper_scene, vary, sample=sample)


def test_a_sweep_over_a_wide_range_is_no_wrong_unit(paper_scene: Scene) -> None:
    """From a tenth to 300 times the scene's own bore: only a list that is far as a whole is refused."""
    bore = paper_scene.tube.bore
    table = rb.sweep(paper_scene, {"tube.bore": [0.1 * bore, 300 * bore]}, intervals=False)
    assert [point["tube.bore"] for point in table.points] == pytest.approx([0.1 * bore, 300 * bore])


class Lost(Executor):
    """Workers that the system ends: at work, or before, as a pool that is broken already says at once."""

    def __init__(self, *, before: bool = False) -> None:
        self.before = before

    def submit(self, _function: Any, /, *_: Any, **_named: Any) -> Future[Any]:
        future: Future[Any] = Future()
        if self.before:
            raise BrokenProcessPool("ended before")
        future.set_exception(BrokenProcessPool("ended"))
        return future


def test_any_executor_gives_the_same_table(paper_scene: Scene, caplog: pytest.LogCaptureFixture) -> None:
    pressures = {"gas.pressure": np.linspace(0.4e6, 0.8e6, 5)}
    serial = rb.sweep(paper_scene, pressures, runs=2).to_csv()
    with ThreadPoolExecutor(2) as threads:
        assert rb.sweep(paper_scene, pressures, runs=2, executor=threads).to_csv() == serial
    for lost in (Lost(), Lost(before=True)):
        caplog.clear()
        assert rb.sweep(paper_scene, pressures, runs=2, executor=lost).to_csv() == serial
        (note,) = caplog.messages
        assert "its work is done again in this process" in note


def test_kept_answers_are_found_by_content_and_damaged_ones_made_again(
    paper_scene: Scene, tmp_path: Path
) -> None:
    done: list[int] = []

    def sweep(**options: Any) -> str:
        done.clear()
        found = rb.sweep(
            paper_scene, VARY, store=tmp_path, progress=lambda d: done.append(d.computed), **options
        )
        return found.to_csv()

    first = sweep()
    assert done[-1] == 12
    assert sweep() == first
    assert done[-1] == 0
    (entry,) = (path for path in tmp_path.rglob("*") if path.is_file())
    content = bytearray(entry.read_bytes())
    content[len(content) // 2] ^= 4
    entry.write_bytes(bytes(content))
    assert Store(folder=tmp_path).get(entry.name) is None
    assert sweep() == first
    assert done[-1] == 12
    for spoil in (
        partial(entry.symlink_to, "/dev/zero"),
        partial(os.mkfifo, entry),
        partial((entry / "more").mkdir, parents=True),
    ):
        entry.unlink()
        spoil()
        assert sweep() == first
        assert done[-1] == 12
        assert entry.is_file()
    shutil.rmtree(entry.parent)
    entry.parent.touch()
    assert sweep() == first
    assert entry.is_file()
    sweep(intervals=False)
    assert done[-1] == 12


def test_bundles_hide_what_a_call_costs_and_leave_work_for_all() -> None:
    """At 5 ms a call and 5 % of it: at least 100 ms of work, except where workers would be idle."""
    for seconds in (1e-4, 1e-2, 0.3, 10.0):
        size = bundle_size(seconds, count=100_000, workers=4)
        assert size * seconds >= 0.1
    assert bundle_size(1e-3, count=64, workers=4) == 2


@pytest.mark.parametrize(("workers", "least"), [(10, 0.95), (100, 0.95), (1000, 0.8)])
def test_many_workers_wait_little_for_the_process_that_serves_them(workers: int, least: float) -> None:
    """On paper: 100,000 designs of 0.25 s, 5 ms a call."""
    assert on_paper(workers, designs=100_000, each=0.25) > least


def test_a_map_is_drawn_with_its_boundary(paper_scene: Scene, tmp_path: Path) -> None:
    found = rb.sweep(
        paper_scene, {"tube.bore": "1mm:2mm:3", "gas.pressure": "0.2MPa:0.8MPa:4"}, intervals=False
    )
    names = [path.name for path in found.plot(tmp_path)]
    assert names == ["sweep-reach.svg", "sweep-velocity.svg", "sweep-loop-factor.svg"]
    assert found.best is not None
    assert math.isfinite(found.static[found.best]["values"]["reach"][0])
    assert "not feasible" in (tmp_path / names[0]).read_text()


def test_devices_out_of_reach_are_not_run_and_count_all_the_same(paper_scene: Scene) -> None:
    """Where many devices lack capacity, fraction and codes are those of runs to their ends."""
    scene = paper_scene.with_values({"rotor.initial_vibration.amplitude": "24 um"})
    (row,) = rb.sweep(scene, {"gas.pressure": [0.7e6]}, runs=16, intervals=False).driven
    same = balancer_of(scene.with_values({"gas.pressure": 0.7e6}))
    (whole,) = judged_all(same, [{}], first=row["devices"], most=row["devices"])
    assert row["fraction"] == whole.fraction.value
    assert row["ended"] == dict(Counter(whole.outcomes.ended))
    assert row["ended"]["capacity_exceeded"] > 0


def test_rows_that_err_by_more_than_the_tolerance_are_named(paper_scene: Scene) -> None:
    strict = paper_scene.with_values({"accuracy.tolerance": 1e-10})
    for scene, coarse in ((paper_scene, set()), (strict, {"velocity"})):
        found = rb.sweep(scene, {"tube.bore": [1e-3]}, intervals=False, check=1)
        findings = found.rows().findings
        named = {each.values["quantity"] for each in findings if each.code == "sweep_too_coarse"}
        assert named >= coarse
        assert bool(named) == bool(coarse)
        (worst,) = (each for each in findings if each.code == "sweep_left_out")
        assert worst.values["error"] == max(each["error"] for each in found.errors)


@pytest.mark.parametrize(
    ("text", "messages"),
    [
        ('vary = ["tube.bor=1mm"]', ['vary = "tube.bor": a scene of this kind has no such key']),
        (
            'vary = ["gas=none.csv", "tube.bore=1:2:3"]',
            ['vary = "gas=none.csv": there is no such file', 'vary = "tube.bore=1": the unit is missing'],
        ),
        ('vary = ["tube.bore=1mm"]\nruns = 4', ["runs: unknown key"]),
        ('vary = "tube.bore=1mm"\nsample = 3', ["vary: it is no list of axes", "sample: it is no text"]),
        ('vary = ["tube.bore=1mm:2mm"]\nsample = "halton:8"', ['sample = "halton:8": this is no sample']),
        (None, ["there is no such file; allowed: a TOML file with vary and sample"]),
    ],
)
def test_an_error_of_a_plan_names_its_file_and_key(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], text: str | None, messages: list[str]
) -> None:
    plan, out = tmp_path / "plan.toml", tmp_path / "out"
    if text is not None:
        plan.write_text(text)
    scene = str(rb.bundled_scene("liquid_ring_paper"))
    assert main(["sweep", scene, "--plan", str(plan), "--out", str(out)]) == 2
    lines = capsys.readouterr().err.replace(f"{tmp_path}/", "").splitlines()
    assert len(lines) == len(messages)
    for line, message in zip(lines, messages, strict=True):
        assert line.startswith(f"plan.toml: {message}")


def test_arguments_that_make_no_sense_are_named(paper_scene: Scene) -> None:
    bore: Any = {"tube.bore": [1e-3]}
    for arguments in ({"runs": -1}, {"runs": 2.5}, {"check": -1}, {"workers": 0}):
        (name,) = arguments
        with pytest.raises(ValueError, match=f"`{name}` is a whole number of at least"):
            rb.sweep(paper_scene, bore, **arguments)
    with pytest.raises(TypeError, match="`vary` maps keys to values"):
        rb.sweep(paper_scene, ["tube.bore=1mm:2mm:3"])  # type: ignore[arg-type]
    with pytest.raises(TypeError, match="`executor` is none"):
        rb.sweep(paper_scene, bore, executor=3)  # type: ignore[arg-type]
    for vary, problem in (
        ({"tube.bore": []}, "no value stands there"),
        ({("tube.bore", "tube.length"): ([1e-3],)}, "one for each key"),
        ({"gas": [1e-8]}, "its rows are no mappings"),
    ):
        with pytest.raises(rb.SceneError, match=problem):
            rb.sweep(paper_scene, vary)


def test_a_single_value_and_a_single_row_are_lists_of_one(paper_scene: Scene) -> None:
    valve = {"conductance": "1 l/(s*bar)", "critical_ratio": 0.3, "valve_lag": "2 ms"}
    found = rb.sweep(paper_scene, {"tube.bore": 1e-3, "gas": valve}, intervals=False)
    assert [dict(point) for point in found.points] == [
        {"tube.bore": 1e-3, "gas.conductance": 1e-8, "gas.critical_ratio": 0.3, "gas.valve_lag": 2e-3}
    ]


def test_an_objective_refuses_a_misspelt_key_and_answers_a_refused_value(paper_scene: Scene) -> None:
    """Whose verdict is its status, as in a sweep's row, with runs too."""
    with pytest.raises(rb.SceneError, match='did you mean "bore"'):
        rb.objective(paper_scene, {"tube.bor": 1e-3})
    for runs in (0, 4):
        refused = rb.objective(paper_scene, {"tube.bore": -1.0}, runs=runs)
        assert (refused["status"], refused["verdict"]) == ("point_refused", "point_refused")
    with pytest.raises(ValueError, match="`runs`"):
        rb.objective(paper_scene, {"tube.bore": 1e-3}, runs=-1)


def test_figures_of_a_sweep_are_shown_without_a_folder(paper_scene: Scene) -> None:
    found = rb.sweep(paper_scene, {"tube.bore": [1e-3, 1.5e-3, 2e-3]}, intervals=False)
    assert found.plot().svg().count("tube.bore in mm") == 3


VALVES = """# from their data sheets
name;conductance [l/(s*bar)];critical_ratio;valve_lag
slow;0.5;0.3;5 ms
fast;2;30 %;2 ms
"""


@pytest.fixture
def valves(tmp_path: Path) -> Path:
    file = tmp_path / "valves.csv"
    file.write_text(VALVES, encoding="utf-8-sig")
    return file


def test_things_that_have_names_keep_them(paper_scene: Scene, valves: Path) -> None:
    """In the table, the summary and along the axes; units may stand in a head, as spreadsheets have them."""
    found = rb.sweep(paper_scene, {"gas": valves, "tube.bore": ["1 mm", "1.5 mm"]}, intervals=False)
    assert found.columns()["gas.name"] == ["slow", "slow", "fast", "fast"]
    assert found.columns()["gas.conductance [m^3/(s*Pa)]"] == [5e-9, 5e-9, 2e-8, 2e-8]
    assert found.grid() == {"gas.name": ["slow", "fast"], "tube.bore": [1e-3, 1.5e-3]}
    assert found.to_dict()["best"]["names"] == {"gas.name": "slow"}
    (best,) = (each.text for each in found.rows().findings if each.code == "sweep_best")
    assert "gas.name = slow, tube.bore = 1 mm" in best
    rows = [{"name": "slow", "conductance": "0.5 l/(s*bar)", "critical_ratio": 0.3, "valve_lag": "5 ms"}]
    assert rb.sweep(paper_scene, {"gas": rows}, intervals=False).columns()["gas.name"] == ["slow"]


def test_every_error_of_a_file_of_valves_names_its_cell(paper_scene: Scene, valves: Path) -> None:
    cases = {
        VALVES.replace("2;30 %", "2 bar;130 %"): [("line 4", "conductance"), ("line 4", "critical_ratio")],
        VALVES.replace("critical_ratio", "critical_ration"): [("line 2", "did you mean")],
        VALVES.replace("30 %;2 ms", "30 %"): [("line 4", "3 values, and the columns are 4")],
        VALVES.replace("valve_lag", "critical_ratio"): [("line 2", "stands twice")],
    }
    for text, expected in cases.items():
        valves.write_text(text)
        with pytest.raises(rb.SceneError) as caught:
            rb.sweep(paper_scene, {"gas": valves})
        lines = str(caught.value).splitlines()
        assert len(lines) == len(expected), lines
        for line, parts in zip(lines, expected, strict=True):
            assert all(part in line for part in ("valves.csv", *parts)), line


def test_a_map_of_more_axes_shows_those_with_most_values(
    paper_scene: Scene, valves: Path, tmp_path: Path
) -> None:
    """The others are held as in the best row; the boundary between shades is that of a two-axis sweep."""
    vary = {"gas": valves, "tube.bore": "1mm:2mm:3", "gas.pressure": "0.2MPa:0.8MPa:4"}
    found = rb.sweep(paper_scene, vary, intervals=False)
    reach = found.plot(tmp_path)[0].read_text()
    assert "gas.name = slow as in row" in reach
    values = [value for value in found.columns()["reach [kg m]"][:12] if value is not None]
    assert f"{format_given(max(values), 'kg m', digits=3)} (dark)" in reach
    alone = rb.sweep(paper_scene, dict(list(vary.items())[1:]), intervals=False)
    assert reach.count("<use") == alone.plot(tmp_path / "alone")[0].read_text().count("<use")


def test_where_no_point_serves_enough_devices_the_nearest_is_named(paper_scene: Scene) -> None:
    scene = paper_scene.with_values({"requirement.fraction": 0.999})
    found = rb.sweep(scene, {"gas.pressure": ["0.42 MPa", "0.62 MPa"]}, runs=16, intervals=False)
    assert (found.best, found.nearest) == (None, 1)
    assert "sweep_nearest" in {each.code for each in found.rows().findings}
    assert found.rows().tables[1].caption == "Nearest: row 1"


def test_points_that_do_not_meet_show_their_values_too_and_the_nearest_is_marked(
    paper_scene: Scene, tmp_path: Path
) -> None:
    scene = paper_scene.with_values({"requirement.fraction": 0.999})
    vary = {"gas.pressure": "0.42MPa:0.62MPa", "tube.bore": "1mm:2mm"}
    found = rb.sweep(scene, vary, sample="sobol:8", runs=8, intervals=False)
    assert found.best is None
    reach = next(path for path in found.plot(tmp_path) if path.name == "sweep-reach.svg").read_text()
    assert "nearest" in reach
    colours = re.findall(r'<use [^>]*style="fill: (#[0-9a-f]{6}); stroke', reach)
    assert len({*colours}) > 4


def test_the_summary_of_a_sample_says_what_decides(paper_scene: Scene, valves: Path) -> None:
    """One share for each axis, a list of valves among them."""
    vary = {"tube.bore": "1mm:2mm", "gas": valves}
    found = rb.sweep(paper_scene, vary, sample="sobol:64", intervals=False)
    (shares,) = found.to_dict()["sensitivity"].values()
    assert set(shares) == {"tube.bore", "gas.name"}
    assert shares["tube.bore"][0] > 0.9
    assert shares["gas.name"][0] < shares["gas.name"][1]
    assert found.sensitivity()["reach"] == shares


def test_rows_to_write_are_looked_at_first_and_refused_ones_cost_no_table(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    scene, out = str(rb.bundled_scene("liquid_ring_paper")), tmp_path / "out"
    options = ["--vary", "tube.hump_radius=30mm,500mm", "--out", str(out), "--no-figures", "--check", "0"]
    assert main(["sweep", scene, *options, "--write", "2"]) == 2
    assert not out.exists()
    assert main(["sweep", scene, *options, "--write", "0", "1"]) == 2
    assert "--write = 1: this row has no scene" in capsys.readouterr().err
    assert [file.name for file in (out / "scenes").iterdir()] == ["row-0.toml"]
    assert (out / "table.csv").exists()
