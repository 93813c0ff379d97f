"""Axes and plans of a sweep: every kind of values, names of choices, and errors."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

import ringbalance as rb
from ringbalance.cli import main
from ringbalance.scene.models import Scene


@pytest.mark.parametrize(
    ("name", "path", "text", "values"),
    [
        (
            "driven_masses_small",
            "masses.friction_arm",
            '["60 um", "60 um"],[80um, 40um]',
            [(6e-5, 6e-5), (8e-5, 4e-5)],
        ),
        ("driven_masses_small", "masses.initial_angle", "[0 deg,180deg]", [(0.0, np.pi)]),
        (
            "liquid_ring_paper",
            "controller.sequence",
            "[A,C,B,D],[A,B,C,D]",
            [("A", "C", "B", "D"), ("A", "B", "C", "D")],
        ),
        (
            "liquid_ring_paper",
            "controller.gas_time_offset",
            "10ms,[1ms,2ms,3ms,4ms]",
            [(0.01,), (1e-3, 2e-3, 3e-3, 4e-3)],
        ),
    ],
)
def test_keys_that_take_lists_vary(name: str, path: str, text: str, values: list[tuple[object, ...]]) -> None:
    """As in a scene file, with or without its quotation marks; the same in Python."""
    scene = rb.load_scene(name)
    table = rb.sweep(scene, {path: text}, intervals=False)
    points = [point[path] for point in table.points]
    assert points == [pytest.approx(each) if isinstance(each[0], float) else each for each in values]
    again = rb.sweep(scene, {path: [list(each) for each in values]}, intervals=False)
    assert again.to_csv() == table.to_csv()
    assert [row["status"] for row in table.static] == ["ok"] * len(values)


def test_a_list_of_the_wrong_length_is_refused(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    for values in ("40um:80um:5", "[40um]", "[40um,60um"):
        vary = f"masses.friction_arm={values}"
        assert main(["sweep", "driven_masses_small", "--vary", vary, "--out", str(tmp_path / "out")]) == 2
        assert (
            'it is not a list of 2; allowed: a list of 2 such as ["10 mm", "10 mm"]'
            in capsys.readouterr().err
        )


def test_axes_of_every_kind_make_the_same_points(paper_scene: Scene, valves: Path) -> None:
    rows = [
        {"conductance": f"{each} l/(s*bar)", "critical_ratio": 0.3, "valve_lag": lag}
        for each, lag in (("0.5", "5 ms"), ("2", "2 ms"))
    ]
    by_file, by_rows = (rb.sweep(paper_scene, {"gas": each}, intervals=False) for each in (valves, rows))
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
    shares = np.array([[p["tube.bore"] / 1e-3 - 1, p["gas.pressure"] / 0.4e6 - 1] for p in sobol.points])
    assert all(sorted((8 * column).astype(int)) == list(range(8)) for column in shares.T)


@pytest.mark.parametrize(
    ("vary", "sample", "problem"),
    [
        ({"tube.bor": "1mm:2mm:3"}, "", "did you mean"),
        ({"tube.bore": "1mm:2kg:3"}, "", "unit of mass"),
        ({"tube.bore": "1mm:2mm"}, "", "steps"),
        ({"tube.bore": "1mm:2mm:x"}, "", "whole and above 0"),
        ({"tube.bore": "1mm:2mm:3:x:y"}, "", "no range"),
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


def test_an_array_of_points_is_an_axis_with_a_row_for_each(paper_scene: Scene) -> None:
    points = np.array([[1e-3, 60e-3], [1.2e-3, 70e-3], [1.5e-3, 80e-3]])
    paths = ("tube.bore", "disc.axial_width")
    table = rb.sweep(paper_scene, {paths: points}, intervals=False)
    assert [tuple(point.values()) for point in table.points] == [*map(tuple, points.tolist())]
    assert table.points == rb.sweep(paper_scene, {paths: points.T}, intervals=False).points
    for shape, problem in (((2, 2), "square array"), ((5, 3), r"shape \(5, 3\)")):
        with pytest.raises(rb.SceneError, match=problem):
            rb.sweep(paper_scene, {paths: np.ones(shape)})


def test_errors_from_python_name_the_function_and_its_argument(paper_scene: Scene) -> None:
    table = rb.sweep(paper_scene, {"tube.bore": [1e-3]}, intervals=False)
    for call, start in (
        (lambda: rb.sweep(paper_scene, {"tube.bor": [1e-3]}), 'rb.sweep: vary = "tube.bor": '),
        (lambda: rb.sweep(paper_scene, {}), 'rb.sweep: vary = "": nothing varies'),
        (lambda: rb.sweep(paper_scene, {"tube.bore": "1mm:2mm"}, sample="none"), 'rb.sweep: sample = "none"'),
        (lambda: table.point_scene(3), "point_scene: row = 3: no such row; allowed: 0 to 0"),
    ):
        with pytest.raises(rb.SceneError) as caught:
            call()
        assert str(caught.value).startswith(start)


def test_a_single_value_and_a_single_row_are_lists_of_one(paper_scene: Scene) -> None:
    valve = {"conductance": "1 l/(s*bar)", "critical_ratio": 0.3, "valve_lag": "2 ms"}
    sweep = rb.sweep(paper_scene, {"tube.bore": 1e-3, "gas": valve}, intervals=False)
    assert [dict(point) for point in sweep.points] == [
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


def test_things_that_have_names_keep_them(paper_scene: Scene, valves: Path) -> None:
    """In the table, the summary and along the axes; units may stand in a head, as spreadsheets have them."""
    sweep = rb.sweep(paper_scene, {"gas": valves, "tube.bore": ["1 mm", "1.5 mm"]}, intervals=False)
    assert sweep.columns()["gas.name"] == ["slow", "slow", "fast", "fast"]
    assert sweep.columns()["gas.conductance [m^3/(s*Pa)]"] == [5e-9, 5e-9, 2e-8, 2e-8]
    assert sweep.grid() == {"gas.name": ["slow", "fast"], "tube.bore": [1e-3, 1.5e-3]}
    assert sweep.to_dict()["best"]["names"] == {"gas.name": "slow"}
    (best,) = (each.text for each in sweep.rows().findings if each.code == "sweep_best")
    assert "gas.name = slow, tube.bore = 1 mm" in best
    rows = [{"name": "slow", "conductance": "0.5 l/(s*bar)", "critical_ratio": 0.3, "valve_lag": "5 ms"}]
    assert rb.sweep(paper_scene, {"gas": rows}, intervals=False).columns()["gas.name"] == ["slow"]


def test_every_error_of_a_file_of_valves_names_its_cell(paper_scene: Scene, valves: Path) -> None:
    sound = valves.read_text(encoding="utf-8-sig")
    cases = {
        sound.replace("2;30 %", "2 bar;130 %"): [("line 4", "conductance"), ("line 4", "critical_ratio")],
        sound.replace("critical_ratio", "critical_ration"): [("line 2", "did you mean")],
        sound.replace("30 %;2 ms", "30 %"): [("line 4", "3 values, and the columns are 4")],
        sound.replace("valve_lag", "critical_ratio"): [("line 2", "stands twice")],
    }
    for text, expected in cases.items():
        valves.write_text(text)
        with pytest.raises(rb.SceneError) as caught:
            rb.sweep(paper_scene, {"gas": valves})
        lines = str(caught.value).splitlines()
        assert len(lines) == len(expected), lines
        for line, parts in zip(lines, expected, strict=True):
            assert all(part in line for part in ("valves.csv", *parts)), line


def test_tolerances_are_swept_as_they_are_written(paper_scene: Scene) -> None:
    """A tolerance is read with its kind, relative or not: neither is a plain number."""
    table = rb.sweep(paper_scene, {"uncertainty.bore": "0.01 mm,2 %"}, intervals=False)
    assert [row["status"] for row in table.static] == ["ok", "ok"]
    assert [point["uncertainty.bore"] for point in table.points] == ["0.01 mm", "2 %"]
