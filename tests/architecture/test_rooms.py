"""One way through the house: a room imports only from rooms before it, absolutely, and at module level."""

from __future__ import annotations

import ast
from collections.abc import Iterator, Mapping, Sequence
from functools import cache
from graphlib import CycleError, TopologicalSorter
from pathlib import Path

import pytest

DYNAMIC = {"import_module", "__import__"}
REGISTRY = "ringbalance.scene.registry"
"""It imports what the face registers, or a package of the user's own."""
Function = ast.FunctionDef | ast.AsyncFunctionDef
Scope = Function | ast.ClassDef
Scopes = tuple[ast.AST, ...]
"""Functions and classes around a statement, the outermost first."""


def imported_names(node: ast.AST) -> list[str]:
    """Dotted names that an import statement may load, submodules included."""
    if isinstance(node, ast.Import):
        return [alias.name for alias in node.names]
    if isinstance(node, ast.ImportFrom) and node.module:
        return [node.module, *(f"{node.module}.{alias.name}" for alias in node.names)]
    return []


def _called_name(node: ast.Call) -> str:
    return getattr(node.func, "id", "") or getattr(node.func, "attr", "")


@cache
def loading(source: str) -> tuple[tuple[ast.AST, Scopes], ...]:
    """Imports and dynamic imports of a module, each with what it stands in; every test asks for them all."""
    return tuple(_loading(ast.parse(source), ()))


def _loading(node: ast.AST, scopes: Scopes) -> Iterator[tuple[ast.AST, Scopes]]:
    dynamic = isinstance(node, ast.Call) and _called_name(node) in DYNAMIC
    if dynamic or isinstance(node, ast.Import | ast.ImportFrom):
        yield node, scopes
    inner = (*scopes, node) if isinstance(node, Scope) else scopes
    for child in ast.iter_child_nodes(node):
        if not isinstance(child, ast.expr_context | ast.operator):
            yield from _loading(child, inner)


def _lazy(scopes: Scopes) -> bool:
    """Whether it is a module's own `__getattr__`, which loads a public name when it is first used."""
    return bool(scopes) and isinstance(scopes[0], ast.FunctionDef) and scopes[0].name == "__getattr__"


def style_faults(source: str) -> list[str]:
    """Imports that are relative, dynamic, or hidden in a function's body."""
    faults = []
    for node, scopes in loading(source):
        line = f"line {getattr(node, 'lineno', 0)}"
        if isinstance(node, ast.Call):
            faults += [] if _lazy(scopes) else [f"{line}: dynamic import"]
            continue
        if isinstance(node, ast.ImportFrom) and node.level:
            faults.append(f"{line}: relative import")
        if any(isinstance(scope, Function) for scope in scopes):
            faults.append(f"{line}: import inside a function")
    return faults


def room_faults(source: str, *, room: str, room_order: Sequence[str]) -> list[str]:
    """Imports from the face or from a later room."""
    allowed = {*room_order[: room_order.index(room) + 1]}
    faults = []
    for node, _ in loading(source):
        for name in imported_names(node)[:1]:
            top, _, rest = name.partition(".")
            if top == "ringbalance" and rest.split(".")[0] not in allowed:
                faults.append(f"line {getattr(node, 'lineno', 0)}: {room} imports {name}")
    return faults


def import_graph(sources: Mapping[str, str]) -> dict[str, set[str]]:
    """Module to the modules of the project that it imports."""
    return {module: set(_project_imports(source, sources)) - {module} for module, source in sources.items()}


def _project_imports(source: str, sources: Mapping[str, str]) -> Iterator[str]:
    for node, _ in loading(source):
        names = [name for name in imported_names(node) if name in sources]
        # `from package import module` needs the module; that Python runs the package first is no cycle.
        only_submodules = isinstance(node, ast.ImportFrom) and len(names) == len(node.names) + 1
        yield from names[1:] if only_submodules else names


def cycle(sources: Mapping[str, str]) -> list[str]:
    """One import cycle, or nothing."""
    try:
        TopologicalSorter(import_graph(sources)).prepare()
    except CycleError as error:
        return list(error.args[1])
    return []


def test_imports_are_absolute_and_at_module_level(modules: Mapping[str, Path]) -> None:
    faults = {name: style_faults(path.read_text()) for name, path in modules.items() if name != REGISTRY}
    assert {name: found for name, found in faults.items() if found} == {}


def test_no_room_imports_from_a_later_room(modules: Mapping[str, Path], room_order: tuple[str, ...]) -> None:
    faults = [
        f"{name}: {fault}"
        for name, path in modules.items()
        for fault in room_faults(path.read_text(), room=name.split(".")[1], room_order=room_order)
    ]
    assert faults == []


def parts_imported(sources: Mapping[str, str], room: str) -> dict[str, set[str]]:
    """Sub-packages and plain modules of a room, each with those that it imports."""

    def part(module: str) -> str:
        return ".".join(module.split(".")[:3])

    graph: dict[str, set[str]] = {}
    for module, imported in import_graph(sources).items():
        inside = {part(m) for m in imported if m.startswith(f"ringbalance.{room}.")}
        if module.startswith(f"ringbalance.{room}."):
            graph[part(module)] = graph.get(part(module), set()) | inside - {part(module)}
    return graph


@pytest.mark.parametrize("room", ["reduced_model"])
def test_sub_packages_do_not_import_both_ways(modules: Mapping[str, Path], room: str) -> None:
    sources = {name: path.read_text() for name, path in modules.items()}
    order = list(TopologicalSorter(parts_imported(sources, room)).static_order())
    assert order.index(f"ringbalance.{room}.chamber") < order.index(f"ringbalance.{room}.law")


def test_no_import_cycle(modules: Mapping[str, Path]) -> None:
    assert cycle({name: path.read_text() for name, path in modules.items()}) == []


@pytest.mark.parametrize(
    ("source", "fault"),
    [
        ("from . import geometry", "relative"),
        ("def f():\n    import numpy", "inside a function"),
        ("class A:\n    def f(self):\n        from os import path", "inside a function"),
        ("import importlib\nimportlib.import_module('ringbalance.reports')", "dynamic"),
        ("import ringbalance.reports.cli", "mesh imports"),
        ("from ringbalance import load_scene", "mesh imports"),
        ("if True:\n    from ringbalance.verification import run_case", "mesh imports"),
    ],
)
def test_import_faults_are_seen(source: str, fault: str, room_order: tuple[str, ...]) -> None:
    found = style_faults(source) + room_faults(source, room="mesh", room_order=room_order)
    assert any(fault in each for each in found)
    lawful = "import numpy\nfrom ringbalance.scene.models import Disc\nimport ringbalance.mesh.geometry"
    assert style_faults(lawful) + room_faults(lawful, room="mesh", room_order=room_order) == []


def test_a_cycle_is_seen_and_a_package_that_gathers_its_modules_is_none() -> None:
    gathered = {
        "ringbalance.mesh": "from ringbalance.mesh.a import f",
        "ringbalance.mesh.a": "from ringbalance.mesh import b",
        "ringbalance.mesh.b": "",
    }
    assert cycle(gathered) == []
    assert cycle(gathered | {"ringbalance.mesh.b": "from ringbalance.mesh import f"}) != []
    assert cycle(gathered | {"ringbalance.mesh.b": "import ringbalance.mesh.a"}) != []
