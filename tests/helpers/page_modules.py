"""Modules of the panel's page, run by Node."""

from __future__ import annotations

import json
import shutil
import subprocess
from functools import cache
from pathlib import Path
from tempfile import mkdtemp
from typing import Any, Final, cast

import pytest

import ringbalance as rb
from ringbalance.panels.content import content_of
from ringbalance.panels.document import MASS_MODULES, MODULES, module_text
from ringbalance.scene.models import Scene

NODE: Final = shutil.which("node")
needs_node = pytest.mark.skipif(NODE is None, reason="no Node")


@cache
def panel_scene(name: str, **values: str) -> Scene:
    """A bundled scene with one valve at hand, which spares the choice among many."""
    valves = [{"name": "V", "conductance": "0.8 l/(s*bar)", "critical_ratio": 0.3, "valve_lag": "5 ms"}]
    changes = {"design.valves": valves, **{key.replace("__", "."): each for key, each in values.items()}}
    return cast(Scene, rb.load_scene(rb.bundled_scene(name)).with_values(changes))


@cache
def panel_content(name: str, *vary: str, devices: int = 4, **values: str) -> dict[str, Any]:
    """Content of the panel of `panel_scene`."""
    return content_of(panel_scene(name, **values), vary=vary, devices=devices)


@cache
def page_folder() -> Path:
    """Folder with all modules of the page."""
    folder = Path(mkdtemp(prefix="panel"))
    (folder / "package.json").write_text('{"type": "module"}')
    for name in {*MODULES, *MASS_MODULES} - {"mass_blocks"}:
        (folder / f"{name}.js").write_text(module_text(name))
    return folder


def in_node(script: str, *, blocks: str = "", **values: Any) -> Any:
    """Value of `answer` after a script on the page's modules.

    Args: `blocks`: module of a scene with eccentric masses. `values`: the script's constants by name.
    """
    (page_folder() / "mass_blocks.js").write_text(blocks)
    lines = [f"const {name} = JSON.parse({json.dumps(json.dumps(each))});" for name, each in values.items()]
    text = "\n".join(
        [*_imports(script), *lines, "let answer;", script, "console.log(JSON.stringify(answer));"]
    )
    file = page_folder() / "script.js"
    file.write_text(text)
    ran = subprocess.run([str(NODE), str(file)], capture_output=True, text=True, check=False)
    assert ran.returncode == 0, ran.stderr
    return json.loads(ran.stdout)


_EXPORTS: Final = {
    "numbers": ("unpack", "normalPairs"),
    "model": ("Run", "discOf", "lostTime", "noisy", "outcomeOf", "sceneSettings"),
    "controls": ("CONTROLS", "sceneBlocks", "stepOf", "valueAt", "digits"),
    "address": ("read", "written"),
    "devices": ("bounds", "summary", "noiseOf", "verdict"),
    "disc_picture": ("surfaceRadius", "sector"),
    "mass_model": ("MASS_CONTROLS", "MassRun", "constantsOf", "massAddress", "massSettings", "massState"),
    "mass_picture": ("moments",),
}


def _imports(script: str) -> list[str]:
    wanted = {module: [name for name in names if name in script] for module, names in _EXPORTS.items()}
    return [
        f'import {{ {", ".join(names)} }} from "./{module}.js";' for module, names in wanted.items() if names
    ]
