"""The file of a panel: nothing is requested, no text of the scene ends its element, errors are named."""

from __future__ import annotations

import base64
import hashlib
import json
import re
from pathlib import Path

import numpy as np
import pytest
from page_modules import panel_content, panel_scene

from ringbalance.cli import main
from ringbalance.controller.balancer import Draws
from ringbalance.controller.judging.judge import FIRST_VERDICT_DEVICE
from ringbalance.controller.liquid_ring.balancer import LiquidRingBalancer
from ringbalance.export.blocks import disc_block
from ringbalance.panels.devices import packed_blocks
from ringbalance.panels.document import MODULES, Panel, document_of, joined, module_text
from ringbalance.reduced_model.calibration import chamber_and_law

NAME = '</script><script>alert("x")</script> & <b>\u2028'


@pytest.fixture(scope="module")
def page() -> str:
    """Page of a scene with a name that would end an element."""
    return document_of({**panel_content("liquid_ring_paper"), "name": NAME})


def element_text(page: str, tag: str, attributes: str = "") -> str:
    """Text of the only element of a kind."""
    (text,) = re.findall(f"<{tag}{attributes}>(.*?)</{tag}>", page, re.DOTALL)
    return str(text)


def digest(text: str) -> str:
    return f"'sha256-{base64.b64encode(hashlib.sha256(text.encode()).digest()).decode()}'"


def test_the_policy_allows_this_script_and_style_alone(page: str) -> None:
    (policy,) = re.findall(r'http-equiv="Content-Security-Policy" content="([^"]*)"', page)
    program = element_text(page, "script", ' type="module" id="program"')
    rules = dict(each.strip().split(" ", 1) for each in policy.split(";"))
    assert rules == {
        "default-src": "'none'",
        "script-src": digest(program),
        "style-src": digest(element_text(page, "style")),
        "worker-src": "blob:",
        "base-uri": "'none'",
        "form-action": "'none'",
    }


def test_nothing_of_another_place_is_named(page: str) -> None:
    """Only the name space of SVG is an address, and no attribute refers to another file."""
    assert set(re.findall(r"[a-z]+://[^\s\"'`)]+", page)) == {"http://www.w3.org/2000/svg"}
    assert re.findall(r"<[^>]*\s(?:src|href|style|on\w+)=", element_text(page, "body")) == []


def test_a_scenes_name_ends_no_element(page: str) -> None:
    assert json.loads(element_text(page, "script", ' type="application/json" id="content"'))["name"] == NAME
    assert page.count("<script") == page.count("</script") == 2
    assert "alert(" not in page.replace("alert(&quot;", "").split('id="content"')[0]


def test_a_page_of_64_devices_stays_below_300_kb() -> None:
    """The numbers of one drawn device, 64 times, with all else that a page holds."""
    few, more = (panel_content("liquid_ring_paper", devices=count) for count in (2, 4))
    each = (len(more["numbers"]) - len(few["numbers"])) / 2
    assert len(document_of(few).encode()) + 62 * (each + 400) < 300e3


def test_modules_import_from_those_before_them_and_are_joined_in_this_order() -> None:
    for at, name in enumerate(MODULES):
        imported = set(re.findall(r'from "\./(\w+)\.js"', module_text(name)))
        assert imported <= set(MODULES[:at]), name
    program = joined(
        {"one": "export const a = 1;\n", "two": 'import { a } from "./one.js";\nexport function b() {}\n'}
    )
    assert "import" not in program
    assert "export" not in program
    assert program.index("return { a }") < program.index("const { a } = one;") < program.index("return { b }")


def test_numbers_are_packed_column_by_column() -> None:
    """Bytes of one significance together, deflated; tested back in Node, here by their number."""
    scene = panel_scene("liquid_ring_paper")
    block = disc_block(scene, chamber_and_law(scene)[1])
    _, ((constants, cells, pieces, levels, row),) = packed_blocks([block])
    assert block.tables is not None
    assert (constants, cells, row) == (len(block.constants), len(block.tables.cells), len(block.start))
    assert (pieces, levels) == (len(block.tables.pieces), len(block.tables.levels))


def test_least_fills_are_those_at_which_the_devices_runs_judge() -> None:
    """A chamber is never emptied beyond its residual fill, and less so under a lower pressure."""
    balancer = LiquidRingBalancer(panel_scene("liquid_ring_paper"))
    numbers = range(FIRST_VERDICT_DEVICE, FIRST_VERDICT_DEVICE + 6)
    emptied, residual = balancer.drawn_runs.least_fills(numbers, balancer.scene.gas.pressure)
    assert np.all(emptied >= residual)
    assert np.all((residual > 0.0) & (residual < balancer.scene.disc.initial_fill))
    weak, _ = balancer.drawn_runs.least_fills(numbers, 0.3 * balancer.scene.gas.pressure)
    assert np.all(weak > emptied)


def test_the_fraction_beside_the_page_is_that_of_the_programs_runs() -> None:
    scene = panel_scene("liquid_ring_paper")
    (design,) = panel_content("liquid_ring_paper")["designs"]
    outcomes = LiquidRingBalancer(scene).run({}, Draws.block(FIRST_VERDICT_DEVICE, 4))
    assert (design["program"]["count"], design["program"]["of"]) == (int(outcomes.settled.sum()), 4)


def test_designs_are_those_of_the_axes() -> None:
    content = panel_content("liquid_ring_paper", "tube.bore=1mm:2mm:2")
    assert [each["name"] for each in content["designs"]] == ["1 mm", "2 mm"]
    assert [each["count"] for each in content["designs"]] == [2, 2]
    assert [each["device"] for each in content["designs"]] == [0, 3]
    narrow, wide = (each["velocity"] for each in content["designs"])
    assert narrow < wide
    assert content["axes"] == ["bore d"]


@pytest.mark.parametrize(
    ("scene", "options", "part"),
    [
        ("eccentric_mass_paper", ["--vary", "tube.bore=1mm:2mm:5"], "a scene of a liquid ring"),
        ("liquid_ring_paper", ["--vary", "tube.bore=1mm:2mm:50"], "50 designs; allowed: at most 9"),
        ("liquid_ring_paper", ["--vary", "tube.bor=1mm:2mm:5"], 'did you mean "tube.bore"?'),
        ("liquid_ring_paper", ["--out", "panel.txt"], "a file name that ends in .html"),
        ("liquid_ring_paper", ["--out", "no/such\n/x.html"], "control character"),
    ],
)
def test_bad_input_is_named_before_the_work(
    scene: str, options: list[str], part: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file = Path(__file__).parents[2] / f"scenes/{scene}.toml"
    out = [] if "--out" in options else ["--out", str(tmp_path / "panel.html")]
    assert main(["panel", str(file), *out, *options]) == 2
    assert part in capsys.readouterr().err
    assert list(tmp_path.iterdir()) == []


def test_a_notebook_shows_the_page_in_a_frame(tmp_path: Path) -> None:
    panel = Panel(name="A & B", html='<p title="x">')
    assert 'srcdoc="&lt;p title=&quot;x&quot;&gt;"' in panel._repr_html_()
    assert panel.save(tmp_path / "panel.html").read_text() == panel.html
