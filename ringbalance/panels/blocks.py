"""Exported functions in JavaScript, without numbers: the same text for every device."""

from __future__ import annotations

from types import ModuleType
from typing import Final

from ringbalance.controller.algorithms import law_steps, target_steps, trial_steps, valve_steps
from ringbalance.export import disc, law_based
from ringbalance.export.translate import Source, js_functions
from ringbalance.reduced_model.pieces import point, query

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
