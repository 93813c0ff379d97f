"""`ringbalance calibrate`: tables for people, one clean document for scripts, a law for `simulate`."""

from __future__ import annotations

import json
import re
from pathlib import Path

import pytest
from quantities import by_key

from ringbalance.reduced_model.law.files import load_law
from ringbalance.reduced_model.terms import models_used
from ringbalance.results.result import models_table
from ringbalance.running import run_command
from ringbalance.scene import Scene, SceneError, bundled_scene


def test_json_is_one_clean_document(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    target = tmp_path / "deep" / "law.json"
    assert run_command("calibrate", scene=bundled_scene("liquid_ring_paper"), json=True, save=target) == 0
    captured = capsys.readouterr()
    document = json.loads(captured.out)
    assert document["scene"]["source"] == "liquid_ring_paper.toml"
    assert len(captured.out.splitlines()) == 1
    assert load_law(target).chamber_volume == by_key(document)["chamber_volume"]["value"]


@pytest.mark.parametrize("name", ["liquid_ring_paper", "silicone_oil_100cst"])
def test_tables_show_what_matters(name: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert run_command("calibrate", scene=bundled_scene(name)) == 0
    shown = capsys.readouterr().out
    for word in (
        "lambda",
        "operating point",
        "Chamber",
        "Tube",
        "Velocity",
        "Models used",
        "full siphon stalls",
        "cavitation margin",
    ):
        assert word in shown
    assert "nan" not in shown


def test_no_interval_is_finer_than_inputs_that_nobody_stated(
    capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    stated = bundled_scene("liquid_ring_paper").read_text(encoding="utf-8")
    parts = re.split(r"(?m)^(?=\[(?:uncertainty|run)\])", stated)
    unstated = tmp_path / "unstated.toml"
    unstated.write_text(parts[0] + parts[2], encoding="utf-8")
    assert run_command("calibrate", scene=unstated) == 0
    shown = " ".join(capsys.readouterr().out.split())
    assert "the scene states no uncertainty of its inputs" in shown
    assert "volume of a chamber 67.69 ml" in shown
    assert "lambda per transferred mass 73.36 mm" in shown
    assert re.search(r"k there \d\.\d+ ± 0\.\d+ ", shown), "what the models leave open stands"
    for value, width in re.findall(r"([\d.]+) ± ([\d.e-]+)", shown):
        assert float(width) > 5e-4 * float(value)


def test_a_missing_scene_is_a_fault_not_a_traceback(tmp_path: Path) -> None:
    with pytest.raises(SceneError):
        run_command("calibrate", scene=tmp_path / "none.toml")


def test_terms_far_below_the_tolerance_leave_the_printed_table(paper_scene: Scene) -> None:
    used = models_used(paper_scene)
    whole, printed = (
        [term for term, *_ in models_table(used, tolerance=tolerance).rows] for tolerance in (0.0, 0.01)
    )
    assert whole == [each.term for each in used]
    assert [term for term in whole if term not in printed] == [
        each.term for each in used if (each.estimated_contribution or 1.0) < 0.001
    ]
    assert "surface tension" not in printed
    assert "gas filling" in printed
