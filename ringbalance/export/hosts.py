"""A block as files for other programs: templates filled with one source."""

from __future__ import annotations

import keyword
import re
from collections.abc import Iterable, Iterator, Sequence
from importlib.resources import files
from string import Template
from typing import Any, Final

import numpy as np

from ringbalance.export.blocks import RANGE, Block, Variable
from ringbalance.export.translate import (
    MATHS,
    PER_PIECE,
    c_functions,
    exact_text,
    js_functions,
    number_text,
    python_functions,
    st_functions,
)

_CHAMBER_FUNCTIONS: Final = ("surface_radius", "moment", "moment_uncertainty")
"""Functions of the law for one chamber, which a caller may ask for by themselves."""
_ST_TYPES: Final = {"Real": "LREAL", "Integer": "DINT", "Boolean": "BOOL"}


_TAKEN: Final = frozenset(keyword.kwlist) | {"math", "collections"}
"""Names that a Python module cannot have, or that hide one that it imports."""


def identifier(text: str) -> str:
    """Name that is valid in every language."""
    name = re.sub(r"_+", "_", re.sub(r"[^0-9a-z]", "_", text.lower())).strip("_") or "law"
    return f"law_{name}" if name[0].isdigit() or name in _TAKEN else name


def c_files(block: Block, name: str) -> dict[str, str]:
    """Text of the source and of the header by file name; `name`: of file and functions."""
    if block.kind == "law":
        head = _head(block, name, ("answer", *_CHAMBER_FUNCTIONS))
        return {f"{name}.h": filled("h", block, name), f"{name}.c": filled("c", block, name, head=head)}
    return block_c_files(block, name)


def block_c_files(block: Block, name: str) -> dict[str, str]:
    """Text of source and header by file name, with the function names common to all blocks."""
    upper = name.upper()
    last = block.variables[-1]
    places = [
        f"    {upper}_{each.name.upper()} = {each.index}{',' * (each is not last)} /* {each.explained} */"
        for each in block.variables
    ]
    run = f"{block.steps}({_C_TABLES if block.tables else 'CONSTANTS'}, s->w{', time' * block.timed});"
    source = filled("block_c", block, name, head=_head(block, name), run=run)
    header = filled("block_h", block, name, places="\n".join(places))
    return {f"{name}.h": header, f"{name}.c": source}


def _head(block: Block, name: str, entries: tuple[str, ...] = ()) -> str:
    functions = c_functions(block.source(entries))
    return filled("head_c", block, name, functions=functions)


def st_files(block: Block, name: str) -> dict[str, str]:
    """Structured text: functions, and a function block `FB_name`."""
    sizes = {"Law": len(block.constants), "Query": len(block.start)}
    arrays = {kind: f"[0..{count - 1}] OF LREAL" for kind, count in sizes.items()}
    arrays |= {kind: _st_array(kind, rows) for kind, rows in zip(_NUMBERS, block.tables or (), strict=False)}
    entries = ("answer", *_CHAMBER_FUNCTIONS) if block.kind == "law" else ()
    functions = st_functions(block.source(entries), prefix=name, sizes=arrays)
    if block.kind == "law":
        return {f"{name}.st": filled("st", block, name, functions=functions)}
    inputs, outputs = _sides(block)
    text = filled(
        "block_st",
        block,
        name,
        functions=functions,
        inputs="\n".join(map(_st_declared, inputs)),
        outputs="\n".join(map(_st_declared, outputs)),
        set="\n".join(map(_st_set, inputs)),
        get="\n".join(map(_st_get, outputs)),
        run=f"{block.steps}({'c, k, p, q' if block.tables else 'c'}, w, elapsed)",
    )
    return {f"{name}.st": text}


def _sides(block: Block) -> tuple[list[Variable], list[Variable]]:
    """Inputs and outputs."""
    every = block.variables
    return [each for each in every if each.input], [each for each in every if not each.input]


def _st_declared(each: Variable) -> str:
    return f"    {each.name} : {_ST_TYPES[each.kind]}; (* {each.explained} *)"


def _st_set(each: Variable) -> str:
    if each.kind == "Boolean":
        return f"w[{each.index}] := 0.0;\nIF {each.name} THEN\n    w[{each.index}] := 1.0;\nEND_IF;"
    return f"w[{each.index}] := {each.name};"


def _st_get(each: Variable) -> str:
    value = f"w[{each.index}]"
    if each.kind == "Boolean":
        return f"{each.name} := {value} <> 0.0;"
    return f"{each.name} := LREAL_TO_DINT({value});" if each.kind == "Integer" else f"{each.name} := {value};"


def python_files(block: Block, name: str) -> dict[str, str]:
    """A module that needs nothing but Python."""
    law = block.kind == "law"
    source = python_functions(block.source(("answer", *_CHAMBER_FUNCTIONS) if law else ()))
    if law:
        return {f"{name}.py": filled("python", block, name, source=source)}
    inputs, outputs = (
        "\n".join(f'    "{v.name}": {v.index},  # {v.explained}' for v in side) for side in _sides(block)
    )
    run = f"{block.steps}({_C_TABLES if block.tables else 'CONSTANTS'}, self.w, time)"
    text = filled(
        "block_python", block, name, source=source, inputs=inputs, outputs=outputs, run=run, kind=block.kind
    )
    return {f"{name}.py": text}


def js_files(block: Block, name: str) -> dict[str, str]:
    """A module of ES2020 that imports nothing; `name`: of the file.

    It exports `NUMBERS`, an object of the typed arrays `constants`, `cells`, `pieces`, `levels` and `start`
    (without tables the first and the last). For a disc or a controller it also has `INPUTS` and `OUTPUTS`,
    the index in the row by name, and `Block`: `new Block(numbers = NUMBERS)` has the row `w`, `advance(time)`
    and `step(time, inputs)`, which returns the outputs by name. For a law it also exports `flow`, and the
    functions of one chamber, which take the arrays.
    """
    law = block.kind == "law"
    source = js_functions(block.source(("answer", *_CHAMBER_FUNCTIONS) if law else ()))
    head = filled("head_js", block, name, source=source)
    if law:
        return {f"{name}.mjs": filled("js", block, name, head=head)}
    inputs, outputs = (
        "\n".join(f"    {v.name}: {v.index}, // {v.explained}" for v in side) for side in _sides(block)
    )
    arrays = f"n.constants, {'n.cells, n.pieces, n.levels, ' if block.tables else ''}this.w"
    run = f"{block.steps}({arrays}, time);"
    text = filled(
        "block_js", block, name, head=head, inputs=inputs, outputs=outputs, run=run, kind=block.kind
    )
    return {f"{name}.mjs": text}


_C_TABLES: Final = "CONSTANTS, CELL_ROWS, PIECES, LEVELS"
_TEXT: Final = {"c": exact_text, "st": number_text, "python": number_text, "js": number_text}
"""Writer of a number by language; C's hexadecimal numbers are short and leave nothing to round."""
_NUMBERS: Final = {
    "Cells": {"c": "unsigned char", "st": "USINT", "st_name": "k", "js": "cells: new Uint8Array"},
    "Pieces": {"c": "float", "st": "REAL", "st_name": "p", "js": "pieces: new Float32Array"},
    "Levels": {"c": "double", "st": "LREAL", "st_name": "q", "js": "levels: new Float64Array"},
}
"""Types and names of the numbers in a law's tables, by their types in `translate`."""
_ROW: Final = {"c": "    {{{}}}", "st": "    {}", "python": "    ({})", "js": "    {}"}


def _st_array(kind: str, rows: Sequence[Any]) -> str:
    """Declaration of a table in structured text, after ARRAY."""
    width = "" if kind == "Cells" else f", 0..{PER_PIECE - 1}"
    return f"[0..{len(rows) - 1}{width}] OF {_NUMBERS[kind]['st']}"


def _declared(block: Block, language: str) -> Iterator[str]:
    """Declarations of all tables."""
    tables: Iterable[tuple[str, Sequence[Any]]] = zip(_NUMBERS, block.tables or (), strict=False)
    for kind, rows in tables:
        if kind == "Cells":
            text, width = _lines([str(row) for row in rows], per_line=20), ""
        else:
            if kind == "Pieces" and language in ("st", "js"):
                # The shortest decimals that are these numbers in single precision.
                rows = [[float(str(np.float32(value))) for value in row] for row in rows]
            texts = (", ".join(map(_TEXT[language], row)) for row in rows)
            text = ",\n".join(map(_ROW[language].format, texts))
            width = f"[{PER_PIECE}]"
        name = "CELL_ROWS" if kind == "Cells" else kind.upper()
        if language == "c":
            yield f"static const {_NUMBERS[kind]['c']} {name}[{len(rows)}]{width} = {{\n{text}\n}};\n"
        elif language == "st":
            name = _NUMBERS[kind]["st_name"]
            yield f"    {name} : ARRAY{_st_array(kind, rows)} := [\n{text}\n    ];\n"
        elif language == "js":
            yield f"    {_NUMBERS[kind]['js']}([\n{text}\n    ]),\n"
        else:
            yield f"{name} = (\n{text},\n)\n"


_BITS: Final = (
    "Same bits on every machine with IEEE 754 doubles: only + - * / sqrt and comparisons.",
    "Same bits as every other host: only + - * / Math.sqrt and comparisons.",
)
_CLOSE: Final = "A step equals ringbalance's to 1e-12: sin, cos, atan, acos, exp and log are the host's own."


def template(name: str) -> str:
    """Text of a template."""
    return files("ringbalance.export").joinpath(f"templates/{name}.txt").read_text(encoding="utf-8")


def filled(frame: str, block: Block, name: str, **parts: str) -> str:
    """Template filled with a block. Args: `parts`: further substitutions of that template."""
    text = template(frame)
    language = next((each for each in ("st", "python", "js") if frame.endswith(each)), "c")
    written = _TEXT[language]
    bits = _BITS[language == "js"] if block.flat is None else _CLOSE
    most = next((each.range["max"] for each in block.variables if each.range.get("unit") == "1"), "")
    return Template(text).substitute(
        title=f"{block.title}, made by ringbalance from {plain_name(block.scene)}.",
        facts=block.facts.replace("\n   ", "\n * ") if language == "js" else block.facts,
        name=name,
        upper=name.upper(),
        bits=bits,
        more="" if block.flat is None else f"{_CLOSE} ",
        maths="sqrt" if block.flat is None else ", ".join(sorted(MATHS)),
        range=RANGE,
        most=most,
        count=len(block.constants),
        last=len(block.constants) - 1,
        row=len(block.start),
        last_of_row=len(block.start) - 1,
        constants=_lines([written(value) for value in block.constants]),
        tables="".join(_declared(block, language)),
        start=_lines([written(value) for value in block.start]),
        **parts,
    )


def plain_name(scene: str) -> str:
    """File name of a scene without characters that could end a comment."""
    return re.sub(r"[^\w./ -]", "_", scene.replace("\\", "/").rpartition("/")[2], flags=re.ASCII)


def _lines(texts: Sequence[str], per_line: int = 4) -> str:
    rows = [texts[at : at + per_line] for at in range(0, len(texts), per_line)]
    return ",\n".join("    " + ", ".join(row) for row in rows)
