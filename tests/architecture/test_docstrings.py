"""A docstring gives what the signature does not: no missing one, no wrong name, no entry without content.

An implementation of a method that a protocol documents, and a case's `compute` and `reference`, inherit its
text.  The options of a command need their entries, because `--help` shows them.  Arguments stand in running
text, `name`: with a colon, or one a line when there is much to say.
"""

from __future__ import annotations

import ast
import re
from collections.abc import Collection, Iterator, Mapping

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


def named_parts(pattern: re.Pattern[str], text: str) -> dict[str, str]:
    """Name to text of the parts that a pattern begins, in order."""
    parts = pattern.split(text)
    return dict(zip(parts[1::2], parts[2::2], strict=True))


def words(text: str) -> set[str]:
    """The words of a text or a name, lower case and singular."""
    spaced = re.sub(r"(?<=[a-z])(?=[A-Z])", " ", text).lower().replace("_", " ")
    return {word.removesuffix("s") if len(word) > 3 else word for word in re.findall(r"\w+", spaced)}


def arguments(function: Function) -> dict[str, str]:
    """Name to type of the signature's arguments, in order, without self and cls."""
    spec = function.args
    named = [*spec.posonlyargs, *spec.args, spec.vararg, *spec.kwonlyargs, spec.kwarg]
    return {
        each.arg: ast.unparse(each.annotation) if each.annotation else ""
        for each in named
        if each and each.arg not in {"self", "cls"}
    }


def contract(function: Function) -> Contract:
    """What must agree for a method to inherit the text of a protocol or an abstract class."""
    return function.name, tuple(arguments(function))


def protocol_methods(tree: ast.Module) -> Iterator[Contract]:
    """Documented methods of the protocols and abstract classes of a module."""
    for node in tree.body:
        bases = [ast.unparse(base) for base in node.bases] if isinstance(node, ast.ClassDef) else []
        if isinstance(node, ast.ClassDef) and any("Protocol" in base or base == "ABC" for base in bases):
            for inner in node.body:
                if isinstance(inner, Function) and ast.get_docstring(inner):
                    yield contract(inner)


def disagreements(function: Function) -> Iterator[str]:
    """Differences between a function's docstring and its signature, and what the docstring repeats."""
    docstring = ast.get_docstring(function) or ""
    summary = f"{function.name} {SECTION.split(docstring)[0]}".split(".")[0]
    sections, signature = named_parts(SECTION, docstring), arguments(function)
    entries = named_parts(ENTRY, sections.get("Args", ""))
    if [name for name in signature if name in entries] != list(entries):
        yield f"Args: name {list(entries)}, the signature {list(signature)}"
    texts = [(name, text, f"{name} {signature.get(name, '')}") for name, text in entries.items()]
    if sections.get("Returns"):
        texts.append(("Returns", sections["Returns"], ast.unparse(function.returns or ast.Constant(None))))
    for name, text, known in texts:
        if words(text) <= words(f"{known} {summary} {NO_CONTENT}"):
            yield f"{name}: {text.strip()} (repeats the name, the type or the first sentence)"


def docstring_errors(
    tree: ast.Module, *, inherited: Collection[Contract] = (), is_case: bool = False
) -> Iterator[str]:
    """Missing docstrings and disagreements of a module, its public functions, classes and methods."""
    if tree.body and not ast.get_docstring(tree):
        yield "the module has no docstring"
    functions = [(node.name, node) for node in tree.body if isinstance(node, Function)]
    for node in tree.body:
        if isinstance(node, ast.ClassDef) and not node.name.startswith("_"):
            if not ast.get_docstring(node):
                yield f"{node.name}: no docstring"
            functions += [(f"{node.name}.{f.name}", f) for f in node.body if isinstance(f, Function)]
    for name, function in functions:
        if function.name.startswith("_"):
            continue
        inherits = ("." in name and contract(function) in inherited) or (is_case and name in CASE_INTERFACE)
        if not (ast.get_docstring(function) or inherits):
            yield f"{name}: no docstring"
        for each in disagreements(function):
            yield f"{name}: {each}"


def test_docstrings_agree_with_signatures_and_repeat_nothing(
    trees: Mapping[str, ast.Module], room_order: tuple[str, ...]
) -> None:
    inherited = {method for tree in trees.values() for method in protocol_methods(tree)}
    assert [
        f"{name}.{error}"
        for name, tree in trees.items()
        if name.split(".")[1] in room_order and not name.endswith("cli")
        for error in docstring_errors(tree, inherited=inherited, is_case=name.endswith(".case"))
    ] == []


@pytest.mark.parametrize(
    ("source", "error"),
    [
        ('def speed(*, radius):\n    """Speed of a point.\n\n    Args: `rate`: omega.\n    """', "Args:"),
        ('def speed(*, radius):\n    """Speed. Args: `radius`: the radius."""', "radius: the radius."),
        ('def speed() -> float:\n    """Speed of a point. Returns: The speed."""', "Returns: The speed."),
        ('class Law:\n    """A law."""\n    def evaluate(self, y): ...', "Law.evaluate: no docstring"),
        ("class Law: ...", "Law: no docstring"),
        ("def compute(scene): ...", "the module has no docstring"),
    ],
)
def test_a_disagreement_or_repetition_is_seen(source: str, error: str) -> None:
    assert any(
        error in each for each in docstring_errors(ast.parse(source), inherited={("evaluate", ("x",))})
    )
