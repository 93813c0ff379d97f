"""The whole report: complete, reproducible, and written whole or not at all."""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Iterator, Mapping
from functools import partial
from pathlib import Path
from typing import Any

import pytest
from check_traces import apart, traces, untrue
from keep_evidence import kept_document

from ringbalance import reporting
from ringbalance.controller.judging import tune
from ringbalance.controller.judging.judge import judged_all
from ringbalance.reports import evidence as evidence_module
from ringbalance.reports import report as report_module
from ringbalance.reports import saved as saved_module
from ringbalance.reports.page import page_content, render_pages
from ringbalance.reports.pages import first_page, loop
from ringbalance.reports.pictures.opengl import OpenGL
from ringbalance.reports.report import Report, write_report
from ringbalance.reports.saved import heavy_cases
from ringbalance.reports.sections import CASES_VIEW, views_of
from ringbalance.running import run_command
from ringbalance.scene import Scene, SceneError, bundled_scene
from ringbalance.scene.platform.processes import Workers
from ringbalance.verification.case import CaseDefinition
from ringbalance.verification.catalogue import load_case
from scenes import with_tables

Record = dict[str, Any]
NO_OPENGL = OpenGL(available=False, window="", text="The 3-D pictures were left out: no OpenGL here.")
QUICK = ("gci_celik2008", "claim_01_volume", "coverage")


@pytest.fixture(scope="module")
def store(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Folder in which reports keep what looks at no scene."""
    return tmp_path_factory.mktemp("kept")


@pytest.fixture(scope="module", autouse=True)
def few_cases(store: Path) -> Iterator[None]:
    """Three cases instead of all, one check, one claim, one heavy; and few devices."""

    def cases() -> list[CaseDefinition]:
        return [load_case(name) for name in QUICK]

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(evidence_module, "load_cases", cases)
        patch.setattr(saved_module, "code_root", lambda: store)
        patch.setattr(tune, "search", lambda *_, **__: ())
        patch.setattr(tune, "judged_all", partial(judged_all, most=16))
        patch.setattr(tune, "tried_remedies", lambda *_, **__: ())
        patch.setattr(first_page, "tried_choices", lambda *_, **__: ())
        patch.setattr(first_page, "judged_all", partial(judged_all, most=16))
        patch.setattr(loop, "judged_all", partial(judged_all, most=16))
        yield


Write = Callable[[Path], Report]


@pytest.fixture(scope="module")
def write(paper_scene: Scene) -> Write:
    """Writes a report of the paper's disc without pictures, its loop cut short."""
    scene = with_tables(paper_scene, run={"time_limit": 8.0})
    return partial(write_report, scene, scene_text="# a scene\n", opengl=NO_OPENGL)


@pytest.fixture(scope="module")
def first(write: Write, tmp_path_factory: pytest.TempPathFactory) -> Report:
    """A finished report."""
    return write(tmp_path_factory.mktemp("report") / "out")


def test_everything_is_there(first: Report) -> None:
    folder = first.page.parent
    assert json.loads((folder / "evidence.json").read_text()) == first.evidence
    assert len(list((folder / "figures").glob("*.svg"))) >= 10
    linked = 'href="figures.html"' in (folder / "report.html").read_text()
    assert linked == (folder / "figures.html").exists()
    assert len(list((folder / "fields").glob("*.vtu"))) == 2
    assert [path.name for path in folder.parent.iterdir()] == ["out"]
    written = folder / "touched.txt"
    written.touch()
    # As any file of this user: 0644, or 0664 where the group may write.
    assert (folder / "report.html").stat().st_mode == written.stat().st_mode
    written.unlink()


def test_the_report_gives_the_estimates_of_every_command(first: Report) -> None:
    evidence = first.evidence
    used = evidence["calibration"]["models_used"]
    assert used == evidence["closed_loop"]["calibrated"]["models_used"]
    shown = {row["term"]: row for row in used}
    for row in evidence["trade"]["terms"]:
        assert shown[row["term"]]["estimated_contribution"] == row["estimated_contribution"]
        assert shown[row["term"]]["why"].startswith(row["why"].rpartition("; ")[0])
    assert shown["tube inertia"]["model"] != "left out"


@pytest.fixture(scope="module")
def evidence_file(first: Report) -> Record:
    """Content of the evidence file."""
    content: Record = json.loads((first.page.parent / "evidence.json").read_text())
    return content


@pytest.fixture(scope="module")
def views(evidence_file: Record) -> Mapping[str, Record | None]:
    """Views of the sections, made by this process."""
    return views_of(evidence_file)


def test_the_page_comes_from_the_evidence_file_alone(
    first: Report, evidence_file: Record, views: Mapping[str, Record | None]
) -> None:
    evidence = evidence_file
    pages = render_pages(page_content(evidence, views=views))
    for name, page in pages.items():
        assert (first.page.parent / name).read_text() == page
    assert untrue(pages.values(), evidence) == []
    assert apart(evidence) == []
    assert len(traces(pages.values())) > 100


def test_both_laws_are_judged_over_the_same_devices(first: Report) -> None:
    assert 'href="#consequences"' in (first.page.parent / "annex.html").read_text()
    of = first.evidence["consequences"]["paper"]["fraction"]["of"]
    assert of == first.evidence["summary"]["own"]["fraction"]["of"]
    assert [each["law"] for each in first.evidence["consequences"]["gain"]] == ["paper", "calibrated"]


def test_without_opengl_the_page_says_so(first: Report) -> None:
    assert NO_OPENGL.text in (first.page.parent / "annex.html").read_text()
    assert first.evidence["pictures"] == {"drawn": False, "text": NO_OPENGL.text, "files": []}


@pytest.fixture(scope="module")
def second(write: Write, first: Report, tmp_path_factory: pytest.TempPathFactory) -> Report:
    """The report made again, into a folder with earlier results of its heavy case."""
    out = tmp_path_factory.mktemp("again")
    coverage = next(case for case in first.evidence["verification"] if case["id"] == "coverage")
    earlier = [
        {**coverage, "verdict": "passed", "date": "2029-02-03"},
        {**coverage, "verdict": "failed", "date": "2028-01-01"},
        {**coverage, "verdict": "inconclusive", "date": "2030-01-01", "scene_sha256": "0" * 64},
    ]
    (out / "evidence.json").write_text(json.dumps({"verification": earlier}))
    return write(out)


@pytest.mark.heavy
def test_a_second_run_differs_in_times_alone(first: Report, second: Report) -> None:
    again = second.evidence
    assert {key for key in again if again[key] != first.evidence[key]} <= {"times", "verification"}
    run, repeated = (
        [case for case in report.evidence["verification"] if case["id"] != "coverage"]
        for report in (first, second)
    )
    assert json.dumps(repeated) == json.dumps(run)
    assert len(run) == len(QUICK) - 1


@pytest.mark.heavy
def test_what_looks_at_no_scene_is_run_once(first: Report, second: Report) -> None:
    assert first.evidence["times"]["kept_cases"] == {}
    today = first.evidence["times"]["date"]
    # The check of the grid convergence index takes the report's own scene; the other is heavy.
    assert second.evidence["times"]["kept_cases"] == {"claim_01_volume": today}
    page = (second.page.parent / "report.html").read_text()
    assert f"1 independent of the scene, run by the same program on {today}" in page


def test_a_real_document_has_the_shape_of_the_sample(first: Report, sample: Record) -> None:
    """The page's tests stand on a sample: each of its keys must exist in the real thing."""

    def lacking(expected: Any, real: Any, path: str) -> list[str]:
        if isinstance(expected, dict) and not path.endswith(
            ("terms", "versions", "verification", "fill_ratio", "causes")
        ):
            missing = [f"{path}/{key}" for key in expected if key not in real]
            return missing + [
                f for k in expected if k in real for f in lacking(expected[k], real[k], f"{path}/{k}")
            ]
        if isinstance(expected, list) and expected and isinstance(expected[0], dict) and real:
            return lacking(expected[0], real[0], path)
        return []

    assert [fault for fault in lacking(sample, first.evidence, "") if "verification" not in fault] == []


def test_the_scene_and_its_text_are_reported(first: Report, paper_scene: Scene) -> None:
    assert first.evidence["scene"]["sha256"] == paper_scene.sha256
    assert first.evidence["scene"]["text"] == "# a scene\n"
    assert first.evidence["seeds"] == {"run": paper_scene.run.seed}
    assert first.evidence["versions"]["ringbalance"]


def test_thresholds_of_the_papers_disc(first: Report) -> None:
    quantities = {each["key"]: each for each in first.evidence["calibration"]["quantities"]}
    # rho omega^2 (R2^2 - r_m^2)/2 with 44.5 mm, 31.5 mm and 10 000 rpm, and Eq. 19 with u = 0, by hand.
    assert quantities["priming_pressure_vented"]["value"] == pytest.approx(0.5417e6, rel=1e-3)
    assert quantities["stall_pressure_paper"]["value"] == pytest.approx(0.381e6, rel=1e-3)
    # Density 0.2 % and speed 0.1 %, squared in the pressure, alone give 0.28 %; the radii add less than
    # three times that. The rest is waves: at the largest fill one may be resonant with gravity.
    share = quantities["stall_pressure"]["parts"]["input"] / quantities["stall_pressure"]["value"]
    assert math.hypot(0.002, 0.002) < share < 3 * math.hypot(0.002, 0.002)


def test_a_failure_leaves_the_old_report(
    write: Write, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    out = tmp_path / "out"
    out.mkdir()
    (out / "report.html").write_text("the old one")

    def fail(*_: Any, **__: Any) -> Record:
        raise KeyboardInterrupt

    monkeypatch.setattr(report_module, "collect_evidence", fail)
    with pytest.raises(KeyboardInterrupt):
        write(out)
    assert (out / "report.html").read_text() == "the old one"
    assert [path.name for path in tmp_path.iterdir()] == ["out"]
    assert [path.name for path in out.iterdir()] == ["report.html"]


@pytest.mark.heavy
def test_heavy_results_are_kept_with_their_date(second: Report) -> None:
    heavy = next(case for case in second.evidence["verification"] if case["id"] == "coverage")
    # The newest result on this very scene; the one on another scene is left alone.
    assert (heavy["verdict"], heavy["date"]) == ("passed", "2029-02-03")
    assert "2029-02-03" in (second.page.parent / "annex.html").read_text()


def test_what_is_kept_is_heavy_and_dated(evidence: Record) -> None:
    next(case for case in evidence["verification"] if case.get("cost") == "heavy").update(verdict="passed")
    (case,) = heavy_cases(evidence)
    assert case["date"] == evidence["times"]["date"]
    assert kept_document(evidence)["verification"] == [case]
    assert heavy_cases(kept_document(evidence)) == [case]


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (b"", "evidence.json is not an evidence file"),
        (b"\xff\xfe{}", "evidence.json is not an evidence file"),
        (b"[" * 100_000, "nested too deeply"),
        (b"[]", "no object"),
        (b'{"times": null}', '"times"'),
        (b'{"times": []}', '"times"'),
        (b'{"times": {"date": 3}}', '"times"'),
        (b'{"times": {"total_s": NaN}}', "not JSON compliant"),
        (b'{"verification": null}', '"verification"'),
        (b'{"verification": [1]}', '"verification"'),
        (b'{"verification": {"a": 1}}', '"verification"'),
        (b'{"verification": [{"cost": "heavy", "verdict": "passed"}]}', '"id" of verification[0] is missing'),
    ],
)
def test_a_damaged_evidence_file_is_reported_before_the_work(
    content: bytes, message: str, write: Write, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(report_module, "drawing_beside", lambda *_: pytest.fail("begun"))
    (tmp_path / "evidence.json").write_bytes(content)
    with pytest.raises(OSError, match="move it away or choose another folder") as caught:
        write(tmp_path)
    assert message in str(caught.value)
    assert str(tmp_path / "evidence.json") in str(caught.value)
    assert (tmp_path / "evidence.json").read_bytes() == content


@pytest.mark.parametrize("name", ["figures", "fields", "report.html"])
def test_what_is_in_the_way_of_a_report_is_reported_before_the_work(
    name: str, write: Write, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(report_module, "drawing_beside", lambda *_: pytest.fail("begun"))
    (tmp_path / name).touch() if name != "report.html" else (tmp_path / name).mkdir()
    with pytest.raises(OSError, match=f"{name} is a f"):
        write(tmp_path)
    assert [path.name for path in tmp_path.iterdir()] == [name]


@pytest.mark.parametrize(("failed", "code"), [(False, 0), (True, 1)])
def test_exit_codes(
    sample: Record,
    failed: bool,
    code: int,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    cases = [
        case | {"verdict": "failed"} if failed and case["kind"] == "code_verification" else case
        for case in sample["verification"]
    ]
    finished = Report(page=tmp_path / "report.html", evidence=sample | {"verification": cases})
    monkeypatch.setattr(reporting, "write_scene_report", lambda *_, **__: finished)
    assert run_command("report", scene=bundled_scene("liquid_ring_paper"), out=tmp_path) == code
    printed = capsys.readouterr()
    assert printed.out.strip() == str(finished.page)
    assert "claims of the liquid-ring paper" in printed.err


def test_a_broken_scene_writes_nothing(tmp_path: Path) -> None:
    (tmp_path / "bad.toml").write_text("[disc]\n")
    with pytest.raises(SceneError):
        run_command("report", scene=tmp_path / "bad.toml", out=tmp_path / "out")
    assert not (tmp_path / "out").exists()


@pytest.mark.heavy
def test_a_worker_makes_the_same_views(first: Report, views: Mapping[str, Record | None]) -> None:
    path = first.page.parent / "evidence.json"
    with Workers(1) as pool:
        by_worker = dict(report_module._views(path, first.evidence["balancer"], pool))
    assert set(by_worker) > {"trade", "inside", CASES_VIEW}
    assert by_worker == views
