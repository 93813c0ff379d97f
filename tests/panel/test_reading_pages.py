"""Pages that answer a pointer, a finger and keys: figures with their values, and replayed runs."""

from __future__ import annotations

import re
import time
from collections.abc import Callable
from pathlib import Path
from typing import cast

import pytest
from browsers import SIZES, Firefox, accessibility_violations
from playwright.sync_api import Page, expect

import ringbalance as rb
from ringbalance.controller.eccentric_mass.scene_records import EccentricScene
from ringbalance.panels.document import REPLAY_MODULES, document_of
from ringbalance.panels.replay import replay_content
from ringbalance.scene.models import Scene

pytestmark = pytest.mark.panel
OpenPage = Callable[..., Page]


@pytest.fixture(scope="module")
def sweep_page(paper_scene: Scene, tmp_path_factory: pytest.TempPathFactory) -> Path:
    vary = {"tube.bore": "0.5mm:2mm:12", "gas.pressure": "0.2MPa:0.8MPa:10"}
    figures = rb.sweep(paper_scene, vary, intervals=False).plot(tmp_path_factory.mktemp("sweep"))
    return cast(Path, figures[-1])


@pytest.fixture(scope="module")
def replay_page(tmp_path_factory: pytest.TempPathFactory) -> Path:
    driven = rb.load_scene(rb.bundled_scene("driven_masses_small"))
    scene = cast(EccentricScene, driven.with_values({"run.time_limit": "12 s"}))
    file = tmp_path_factory.mktemp("replay") / "panel.html"
    page = document_of(replay_content(scene, devices=3), page="replay.html", modules=REPLAY_MODULES)
    file.write_text(page, encoding="utf-8")
    return file


def reading(page: Page) -> dict[str, str]:
    names, values = page.locator("dt").all_inner_texts(), page.locator("dd").all_inner_texts()
    return dict(zip(names, values, strict=True))


def is_wider_than_its_window(page: Page) -> bool:
    return bool(page.evaluate("document.documentElement.scrollWidth > innerWidth"))


@pytest.mark.parametrize("size", SIZES)
def test_keys_and_a_pointer_move_through_the_points(sweep_page: Path, open_page: OpenPage, size: str) -> None:
    page = open_page(sweep_page, size=size)
    page.locator("figure").first.focus()
    page.keyboard.press("Home")
    assert reading(page)["row"] == "0"
    for key, row in (("ArrowRight", "10"), ("ArrowUp", "11"), ("ArrowLeft", "1"), ("End", "119")):
        page.keyboard.press(key)
        assert reading(page)["row"] == row
    picture = page.locator("figure svg").nth(1)
    picture.scroll_into_view_if_needed()
    box = picture.bounding_box()
    assert box is not None
    # The middle of the map's axes: bores of 1.2 and 1.3 mm, pressures of 0.47 and 0.53 MPa lie nearest.
    page.mouse.move(box["x"] + 0.43 * box["width"], box["y"] + 0.48 * box["height"])
    values = reading(page)
    assert 1.0 < float(values["bore d"].split("\u202f")[0]) < 1.5
    assert 0.4 < float(values["gas pressure"].split("\u202f")[0]) < 0.6
    assert not is_wider_than_its_window(page)
    assert accessibility_violations(page) == []


@pytest.mark.parametrize("size", SIZES)
def test_a_replay_is_moved_by_keys(replay_page: Path, open_page: OpenPage, size: str) -> None:
    page = open_page(replay_page, fragment="#device=1&time=6", size=size)
    # The runs are unpacked in the background.
    expect(page.locator("#clock")).to_have_text("6.0 s")
    page.locator("#at").focus()
    page.keyboard.press("Home")
    assert page.locator("#clock").inner_text() == "0.0 s"
    page.keyboard.press("End")
    assert page.locator("#clock").inner_text() == "12.0 s"
    page.locator("#device").focus()
    page.keyboard.press("ArrowDown")
    expect(page).to_have_url(re.compile("#device=2"))
    page.locator("#play").focus()
    page.keyboard.press("Enter")
    assert page.locator("#play").inner_text() == "Play"
    assert not is_wider_than_its_window(page)
    assert accessibility_violations(page) == []


def test_a_replay_plays_by_itself(replay_page: Path, open_page: OpenPage) -> None:
    page = open_page(replay_page)
    expect(page.locator("#clock")).to_have_text(re.compile(r"[1-9]\.\d s"))
    assert page.locator("#play").inner_text() == "Pause"


def test_both_in_firefox(sweep_page: Path, replay_page: Path, firefox: Firefox) -> None:
    firefox.open(sweep_page.as_uri())
    assert firefox.run("return document.querySelectorAll('figure circle').length") == 3
    firefox.open(replay_page.as_uri() + "#time=6")
    until = time.monotonic() + 30.0
    while not firefox.run("return document.getElementById('count').textContent"):
        assert time.monotonic() < until
        time.sleep(0.1)
    assert firefox.run("return document.getElementById('clock').textContent") == "6.0 s"
    assert firefox.messages() == []
