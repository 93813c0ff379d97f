"""Write functions of numbers in C99, JavaScript and structured text (IEC 61131-3), from their syntax trees.

Only what all languages evaluate alike is accepted: +, -, *, /, sqrt, comparisons, `if`, `while`, whole
numbers that divide without remainder or towards zero, and rows of numbers.  `for` over a range, `+=`, several
targets and names of modules are reduced to these first.
"""

from __future__ import annotations

import ast
import inspect
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from types import ModuleType
from typing import Final

NUMBER, WHOLE, TRUTH, NOTHING = "float", "int", "bool", "None"
LAW, CELLS, PIECES, LEVELS, QUERY = "Law", "Cells", "Pieces", "Levels", "Query"
"""Types of the subset; all but the last are only read, cells are bytes, pieces of single precision."""
PER_PIECE: Final = 8  # numbers in a row of `Pieces` or `Levels`
MATHS: Final = ("sqrt", "sin", "cos", "exp", "log", "atan", "acos")
"""Functions of one number that all languages have; only the first gives the same bits in each."""
_ARITHMETIC: Final = ast.Add, ast.Sub, ast.Mult, ast.Div, ast.FloorDiv
BINARY: Final[Mapping[type, str]] = dict(zip(_ARITHMETIC, "+-*//", strict=True))
_UNKNOWN: Final = ast.Constant("?")
_NOT_OF: Final = {NUMBER: ast.FloorDiv, WHOLE: ast.Div}
_SIGNED: Final = (
    *(ast.Lt, ast.LtE, ast.Gt, ast.GtE, ast.Eq, ast.NotEq),
    *(ast.And, ast.Or, ast.Not),
)
"""Comparisons and connectives, in the order of a language's signs."""


@dataclass(frozen=True, kw_only=True)
class Function:
    """One function of the source."""

    name: str
    summary: str
    """First line of its docstring."""
    arguments: Mapping[str, str]
    """Types by name."""
    result: str
    body: Sequence[ast.stmt]
    text: str
    """The function in Python."""

    @property
    def names(self) -> set[str]:
        """Names used in the body."""
        nodes = [node for each in self.body for node in ast.walk(each)]
        return {node.id for node in nodes if isinstance(node, ast.Name)}


@dataclass(frozen=True, kw_only=True)
class Source:
    """A module of functions of numbers."""

    constants: Mapping[str, int | float]
    functions: Mapping[str, Function]

    @classmethod
    def of_modules(cls, modules: Sequence[ModuleType], entries: Sequence[str]) -> Source:
        """Source of some functions and all that they call; of functions with one name, the last module's.

        Raises: ValueError: code outside the subset, or a constant with two values.
        """
        sources = [cls.of_text(inspect.getsource(each)) for each in modules]
        functions = {name: each for source in sources for name, each in source.functions.items()}
        needed, todo = set(entries), list(entries)
        while todo:
            names = functions[todo.pop()].names
            todo += [name for name in names - needed if name in functions]
            needed |= names
        constants = {name: value for source in sources for name, value in source.constants.items()}
        used: dict[str, int | float] = {}
        for source in sources:
            values = {**constants, **source.constants}
            for name in set().union(
                *(source.functions[each].names for each in needed & source.functions.keys())
            ):
                if name in values and used.setdefault(name, values[name]) != values[name]:
                    raise ValueError(f"two modules mean different numbers by {name}")
        return cls(
            constants={name: used[name] for name in constants if name in used},
            functions={name: each for name, each in functions.items() if name in needed},
        )

    @classmethod
    def of_text(cls, text: str) -> Source:
        """Read the source of a module.

        Raises: ValueError: code outside the subset.
        """
        constants: dict[str, int | float] = {}
        functions: dict[str, Function] = {}
        for node in ast.parse(text).body:
            match node:
                case ast.Assign(targets=[ast.Tuple(elts=names)], value=ast.Tuple(elts=values)):
                    pairs = zip(names, values, strict=True)
                    constants |= {ast.unparse(name): ast.literal_eval(value) for name, value in pairs}
                case ast.FunctionDef(args=ast.arguments(args=arguments)):
                    docstring = ast.get_docstring(node) or ""
                    # Decorators serve only the program's own compiled code.
                    node.decorator_list = []
                    ast.fix_missing_locations(_Reduction().visit(node))
                    functions[node.name] = Function(
                        name=node.name,
                        summary=docstring.split("\n")[0],
                        arguments={each.arg: ast.unparse(each.annotation or _UNKNOWN) for each in arguments},
                        result=ast.unparse(node.returns or _UNKNOWN),
                        body=node.body[1 if docstring else 0 :],
                        text=ast.unparse(node),
                    )
        return cls(constants=constants, functions=functions)


class _Reduction(ast.NodeTransformer):
    """Reduce `for`, `+=`, several targets and `module.name` to what all languages have; leave the rest."""

    def visit_Attribute(self, node: ast.Attribute) -> ast.AST:
        return ast.Name(node.attr)

    def visit_AugAssign(self, node: ast.AugAssign) -> ast.AST:
        return self.generic_visit(ast.Assign([node.target], ast.BinOp(node.target, node.op, node.value)))

    def visit_For(self, node: ast.For) -> list[ast.AST] | ast.AST:
        match node:
            case ast.For(ast.Name() as index, ast.Call(func=ast.Name(id="range"), args=ends), orelse=[]):
                first, last = (ast.Constant(0), *ends)[-2:]
                # Neither the index nor the names in its end may change within the loop.
                fixed = {index.id, *(each.id for each in ast.walk(last) if isinstance(each, ast.Name))}
                names = [each for part in node.body for each in ast.walk(part) if isinstance(each, ast.Name)]
                if any(each.id in fixed and isinstance(each.ctx, ast.Store) for each in names):
                    return node
                increment = ast.Assign([index], ast.BinOp(index, ast.Add(), ast.Constant(1)))
                loop = ast.While(ast.Compare(index, [ast.Lt()], [last]), [*node.body, increment], [])
                return [self.generic_visit(ast.Assign([index], first)), self.generic_visit(loop)]
        return node

    def visit_Assign(self, node: ast.Assign) -> list[ast.AST] | ast.AST:
        pairs = [(target, node.value) for target in node.targets]
        match node:
            case ast.Assign(targets=[ast.Tuple(elts=targets)], value=ast.Tuple(elts=values)):
                names = {each.id for each in targets[:-1] if isinstance(each, ast.Name)}
                read = {each.id for value in values for each in ast.walk(value) if isinstance(each, ast.Name)}
                if len(names) < len(targets) - 1 or names & read:
                    return node
                pairs = list(zip(targets, values, strict=True))
            case ast.Assign(targets=[_, _, *_], value=value) if not isinstance(value, ast.Constant):
                return node
        return [self.generic_visit(ast.Assign([target], value)) for target, value in pairs]


@dataclass(frozen=True, kw_only=True)
class Language:
    """Syntax of one language; where it is not given, that of C99."""

    types: Mapping[str, str]
    """Format of a declared name."""
    operators: Mapping[type, str]
    """Signs of comparisons and of `and`, `or`, `not`."""
    maths: Mapping[str, str]
    """Formats of functions of one number: of Python's `math`, and `abs`."""
    element: Mapping[str, str]
    """Format of an element of an array, by type of the array, from its name and indices."""
    to_whole: str = "(int)({})"
    to_number: str = "(double)({})"
    whole_quotient: str = "{} / {}"
    """Format of the quotient of two whole numbers, from dividend and divisor."""
    truths: tuple[str, str] = ("0", "1")
    """False and true."""
    variable: str = "{}"
    """Format of a variable's name."""
    function: str = "{}"
    constants: bool = True
    """True if constants are written by name."""
    assign: str = "{} = {};"
    open_if: str = "if ({}) {{"
    else_if: str = "}} else if ({}) {{"
    otherwise: str = "} else {"
    close_if: str = "}"
    open_while: str = "while ({}) {{"
    close_while: str = "}"
    leave: str = "break;"
    """Statement that ends a loop."""
    returned: Sequence[str] = ("return {1};",)
    """Lines that end a function, from its name and its result."""
    ended: str = "return;"
    """Line that ends a function without a result."""


_ROW_ELEMENTS: Final = dict.fromkeys((LAW, QUERY, CELLS), "{}[{}]")
C99: Final = Language(
    types={
        NUMBER: "double {}",
        WHOLE: "int {}",
        TRUTH: "int {}",
        NOTHING: "void {}",
        LAW: "const double *{}",
        CELLS: "const unsigned char *{}",
        PIECES: f"const float (*{{}})[{PER_PIECE}]",
        LEVELS: f"const double (*{{}})[{PER_PIECE}]",
        QUERY: "double *{}",
    },
    operators=dict(zip(_SIGNED, ("<", "<=", ">", ">=", "==", "!=", "&&", "||", "!"), strict=True)),
    maths={"abs": "fabs({})"} | {name: f"{name}({{}})" for name in MATHS},
    element=_ROW_ELEMENTS | {PIECES: "(double){}[{}][{}]", LEVELS: "{}[{}][{}]"},
)
JAVASCRIPT: Final = replace(
    C99,
    types={
        NUMBER: "{{number}} {}",
        WHOLE: "{{number}} {}",
        TRUTH: "{{boolean}} {}",
        NOTHING: "{{void}} {}",
        LAW: "{{Float64Array}} {}",
        CELLS: "{{Uint8Array}} {}",
        PIECES: "{{Float32Array}} {}",
        LEVELS: "{{Float64Array}} {}",
        QUERY: "{{Float64Array}} {}",
    },
    operators={**C99.operators, ast.Eq: "===", ast.NotEq: "!=="},
    # All numbers are doubles: `| 0` cuts off the part behind the point, and the sign of a zero.
    to_whole="(({}) | 0)",
    to_number="{}",
    whole_quotient="({} / {}) | 0",
    maths={name: f"Math.{name}({{}})" for name in (*MATHS, "abs")},
    truths=("false", "true"),
    # Rows of a table follow one another in one array.
    element=_ROW_ELEMENTS | dict.fromkeys((PIECES, LEVELS), f"{{}}[{PER_PIECE} * ({{}}) + {{}}]"),
)


def structured_text(prefix: str) -> Language:
    """Structured text, whose names do not distinguish cases and whose functions share one space."""
    return Language(
        types={NUMBER: "{} : LREAL", WHOLE: "{} : DINT", TRUTH: "{} : BOOL", NOTHING: "{} : BOOL"},
        operators=dict(zip(_SIGNED, ("<", "<=", ">", ">=", "=", "<>", "AND", "OR", "NOT "), strict=True)),
        to_whole="TRUNC({})",
        to_number="DINT_TO_LREAL({})",
        maths={name: ("LN" if name == "log" else name.upper()) + "({})" for name in (*MATHS, "abs")},
        truths=("FALSE", "TRUE"),
        variable="v_{}",
        function=prefix + "_{}",
        constants=False,
        assign="{} := {};",
        open_if="IF {} THEN",
        else_if="ELSIF {} THEN",
        otherwise="ELSE",
        close_if="END_IF;",
        open_while="WHILE {} DO",
        close_while="END_WHILE;",
        leave="EXIT;",
        returned=(f"{prefix}_{{0}} := {{1}};", "RETURN;"),
        ended="RETURN;",
        element=_ROW_ELEMENTS
        | {
            CELLS: "USINT_TO_DINT({}[{}])",
            PIECES: "REAL_TO_LREAL({}[{}, {}])",
            LEVELS: "{}[{}, {}]",
        },
    )


@dataclass(frozen=True, kw_only=True)
class Writer:
    """Writer of one function."""

    language: Language
    source: Source
    function: Function
    types: dict[str, str] = field(default_factory=dict)
    """Types of arguments, and of local variables as they are met."""

    def written(self) -> tuple[dict[str, str], list[str]]:
        """Types of the local variables by name, and the body, one statement a line."""
        self.types.update(self.function.arguments)
        lines = list(self._block(self.function.body))
        return {name: kind for name, kind in self.types.items() if name not in self.function.arguments}, lines

    def _block(self, body: Sequence[ast.stmt]) -> Iterator[str]:
        for node in body:
            match node:
                case ast.Assign(targets=[ast.Name(id=name)], value=value):
                    text, kind = self._expression(value)
                    if self.types.setdefault(name, kind) != kind or name in self.source.constants:
                        raise self._refused(node)
                    yield self.language.assign.format(self.language.variable.format(name), text)
                case ast.Assign(targets=[ast.Subscript() as target], value=value):
                    yield self.language.assign.format(self._expression(target)[0], self._typed(value, NUMBER))
                case ast.If(test=test, body=inner, orelse=orelse):
                    yield from self._if(self.language.open_if, test, inner, orelse)
                case ast.While(test=test, body=inner, orelse=[]):
                    yield self.language.open_while.format(self._typed(test, TRUTH))
                    yield from self._inner(inner)
                    yield self.language.close_while
                case ast.Break():
                    yield self.language.leave
                case ast.Return(value=None):
                    yield self.language.ended
                case ast.Return(value=ast.expr() as value):
                    text = self._typed(value, self.function.result)
                    for line in self.language.returned:
                        yield line.format(self.function.name, text)
                case ast.Expr(value=ast.Call() as call) if self._expression(call)[1] == NOTHING:
                    yield f"{self._expression(call)[0]};"
                case _:
                    raise self._refused(node)

    def _inner(self, body: Sequence[ast.stmt]) -> Iterator[str]:
        return (f"    {line}" for line in self._block(body))

    def _if(
        self, opening: str, test: ast.expr, body: Sequence[ast.stmt], orelse: Sequence[ast.stmt]
    ) -> Iterator[str]:
        yield opening.format(self._typed(test, TRUTH))
        yield from self._inner(body)
        match orelse:
            case [ast.If(test=other, body=inner, orelse=rest)]:
                yield from self._if(self.language.else_if, other, inner, rest)
                return
            case [_, *_]:
                yield self.language.otherwise
                yield from self._inner(orelse)
        yield self.language.close_if

    def _typed(self, node: ast.expr, kind: str) -> str:
        text, actual = self._expression(node)
        if actual != kind:
            raise self._refused(node)
        return text

    def _expression(self, node: ast.expr) -> tuple[str, str]:
        """Text and type."""
        match node:
            case ast.Constant(value=value):
                return self._constant(value, node)
            case ast.Name(id=name) if name in self.source.constants:
                text, kind = self._constant(self.source.constants[name], node)
                return (name if self.language.constants else text), kind
            case ast.Name(id=name) if name in self.types:
                return self.language.variable.format(name), self.types[name]
            case ast.Subscript(value=ast.Subscript(value=rows, slice=row), slice=place):
                name, kind = self._expression(rows)
                if kind in (PIECES, LEVELS):
                    at = (self._typed(row, WHOLE), self._typed(place, WHOLE))
                    return self.language.element[kind].format(name, *at), NUMBER
            case ast.Subscript(value=row, slice=place) if self._expression(row)[1] in (LAW, CELLS, QUERY):
                name, kind = self._expression(row)
                element = self.language.element[kind].format(name, self._typed(place, WHOLE))
                return element, WHOLE if kind == CELLS else NUMBER
            case ast.Call(func=ast.Name(id=name), args=arguments, keywords=[]):
                return self._call(node, name, arguments)
        return self._operation(node)

    def _operation(self, node: ast.expr) -> tuple[str, str]:
        signs = self.language.operators
        match node:
            case ast.UnaryOp(op=ast.USub(), operand=operand):
                kind = self._expression(operand)[1]
                return f"-{self._operand(operand, kind)}", kind
            case ast.UnaryOp(op=ast.Not() as no, operand=operand):
                return f"{signs[type(no)]}({self._typed(operand, TRUTH)})", TRUTH
            case ast.BinOp(left=left, op=operator, right=right) if type(operator) in BINARY:
                kind = self._expression(left)[1]
                if isinstance(operator, _NOT_OF.get(kind, ast.operator)):
                    raise self._refused(left)
                # Every operation has its own brackets, so that operator precedence does not matter.
                operands = self._operand(left, kind), self._operand(right, kind)
                if kind == WHOLE and isinstance(operator, ast.FloorDiv):
                    return self.language.whole_quotient.format(*operands), kind
                return f" {BINARY[type(operator)]} ".join(operands), kind
            case ast.Compare(left=left, ops=[comparison], comparators=[right]):
                kind = self._expression(left)[1]
                sign = signs[type(comparison)]
                return f"{self._operand(left, kind)} {sign} {self._operand(right, kind)}", TRUTH
            case ast.BoolOp(op=join, values=values):
                sign = f" {signs[type(join)]} "
                return sign.join(f"({self._typed(each, TRUTH)})" for each in values), TRUTH
        raise self._refused(node)

    def _constant(self, value: object, node: ast.expr) -> tuple[str, str]:
        if isinstance(value, bool):
            return self.language.truths[value], TRUTH
        if isinstance(value, int):
            return str(value), WHOLE
        if isinstance(value, float):
            return number_text(value), NUMBER
        raise self._refused(node)

    def _operand(self, node: ast.expr, kind: str) -> str:
        text = self._typed(node, kind)
        return f"({text})" if isinstance(node, ast.BinOp | ast.UnaryOp | ast.BoolOp | ast.Compare) else text

    def _call(self, node: ast.expr, name: str, arguments: Sequence[ast.expr]) -> tuple[str, str]:
        if name in self.language.maths and name not in self.source.functions:
            return self.language.maths[name].format(self._typed(arguments[0], NUMBER)), NUMBER
        if name == "int":
            text, kind = self._expression(arguments[0])
            if kind == WHOLE:
                return text, WHOLE
            return self.language.to_whole.format(self._typed(arguments[0], NUMBER)), WHOLE
        if name == "float":
            return self.language.to_number.format(self._typed(arguments[0], WHOLE)), NUMBER
        if name not in self.source.functions:
            raise self._refused(node)
        called = self.source.functions[name]
        texts = [
            self._typed(each, kind) for each, kind in zip(arguments, called.arguments.values(), strict=True)
        ]
        return f"{self.language.function.format(name)}({', '.join(texts)})", called.result

    def _refused(self, node: ast.stmt | ast.expr) -> ValueError:
        return ValueError(f"{self.function.name}: not of the subset that is translated: {ast.unparse(node)}")


def number_text(value: float) -> str:
    """The shortest decimal that is this number, with a point as structured text asks for."""
    text = repr(value)
    if "." in text:
        return text
    digits, _, exponent = text.partition("e")
    return f"{digits}.0e{exponent}" if exponent else f"{digits}.0"


def exact_text(value: float) -> str:
    """A number of C99: the hexadecimal one where it is shorter than the decimal one."""
    digits, exponent = value.hex().split("p")
    hexadecimal = f"{digits.rstrip('0').rstrip('.')}p{exponent}"
    return min(number_text(value), hexadecimal, key=len)


def python_functions(source: Source) -> str:
    """Constants and functions of a source in Python."""
    constants = "".join(f"{name} = {value!r}\n" for name, value in source.constants.items())
    return constants + "".join(f"\n\n{each.text}\n" for each in source.functions.values())


def c_functions(source: Source) -> str:
    """All functions of a source in C99, each `static`, and its constants; nothing is exported."""
    integers = [f"    {name} = {value}" for name, value in source.constants.items() if isinstance(value, int)]
    parts = ["enum {\n" + ",\n".join(integers) + "\n};\n"]
    parts += [
        f"static const double {name} = {number_text(value)};\n"
        for name, value in source.constants.items()
        if isinstance(value, float)
    ]
    for function in source.functions.values():
        variables, lines = Writer(language=C99, source=source, function=function).written()
        declared = [f"{C99.types[kind].format(name)};" for name, kind in variables.items()]
        arguments = ", ".join(C99.types[kind].format(name) for name, kind in function.arguments.items())
        body = "".join(f"    {line}\n" for line in [*declared, *lines])
        head = C99.types[function.result].format(f"{function.name}({arguments})")
        parts.append(f"\n/* {function.summary} */\nstatic {head}\n{{\n{body}}}\n")
    return "".join(parts)


def js_functions(source: Source) -> str:
    """Constants and functions of a source in JavaScript (ES2020), with types for JSDoc."""
    parts = [
        f"const {name} = {value if isinstance(value, int) else number_text(value)};\n"
        for name, value in source.constants.items()
    ]
    types = JAVASCRIPT.types
    for function in source.functions.values():
        variables, lines = Writer(language=JAVASCRIPT, source=source, function=function).written()
        tags = [f" * @param {types[kind].format(name)}\n" for name, kind in function.arguments.items()]
        tags.append(f" * @returns {types[function.result].format('').strip()}\n")
        starts = {name: JAVASCRIPT.truths[0] if kind == TRUTH else 0 for name, kind in variables.items()}
        declared = [f"let {name} = {start};" for name, start in starts.items()]
        body = "".join(f"    {line}\n" for line in [*declared, *lines])
        parts.append(f"\n/**\n * {function.summary}\n{''.join(tags)} */\n")
        parts.append(f"function {function.name}({', '.join(function.arguments)}) {{\n{body}}}\n")
    return "".join(parts)


def st_functions(source: Source, *, prefix: str, sizes: Mapping[str, str]) -> str:
    """All functions of a source in structured text.

    Args: `prefix`: prefix of their names. `sizes`: bounds and element type of each array, by type of the row.
    """
    language, parts = structured_text(prefix), []
    for function in source.functions.values():
        variables, lines = Writer(language=language, source=source, function=function).written()
        sections: dict[str, list[str]] = {"VAR_IN_OUT": [], "VAR_INPUT": [], "VAR": []}
        for name, kind in function.arguments.items():
            if kind in sizes:
                sections["VAR_IN_OUT"].append(f"v_{name} : ARRAY{sizes[kind]};")
            else:
                sections["VAR_INPUT"].append(f"{language.types[kind].format(f'v_{name}')};")
        sections["VAR"] = [f"{language.types[kind].format(f'v_{name}')};" for name, kind in variables.items()]
        parts.append(f"\n(* {function.summary} *)\n")
        parts.append(f"FUNCTION {language.types[function.result].format(f'{prefix}_{function.name}')}\n")
        for section, declared in sections.items():
            if declared:
                parts.append(f"{section}\n" + "".join(f"    {each}\n" for each in declared) + "END_VAR\n")
        parts.append("".join(f"{line}\n" for line in lines) + "END_FUNCTION\n")
    return "".join(parts)
