"""Chromium and Firefox of the machine, each page without a network and with every fault noted."""

from __future__ import annotations

import json
import socket
import subprocess
import time
from collections.abc import Iterator
from contextlib import contextmanager
from importlib.resources import files
from pathlib import Path
from typing import Any, Final

from playwright.sync_api import Browser, Page

SIZES: Final = {"phone": (390, 844), "desktop": (1440, 900)}
"""Width and height, pixels of a page."""
_INSIDE: Final = ("file:", "blob:", "data:", "about:")


@contextmanager
def watched_page(browser: Browser, url: str, *, size: str = "desktop") -> Iterator[tuple[Page, list[str]]]:
    """A page and a growing list of faults: errors, console messages, requests that leave the machine."""
    width, height = SIZES[size]
    context = browser.new_context(
        viewport={"width": width, "height": height}, has_touch=size == "phone", offline=True
    )
    context.set_default_timeout(10_000)
    faults: list[str] = []
    page = context.new_page()
    page.on("pageerror", lambda error: faults.append(f"error: {error}"))
    page.on("console", lambda said: faults.append(said.text) if said.type in ("error", "warning") else None)
    context.on(
        "request",
        lambda asked: None if asked.url.startswith(_INSIDE) else faults.append(f"request: {asked.url}"),
    )
    page.goto(url)
    try:
        yield page, faults
    finally:
        context.close()


def accessibility_violations(page: Page) -> list[str]:
    """Rules of axe-core that the page breaks, each with the first elements that do."""
    source = files("axe_playwright_python").joinpath("axe.min.js").read_text(encoding="utf-8")
    # Evaluated by the browser's debugger: no content security policy of the page stands in the way.
    result: dict[str, Any] = page.evaluate(source + "\naxe.run()")
    return [
        f"{each['id']}: {each['help']}: " + "; ".join(node["html"][:160] for node in each["nodes"][:5])
        for each in result["violations"]
    ]


class Firefox:
    """Firefox without a window, by its remote protocol Marionette: lengths and JSON on a local socket."""

    def __init__(self, profile: Path) -> None:
        with socket.socket() as free:
            free.bind(("127.0.0.1", 0))
            port = int(free.getsockname()[1])
        (profile / "user.js").write_text(
            f'user_pref("marionette.port", {port});\n'
            # No proxy answers: whatever leaves the machine fails.
            'user_pref("network.proxy.type", 1);\nuser_pref("network.proxy.http", "127.0.0.1");\n'
            'user_pref("network.proxy.http_port", 9);\nuser_pref("network.proxy.ssl", "127.0.0.1");\n'
            'user_pref("network.proxy.ssl_port", 9);\n'
        )
        command = ["firefox-esr", "--headless", "--no-remote", "--marionette"]
        command += ["--remote-allow-system-access", "--profile", str(profile)]
        self._process = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        self._socket = _connected(port, self._process)
        self._stream = self._socket.makefile("rb")
        self._number = 0
        self._read()
        self.command("WebDriver:NewSession", capabilities={"alwaysMatch": {}})

    def _read(self) -> Any:
        digits = b""
        while not digits.endswith(b":"):
            digits += self._stream.read(1)
        return json.loads(self._stream.read(int(digits[:-1])))

    def command(self, name: str, **parameters: Any) -> Any:
        """Result of a command of Marionette."""
        self._number += 1
        text = json.dumps([0, self._number, name, parameters])
        self._socket.sendall(f"{len(text.encode())}:{text}".encode())
        _, _, error, result = self._read()
        if error:
            raise RuntimeError(f"{name}: {error['message']}")
        return result["value"] if isinstance(result, dict) and "value" in result else result

    def open(self, url: str) -> None:
        """Load a page."""
        self.command("WebDriver:Navigate", url=url)

    def run(self, script: str, *args: Any) -> Any:
        """What a script returns in the page."""
        return self.command("WebDriver:ExecuteScript", script=script, args=list(args))

    def messages(self) -> list[str]:
        """Errors of scripts and policies in pages from files, since they were last asked for."""
        self.command("Marionette:SetContext", value="chrome")
        script = """const told = Services.console.getMessageArray().filter((each) =>
            each instanceof Ci.nsIScriptError && /^(file|blob|about:blank)/.test(each.sourceName)
            && !(each.flags & Ci.nsIScriptError.warningFlag)).map(String);
            Services.console.reset();
            return told;"""
        told = self.run(script)
        self.command("Marionette:SetContext", value="content")
        return [str(each) for each in told]

    def close(self) -> None:
        """End the browser."""
        self._stream.close()
        self._socket.close()
        self._process.terminate()
        self._process.wait(30)


def _connected(port: int, process: subprocess.Popen[bytes]) -> socket.socket:
    """Connection to a browser that is starting."""
    until = time.monotonic() + 60.0
    while time.monotonic() < until and process.poll() is None:
        try:
            return socket.create_connection(("127.0.0.1", port), timeout=30.0)
        except OSError:
            time.sleep(0.1)
    process.kill()
    raise RuntimeError("Firefox did not start")
