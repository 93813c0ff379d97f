"""Compiled functions on records, complex numbers and tuples, as functions of numbers on two rows.

What `translate` writes in other languages has numbers, rows, `if` and `while` alone.  Here a record (an
element of a numpy array, or a named tuple; of any depth) becomes a place in a row: of `c` if it is constant,
else of `w`.  A complex number becomes two numbers and a tuple its values; a function that returns several
leaves them in places of its own behind `w`.  A loop stays one, unless it indexes a tuple: it is then written
out.  What is evaluated, and in which order, stays the same.

The functions of the liquid ring need none of this: they are functions of two rows already, since every host
indexes these, and go to `translate` as they stand.
"""

from __future__ import annotations

import ast
import inspect
import math
import re
import textwrap
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from enum import EnumType
from math import atan, exp, log, sqrt
from typing import Any, Final, TypeAlias, cast

import numpy as np

from ringbalance.export.translate import BINARY, C99, LAW, MATHS, NOTHING, NUMBER, QUERY, TRUTH, WHOLE, Source

FINITE_INFINITY: Final = 1e150
"""Number in place of an infinity, with a finite square."""
COMPLEX: Final = ("real", "imag")
_KINDS: Final = {bool: TRUTH, np.bool_: TRUTH, int: WHOLE, np.int64: WHOLE, float: NUMBER, np.float64: NUMBER}
_ROWS: Final = {"c": LAW, "w": QUERY}
_SIGNS: Final[dict[type, str]] = {**C99.operators, **BINARY, ast.FloorDiv: "//"}


@dataclass(frozen=True)
class Layout:
    """Places of a value in a row: of a number, of an array or tuple, or of a record."""

    size: int
    kind: str = ""
    """Type of a number; empty for several."""
    parts: tuple[Layout, ...] = ()
    names: tuple[str, ...] = ()
    """Names of the parts; empty for an array or a tuple."""
    owner: str = ""
    """Name of the record."""

    @classmethod
    def of(cls, value: Any, owner: str = "") -> Layout:
        """Layout of a value. Args: `owner`: name of an element of a numpy array."""
        if (kind := _KINDS.get(type(value))) is not None:
            return cls(1, kind)
        names, parts = parts_of(value)
        if hasattr(value, "_fields"):
            owner = re.sub(r"(?<=[a-z])(?=[A-Z])", "_", type(value).__name__.strip("_")).lower()
        inner = tuple(cls.of(each, names[i] if names else owner) for i, each in enumerate(parts))
        return cls(sum(each.size for each in inner), "", inner, names, owner)

    def start(self, part: int) -> int:
        """Place of a part."""
        return sum(each.size for each in self.parts[:part])

    def index(self, path: str) -> int:
        """Place of a number, such as "memory.friction.filter.1.arm"."""
        step, _, rest = path.partition(".")
        if not step:
            return 0
        part = int(step) if step.isdigit() else self.names.index(step)
        return self.start(part) + self.parts[part].index(rest)


def parts_of(value: Any) -> tuple[tuple[str, ...], list[Any]]:
    """Parts of a value with their names, if it has some."""
    if isinstance(value, complex):
        return COMPLEX, [float(value.real), float(value.imag)]
    names = getattr(value, "_fields", ()) or (isinstance(value, np.void) and value.dtype.names) or ()
    return tuple(names), [value[i] for i in range(len(value))]


def numbers_of(value: Any) -> list[float]:
    """Numbers of a value, in the order of its layout."""
    if type(value) in _KINDS:
        return [min(max(float(value), -FINITE_INFINITY), FINITE_INFINITY)]
    return [number for each in parts_of(value)[1] for number in numbers_of(each)]


@dataclass(frozen=True)
class _Scalar:
    """Number, as an expression of the subset."""

    text: str
    kind: str

    @property
    def constant(self) -> int | float | None:
        """Value, if it is written as one."""
        try:
            return cast(float, ast.literal_eval(self.text))
        except ValueError:
            return None


@dataclass(frozen=True)
class _RowPart:
    """Part of a row."""

    row: str
    layout: Layout
    at: str


@dataclass(frozen=True)
class _Compound:
    """Complex number, tuple or named tuple."""

    values: tuple[_Value, ...]
    names: tuple[str, ...] = ()

    def labelled(self, name: str) -> Iterator[tuple[str, _Value]]:
        """Parts with names of local variables."""
        labels = self.names or map(str, range(len(self.values)))
        return ((f"{name}_{label}", each) for label, each in zip(labels, self.values, strict=True))


_Value: TypeAlias = _Scalar | _RowPart | _Compound


class _Varying(Exception):  # noqa: N818
    """A tuple is indexed by a variable."""


def _constant(value: float) -> _Scalar:
    kind = TRUTH if isinstance(value, bool) else WHOLE if isinstance(value, int) else NUMBER
    return _Scalar(repr(numbers_of(value)[0] if kind == NUMBER else value), kind)


def _as(value: _Scalar, kind: str) -> str:
    """A number as one of another type."""
    if value.kind == kind:
        return value.text
    if (literal := value.constant) is not None:
        return _constant({NUMBER: float, WHOLE: int, TRUTH: bool}[kind](literal)).text
    if kind == TRUTH:
        return f"({value.text} != {'0' if value.kind == WHOLE else '0.0'})"
    return f"{kind}({value.text})"


def _numbers(values: Sequence[_Scalar]) -> list[_Scalar]:
    return [_Scalar(_as(each, NUMBER), NUMBER) for each in values]


def _sum(first: str, second: str) -> str:
    """Sum of two places."""
    return second if first == "0" else first if second == "0" else f"{first} + {second}"


def _leaves(value: _Value) -> list[_Scalar]:
    """Numbers of a value; those of a part of a row are its place."""
    match value:
        case _Scalar():
            return [value]
        case _RowPart(at=at):
            return [] if at == "0" else [_Scalar(at, WHOLE)]
    return [leaf for each in value.values for leaf in _leaves(each)]


def _mapped(value: Any, change: Callable[[_Scalar], _Scalar]) -> Any:
    """A value with all its numbers changed; a part of a row stays."""
    match value:
        case _Scalar():
            return change(value)
        case _Compound(values=values, names=names):
            return _Compound(tuple(_mapped(each, change) for each in values), names)
    return value


def _shape(value: _Value) -> Any:
    """Types and layouts of a value, which decide how a function of it is written."""
    match value:
        case _Scalar(kind=kind):
            return kind
        case _RowPart(row=row, layout=layout, at=at):
            return row, layout, at == "0"
    return value.names, tuple(map(_shape, value.values))


@dataclass(frozen=True)
class _FlatFunction:
    """A function as written out."""

    name: str
    result: _Value | None
    rows: tuple[str, ...]
    needs: tuple[bool, ...]
    """For each number of its arguments, true if it is used."""


@dataclass(kw_only=True)
class Flattening:
    """Functions written out, their constants, and the places behind the rows."""

    settings: int
    """Numbers of the settings in `c`; `tables` follow."""
    row: int
    """Numbers of `w`, with results at its end."""
    tables: list[float] = field(default_factory=list)
    constants: dict[str, int | float] = field(default_factory=dict)
    texts: list[str] = field(default_factory=list)
    _done: dict[Any, _FlatFunction] = field(default_factory=dict)

    @classmethod
    def of(cls, entry: Callable[..., None], settings: Any, host: Any) -> Flattening:
        """Write out a function of settings, a host's record and a time, and all that it calls."""
        rows = Layout.of(settings), Layout.of(host, "host")
        new = cls(settings=rows[0].size, row=rows[1].size)
        views = (_RowPart(row, layout, "0") for row, layout in zip(_ROWS, rows, strict=True))
        new.called(getattr(entry, "py_func", entry), [*views, _Scalar("time", NUMBER)])
        return new

    @property
    def source(self) -> Source:
        """Source for `translate`."""
        return replace(Source.of_text("\n".join(self.texts)), constants=self.constants)

    def named(self, name: str, value: int | float) -> str:
        """A constant by name; by value if its name means another."""
        name = name.strip("_").upper()
        return name if self.constants.setdefault(name, value) == value else repr(value)

    def called(self, function: Callable[..., Any], arguments: Sequence[_Value]) -> _FlatFunction:
        """A function for arguments of certain types, written out if it is not yet."""
        key = function, tuple(map(_shape, arguments))
        if key not in self._done:
            # No name may be one of a host's functions or of its variables.
            name = re.sub("^_+|^(?=.*_(step|start)$)", "do_", function.__name__)
            versions = sum(each is function for each, _ in self._done)
            name = f"{name}_{versions + 1}" if versions else name
            self._done[key] = _FunctionWriter(self, function, name).written(arguments)
        return self._done[key]


class _FunctionWriter:
    """One function, as far as it is written."""

    def __init__(self, program: Flattening, function: Callable[..., Any], name: str) -> None:
        self.program, self.function, self.name = program, function, name
        self.variables: dict[str, _Value] = {}
        self.out: list[str] = []
        self.result: _Value | None = None
        self.temporaries = 0

    def written(self, arguments: Sequence[_Value]) -> _FlatFunction:
        """Write the function out."""
        node = ast.parse(textwrap.dedent(inspect.getsource(self.function))).body[0]
        assert isinstance(node, ast.FunctionDef)
        types: dict[str, str] = {}
        for each, value in zip(node.args.args, arguments, strict=True):
            self.variables[each.arg] = self._parameter(_local(each.arg), value, types)
        documented = ast.get_docstring(node)
        lines, used = _needed(self._block(node.body[bool(documented) :]) or ["return"])
        result = self.result.kind if isinstance(self.result, _Scalar) else NOTHING
        listed = ", ".join(f"{name}: {kind}" for name, kind in (_ROWS | types).items() if name in used)
        summary = (documented or self.name).split("\n")[0]
        head = [f"def {self.name}({listed}) -> {result}:", f"    {summary!r}"]
        self.program.texts.append("\n".join([*head, *_indented(lines)]))
        rows = tuple(row for row in _ROWS if row in used)
        return _FlatFunction(self.name, self.result, rows, tuple(name in used for name in types))

    def _parameter(self, name: str, value: _Value, types: dict[str, str]) -> _Value:
        match value:
            case _Scalar(kind=kind):
                types[name] = kind
                return _Scalar(name, kind)
            case _RowPart(row=row, layout=layout, at=at):
                if at != "0":
                    types[name], at = WHOLE, name
                return _RowPart(row, layout, at)
        parts = (self._parameter(label, each, types) for label, each in value.labelled(name))
        return _Compound(tuple(parts), value.names)

    # Statements.

    def _block(self, body: Sequence[ast.stmt]) -> list[str]:
        outer, self.out = self.out, []
        for node in body:
            self._statement(node)
        written, self.out = self.out, outer
        return written

    def _statement(self, node: ast.stmt) -> None:
        match node:
            case ast.Assign(targets=targets, value=value):
                self._assign(targets, value)
            case ast.AnnAssign(target=target, value=ast.expr() as value):
                self._assign([target], value)
            case ast.AugAssign(target=target, op=operator, value=value):
                self._assign([target], ast.BinOp(target, operator, value))
            case ast.If(test=test, body=body, orelse=orelse):
                self._if(self._truth(test), body, orelse)
            case ast.For(target=target, iter=ast.Call(func=ast.Name(id="range"), args=ends), body=body):
                self._for(ast.unparse(target), [self._whole(each) for each in ends], body)
            case ast.For(target=target, iter=ast.Tuple(elts=elements), body=body):
                for each in elements:
                    self.out += self._block([ast.Assign([target], each), *body])
            case ast.While(test=test, body=body):
                leave = ast.If(ast.UnaryOp(ast.Not(), test), [ast.Break()], [])
                self.out += ["while True:", *_indented(self._block([leave, *body]))]
            case ast.Return(value=value):
                self._return(value)
            case ast.Expr(value=ast.Call() as call):
                self._called(call)
            case ast.Break():
                self.out.append("break")
            case _:
                raise self._refused(node)

    def _if(self, test: str, body: Sequence[ast.stmt], orelse: Sequence[ast.stmt]) -> None:
        first, second = self._block(body), self._block(orelse)
        if first:
            self.out += [f"if {test}:", *_indented(first)]
            self.out += ["else:", *_indented(second)] if second else []
        elif second:
            self.out += [f"if not {test}:", *_indented(second)]

    def _for(self, name: str, ends: list[str], body: Sequence[ast.stmt]) -> None:
        first, last = ("0", *ends)[-2:]
        saved, outer, length, index = dict(self.variables), self.out, len(self.out), _local(name)
        try:
            self.variables[name] = self._local(index, _Scalar(first, WHOLE))
            end = self._simple(_Scalar(last, WHOLE)).text
            lines = [*self._block(body), f"{index} = {index} + 1"]
            self.out += [f"while {index} < {end}:", *_indented(lines)]
        except _Varying:
            self.variables, self.out = saved, outer
            del outer[length:]
            if not (first.isdigit() and last.isdigit()):
                raise
            for value in range(int(first), int(last)):
                self.variables[name] = _constant(value)
                self.out += self._block(body)

    def _return(self, node: ast.expr | None) -> None:
        value = None if node is None else self._copied(self._value(node))
        if self.result is None and value is not None:
            self.result = value
            if isinstance(value, _Compound):
                self.program.named(f"{self.name}_result", self.program.row)
                self.program.row += len(_leaves(value))
        if isinstance(self.result, _Scalar) and isinstance(value, _Scalar):
            self.out.append(f"return {_as(value, self.result.kind)}")
            return
        for i, each in enumerate([] if value is None else _leaves(value)):
            self._write(_sum(f"{self.name}_result".upper(), str(i)), each)
        self.out.append("return")

    def _assign(self, targets: Sequence[ast.expr], node: ast.expr) -> None:
        match targets, node:
            case [ast.Tuple(elts=names)], ast.Tuple(elts=nodes):
                # What a target before it changes is read beforehand.
                changed = {each.id for name in names for each in ast.walk(name) if isinstance(each, ast.Name)}
                first, *others = [self._value(each) for each in nodes]
                values = [first, *(self._before(each, changed | {"w"}) for each in others)]
                for name, value in zip(names, values, strict=True):
                    self._bind(name, value)
            case _:
                value = self._value(node)
                if len(targets) > 1:
                    value = _mapped(value, self._simple)
                for target in targets:
                    self._bind(target, value)

    def _before(self, value: _Value, changed: set[str]) -> Any:
        """A value that stays when some names change."""
        return _mapped(value, lambda x: self._stored(x) if changed & set(re.findall(r"\w+", x.text)) else x)

    def _bind(self, target: ast.expr, value: _Value) -> None:
        match target:
            case ast.Name(id="_"):
                pass
            case ast.Name(id=name):
                self.variables[name] = self._local(_local(name), value, self.variables.get(name))
            case ast.Tuple(elts=targets):
                for each, part in zip(targets, self._unpacked(value), strict=True):
                    self._bind(each, part)
            case _:
                written = self._place(target)
                if not isinstance(written, _RowPart) or isinstance(value, _RowPart):
                    raise self._refused(target)
                if written.layout.names == COMPLEX:
                    value = _mapped(self._complex(value), self._simple)
                for i, leaf in enumerate(_leaves(value)):
                    self._write(_sum(written.at, str(i)), leaf)

    def _local(self, name: str, value: _Value, previous: _Value | None = None) -> _Value:
        """Keep a value in local variables; a part of a row by its place."""
        match value:
            case _Scalar(kind=kind):
                kind = previous.kind if isinstance(previous, _Scalar) else kind
                if (kind, value.kind) == (WHOLE, NUMBER):
                    raise ValueError(f"{self.name}: {name} is a whole number first")
                self.out.append(f"{name} = {_as(value, kind)}")
                return _Scalar(name, kind)
            case _RowPart(row=row, layout=layout, at=at):
                return _RowPart(row, layout, self._stored(_Scalar(at, WHOLE)).text if "[" in at else at)
        labels = {label for label, _ in value.labelled(name)}
        before = previous.values if isinstance(previous, _Compound) else (None,) * len(value.values)
        values = [self._before(each, labels) if i else each for i, each in enumerate(value.values)]
        parts = map(self._local, (label for label, _ in value.labelled(name)), values, before)
        return _Compound(tuple(parts), value.names)

    def _write(self, at: str, value: _Scalar) -> None:
        if value.kind == TRUTH:
            self.out += [f"w[{at}] = 0.0", f"if {value.text}:", f"    w[{at}] = 1.0"]
        else:
            self.out.append(f"w[{at}] = {_as(value, NUMBER)}")

    def _stored(self, value: _Scalar) -> _Scalar:
        self.temporaries += 1
        self.out.append(f"t{self.temporaries} = {value.text}")
        return _Scalar(f"t{self.temporaries}", value.kind)

    def _simple(self, value: _Scalar) -> _Scalar:
        """A number to be read more than once."""
        return value if value.text.isidentifier() or value.constant is not None else self._stored(value)

    # Expressions.

    def _value(self, node: ast.expr) -> Any:
        match node:
            case ast.Constant(value=complex() as value):
                return _Compound((_constant(value.real), _constant(value.imag)), COMPLEX)
            case ast.Constant(value=bool() | int() | float() as value):
                return _constant(value)
            case ast.Name(id=name):
                return self.variables[name] if name in self.variables else self._global(name)
            case ast.Tuple(elts=elements):
                return _Compound(tuple(map(self._value, elements)))
            case ast.Attribute(value=ast.Name(id="math"), attr=name):
                return _constant(getattr(math, name))
            case ast.Attribute(value=ast.Name(id=name), attr=member) if self._is_enum(name):
                value = int(self.function.__globals__[name][member])
                return _Scalar(self.program.named(f"{name}_{member}", value), WHOLE)
            case ast.Attribute() | ast.Subscript():
                return self._read(self._place(node))
            case ast.Call():
                return self._called(node)
            case ast.IfExp(test=test, body=body, orelse=orelse):
                self.temporaries += 1
                chosen = ast.Name(f"t{self.temporaries}")
                either = ([ast.Assign([chosen], each)] for each in (body, orelse))
                self._if(self._truth(test), *either)
                return self.variables[chosen.id]
            case ast.BinOp(left=left, op=operator, right=right):
                return self._operation(operator, self._value(left), self._value(right))
            case ast.UnaryOp(op=ast.USub(), operand=operand):
                return _mapped(self._value(operand), lambda each: _Scalar(f"(-{each.text})", each.kind))
            case ast.UnaryOp(op=ast.Not(), operand=operand):
                return _Scalar(f"(not {self._truth(operand)})", TRUTH)
            case ast.BoolOp(op=join, values=[first, *others]):
                return self._joined(join, first, others)
            case ast.Compare(left=left, ops=signs, comparators=others):
                return self._compared(left, signs, others)
        raise self._refused(node)

    def _whole(self, node: ast.expr) -> str:
        value: _Scalar = self._value(node)
        if value.kind != WHOLE:
            raise self._refused(node)
        return value.text

    def _truth(self, node: ast.expr) -> str:
        return _as(self._value(node), TRUTH)

    def _is_enum(self, name: str) -> bool:
        return isinstance(self.function.__globals__.get(name), EnumType)

    def _global(self, name: str) -> _Value:
        value, program = self.function.__globals__[name], self.program
        if isinstance(value, bool | int | float):
            return _Scalar(program.named(name, value), _constant(value).kind)
        assert isinstance(value, tuple | np.ndarray), name
        label, end = name.strip("_"), program.settings + len(program.tables)
        if program.constants.setdefault(label, end) == end:
            program.tables += numbers_of(value)
        return _RowPart("c", Layout.of(value), label)

    def _place(self, node: ast.expr) -> _Value:
        """A part of a row or of a tuple."""
        match node:
            case ast.Attribute(value=owner, attr=name):
                record = self._value(owner)
                if isinstance(record, _Compound):
                    return record.values[record.names.index(name)]
                layout = record.layout
                if name == "size":
                    return _constant(len(layout.parts))
                part = layout.names.index(name)
                label = self.program.named(f"at_{layout.owner}_{name}", layout.start(part))
                return _RowPart(record.row, layout.parts[part], _sum(record.at, label))
            case ast.Subscript(value=owner, slice=ast.Tuple(elts=[*places])):
                for each in places:
                    owner = ast.Subscript(owner, each)
                return self._place(owner)
            case ast.Subscript(value=owner, slice=index):
                series, at = self._value(owner), self._whole(index)
                if isinstance(series, _RowPart):
                    part, last = series.layout.parts[0], len(series.layout.parts) - 1
                    at = str(last) if at == "(-1)" else at
                    at = str(part.size * int(at)) if at.isdigit() else at
                    at = at if at.isdigit() or part.size == 1 else f"{part.size} * ({at})"
                    return _RowPart(series.row, part, _sum(series.at, at))
                if isinstance(series, _Compound) and at.isdigit():
                    return series.values[int(at)]
                raise _Varying
        raise self._refused(node)

    def _read(self, value: _Value) -> _Value:
        """A value; what is one number in a row by its text."""
        if not isinstance(value, _RowPart) or (value.layout.parts and value.layout.names != COMPLEX):
            return value
        if value.layout.names == COMPLEX:
            return _Compound(tuple(self._unpacked(value)), COMPLEX)
        kind, text = value.layout.kind, f"{value.row}[{value.at}]"
        return _Scalar({NUMBER: text, WHOLE: f"int({text})", TRUTH: f"({text} != 0.0)"}[kind], kind)

    def _unpacked(self, value: Any) -> list[_Value]:
        if isinstance(value, _Compound):
            return list(value.values)
        layout = value.layout
        return [
            self._read(_RowPart(value.row, part, _sum(value.at, str(layout.start(i)))))
            for i, part in enumerate(layout.parts)
        ]

    def _copied(self, value: Any) -> Any:
        """A value with the numbers of parts of rows in place of their places, which a function may change."""
        if isinstance(value, _Scalar):
            return value
        names = value.names if isinstance(value, _Compound) else value.layout.names
        return _Compound(tuple(map(self._copied, self._unpacked(value))), names)

    def _complex(self, value: Any) -> Any:
        if isinstance(value, _Scalar):
            return _Compound((_Scalar(_as(value, NUMBER), NUMBER), _constant(0.0)), COMPLEX)
        return value

    def _operation(self, operator: ast.operator, left: Any, right: Any) -> Any:
        """Arithmetic, of complex numbers in their parts."""
        of = self._of_numbers
        if isinstance(left, _Scalar) and isinstance(right, _Scalar):
            return of(operator, left, right)
        plus, minus, times, over = ast.Add(), ast.Sub(), ast.Mult(), ast.Div()
        if isinstance(operator, ast.Add | ast.Sub):
            pairs = zip(_leaves(self._complex(left)), _leaves(self._complex(right)), strict=True)
            return _Compound(tuple(of(operator, *each) for each in pairs), COMPLEX)
        left, right = _mapped(left, self._simple), _mapped(right, self._simple)
        if isinstance(right, _Scalar):
            return _mapped(left, lambda each: of(operator, each, right))
        if isinstance(left, _Scalar) and isinstance(operator, ast.Mult):
            return _mapped(right, lambda each: of(times, left, each))
        (a, b), (x, y) = _leaves(self._complex(left)), _leaves(right)
        if isinstance(operator, ast.Mult):
            real = of(minus, of(times, a, x), of(times, b, y))
            return _Compound((real, of(plus, of(times, a, y), of(times, b, x))), COMPLEX)
        square = self._simple(of(plus, of(times, x, x), of(times, y, y)))
        real = of(over, of(plus, of(times, a, x), of(times, b, y)), square)
        return _Compound((real, of(over, of(minus, of(times, b, x), of(times, a, y)), square)), COMPLEX)

    def _of_numbers(self, operator: ast.operator, left: _Scalar, right: _Scalar) -> Any:
        if isinstance(operator, ast.Pow):
            assert right.text == "2"
            left = right = self._simple(left)
            operator = ast.Mult()
        of_whole = left.kind == right.kind == WHOLE and not isinstance(operator, ast.Div)
        kind = WHOLE if of_whole else NUMBER
        a, b = _as(left, kind), _as(right, kind)
        if isinstance(operator, ast.Mod):
            if of_whole:
                return _Scalar(f"({a} - {a} // {b} * {b})", kind)
            return self._user(modulo, [_Scalar(a, kind), _Scalar(b, kind)])
        text = f"({a} {_SIGNS[type(operator)]} {b})"
        return _Scalar(str(eval(text)) if of_whole and a.isdigit() and b.isdigit() else text, kind)

    def _joined(self, join: ast.boolop, first: ast.expr, others: list[ast.expr]) -> Any:
        """All or any of some truths; one that calls a function is not asked for without need."""
        rest = others[0] if len(others) == 1 else ast.BoolOp(join, others)
        if any(isinstance(each, ast.Call) for each in ast.walk(rest)):
            both = (rest, ast.Constant(False)) if isinstance(join, ast.And) else (ast.Constant(True), rest)
            return self._value(ast.IfExp(first, *both))
        sign = " and " if isinstance(join, ast.And) else " or "
        return _Scalar(f"({sign.join(map(self._truth, (first, *others)))})", TRUTH)

    def _compared(self, left: ast.expr, signs: Sequence[ast.cmpop], others: Sequence[ast.expr]) -> Any:
        match signs, others:
            case [ast.In()], [ast.Tuple(elts=elements)]:
                equal: list[ast.expr] = [ast.Compare(left, [ast.Eq()], [each]) for each in elements]
                return self._value(ast.BoolOp(ast.Or(), equal))
            case [first, *further], [middle, *_] if further:
                rest = ast.Compare(middle, further, list(others[1:]))
                return self._value(ast.BoolOp(ast.And(), [ast.Compare(left, [first], [middle]), rest]))
        a, b, sign = self._value(left), self._value(others[0]), _SIGNS[type(signs[0])]
        if not (isinstance(a, _Scalar) and isinstance(b, _Scalar)):
            pairs = zip(_leaves(self._complex(a)), _leaves(self._complex(b)), strict=True)
            tests = [f"{x.text} {sign} {y.text}" for x, y in pairs]
            return _Scalar(f"({(' and ' if sign == '==' else ' or ').join(tests)})", TRUTH)
        kind = a.kind if a.kind == b.kind else NUMBER
        return _Scalar(f"({_as(a, kind)} {sign} {_as(b, kind)})", TRUTH)

    # Calls.

    def _called(self, node: ast.Call) -> Any:
        values: list[Any] = [self._value(each) for each in node.args]
        match node.func:
            case ast.Attribute(value=ast.Name(id="math" | "cmath"), attr=name):
                return self._of_math(name, values)
            case ast.Name(id=name):
                function: Any = self.function.__globals__.get(name)
            case _:
                raise self._refused(node)
        if hasattr(function, "_fields"):
            return _Compound(tuple(values), function._fields)
        if getattr(function, "__module__", "") == "math":
            return self._of_math(name, values)
        if function is not None:
            return self._user(function, values)
        match name:
            case "complex":
                return _Compound(tuple(_numbers(values)), COMPLEX)
            case "abs" if isinstance(values[0], _Compound):
                return self._of_math("hypot", values[0].values)
            case "abs":
                return _Scalar(f"abs({_as(values[0], NUMBER)})", NUMBER)
            case "min" | "max":
                extreme, result = smaller if name == "min" else larger, values[0]
                for other in values[1:]:
                    result = self._user(extreme, _numbers([result, other]))
                of_whole = all(each.kind == WHOLE for each in values)
                return _Scalar(_as(result, WHOLE), WHOLE) if of_whole else result
            case "bool" | "float" | "int":
                return _Scalar(_as(values[0], name), name)
            case "len":
                return _constant(len(values[0].layout.parts))
        raise self._refused(node)

    def _of_math(self, name: str, values: Sequence[Any]) -> Any:
        if name == "phase":
            name, values = "atan2", values[0].values[::-1]
        numbers = _numbers(values)
        if name in MATHS:
            return _Scalar(f"{name}({numbers[0].text})", NUMBER)
        if name == "isfinite":
            x = self._simple(numbers[0]).text
            return _Scalar(f"({x} - {x} == 0.0)", TRUTH)
        return self._user(globals()[f"host_{name}"], numbers)

    def _user(self, function: Callable[..., Any], values: Sequence[_Value]) -> Any:
        """Call of a function of the program; several results are read from their places."""
        flat = self.program.called(getattr(function, "py_func", function), values)
        numbers = [each.text for value in values for each in _leaves(value)]
        needed = (each for each, used in zip(numbers, flat.needs, strict=True) if used)
        call = f"{flat.name}({', '.join((*flat.rows, *needed))})"
        if isinstance(flat.result, _Scalar):
            return _Scalar(call, flat.result.kind)
        self.out.append(call)
        places = (_sum(f"{flat.name}_result".upper(), str(i)) for i in range(self.program.row))

        def taken(each: _Scalar) -> _Scalar:
            value: Any = self._read(_RowPart("w", Layout(1, each.kind), next(places)))
            return self._stored(value)

        return _mapped(flat.result, taken)

    def _refused(self, node: ast.stmt | ast.expr) -> ValueError:
        return ValueError(f"{self.name}: not of the subset that is written out: {ast.unparse(node)}")


def _local(name: str) -> str:
    return f"{name}_here" if name in _ROWS else name


def _needed(lines: list[str]) -> tuple[list[str], set[str]]:
    """Lines without variables that are set and not read, and the names that they hold."""
    reads = [re.sub(r"^ *\w+ = ", "", line) for line in lines]
    used = set(re.findall(r"[^\W\d]\w*", "\n".join(reads)))
    idle = re.compile(r" *(\w+) = [^()]*$")
    left = [line for line in lines if not ((match := idle.match(line)) and match[1] not in used)]
    return (lines, used) if len(left) == len(lines) else _needed(left)


def _indented(lines: Sequence[str]) -> list[str]:
    return [f"    {line}" for line in lines]


# Functions that not every language has, from those that all have; written out as the program's own.

HALF_TURN: Final = math.pi


def larger(a: float, b: float) -> float:
    """The larger of two numbers."""
    return b if a < b else a


def smaller(a: float, b: float) -> float:
    """The smaller of two numbers."""
    return b if b < a else a


def modulo(a: float, b: float) -> float:
    """Remainder of a within 0 and b, b excluded."""
    rest = a - float(int(a / b)) * b
    if rest < 0:
        rest = rest + b
    return 0.0 if rest >= b else rest


def host_hypot(x: float, y: float) -> float:
    """Length of a vector."""
    return sqrt(x * x + y * y)


def host_copysign(size: float, sign: float) -> float:
    """A size with the sign of another number, plus for a zero."""
    return -abs(size) if sign < 0 else abs(size)


def host_atan2(y: float, x: float) -> float:
    """Angle of a vector, within -pi and pi, the former excluded."""
    length = sqrt(x * x + y * y)
    if x > 0:
        return 2 * atan(y / (length + x))
    if y != 0:
        return 2 * atan((length - x) / y)
    return HALF_TURN if x < 0 else 0.0


def host_expm1(x: float) -> float:
    """exp(x) - 1, exact near zero too. Source: Kahan's formula."""
    power = exp(x)
    if power == 1:
        return x
    if power - 1 == -1:
        return -1.0
    return (power - 1) * x / log(power)


def host_ceil(x: float) -> int:
    """Least whole number that is not less."""
    below = int(x)
    return below + 1 if x > below else below
