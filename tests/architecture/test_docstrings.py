"""A docstring gives what the signature does not: no missing one, no wrong name, no entry without content.

An implementation of a method that a protocol documents, and a case's `compute` and `reference`, inherit its
text.  The options of a command need their entries, because `--help` shows them.  Arguments stand in running
text, `name`: with a colon, or one a line when there is much to say.
"""

from __future__ import annotations

import ast
import re
from collections.abc import Collection, Iterator, Mapping
from pathlib import Path

import pytest

Function = ast.FunctionDef | ast.AsyncFunctionDef
Contract = tuple[str, tuple[str, ...]]
"""Name and arguments of a method."""
SECTION = re.compile(
    r"(?:^|(?<=\. ))(Args|Returns|Yields|Raises|Source|Range|Example|Note):(?=\s|$)", re.MULTILINE
)
ENTRY = re.compile(r"(?:^ {4}|`)\*{0,2}(\w+)`?:(?=\s|$)", re.MULTILINE)
"""A line of its own, or `name`: in running text."""
CASE_INTERFACE = ("compute", "reference", "values")
NO_CONTENT = """
    a an and are as at be by each every for from given gives hand here in into is it its new no not of off
    on one or own returns that the their them there these this those to used value values which whose with
"""


def section(docstring: str, name: str) -> str:
    """Text of a Google-style section; empty when there is none."""
    parts = SECTION.split(docstring)
    return dict(zip(parts[1::2], parts[2::2], strict=True)).get(name, "")


def entries(docstring: str) -> dict[str, str]:
    """Name to text of the `Args:` section, in order."""
    parts = ENTRY.split(section(docstring, "Args"))
    return dict(zip(parts[1::2], parts[2::2], strict=True))


def words(text: str) -> set[str]:
    """The words of a text or a name, lower case and singular."""
    spaced = re.sub(r"(?<=[a-z])(?=[A-Z])", " ", text)
    return {
        word.removesuffix("s") if len(word) > 3 else word
        for word in re.findall(r"\w+", spaced.lower().replace("_", " "))
    }


def is_empty(text: str, *, known: str) -> bool:
    """Whether an entry has no word beyond those that name, type and first sentence have already."""
    return words(text) <= words(known) | words(NO_CONTENT)


def arguments(function: Function) -> dict[str, str]:
    """Name to type of the signature's arguments, in order, without self and cls."""
    spec = function.args
    named = [*spec.posonlyargs, *spec.args, *([spec.vararg] if spec.vararg else []), *spec.kwonlyargs]
    named += [spec.kwarg] if spec.kwarg else []
    return {
        each.arg: ast.unparse(each.annotation) if each.annotation else ""
        for each in named
        if each.arg not in {"self", "cls"}
    }


def contract(function: Function) -> Contract:
    """What must agree for a method to inherit a protocol's text."""
    return function.name, tuple(arguments(function))


def protocol_methods(tree: ast.Module) -> Iterator[Contract]:
    """Documented methods of the protocols of a module."""
    for node in tree.body:
        if isinstance(node, ast.ClassDef) and any("Protocol" in ast.unparse(base) for base in node.bases):
            for inner in node.body:
                if isinstance(inner, Function) and ast.get_docstring(inner):
                    yield contract(inner)


def faults(function: Function) -> list[str]:
    """Where a function's docstring disagrees with its signature, or repeats it."""
    docstring = ast.get_docstring(function) or ""
    summary = f"{function.name} {SECTION.split(docstring)[0]}".split(".")[0]
    signature = arguments(function)
    documented = entries(docstring)
    found = []
    if [name for name in signature if name in documented] != list(documented):
        found.append(f"Args: name {list(documented)}, the signature {list(signature)}")
    found += [
        f"{name}: {text.strip()} (repeats the name, the type or the first sentence)"
        for name, text in documented.items()
        if is_empty(text, known=f"{name} {signature.get(name, '')} {summary}")
    ]
    returns = section(docstring, "Returns")
    given = ast.unparse(function.returns) if function.returns else ""
    if returns and is_empty(returns, known=f"{given} {summary}"):
        found.append(f"Returns: {returns.strip()} (repeats the name, the type or the first sentence)")
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


def module_faults(source: str, *, inherited: Collection[Contract] = (), is_case: bool = False) -> list[str]:
    """All disagreements of one module, its own docstring and those of its public classes included."""
    tree = ast.parse(source)
    found = [] if ast.get_docstring(tree) or not tree.body else ["the module has no docstring"]
    found += [
        f"{node.name}: no docstring"
        for node in tree.body
        if isinstance(node, ast.ClassDef) and not node.name.startswith("_") and not ast.get_docstring(node)
    ]
    for name, function in public_functions(tree):
        inherits = ("." in name and contract(function) in inherited) or (is_case and name in CASE_INTERFACE)
        if not (ast.get_docstring(function) or inherits):
            found.append(f"{name}: no docstring")
        found += [f"{name}: {fault}" for fault in faults(function)]
    return found


def is_command(name: str) -> bool:
    """Whether a module's functions are commands, whose entries are the text of `--help`."""
    return name.rpartition(".")[2].endswith("cli")


def test_docstrings_agree_with_signatures_and_repeat_nothing(modules: Mapping[str, Path]) -> None:
    sources = {name: path.read_text() for name, path in modules.items()}
    inherited = {method for source in sources.values() for method in protocol_methods(ast.parse(source))}
    found = [
        f"{name}.{fault}"
        for name, source in sources.items()
        if not is_command(name)
        for fault in module_faults(source, inherited=inherited, is_case=name.endswith(".case"))
    ]
    assert found == []


GOOD = '''"""Module."""
def speed(*, radius: float, rate: float) -> float:
    """Speed of a point on a turning body.

    v = omega r.
    Args:
        radius: r, m.
        rate: omega, rad/s:
            a continued line: with a colon.
    Returns: v, m/s.
    """
    return radius * rate
'''


DENSE = GOOD.replace("Args:\n        radius: r, m.\n        rate:", "Args: `radius`: r, m. `rate`:")
ENDLESS = GOOD.partition("    Args:")[0] + '    """\n    return radius * rate\n'
METHOD = "    def evaluate(self, x: float) -> float:\n"
PROTOCOL = f'class Law(Protocol):\n{METHOD}        """Velocity, m/s."""\n        ...\n'
PAPER = f'"""M."""\nclass Paper:\n    """P."""\n{METHOD}        return x\n'
CASE = '"""M."""\ndef compute(scene: Scene) -> Evidence:\n    return Evidence()\n'


def test_what_agrees_or_inherits_is_let_through() -> None:
    inherited = set(protocol_methods(ast.parse(PROTOCOL)))
    assert GOOD not in {DENSE, ENDLESS}
    assert [module_faults(source) for source in (GOOD, DENSE, ENDLESS)] == [[], [], []]
    assert module_faults(PAPER, inherited=inherited) == []
    assert module_faults(CASE, is_case=True) == []
    assert module_faults(PAPER.replace("x: float", "y: float"), inherited=inherited) != []


@pytest.mark.parametrize(
    ("source", "fault"),
    [
        (GOOD.replace("rate: omega", "velocity: omega"), "Args:"),
        (GOOD.replace("radius: float, rate: float", "rate: float, radius: float"), "Args:"),
        (GOOD.replace("r, m.", "the radius."), "radius: the radius."),
        (GOOD.replace("r, m.", "a float."), "radius: a float."),
        (GOOD.replace("r, m.", "of the body."), "radius: of the body."),
        (GOOD.replace("v, m/s.", "The speed."), "Returns: The speed."),
        (DENSE.replace("r, m.", "the radius."), "radius: the"),
        (GOOD.replace('"""Module."""\n', ""), "the module has no docstring"),
        (PAPER.replace('    """P."""\n', ""), "Paper: no docstring"),
        (PAPER, "Paper.evaluate: no docstring"),
        (CASE, "compute: no docstring"),
    ],
)
def test_a_disagreement_or_repetition_is_seen(source: str, fault: str) -> None:
    assert any(fault in found for found in module_faults(source))
