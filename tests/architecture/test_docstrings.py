"""The docstring is a contract: what it says of arguments and results is held against the signature."""

from __future__ import annotations

import ast
import re
from collections.abc import Iterator, Mapping
from pathlib import Path

import pytest

Function = ast.FunctionDef | ast.AsyncFunctionDef
SECTION = re.compile(r"^(Args|Returns|Yields|Raises|Source|Range|Example|Note):", re.MULTILINE)
ENTRY = re.compile(r"^ {4}\*{0,2}(\w+):", re.MULTILINE)


def section(docstring: str, name: str) -> str:
    """Text of a Google-style section; empty when there is none."""
    parts = SECTION.split(docstring)
    found = dict(zip(parts[1::2], parts[2::2], strict=True))
    return found.get(name, "")


def documented_arguments(docstring: str) -> list[str]:
    """Names in the `Args:` section, in order, without those that nothing reads."""
    return [name for name in ENTRY.findall(section(docstring, "Args")) if name[0] != "_"]


def arguments(function: Function) -> list[str]:
    """Names in the signature, in order, without self, cls and those that nothing reads."""
    spec = function.args
    named = [*spec.posonlyargs, *spec.args]
    named += [spec.vararg] if spec.vararg else []
    named += spec.kwonlyargs
    named += [spec.kwarg] if spec.kwarg else []
    return [name for argument in named if (name := argument.arg) not in {"self", "cls"} and name[0] != "_"]


def _gives_something(function: Function) -> bool:
    return function.returns is not None and ast.unparse(function.returns) not in {"None", "NoReturn"}


def faults(function: Function) -> list[str]:
    """Where a function's docstring and its signature disagree."""
    docstring = ast.get_docstring(function)
    if not docstring:
        return ["no docstring"]
    found = []
    if documented_arguments(docstring) != arguments(function):
        found.append(f"Args: name {documented_arguments(docstring)}, the signature {arguments(function)}")
    if (
        arguments(function)
        and _gives_something(function)
        and not (section(docstring, "Returns") or section(docstring, "Yields"))
    ):
        found.append("no Returns:")
    return found


def public_functions(tree: ast.Module) -> Iterator[tuple[str, Function]]:
    """Public functions of a module, and public methods of its public classes, with their dotted names."""
    for node in tree.body:
        if isinstance(node, Function) and not node.name.startswith("_"):
            yield node.name, node
        if isinstance(node, ast.ClassDef) and not node.name.startswith("_"):
            for inner in node.body:
                if isinstance(inner, Function) and not inner.name.startswith("_"):
                    yield f"{node.name}.{inner.name}", inner


def module_faults(source: str) -> list[str]:
    """All disagreements of one module, its own docstring and those of its public classes included."""
    tree = ast.parse(source)
    found = [] if ast.get_docstring(tree) or not tree.body else ["the module has no docstring"]
    found += [
        f"{node.name}: no docstring"
        for node in tree.body
        if isinstance(node, ast.ClassDef) and not node.name.startswith("_") and not ast.get_docstring(node)
    ]
    found += [f"{name}: {fault}" for name, function in public_functions(tree) for fault in faults(function)]
    return found


def test_docstrings_agree_with_signatures(modules: Mapping[str, Path]) -> None:
    found = [f"{name}.{fault}" for name, path in modules.items() for fault in module_faults(path.read_text())]
    assert found == []


GOOD = '''"""Module."""
def speed(*, radius: float, rate: float) -> float:
    """Speed of a point on a turning body.

    v = omega r.

    Args:
        radius: r, m.
        rate: omega, rad/s:
            a continued line: with a colon.

    Returns:
        v, m/s.
    """
    return radius * rate
'''


def test_an_agreeing_docstring_is_let_through() -> None:
    assert module_faults(GOOD) == []


@pytest.mark.parametrize(
    ("old", "new", "fault"),
    [
        ("        radius: r, m.\n", "", "Args:"),
        ("rate: omega", "speed: omega", "Args:"),
        ("radius: float, rate: float", "rate: float, radius: float", "Args:"),
        ("rate: float)", "rate: float, extra: int = 0)", "Args:"),
        ("    Returns:\n        v, m/s.\n", "", "no Returns:"),
        ('"""Module."""\n', "", "the module has no docstring"),
    ],
)
def test_a_disagreement_is_seen(old: str, new: str, fault: str) -> None:
    assert old in GOOD
    assert any(fault in found for found in module_faults(GOOD.replace(old, new)))


def test_methods_and_classes_are_seen() -> None:
    source = '"""M."""\nclass Law:\n    def evaluate(self, x: float) -> float:\n        return x\n'
    assert module_faults(source) == ["Law: no docstring", "Law.evaluate: no docstring"]
