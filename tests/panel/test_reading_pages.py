"""Pages that answer a pointer, a finger and keys: figures with their values, and runs of eccentric masses."""

from __future__ import annotations

import re
import time
from collections.abc import Callable
from pathlib import Path
from typing import Literal, cast

import pytest
from browsers import SIZES, Firefox, accessibility_violations
from playwright.sync_api import Page, expect

import ringbalance as rb
from ringbalance.controller.eccentric_mass.scene_records import EccentricScene
from ringbalance.panels.masses import masses_document
from ringbalance.scene.models import Scene

pytestmark = pytest.mark.panel
OpenPage = Callable[..., Page]


@pytest.fixture(scope="module")
def sweep_page(paper_scene: Scene, tmp_path_factory: pytest.TempPathFactory) -> Path:
    vary = {"tube.bore": "0.5mm:2mm:12", "gas.pressure": "0.2MPa:0.8MPa:10"}
    figures = rb.sweep(paper_scene, vary, intervals=False).plot(tmp_path_factory.mktemp("sweep"))
    return cast(Path, figures[-1])


@pytest.fixture(scope="module")
def mass_page(tmp_path_factory: pytest.TempPathFactory) -> Path:
    driven = rb.load_scene(rb.bundled_scene("driven_masses_small"))
    scene = cast(EccentricScene, driven.with_values({"run.time_limit": "6 s"}))
    file = tmp_path_factory.mktemp("masses") / "panel.html"
    file.write_text(masses_document(scene, devices=3), encoding="utf-8")
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


def at_the_end(page: Page) -> None:
    """Run as fast as the browser computes, by keyboard."""
    page.locator("#end").focus()
    page.keyboard.press("Enter")
    until = time.monotonic() + 60.0
    # The page's policy forbids what the driver would wait with.
    while page.evaluate("panel.playing"):
        assert time.monotonic() < until
        page.wait_for_timeout(50)


@pytest.mark.parametrize("scheme", ["light", "dark"])
@pytest.mark.parametrize("size", SIZES)
def test_masses_run_to_the_end_of_the_scene(
    mass_page: Path, open_page: OpenPage, size: str, scheme: Literal["light", "dark"]
) -> None:
    page = open_page(mass_page, size=size)
    page.emulate_media(color_scheme=scheme)
    at_the_end(page)
    assert page.locator("#clock").inner_text() == "6.000 s"
    assert page.locator("#state").inner_text().startswith("Settled after")
    stages = page.locator("#stages li").all_inner_texts()
    assert stages[0].startswith("imbalance estimation")
    assert stages[-1].startswith("rest")
    assert page.locator("#device option").count() == 4
    assert not is_wider_than_its_window(page)
    assert accessibility_violations(page) == []


def test_masses_by_keyboard(mass_page: Path, open_page: OpenPage) -> None:
    page = open_page(mass_page)
    page.locator("#play").focus()
    page.keyboard.press("Space")
    assert page.locator("#play").inner_text() == "Play"
    samples = page.evaluate("panel.run.samples")
    page.locator("#step").focus()
    page.keyboard.press("Enter")
    assert page.evaluate("panel.run.samples") == samples + 1
    page.locator("#speed").focus()
    page.keyboard.press("ArrowDown")
    assert page.evaluate("panel.state.speed") == 2
    for slider in page.locator(".settings input[type=range]").all():
        before = page.evaluate("JSON.stringify(panel.state.settings)")
        slider.focus()
        page.keyboard.press("PageUp")
        assert page.evaluate("JSON.stringify(panel.state.settings)") != before
    assert "limit=" in page.evaluate("location.hash")
    page.locator("#reset").focus()
    page.keyboard.press("Enter")
    assert page.evaluate("location.hash") == "#speed=2"
    page.locator("#device").focus()
    page.keyboard.press("ArrowDown")
    expect(page).to_have_url(re.compile("#device=1"))
    stages = page.evaluate("panel.run.stages.length")
    page.locator("#next").focus()
    page.keyboard.press("Enter")
    until = time.monotonic() + 30.0
    while page.evaluate("panel.playing"):
        assert time.monotonic() < until
        page.wait_for_timeout(50)
    assert page.evaluate("panel.run.stages.length") > stages
    now = page.locator("#clock").inner_text()
    page.locator("#at").focus()
    page.keyboard.press("Home")
    assert page.locator("#clock").inner_text() == "0.000 s" != now
    page.locator("#play").focus()
    page.keyboard.press("Enter")
    # Goes on from where the run was.
    expect(page.locator("#play")).to_have_text("Pause")
    assert page.evaluate("panel.run.samples") > samples


def test_a_link_gives_back_the_run_of_the_masses(mass_page: Path, open_page: OpenPage) -> None:
    pages = [open_page(mass_page, fragment="#imbalance=0.7&device=2&seed=5&noise=2") for _ in range(2)]
    for page in pages:
        at_the_end(page)
    first, second = (page.evaluate("JSON.stringify([...panel.run.plant.w])") for page in pages)
    assert first == second
    other = open_page(mass_page, fragment="#imbalance=0.7&device=2&seed=6&noise=2")
    at_the_end(other)
    assert other.evaluate("JSON.stringify([...panel.run.plant.w])") != first


def test_both_in_firefox(sweep_page: Path, mass_page: Path, firefox: Firefox) -> None:
    firefox.open(sweep_page.as_uri())
    assert firefox.run("return document.querySelectorAll('figure circle').length") == 3
    firefox.open(mass_page.as_uri())
    firefox.run("document.getElementById('end').click()")
    until = time.monotonic() + 60.0
    while firefox.run("return panel.playing"):
        assert time.monotonic() < until
        time.sleep(0.1)
    assert firefox.run("return document.getElementById('clock').textContent") == "6.000 s"
    assert firefox.messages() == []
