"""Structured text, run from the syntax tree of a parser by others, has the bits of Python."""

from __future__ import annotations

import operator
import re
from collections.abc import Callable, Iterator
from contextlib import suppress
from functools import cache
from math import sqrt
from typing import Any, Final

import numpy as np
import pytest
from law_queries import answers, queries

from ringbalance.export.blocks import Block, law_block
from ringbalance.export.compact import CompactLaw
from ringbalance.export.hosts import st_files
from ringbalance.reduced_model.law.calibrated_law import CalibratedLaw
from ringbalance.reduced_model.pieces import point
from ringbalance.reduced_model.pieces.query import is_usual

parse = pytest.importorskip("blark.parse")
Both = tuple[CalibratedLaw, CompactLaw]
STANDARD: Final[dict[str, Callable[[Any], Any]]] = {
    "SQRT": sqrt,
    "TRUNC": int,
    "USINT_TO_DINT": int,
    "REAL_TO_LREAL": float,
    "DINT_TO_LREAL": float,
}
OPERATORS: Final[dict[str, Callable[[Any, Any], Any]]] = {
    "+": operator.add,
    "-": operator.sub,
    "*": operator.mul,
    "<": operator.lt,
    "<=": operator.le,
    ">": operator.gt,
    ">=": operator.ge,
    "=": operator.eq,
    "<>": operator.ne,
    # Both sides, as a controller may do.
    "AND": lambda a, b: a and b,
    "OR": lambda a, b: a or b,
}


OPERATIONS: Final = (
    ("blocked", 80),
    ("flows", 120),
    ("carries", 145),
)
"""At the most, by what the tube does."""
OUTSIDE: Final = 20
"""More for a query with a value outside the law's range."""


class Returned(Exception):  # noqa: N818
    """RETURN."""


class Machine:
    """Runs what it has parsed: assignments, IF, WHILE, RETURN and calls of numbers, truths and rows."""

    def __init__(self, text: str) -> None:
        result = re.findall(r"^FUNCTION .*?^END_FUNCTION$", text, re.DOTALL | re.MULTILINE)
        # Functions of the law are the same in each block but for the lengths of their rows.
        items = [_parsed(re.sub(r"0\.\.\d+", "0..9", each)) for each in result]
        self.functions = {str(item.name): item for item in items}
        self.arguments = {name: list(_arguments(item)) for name, item in self.functions.items()}
        self.operations = 0

    def call(self, name: str, given: list[Any]) -> Any:
        names = dict(zip(self.arguments[name], given, strict=True))
        with suppress(Returned):
            self._run(self.functions[name].body.statements, names)
        return names.get(name)

    def _run(self, statements: list[Any], names: dict[str, Any]) -> None:
        for each in statements:
            getattr(self, f"_{type(each).__name__}")(each, names)

    def _AssignmentStatement(self, node: Any, names: dict[str, Any]) -> None:  # noqa: N802
        target, value = node.variables[0], self._value(node.expression, names)
        if hasattr(target, "elements"):
            names[str(target.name.name)][self._places(target, names)[0]] = value
        else:
            names[str(target.name)] = value

    def _IfStatement(self, node: Any, names: dict[str, Any]) -> None:  # noqa: N802
        branches = [(node.if_expression, node.statements)]
        branches += [(each.if_expression, each.statements) for each in node.else_ifs]
        for test, statements in branches:
            if self._value(test, names):
                return self._run(statements.statements, names)
        if node.else_clause is not None:
            self._run(node.else_clause.statements.statements, names)
        return None

    def _WhileStatement(self, node: Any, names: dict[str, Any]) -> None:  # noqa: N802
        while self._value(node.expression, names):
            self._run(node.statements.statements, names)

    def _ReturnStatement(self, _node: Any, _names: dict[str, Any]) -> None:  # noqa: N802
        raise Returned

    def _FunctionCallStatement(self, node: Any, names: dict[str, Any]) -> None:  # noqa: N802
        self._FunctionCall(node, names)

    def _FunctionCall(self, node: Any, names: dict[str, Any]) -> Any:  # noqa: N802
        name, given = str(node.name.name), [self._value(each.value, names) for each in node.parameters]
        return STANDARD[name](*given) if name in STANDARD else self.call(name, given)

    def _places(self, node: Any, names: dict[str, Any]) -> list[int]:
        return [self._value(each, names) for each in node.elements[0].subscripts]

    def _value(self, node: Any, names: dict[str, Any]) -> Any:
        match type(node).__name__:
            case "Integer":
                return int(node.value)
            case "Boolean":
                return str(node.value) == "TRUE"
            case "Real":
                return float(node.value)
            case "SimpleVariable":
                return names[str(node.name)]
            case "MultiElementVariable":
                result = names[str(node.name.name)]
                for place in self._places(node, names):
                    result = result[place]
                return result
            case "ParenthesizedExpression":
                return self._value(node.expr, names)
            case "UnaryOperation":
                self.operations += 1
                value = self._value(node.expr, names)
                return not value if str(node.op) == "NOT" else -value
            case "BinaryOperation":
                self.operations += 1
                left, right = self._value(node.left, names), self._value(node.right, names)
                if str(node.op) == "/":
                    return left // right if isinstance(left, int) else left / right
                return OPERATORS[str(node.op)](left, right)
            case "FunctionCall":
                return self._FunctionCall(node, names)
        raise TypeError(type(node).__name__)


@cache
def _parsed(function: str) -> Any:
    return parse.parse_source_code(function).transform().items[0]


def _arguments(item: Any) -> Iterator[str]:
    for block in item.declarations:
        if type(block).__name__ in ("InputDeclarations", "InputOutputDeclarations"):
            for each in block.items:
                yield from (str(one.variable.name) for one in each.variables)


def test_structured_text_has_the_bits_of_python(six: Both) -> None:
    law, compact = six
    text = st_files(law_block(compact), "disc")["disc.st"]
    machine = Machine(text)
    block = text.partition("FUNCTION_BLOCK")[2]
    constants = [float(each) for each in re.split(r"[\s,]+", block.split("[")[2].split("]")[0].strip())]
    assert constants == list(compact.constants)
    asked = queries(law, 400, seed=3, outside=True)
    right = np.array(list(answers(compact, asked)))
    assert np.unique(right[:, 1]).size == 4
    operations = []
    for query, expected in zip(asked.T.tolist(), right, strict=True):
        row = query + [0.0] * (point.PLACES_OF_QUERY - 4)
        before = machine.operations
        machine.call("disc_answer", [constants, *compact.tables, row])
        state = "blocked" if row[point.REGIME] == point.BLOCKED else "flows"
        # Part of the gas over the crest is carried out, which takes a third velocity.
        state = "carries" if carries(row) else state
        outside = 0 if is_usual(compact.constants, query) else OUTSIDE
        operations.append((state, machine.operations - before - outside))
        result = row[point.VELOCITY : point.PRIMED_AFTER + 1]
        assert np.array(result).tobytes() == expected.tobytes()
    for state, most in OPERATIONS:
        assert most - 25 < max(n for at, n in operations if at == state) <= most


def carries(row: list[float]) -> bool:
    """Whether a part of the gas over the crest is carried out: neither gas nor cavity holds the column."""
    held = row[point.HOLDS]
    ends = row[point.RESTING] - row[point.GAS_THERE], row[point.RESTING] - row[point.CAVITY]
    return row[point.REGIME] != point.BLOCKED and not row[point.PRIMED] and ends[0] < held < ends[1]


def test_the_function_block_is_one(six: Both) -> None:
    """With three of its constants: the parser takes minutes for them all."""
    text = st_files(law_block(six[1]), "disc")["disc.st"]
    block = "FUNCTION_BLOCK" + text.partition("FUNCTION_BLOCK")[2]
    few = re.sub(r":= \[.*?\]", ":= [1.0, 2.0, 3.0]", block, flags=re.DOTALL)
    (item,) = parse.parse_source_code(few).transform().items
    assert str(item.name) == "FB_disc"


@pytest.mark.parametrize(
    ("kind", "inputs"),
    [
        ("disc", {"open_time_a": 0.004, "open_time_e": 0.002}),
        ("controller", {"vibration_x": 3e-6, "vibration_y": -2e-6}),
        pytest.param("law_based", {"vibration_x": 3e-6, "vibration_y": -2e-6}, marks=pytest.mark.heavy),
    ],
)
def test_disc_and_controller_have_the_bits_of_python(
    blocks: dict[str, Block], kind: str, inputs: dict[str, float]
) -> None:
    block = blocks[kind]
    machine = Machine(st_files(block, "disc")["disc.st"])
    mine, row = list(block.start), list(block.start)
    places = {each.name: each.index for each in block.variables}
    for step in range(3):
        given = {name: value * (step < 2) for name, value in inputs.items()}
        for name, value in given.items():
            mine[places[name]] = value
        machine.call(f"disc_{block.steps}", [block.constants, *(block.tables or ()), mine, 0.003])
        block.run(row, 0.003, given)
        assert np.array(mine).tobytes() == np.array(row).tobytes()
    assert mine != list(block.start)
