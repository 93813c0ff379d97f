"""The command fit end to end: the examples, text and JSON, templates, refusals, the pages about it."""

from __future__ import annotations

import contextlib
import io
import json
import math
import re
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import doc_tables
import example_measurements
import pytest

from ringbalance.cli import main
from ringbalance.identification.parameters import inputs_of
from ringbalance.identification.reading import KINDS, observations_of, read_observations, template
from ringbalance.scene import bundled_scene, load_scene
from ringbalance.scene.models import Scene
from ringbalance.scene.narrowing import liquid_ring_scene
from ringbalance.scene.uncertain import with_value

PAPER = str(bundled_scene("liquid_ring_paper"))
EXAMPLES = {kind: str(example_measurements.FOLDER / f"{kind}.csv") for kind in example_measurements.EXAMPLES}
ROOT = Path(__file__).resolve().parents[2]
Run = Callable[..., tuple[int, str, str]]


@pytest.fixture
def run(capsys: pytest.CaptureFixture[str]) -> Run:
    """Exit code, standard output and standard error of `ringbalance fit` with some words."""

    def run_it(*words: str | Path) -> tuple[int, str, str]:
        capsys.readouterr()
        code = main(["fit", *map(str, words)])
        written = capsys.readouterr()
        return code, written.out, written.err

    return run_it


@pytest.mark.parametrize("kind", EXAMPLES)
def test_the_examples_are_what_their_tool_writes(kind: str) -> None:
    assert Path(EXAMPLES[kind]).read_text(encoding="utf-8") == example_measurements.example(kind)


WIDEST = {
    "liquid_ring": {
        "lambda_factor": 0.1,
        "bore": 0.1e-3,
        "extra_loss": 3.0,
        "influence_coefficient": 0.14 * 0.0108,
        "lag_angle": math.radians(6),
    },
    "eccentric_mass": {
        "rotor.stiffness": 100.0,
        "rotor.damping": 1.0,
        "imbalance.mass": 0.02,
        "imbalance.phase": math.radians(6),
        "masses.friction_arm[0]": 0.002,
        "motor.torque_constant": 0.001,
    },
}
"""Narrower than what the scene states, than a tenth of the value, a fifth of k + 1 of about 15, 6 degrees."""


STATED = {"transfer mass", "flow flow_rate", "trial_weight amplitude", "trial_amplitude amplitude"}
"""Noise that the examples state."""


@pytest.mark.parametrize("balancer", WIDEST)
def test_the_examples_together_give_back_the_truth(balancer: str, run: Run) -> None:
    """Each interval (95 %) holds the truth and is narrow enough to be of use."""
    scene = bundled_scene(example_measurements.SCENES[balancer])
    files = {kind: file for kind, file in EXAMPLES.items() if KINDS[kind].balancer == balancer}
    truth, widest = example_measurements.TRUTH[balancer], WIDEST[balancer]
    code, out, _ = run(scene, *files.values(), "--parameters", ",".join(widest), "--json")
    assert code == 0
    document = json.loads(out)
    assert [each["kind"] for each in document["data"]] == list(files)
    assert [each["name"] for each in document["parameters"]] == list(widest)
    for each in document["parameters"]:
        low, high = each["interval"]
        assert low < truth[each["name"]] < high, each
        assert high - low < widest[each["name"]], each
        # What the correlations of k are uncertain by stands for a bore as well as its own tolerance does.
        assert each["verdict"] == "identified" or "bore^3/(k + 1)" in each["text"]
    stated = {each["group"] for each in document["noise"] if not each["estimated"]}
    assert stated == {group for group in STATED if group.split(" ")[0] in files}


@pytest.fixture(scope="module")
def injections() -> dict[str, Any]:
    """JSON of a fit to the injections alone."""
    out = io.StringIO()
    with contextlib.redirect_stdout(out):
        assert main(["fit", PAPER, EXAMPLES["injection"], "--json"]) == 0
    document: dict[str, Any] = json.loads(out.getvalue())
    return document


def test_injections_alone_do_not_blame_the_bore_for_a_loss(injections: dict[str, Any]) -> None:
    """The extra loss, zero in the scene and 1.5 in truth, is fitted where no parameters are named."""
    found = {each["name"]: each for each in injections["parameters"]}
    assert list(found) == ["lambda_factor", "bore", "extra_loss"]
    for name, each in found.items():
        low, high = each["interval"]
        assert low < example_measurements.TRUTH["liquid_ring"][name] < high, each
    assert found["extra_loss"]["interval"][0] > 0
    assert found["bore"]["verdict"] != "identified"


def test_a_prescribed_loss_is_fitted_in_place_of_the_extra_one() -> None:
    scene = liquid_ring_scene(load_scene(PAPER))
    prescribed = with_value(scene=scene, quantity="drag_coefficient", value=50.0)
    data = read_observations([Path(EXAMPLES[kind]) for kind in ("injection", "transfer")], scene=scene)
    assert inputs_of(scene).informed(data) == ["lambda_factor", "bore", "extra_loss"]
    assert inputs_of(prescribed).informed(data) == ["lambda_factor", "bore", "drag_coefficient"]


@pytest.mark.parametrize(
    ("balancer", "kind", "name", "close"),
    [
        ("liquid_ring", "trial_weight", "lagangle", "lag_angle"),
        ("eccentric_mass", "run_up", "rotor.dampin", "rotor.damping"),
    ],
)
def test_a_misspelt_parameter(balancer: str, kind: str, name: str, close: str, run: Run) -> None:
    scene = bundled_scene(example_measurements.SCENES[balancer])
    code, _, err = run(scene, EXAMPLES[kind], "--parameters", name)
    assert code == 2
    assert f'"{name}" cannot be fitted (did you mean "{close}"?); allowed: ' in " ".join(err.split())


def test_a_mass_that_there_is_not(run: Run, tmp_path: Path) -> None:
    scene = bundled_scene(example_measurements.SCENES["eccentric_mass"])
    path = tmp_path / "third.csv"
    head = Path(EXAMPLES["positioning"]).read_text(encoding="utf-8").split("series\n")[0]
    path.write_text(f"{head}series,moved_mass\n0.1,6,100,38,a,3\n0.2,6,100,38,a,1.5\n", encoding="utf-8")
    code, _, err = run(scene, path)
    assert code == 2
    assert "it is too large" in err
    assert "it is not a whole number" in err


def has_key(document: Any, name: str) -> bool:
    """Whether a key stands anywhere in nested documents."""
    if isinstance(document, Mapping):
        return name in document or any(has_key(each, name) for each in document.values())
    return isinstance(document, list) and any(has_key(each, name) for each in document)


def test_the_promised_keys_are_there(injections: dict[str, Any]) -> None:
    section = (ROOT / "docs/commands.md").read_text().split("## `fit --json`\n")[1].split("\n## ")[0]
    promised = [name for line in section.splitlines() for name in re.findall(r"`([a-z0-9_]+)`", line)]
    assert len(promised) > 25
    missing = {name for name in promised if not has_key(injections, name)}
    assert missing <= {"geometry", "identified", "size", "runs"}  # values, and no keys


def test_text_names_what_an_engineer_must_know(run: Run) -> None:
    code, out, _ = run(
        PAPER, EXAMPLES["trial_weight"], "--parameters", "influence_coefficient,lag_angle,bore"
    )
    assert code == 0
    text = " ".join(out.split())
    assert "fitted to 7 measurements" in text
    assert re.search(r"influence.* 0\.0111?\d", text)
    assert "bore: structurally not identified" in text
    assert "taken as exact" not in text  # nothing of the tube has an effect on trial weights
    assert "lies outside" not in text


def test_runs_without_trial_weight_alone_identify_nothing(run: Run, tmp_path: Path) -> None:
    head = Path(EXAMPLES["trial_weight"]).read_text(encoding="utf-8").split("series\n")[0]
    rows = "\n".join(f"0,0,{amplitude},90,day 1" for amplitude in (9.99, 10.0, 10.02))
    (tmp_path / "none.csv").write_text(f"{head}series\n{rows}\n", encoding="utf-8")
    code, out, _ = run(PAPER, tmp_path / "none.csv", "--json")
    assert code == 0
    document = json.loads(out)
    assert {each["verdict"] for each in document["parameters"]} == {"structurally not identified"}
    assert document["next_measurement"]["candidates"][0]["expected_width_ratio"] < 1


def test_a_value_outside_what_the_scene_states_is_named(run: Run, tmp_path: Path) -> None:
    stated = Path(PAPER).read_text(encoding="utf-8").replace('lag_angle = "3 deg"', 'lag_angle = "0.5 deg"')
    (tmp_path / "sure.toml").write_text(stated, encoding="utf-8")
    code, out, err = run(tmp_path / "sure.toml", EXAMPLES["trial_weight"])
    assert code == 1, err
    assert "lag_angle: the fitted value lies outside" in " ".join(out.split())


@pytest.mark.parametrize("kind", KINDS)
def test_a_template_is_printed_and_nothing_else(kind: str, run: Run) -> None:
    assert run("--template", kind) == (0, template(kind), "")


@pytest.mark.parametrize(
    ("words", "told"),
    [
        ([], "SCENE is missing: ringbalance fit SCENE DATA.csv"),
        ([PAPER], "DATA is missing: ringbalance fit SCENE DATA.csv"),
        (["no.toml", EXAMPLES["flow"]], "no.toml: there is no such file"),
        ([PAPER, "no.csv"], "no.csv: there is no such file"),
        ([PAPER, EXAMPLES["flow"], EXAMPLES["flow"]], "same content"),
        ([PAPER, EXAMPLES["flow"], "--parameters", "bore,bore"], '--parameters = "bore,bore"'),
        ([PAPER, EXAMPLES["flow"], "--parameters", "bor"], '"bor"'),
        ([PAPER, EXAMPLES["flow"], "--parameters", ""], '--parameters = ""'),
        ([PAPER, EXAMPLES["flow"], "--loss", "huber"], "huber"),
        (["--template", "flwo"], 'did you mean "flow"'),
        ([EXAMPLES["flow"], PAPER], "flow.csv: this looks like a file of measurements"),
        ([PAPER, PAPER], "liquid_ring_paper.toml:"),
        ([str(bundled_scene("washing_machine")), EXAMPLES["flow"]], "washing_machine.toml"),
        ([PAPER, EXAMPLES["run_up"]], 'kind = "run_up"'),
    ],
)
def test_what_cannot_be_fitted_is_refused(words: list[str], told: str, run: Run) -> None:
    code, out, err = run(*words)
    assert (code, out) == (2, "")
    assert told in err
    assert "Traceback" not in err


def test_the_page_has_every_kind_and_its_example_can_be_read(paper_scene: Scene) -> None:
    page = doc_tables.text_of("docs/fit.md")
    assert doc_tables.fresh(page, doc_tables.PARTS["docs/fit.md"]()) == page
    example = page.split("## Files of measurements")[1].split("```")[1].lstrip("\n")
    found, faults = observations_of(example.encode(), file="example", scene=paper_scene)
    assert faults == ()
    assert found is not None
    assert len(found) == 3


def test_the_fitted_scene_is_written_and_taken(run: Run, tmp_path: Path) -> None:
    target = tmp_path / "fitted.toml"
    words = (PAPER, EXAMPLES["trial_weight"], "--parameters", "influence_coefficient,lag_angle")
    code, _, err = run(*words, "--save", target, "--next", "lag_angle")
    assert code == 0
    assert f"fitted scene written to {target}" in " ".join(err.split())
    # The run without a weight is of that day: the saved scene keeps the vibration that it had.
    kept = liquid_ring_scene(load_scene(PAPER)).rotor.initial_amplitude * 1e6
    assert f"keeps rotor.initial_vibration, {kept:.3g} um at " in " ".join(err.split())
    assert "without a weight trial_weight.csv has " in " ".join(err.split())
    scene = liquid_ring_scene(load_scene(target))
    assert scene.origin_of("rotor.influence_coefficient") == "measured"
    assert [each.quantity for each in scene.measured.quantities] == [
        "rotor.influence_coefficient",
        "rotor.lag_angle",
    ]
    code, _, err = run(target, EXAMPLES["trial_weight"])
    assert code == 2
    assert "was fitted to this file already" in err


def test_a_file_that_cannot_be_written_is_refused_before_the_work(run: Run, tmp_path: Path) -> None:
    code, out, err = run(PAPER, EXAMPLES["trial_weight"], "--save", tmp_path)
    assert (code, out) == (2, "")
    assert "is a folder" in err
    code, _, err = run(PAPER, EXAMPLES["trial_weight"], "--next", "bore")
    assert code == 2
    assert "not fitted" in err


@pytest.mark.parametrize("place", [0, 1])
def test_no_file_that_is_read_is_replaced(place: int, run: Run, tmp_path: Path) -> None:
    inputs = tmp_path / "disc.toml", tmp_path / "weights.csv"
    for path, source in zip(inputs, (PAPER, EXAMPLES["trial_weight"]), strict=True):
        path.write_bytes(Path(source).read_bytes())
    before = inputs[place].read_bytes()
    code, _, err = run(*inputs, "--save", tmp_path / "." / inputs[place].name)
    assert code == 2
    assert "would replace a file that is read here" in err
    assert inputs[place].read_bytes() == before


def test_names_are_whole_in_a_narrow_terminal(run: Run) -> None:
    scene = bundled_scene(example_measurements.SCENES["eccentric_mass"])
    code, out, err = run(scene, EXAMPLES["positioning"])
    assert code == 0, err
    assert re.search(r"motor\.back_emf_constant .* (yes|hardly)", out)
    code, out, err = run(PAPER, EXAMPLES["trial_weight"])
    assert code == 0, err
    assert re.search(r"influence_coefficient +0\.01", out)


def test_a_wrong_convention_of_amplitudes_shows_in_lambda(run: Run, tmp_path: Path) -> None:
    """Amplitudes of twice the size in the name of zero to peak: lambda is doubted, and saved with that."""
    wrong, target = tmp_path / "wrong.csv", tmp_path / "fitted.toml"
    text = Path(EXAMPLES["injection"]).read_text(encoding="utf-8")
    head, rows = text.split("series\n")
    doubled = []
    for row in rows.splitlines():
        cells = row.split(",")
        for i in (3, 5):
            cells[i] = str(2 * float(cells[i]))
        doubled.append(",".join(cells))
    wrong.write_text(head + "series\n" + "\n".join(doubled) + "\n", encoding="utf-8")
    words = ("--parameters", "lambda_factor", "--save", target)
    code, out, err = run(PAPER, wrong, *words)
    assert code == 1, err
    assert "lambda_factor: lambda follows from the geometry" in " ".join(out.split())
    assert any(each.about == "value" for each in load_scene(target).measured.findings)
    code, out, err = run(PAPER, EXAMPLES["injection"], *words)
    assert code == 0, err
    assert "follows from the geometry" not in " ".join(out.split())
    assert {"central_angle", "extra_loss"} <= set(re.findall(r"\w+", out))


def test_motions_that_take_too_long_are_refused(run: Run, tmp_path: Path) -> None:
    head = Path(EXAMPLES["positioning"]).read_text(encoding="utf-8").split("series\n")[0]
    path = tmp_path / "long.csv"
    rows = "\n".join(f"100,{volts},9000,38,day 1" for volts in (100, 200, 300))
    path.write_text(f"{head}series\n{rows}\n", encoding="utf-8")
    code, out, err = run(bundled_scene(example_measurements.SCENES["eccentric_mass"]), path)
    assert (code, out) == (2, "")
    assert "long.csv: the motions take" in err


def test_a_fit_that_fails_says_so(run: Run, tmp_path: Path) -> None:
    """A bore three times too wide that no parameter may correct."""
    wrong = tmp_path / "wrong.csv"
    lines = Path(EXAMPLES["transfer"]).read_text(encoding="utf-8").splitlines()
    numbers = [i for i, line in enumerate(lines) if line[:1].isdigit()]
    head = lines[numbers[0] - 1].split(",")
    place, pressure = (
        next(i for i, name in enumerate(head) if name.startswith(w)) for w in ("mass", "press")
    )
    for i in numbers:
        cells = lines[i].split(",")
        cells[place] = f"{float(cells[place]) * float(cells[pressure]) ** 3:.4f}"
        lines[i] = ",".join(cells)
    wrong.write_text("\n".join(lines) + "\n", encoding="utf-8")
    code, out, err = run(PAPER, wrong, "--json")
    assert code == 1, err
    document = json.loads(out)
    assert document["criticism"]["describes"] is False
    worst = document["criticism"]["findings"][0]
    assert worst["fails"]
    assert document["criticism"]["text"].startswith("the fit does not describe the data")


@pytest.mark.heavy
def test_a_disc_with_imported_chambers(run: Run) -> None:
    """Injections of the paper's disc; a mesh has no plates that could be uncertain."""
    code, out, err = run(bundled_scene("imported_chamber"), EXAMPLES["transfer"], "--parameters", "bore")
    assert code == 1, err
    named = re.findall(r"\w+", out)
    assert "plate_thickness" not in named
    assert "inner_radius" in named


def test_data_that_tell_nothing_of_a_parameter(run: Run) -> None:
    """What an injection moves does not depend on lambda: what is said of it is what the geometry tells."""
    code, out, err = run(PAPER, EXAMPLES["transfer"], "--parameters", "lambda_factor", "--json")
    assert code == 0, err
    (found,) = json.loads(out)["parameters"]
    assert found["verdict"] == "structurally not identified"
    assert found["interval"] == pytest.approx(found["before_interval"], rel=1e-3)
    assert found["before_interval"] == pytest.approx([0.95, 1.05])
    assert found["before_source"] == "geometry"
    assert "that of the geometry" in found["text"]


def test_a_plot_of_data_against_fit(run: Run, tmp_path: Path) -> None:
    """One figure a kind of reading, with the slope that the JSON has; the examples agree with their fit."""
    sheet, files = tmp_path / "fit.svg", [EXAMPLES["trial_weight"], EXAMPLES["flow"]]
    code, text, _ = run(PAPER, *files, "--plot", sheet, "--json")
    slopes = {each["kind"]: each for each in json.loads(text)["data_over_fit"]}
    assert (code, set(slopes)) == (0, {"trial_weight", "flow"})
    for each in slopes.values():
        assert abs(each["slope"] - 1) < each["slope_uncertainty"] < 0.02
    drawn = sheet.read_text(encoding="utf-8")
    assert drawn.count("<svg ") == 1 + len(files)
    assert "var(" not in drawn


def test_a_plot_replaces_nothing_that_is_read(run: Run, tmp_path: Path) -> None:
    data = tmp_path / "flow.svg"
    data.write_text(Path(EXAMPLES["flow"]).read_text(encoding="utf-8"), encoding="utf-8")
    assert run(PAPER, data, "--plot", data)[0] == 2
    assert run(PAPER, EXAMPLES["flow"], "--plot", tmp_path / "fit.png")[0] == 2
