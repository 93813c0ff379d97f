"""Plain words: names of quantities, texts that stand alone, one class to a name, units in constants."""

from __future__ import annotations

import ast
import re
from collections import Counter
from collections.abc import Callable, Iterator, Mapping
from itertools import pairwise

import pytest

NAMES = frozenset(
    """found told given made asked drawn place there here along aside beside
    one own whole kept known""".split()  # noqa: SIM905
)
"""Acts, places and pronouns, which say nothing of the quantity or the type."""
BINDING: Mapping[type[ast.AST], str] = {
    ast.Name: "id",
    ast.Attribute: "attr",
    ast.arg: "arg",
    ast.alias: "asname",
    ast.FunctionDef: "name",
}
"""Node to its field that holds a name."""
STORE = ast.Store()
LEANING = re.compile(
    r"(?:As|See) `|(?:The same|Of|Also|As above|What|Whether|How|Where|With|That|Those|These|Such|Likewise"
    r"|(?:For|By|In) which)\b"
)
UNIT = re.compile(
    r"(?:^|, )(s|m|mm|um|kg|rad|deg|Pa|K|V|N|Nm|N m|Hz|m\^[23]|m/s|rad/s|kg m|kg/m\^3|m\^2/s)(?=[,.:;]|$)"
)
BARE = """
    almost apart certain close coarse enough few fewest far farthest fine finest kept known large larger
    largest late least longer longest many more most narrowest near nearly noticeable nothing often same
    shortest slow slowest small smallest some steady steepest tiny usual warm wide wider
"""
"""Adjectives that alone name no constant."""


def bound_names(tree: ast.Module) -> Iterator[str]:
    """Variables, arguments, attributes, functions and methods of a module with such a name."""
    for node in ast.walk(tree):
        field = BINDING.get(type(node))
        if field and getattr(node, field) in NAMES and isinstance(getattr(node, "ctx", STORE), ast.Store):
            yield getattr(node, field)


def leaning_texts(tree: ast.Module) -> Iterator[str]:
    """Docstrings and texts of fields that need their neighbours to be understood."""
    for node in ast.walk(tree):
        if isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant):
            text = str(node.value.value).strip()
            if LEANING.match(text):
                yield text.partition("\n")[0]


def unclear_constants(tree: ast.Module) -> Iterator[str]:
    """Numbers of a module named by an adjective alone, or whose text has the unit that the name lacks."""
    for node, following in pairwise([*tree.body, ast.Pass()]):
        if isinstance(node, ast.AnnAssign) and isinstance(node.target, ast.Name) and is_number(node.value):
            words = node.target.id.lower().strip("_").split("_")
            expression = following.value if isinstance(following, ast.Expr) else None
            text = str(expression.value) if isinstance(expression, ast.Constant) else ""
            unit = UNIT.search(text.partition("\n")[0])
            suffix = re.sub("[/ ]", "_", unit[1].lower().replace("^", "")) if unit else ""
            lacks_unit = bool(unit) and f"_{suffix}_" not in f"_{'_'.join(words)}_"
            if lacks_unit or set(BARE.split()).issuperset(words):
                yield node.target.id


def is_number(value: ast.expr | None) -> bool:
    return value is not None and all(
        isinstance(node, ast.BinOp | ast.UnaryOp | ast.operator | ast.unaryop)
        or (isinstance(node, ast.Constant) and type(node.value) in (int, float))
        for node in ast.walk(value)
    )


RULES: Mapping[str, Callable[[ast.Module], Iterator[str]]] = {
    "names": bound_names,
    "texts": leaning_texts,
    "constants": unclear_constants,
}
ROOMS = (
    *("ringbalance", "scene", "results", "mesh", "physics", "reduced_model", "controller"),
    *("identification", "export", "design", "panels", "verification", "reports"),
)
REMAINING: Mapping[str, Mapping[str, int]] = {
    "scene": {"names": 5},
    "reduced_model": {"names": 1},
    "controller": {"names": 4},
    "identification": {"names": 1},
    "design": {"names": 1},
}
"""By room, how many are left: each number is lowered with the next one that goes."""
SHARED_CLASS_NAMES = """
    Table
"""


@pytest.mark.parametrize("room", ROOMS)
def test_words_are_plain(trees: Mapping[str, ast.Module], room_order: tuple[str, ...], room: str) -> None:
    inside = {
        name: tree
        for name, tree in trees.items()
        if (name.split(".")[1] if name.split(".")[1] in room_order else "ringbalance") == room
    }
    for rule, find in RULES.items():
        seen = [f"{name}: {each}" for name, tree in inside.items() for each in find(tree)]
        assert len(seen) == REMAINING.get(room, {}).get(rule, 0), (rule, seen)


def test_a_class_name_stands_once(trees: Mapping[str, ast.Module]) -> None:
    nodes = [node for tree in trees.values() for node in ast.walk(tree) if isinstance(node, ast.ClassDef)]
    count = Counter(node.name.lstrip("_") for node in nodes)
    assert {name for name, times in count.items() if times > 1} == {*SHARED_CLASS_NAMES.split()}


@pytest.mark.parametrize(
    ("rule", "source"),
    [
        ("names", "for place in rows: pass"),
        ("names", "def read(given): pass"),
        ("names", "class Row:\n    own: float"),
        ("texts", "x: float\n'Of the disc, m.'"),
        ("texts", "def f():\n    'As `g` does.'"),
        ("constants", "_LONGEST: Final = 3"),
        ("constants", "WATCH_TIME: Final = 60.0\n'Time of watching, s.'"),
    ],
)
def test_a_vague_word_is_seen(rule: str, source: str) -> None:
    assert len(list(RULES[rule](ast.parse(source)))) == 1
