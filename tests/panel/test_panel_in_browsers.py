"""The panel as a reader has it: from a local file, in Chromium and Firefox, by keyboard, on a phone."""

from __future__ import annotations

import random
from collections.abc import Callable
from pathlib import Path
from time import monotonic
from typing import Any, Final

import numpy as np
import pytest
from browsers import SIZES, Firefox, accessibility_violations, watched_page
from page_modules import panel_content, panel_scene
from playwright.sync_api import Browser, Page

from ringbalance.export.blocks import controller_block, disc_block
from ringbalance.export.hosts import python_files
from ringbalance.panels.document import document_of
from ringbalance.reduced_model.calibration import chamber_and_law

pytestmark = pytest.mark.panel
OpenPage = Callable[..., Page]
SCENE: Final = "liquid_ring_paper"
PART_S: Final = 0.02
SAMPLES: Final = 30
NAME: Final = (
    "</title></script><img src=x onerror=\"document.title='hurt'\"><svg/onload=alert(1)> & \u2028 ${1}"
)

RUN = """
([samples, noise]) => {
    const { content, numbers, scene } = panel;
    const Run = panel.run.constructor;
    const run = new Run(content, numbers, { ...scene, mass: false }, { noise: (k) => noise[k] });
    while (run.samples < samples) run.advance();
    return [run.trace.time, run.trace.x, run.trace.y];
}
"""
FOCUSABLE = """
[...document.querySelectorAll("button, input, select, summary, [tabindex]")].filter((each) =>
    each.tabIndex >= 0 && (each.type !== "radio" || each.checked)
    && each.checkVisibility({ visibilityProperty: true })).length
"""
FOCUSED = "document.activeElement === document.body ? 0 : [...document.all].indexOf(document.activeElement)"
SHOWN = "document.querySelectorAll('#dots button.ok, #dots button.no').length === 4"


@pytest.fixture(scope="module")
def panel(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Panel of the paper's disc with a few devices."""
    path = tmp_path_factory.mktemp("panel") / "panel.html"
    path.write_text(document_of(panel_content(SCENE)), encoding="utf-8")
    return path


@pytest.fixture(scope="module")
def noise() -> list[list[float]]:
    """A stored table: two standard normal numbers for each sample."""
    table: list[list[float]] = np.random.default_rng(7).standard_normal((SAMPLES + 1, 2)).tolist()
    return table


@pytest.fixture(scope="module")
def looped(noise: list[list[float]]) -> list[list[float]]:
    """Time and vibration of what `export --to python` writes, in a loop with the same noise."""
    scene = panel_scene(SCENE)
    law = chamber_and_law(scene)[1]
    modules: list[dict[str, Any]] = [{}, {}]
    for block, names in zip((disc_block(scene, law), controller_block(scene, law)), modules, strict=True):
        exec(python_files(block, "m")["m.py"], names)
    disc, controller = (names["Block"]() for names in modules)
    seen, time, part, samples = disc.step(0.0), 0.0, 0.0, 0
    rows = [[0.0, seen["vibration_x"], seen["vibration_y"]]]
    sigma = scene.sensor.amplitude_noise, scene.sensor.phase_noise
    while samples < SAMPLES:
        x, y = read_with_noise(seen["vibration_x"], seen["vibration_y"], noise[samples], sigma)
        told = controller.step(part, vibration_x=x, vibration_y=y)
        samples, part = int(told["samples"]), min(told["wait"], PART_S)
        seen = disc.step(part, **{name: told[name] for name in modules[0]["INPUTS"]})
        time += part
        rows.append([time, seen["vibration_x"], seen["vibration_y"]])
    columns: list[list[float]] = np.array(rows).T.tolist()
    return columns


def read_with_noise(
    x: float, y: float, deviates: list[float], sigma: tuple[float, float]
) -> tuple[float, float]:
    """A reading with noise by + - * / and a root alone, in the page's order."""
    size, half = (x * x + y * y) ** 0.5, deviates[1] * sigma[1] / 2
    cosine, sine = (1 - half * half) / (1 + half * half), 2 * half / (1 + half * half)
    factor = (size + deviates[0] * sigma[0]) / size
    return factor * (x * cosine - y * sine), factor * (x * sine + y * cosine)


def begun(page: Page) -> Page:
    """Wait until the page has unpacked its numbers, which may be after it has loaded."""
    page.locator("#load:not(:empty)").wait_for()
    return page


def settled(page: Page) -> None:
    """Wait for the end of the run and for all devices."""
    begun(page)
    page.locator("#end").click()
    until = monotonic() + 20.0
    # The page's policy forbids what the driver would wait with.
    while not page.evaluate(f"!panel.playing && {SHOWN}"):
        assert monotonic() < until
        page.wait_for_timeout(50)


def test_a_run_has_the_bits_of_the_exported_python(
    panel: Path, open_page: OpenPage, noise: list[list[float]], looped: list[list[float]]
) -> None:
    assert begun(open_page(panel)).evaluate(RUN, [SAMPLES, noise]) == looped
    assert len(looped[0]) > 20 * SAMPLES


def test_in_firefox(
    panel: Path, firefox: Firefox, noise: list[list[float]], looped: list[list[float]]
) -> None:
    """From a local file: it runs, its workers run the devices, nothing is reported, the bits are the same."""
    firefox.open(panel.as_uri())
    begun_there = """const done = arguments[arguments.length - 1];
        const look = () => document.querySelector("#load:not(:empty)") ? done(true) : setTimeout(look, 50);
        look();"""
    assert firefox.command("WebDriver:ExecuteAsyncScript", script=begun_there, args=[])
    assert firefox.run(f"return ({RUN})(arguments[0])", [SAMPLES, noise]) == looped
    firefox.run("document.getElementById('end').click()")
    wait = f"""const done = arguments[arguments.length - 1];
        const look = () => {SHOWN} ? done(panel.run.held < Infinity) : setTimeout(look, 50);
        look();"""
    assert firefox.command("WebDriver:ExecuteAsyncScript", script=wait, args=[])
    assert firefox.messages() == []


@pytest.mark.parametrize("scheme", ["light", "dark"])
@pytest.mark.parametrize("size", SIZES)
def test_it_fits_and_breaks_no_rule_of_accessibility(
    panel: Path, open_page: OpenPage, size: str, scheme: Any
) -> None:
    page = open_page(panel, size=size)
    page.emulate_media(color_scheme=scheme)
    settled(page)
    page.locator("summary").first.click()
    assert page.evaluate("document.documentElement.scrollWidth") <= SIZES[size][0]
    assert accessibility_violations(page) == []


def test_every_control_by_keyboard(panel: Path, open_page: OpenPage) -> None:
    """Tab comes to each element that acts; arrows, Enter and the space bar do what a pointer does."""
    page = open_page(panel)
    settled(page)
    page.locator("summary").focus()
    page.keyboard.press("Enter")
    page.evaluate("document.activeElement.blur(); window.getSelection().collapse(document.body, 0)")
    wanted, visited = page.evaluate(FOCUSABLE), []
    for _ in range(wanted + 5):
        page.keyboard.press("Tab")
        visited.append(page.evaluate(FOCUSED))
    assert len(set(visited) - {0}) == wanted

    sliders = page.locator("#controls input[type=range]:visible")
    assert sliders.count() > 8
    for at in range(sliders.count()):
        slider = sliders.nth(at)
        before = page.evaluate("JSON.stringify(panel.state.settings)")
        slider.focus()
        page.keyboard.press("PageDown" if float(slider.input_value()) > 500 else "PageUp")
        assert page.evaluate("JSON.stringify(panel.state.settings)") != before
    assert "gain=" in page.evaluate("location.hash")
    for key in ("Enter", "Space"):
        page.locator("#play").focus()
        playing = page.evaluate("panel.playing")
        page.keyboard.press(key)
        assert page.evaluate("panel.playing") != playing
    page.locator("#reset").focus()
    page.keyboard.press("Enter")
    assert page.evaluate("location.hash") == ""
    page.locator("#play").focus()
    page.keyboard.press("Enter")
    samples = page.evaluate("panel.run.samples")
    page.locator("#step").focus()
    page.keyboard.press("Enter")
    assert page.evaluate("panel.run.samples") == samples + 1
    page.locator("#algorithm").focus()
    page.keyboard.press("ArrowDown")
    assert page.evaluate("panel.state.settings.algorithm") == "law_based"
    page.locator("#dots button").first.focus()
    page.keyboard.press("ArrowRight")
    page.keyboard.press("Enter")
    assert page.evaluate("panel.state.device") == 1
    page.locator("#valves input:checked").focus()
    page.keyboard.press("ArrowDown")
    assert page.evaluate("panel.state.settings.valve") == 0
    page.locator("#mass").focus()
    page.keyboard.press("Space")
    assert page.evaluate("panel.state.settings.mass") is False


def test_a_double_click_returns_to_the_marked_value(panel: Path, open_page: OpenPage) -> None:
    page = begun(open_page(panel, fragment="#gain=0.5"))
    assert page.evaluate("panel.state.settings.gain !== panel.scene.gain")
    page.locator("#control-gain").dblclick()
    assert page.evaluate("panel.state.settings.gain === panel.scene.gain")


def test_a_load_after_the_end_lets_the_run_go_on(panel: Path, open_page: OpenPage) -> None:
    page = open_page(panel)
    settled(page)
    assert page.inner_text("#state").startswith("Settled after")
    end = page.evaluate("panel.run.time")
    assert page.inner_text("#load") == "a load of 4 µm now"
    page.locator("#load").click()
    page.locator("#end").click()
    assert page.evaluate("panel.run.time") > end
    assert "after the load" in page.inner_text("#state")


def test_pictures_without_room_are_left_out(panel: Path, open_page: OpenPage) -> None:
    """Nothing is reported; the largest circle of a picture narrower than its labels has no radius."""
    page = begun(open_page(panel))
    for width in ("0px", "60px"):
        page.evaluate(
            """(width) => {
                for (const id of ["time", "polar"]) document.getElementById(id).style.width = width;
                panel.draw();
            }""",
            width,
        )


def test_a_link_gives_back_what_is_seen(panel: Path, open_page: OpenPage) -> None:
    page = open_page(panel, fragment="#amplitude=8&gain=0.02&seed=9&device=2&load=1.5,2,0")
    settled(page)
    other = open_page(panel, fragment=page.evaluate("location.hash"))
    settled(other)
    trace = "JSON.stringify([panel.run.trace, panel.run.held])"
    assert page.evaluate(trace) == other.evaluate(trace)


HARMFUL: Final = (
    "#gain=NaN&pressure=Infinity&amplitude=1e999&limit=-1",
    "#gain=999999999&amplitude=999999999&noise=999999999&load=0,999999999,1",
    "#__proto__=1&constructor=1&toString=2&valve=__proto__&algorithm=constructor&design=9",
    "#<img src=x onerror=alert(1)>=1&gain=<script>alert(1)</script>&algorithm=javascript:alert(1)",
    "#device=63&valve=99999&design=-1&seed=0&speed=61&load=1&load=1,2&load=,,&load=1,2,3,4",
    "#" + "load=0,0.1,0.1&" * 500 + "%E0%A4%A&%00=%FF",
)


def fuzzed(count: int) -> list[str]:
    """Addresses of known names and any values, and of any characters."""
    rng = random.Random(4)
    names = [
        *panel_content(SCENE)["ranges"],
        "algorithm",
        "valve",
        "design",
        "device",
        "seed",
        "load",
        "mass",
    ]
    values = [
        "0",
        "-0",
        "1e9",
        "0.0000001",
        "none",
        "null",
        "[]",
        "5,5,5",
        "1",
        "99",
        "\U0001f600",
        "%",
        "=",
        "&",
    ]
    parts = [
        "&".join(f"{rng.choice(names)}={rng.choice(values)}{rng.choice(['', *values])}" for _ in range(12))
        for _ in range(count)
    ]
    return [f"#{each}" for each in parts] + [
        "#" + "".join(chr(rng.randrange(32, 0x2FFF)) for _ in range(200))
    ]


def test_no_address_does_harm(panel: Path, open_page: OpenPage) -> None:
    """Nothing is executed or reported, and every number stays within its range."""
    page = begun(open_page(panel))
    page.on("dialog", lambda _: pytest.fail("a dialog"))
    for address in [*HARMFUL, *fuzzed(30)]:
        page.evaluate("(address) => { location.hash = address; }", address)
        page.evaluate("panel.run.advance()")
        values = page.evaluate(
            "Object.entries(panel.content.ranges).map(([k, r]) => [panel.state.settings[k], ...r])"
        )
        for value, low, high, _ in values:
            assert value is None or low * 0.998 <= value <= high * 1.002, address
        assert page.evaluate("Number.isFinite(panel.run.amplitude)"), address
        assert page.evaluate("document.querySelectorAll('img, iframe, script:not([id])').length") == 0


def test_no_name_of_a_scene_does_harm(tmp_path: Path, chromium: Browser) -> None:
    path = tmp_path / "panel.html"
    path.write_text(document_of({**panel_content(SCENE), "name": NAME}), encoding="utf-8")
    with watched_page(chromium, path.as_uri()) as (page, faults):
        page.on("dialog", lambda _: pytest.fail("a dialog"))
        settled(page)
        assert page.inner_text("h1").split() == NAME.split()
        assert page.title().startswith("</title></script><img")
        assert page.locator("img").count() == 0
        assert faults == []


def test_the_policy_lets_nothing_out(panel: Path, chromium: Browser) -> None:
    """A request that the page would make is refused by its own policy, before any network."""
    failures: list[str | None] = []
    with watched_page(chromium, panel.as_uri()) as (page, faults):
        page.on("requestfailed", lambda request: failures.append(request.failure))
        refused = page.evaluate("fetch('http://127.0.0.1:9/').then(() => 'sent', (error) => error.name)")
        assert refused == "TypeError"
        page.evaluate("document.body.append(Object.assign(new Image(), { src: 'http://127.0.0.1:9/a.png' }))")
        page.wait_for_timeout(200)
        assert sum("Content Security Policy" in each for each in faults) >= 2
        assert set(failures) <= {"csp"}
