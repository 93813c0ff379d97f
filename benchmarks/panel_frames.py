"""Frames a second of the panel at its fastest clock, beside those of an empty page in the same browser.

A run that never settles is started again whenever it ends; its devices are run by the workers meanwhile.
"""

from __future__ import annotations

from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Final

from playwright.sync_api import Page, sync_playwright

import ringbalance as rb

COUNT: Final = """
(seconds) => new Promise((done) => {
    const begin = performance.now();
    let frames = 0;
    const frame = (now) => {
        frames += 1;
        if (globalThis.panel && !panel.playing) panel.restart();
        if (now - begin < 1000 * seconds) requestAnimationFrame(frame);
        else done((1000 * frames) / (now - begin));
    };
    requestAnimationFrame(frame);
})
"""
SECONDS: Final = 5.0


def frames_a_second(page: Page, url: str) -> float:
    """Mean rate over some seconds, 1/s."""
    page.goto(url)
    return float(page.evaluate(COUNT, SECONDS))


def main() -> None:
    """Print both rates and their ratio."""
    with TemporaryDirectory() as folder, sync_playwright() as playwright:
        scene = rb.load_scene(rb.bundled_scene("liquid_ring_paper"))
        panel = rb.panel(scene).save(Path(folder, "panel.html")).as_uri()
        browser = playwright.chromium.launch(executable_path="/usr/bin/chromium")
        for width, height in ((1440, 900), (390, 844)):
            page = browser.new_page(viewport={"width": width, "height": height})
            empty = frames_a_second(page, "about:blank")
            fastest = frames_a_second(page, f"{panel}#amplitude=20&speed=60")
            ratio = fastest / empty
            print(
                f"{width} pixels: {fastest:.1f} frames/s of {empty:.1f} on an empty page, ratio {ratio:.2f}"
            )
        browser.close()


if __name__ == "__main__":
    main()
