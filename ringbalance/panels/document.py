"""One file of a panel: modules of the page joined into one script, with a policy that forbids any request."""

from __future__ import annotations

import hashlib
import html
import json
import re
from base64 import b64encode
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from importlib.resources import files
from os import PathLike
from pathlib import Path
from string import Template
from types import ModuleType
from typing import Any, Final

from ringbalance.controller.algorithms import law_steps, target_steps, trial_steps, valve_steps
from ringbalance.export import disc, law_based
from ringbalance.export.translate import Source, js_functions
from ringbalance.reduced_model.pieces import point, query
from ringbalance.scene.platform.files import write_whole

MODULES: Final = (
    *("numbers", "blocks", "model", "controls", "address", "devices", "canvas", "time_plot", "polar_plot"),
    *("disc_picture", "form", "many", "main"),
)
"""Modules of the page; each imports from those before it alone."""
MASS_MODULES: Final = (
    *("numbers", "mass_blocks", "controls", "mass_model", "canvas", "time_plot", "polar_plot"),
    *("disc_picture", "form", "mass_picture", "mass_page"),
)
"""Modules of the page of eccentric masses, in such an order; the blocks are the scene's own."""
_IMPORT: Final = re.compile(r'^import (\{[^}]*\}) from "\./(\w+)\.js";$', re.MULTILINE)
_EXPORT: Final = re.compile(r"^export (?=(?:const|class|(?:async )?function\*?) (\w+))", re.MULTILINE)

_COMMENT: Final = re.compile(r"^ *(/\*\*(.|\n)*?\*/|//.*)\n", re.MULTILINE)
_INDENT: Final = re.compile(r"^ +", re.MULTILINE)


@dataclass(frozen=True, kw_only=True, repr=False)
class Panel:
    """Page on which one watches a scene's rotor being balanced; a notebook shows it.

    Example:
        >>> scene = rb.load_scene(rb.bundled_scene("liquid_ring_paper"))
        >>> panel = rb.panel(scene)
        >>> panel.save("panel.html").name
        'panel.html'
    """

    name: str
    """Name of the scene."""
    html: str
    """The whole document."""

    def save(self, path: str | PathLike[str]) -> Path:
        """Write the page to a file. Raises: OSError: it cannot be written."""
        return write_whole(Path(path), self.html)

    def __repr__(self) -> str:
        return f"panel of {self.name}, {len(self.html.encode()) / 1000:.0f} kB"

    def _repr_html_(self) -> str:
        """Frame for a notebook."""
        title, document = html.escape(repr(self)), html.escape(self.html)
        rights = 'sandbox="allow-scripts allow-downloads" width="100%" height="900"'
        return f'<iframe title="{title}" {rights} srcdoc="{document}"></iframe>'


def document_of(
    content: Mapping[str, Any],
    *,
    page: str = "panel.html",
    modules: Sequence[str] = MODULES,
    own_modules: Mapping[str, str] | None = None,
) -> str:
    """HTML document of a panel, which needs no other file, from all its numbers and texts.

    Args: `page`: template of its body. `modules`: names of its modules, in their order.
        `own_modules`: texts of those that are the scene's own.
    """
    texts = {name: (own_modules or {}).get(name) or module_text(name) for name in modules}
    program, style = joined(texts), _part("page/panel.css")
    policy = (
        f"default-src 'none'; script-src {_digest(program)}; style-src {_digest(style)}; worker-src blob:; "
        "base-uri 'none'; form-action 'none'"
    )
    title = html.escape(content["name"])
    return Template(_part("templates/frame.html")).substitute(
        policy=policy,
        title=title,
        style=style,
        body=Template(_part(f"templates/{page}")).substitute(title=title),
        # No text of the scene can end the element that holds it.
        content=json.dumps(content, allow_nan=False, separators=(",", ":")).replace("<", "\\u003c"),
        program=program,
    )


def module_text(name: str) -> str:
    """Text of a module of the page; that of the blocks is made of the exported functions."""
    return blocks_module() if name == "blocks" else _part(f"page/{name}.js")


def joined(modules: Mapping[str, str]) -> str:
    """One script of modules, in their order: each is a function that returns what it exports."""
    parts = []
    for name, text in modules.items():
        text = _IMPORT.sub(r"const \1 = \2;", _COMMENT.sub("", text))
        names = _EXPORT.findall(text)
        text = _INDENT.sub("", _EXPORT.sub("", text))
        parts.append(f"const {name} = (() => {{\n{text}return {{ {', '.join(names)} }};\n}})();\n")
    return "".join(parts)


def _part(name: str) -> str:
    return files("ringbalance.panels").joinpath(name).read_text(encoding="utf-8")


def _digest(text: str) -> str:
    return f"'sha256-{b64encode(hashlib.sha256(text.encode()).digest()).decode()}'"


_LAW: Final = (point, query, disc)
_SOURCES: Final[dict[str, tuple[tuple[ModuleType, ...], dict[str, str]]]] = {
    "ring": (
        (*_LAW, valve_steps, law_steps, law_based),
        {"step": "disc", "control": "law_based", "moment": "moment"},
    ),
    "target": ((point, valve_steps, target_steps), {"step": "target_vector"}),
    "trials": ((point, valve_steps, trial_steps), {"step": "trial"}),
}
"""By name: modules, and names in the page by functions."""


def blocks_module() -> str:
    """Module of ES2020 that exports the functions that advance each block, and the moment of a chamber."""
    parts = []
    for name, (modules, exports) in _SOURCES.items():
        functions = js_functions(Source.of_modules(modules, tuple(exports)))
        parts.append(f"const {name} = (() => {{\n{functions}\nreturn {{ {', '.join(exports)} }};\n}})();\n")
        parts += [f"export const {alias} = {name}.{function};\n" for function, alias in exports.items()]
    return "".join(parts)
