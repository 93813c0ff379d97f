"""Take docs/pictures/panel.png, the first picture of README.md, from the panel of the paper's disc.

python tools/panel_picture.py       needs Chromium (tools/make_browsers.sh); a minute
"""

from __future__ import annotations

from pathlib import Path
from tempfile import TemporaryDirectory

from PIL import Image
from playwright.sync_api import ViewportSize, sync_playwright

import ringbalance as rb

PICTURE = Path(__file__).resolve().parents[1] / "docs" / "pictures" / "panel.png"
SIZE: ViewportSize = {"width": 1280, "height": 960}
COLOURS = 128
SAMPLES = 3
"""Samples after which the run is paused, as soon as a valve is open."""


def main() -> None:
    """Open the panel, let it run a while, and keep what is seen."""
    with TemporaryDirectory() as folder, sync_playwright() as playwright:
        page_file = rb.panel(rb.load_scene(rb.bundled_scene("liquid_ring_paper"))).save(
            Path(folder, "a.html")
        )
        browser = playwright.chromium.launch(executable_path="/usr/bin/chromium")
        page = browser.new_page(viewport=SIZE)
        page.goto(page_file.as_uri() + "#gain=0.03&speed=1")
        while page.locator("#dots button.ok, #dots button.no").count() < 64:
            page.wait_for_timeout(100)
        page.evaluate(
            """(samples) => {
                panel.restart();
                panel.play(false);
                const { run } = panel, open = () => [0, 1, 2, 3].some((chamber) => run.isOpen(chamber));
                while (run.time < 60 && (run.samples < samples || !open())) run.advance();
                panel.draw();
            }""",
            SAMPLES,
        )
        shot = Path(folder, "panel.png")
        page.screenshot(path=shot)
        browser.close()
        with Image.open(shot) as picture:
            # An octree keeps the few colours that stand for valves, limits and devices.
            few = picture.convert("RGB").quantize(COLOURS, method=Image.Quantize.FASTOCTREE)
            few.save(PICTURE, optimize=True)
    print(f"{PICTURE}: {PICTURE.stat().st_size / 1000:.0f} kB")


if __name__ == "__main__":
    main()
