"""One way through the house: a room imports only from rooms before it, absolutely, and at module level."""

from __future__ import annotations

import ast
from collections.abc import Iterator, Mapping, Sequence
from graphlib import CycleError, TopologicalSorter

import pytest

DYNAMIC = {"import_module", "__import__"}
REGISTRY = "ringbalance.scene.registry"
"""It imports what the face registers, or a package of the user's own."""
Function = ast.FunctionDef | ast.AsyncFunctionDef
Import = ast.Import | ast.ImportFrom


def imported_names(node: Import) -> list[str]:
    """Dotted names that an import statement may load, submodules included."""
    if isinstance(node, ast.Import):
        return [alias.name for alias in node.names]
    return [node.module, *(f"{node.module}.{alias.name}" for alias in node.names)] if node.module else []


def style_errors(node: ast.AST, *, in_function: bool = False, lazy: bool = False) -> Iterator[str]:
    """Imports that are relative, dynamic, or hidden in a function's body.

    A module's own `__getattr__` may import: it loads a public name when that is first used.
    """
    line = f"line {getattr(node, 'lineno', 0)}"
    if isinstance(node, ast.Call) and not lazy:
        if (getattr(node.func, "id", "") or getattr(node.func, "attr", "")) in DYNAMIC:
            yield f"{line}: dynamic import"
    elif isinstance(node, Import):
        if getattr(node, "level", 0):
            yield f"{line}: relative import"
        if in_function:
            yield f"{line}: import inside a function"
    for child in ast.iter_child_nodes(node):
        own_getattr = isinstance(node, ast.Module | ast.If) and getattr(child, "name", "") == "__getattr__"
        inside = in_function or isinstance(node, Function)
        yield from style_errors(child, in_function=inside, lazy=lazy or own_getattr)


def room_errors(tree: ast.Module, *, room: str, room_order: Sequence[str]) -> list[str]:
    """Imports from the face or from a later room."""
    allowed = {*room_order[: room_order.index(room) + 1]}
    loaded = [
        name for node in ast.walk(tree) if isinstance(node, Import) for name in imported_names(node)[:1]
    ]
    parts = [(name, *name.split(".")) for name in loaded]
    return [
        f"{room} imports {name}"
        for name, top, *rest in parts
        if top == "ringbalance" and (not rest or rest[0] not in allowed)
    ]


def import_graph(trees: Mapping[str, ast.Module]) -> dict[str, set[str]]:
    """Module to the modules of the project that it imports."""
    graph: dict[str, set[str]] = {}
    for module, tree in trees.items():
        graph[module] = set()
        for node in ast.walk(tree):
            if isinstance(node, Import):
                names = [name for name in imported_names(node) if name in trees]
                # `from package import module` needs the module; the package runs first, which is no cycle.
                only_submodules = isinstance(node, ast.ImportFrom) and len(names) == len(node.names) + 1
                graph[module].update(names[1:] if only_submodules else names)
        graph[module].discard(module)
    return graph


def in_rooms(trees: Mapping[str, ast.Module], room_order: Sequence[str]) -> dict[str, ast.Module]:
    """The modules of the rooms, without the package's face."""
    return {name: tree for name, tree in trees.items() if name.split(".")[1] in room_order}


def test_imports_are_absolute_and_at_module_level(
    trees: Mapping[str, ast.Module], room_order: tuple[str, ...]
) -> None:
    errors = {
        name: list(style_errors(tree))
        for name, tree in in_rooms(trees, room_order).items()
        if name != REGISTRY
    }
    assert {name: each for name, each in errors.items() if each} == {}


def test_no_room_imports_from_a_later_room(
    trees: Mapping[str, ast.Module], room_order: tuple[str, ...]
) -> None:
    assert [
        f"{name}: {error}"
        for name, tree in in_rooms(trees, room_order).items()
        for error in room_errors(tree, room=name.split(".")[1], room_order=room_order)
    ] == []


def test_no_import_cycle(trees: Mapping[str, ast.Module], room_order: tuple[str, ...]) -> None:
    TopologicalSorter(import_graph(in_rooms(trees, room_order))).prepare()


@pytest.mark.parametrize("room", ["reduced_model"])
def test_sub_packages_do_not_import_both_ways(trees: Mapping[str, ast.Module], room: str) -> None:
    graph: dict[str, set[str]] = {}
    for module, imported in import_graph(trees).items():
        if module.startswith(f"ringbalance.{room}."):
            part, *others = (".".join(name.split(".")[:3]) for name in (module, *sorted(imported)))
            inside = {other for other in others if other.startswith(f"ringbalance.{room}.")}
            graph[part] = graph.get(part, set()) | inside - {part}
    order = list(TopologicalSorter(graph).static_order())
    assert order.index(f"ringbalance.{room}.chamber") < order.index(f"ringbalance.{room}.law")


@pytest.mark.parametrize(
    ("source", "error"),
    [
        ("from . import geometry", "relative"),
        ("class A:\n    def f(self):\n        from os import path", "inside a function"),
        ("import importlib\nimportlib.import_module('ringbalance.reports')", "dynamic"),
        ("import ringbalance.reports.cli", "mesh imports"),
        ("from ringbalance import load_scene", "mesh imports"),
        ("if True:\n    from ringbalance.verification import run_case", "mesh imports"),
    ],
)
def test_a_wrong_import_is_seen(source: str, error: str, room_order: tuple[str, ...]) -> None:
    tree = ast.parse(source)
    errors = [*style_errors(tree), *room_errors(tree, room="mesh", room_order=room_order)]
    assert len(errors) == 1
    assert error in errors[0]


def test_a_cycle_is_seen() -> None:
    sources = {"a": "from a.b import f", "a.b": "from a import c", "a.c": "import a.b"}
    with pytest.raises(CycleError):
        TopologicalSorter(import_graph({name: ast.parse(each) for name, each in sources.items()})).prepare()
