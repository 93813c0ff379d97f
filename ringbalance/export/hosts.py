"""A block as files for other programs: templates filled with one source, and the law as a table."""

from __future__ import annotations

import keyword
import re
from collections.abc import Callable, Iterator, Sequence
from importlib.resources import files
from itertools import product
from string import Template
from typing import Any, Final

import numpy as np

from ringbalance.export.blocks import RANGE, Block, Variable, tabulation
from ringbalance.export.compact import CompactLaw
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

COLUMNS: Final = (
    *("fill_ratio", "gas_pressure_Pa", "primed", "velocity_m_per_s", "uncertainty_m_per_s"),
    *("regime", "status", "primed_afterwards"),
)
"""Columns of the law's table."""
_TAKEN: Final = frozenset(keyword.kwlist) | {"math", "collections"}
"""Names that a Python module cannot have, or that hide one that it imports."""
_ST_TYPES: Final = {"Real": "LREAL", "Integer": "DINT", "Boolean": "BOOL"}
_NUMBERS: Final = {
    "Cells": {"c": "unsigned char", "st": "USINT", "st_name": "k", "js": "cells: new Uint8Array"},
    "Pieces": {"c": "float", "st": "REAL", "st_name": "p", "js": "pieces: new Float32Array"},
    "Levels": {"c": "double", "st": "LREAL", "st_name": "q", "js": "levels: new Float64Array"},
}
"""Types and names of the numbers in a law's tables, by their types in `translate`."""
_BITS: Final = (
    "Same bits on every machine with IEEE 754 doubles: only + - * / sqrt and comparisons.",
    "Same bits as every other host: only + - * / Math.sqrt and comparisons.",
)
_CLOSE: Final = "A step equals ringbalance's to 1e-12: sin, cos, atan, acos, exp and log are the host's own."


def identifier(text: str) -> str:
    """Name that is valid in every language."""
    name = re.sub(r"_+", "_", re.sub(r"[^0-9a-z]", "_", text.lower())).strip("_") or "law"
    return f"law_{name}" if name[0].isdigit() or name in _TAKEN else name


def c_files(block: Block, name: str) -> dict[str, str]:
    """Text of the source and of the header by file name; `name`: of file and functions."""
    if block.kind != "law":
        return block_c_files(block, name)
    head = filled("head_c", block, name, functions=c_functions(block.source()))
    return {f"{name}.h": filled("h", block, name), f"{name}.c": filled("c", block, name, head=head)}


def block_c_files(block: Block, name: str) -> dict[str, str]:
    """Text of source and header by file name, with the function names common to all blocks."""
    last = block.variables[-1]
    places = [
        f"    {name.upper()}_{each.name.upper()} = {each.index}{',' * (each is not last)}"
        f" /* {each.explained} */"
        for each in block.variables
    ]
    run = f"{block.steps}({_c_tables(block)}, s->w{', time' * block.timed});"
    head = filled("head_c", block, name, functions=c_functions(block.source((block.steps,))))
    return {
        f"{name}.h": filled("block_h", block, name, places="\n".join(places)),
        f"{name}.c": filled("block_c", block, name, head=head, run=run),
    }


def st_files(block: Block, name: str) -> dict[str, str]:
    """Structured text: functions, and a function block `FB_name`."""
    sizes = {"Law": len(block.constants), "Query": len(block.start)}
    arrays = {kind: f"[0..{count - 1}] OF LREAL" for kind, count in sizes.items()}
    arrays |= {kind: _st_array(kind, rows) for kind, rows in _tables(block)}
    functions = st_functions(block.source(), prefix=name, sizes=arrays)
    if block.kind == "law":
        return {f"{name}.st": filled("st", block, name, functions=functions)}

    def get(each: Variable) -> str:
        value = f"w[{each.index}]"
        reads = {"Boolean": f"{value} <> 0.0", "Integer": f"LREAL_TO_DINT({value})"}
        return f"{each.name} := {reads.get(each.kind, value)};"

    def set_to(each: Variable) -> str:
        if each.kind == "Boolean":
            return f"w[{each.index}] := 0.0;\nIF {each.name} THEN\n    w[{each.index}] := 1.0;\nEND_IF;"
        return f"w[{each.index}] := {each.name};"

    run = f"{block.steps}({'c, k, p, q' if block.tables else 'c'}, w, elapsed)"
    parts = _sides(block, lambda each: f"    {each.name} : {_ST_TYPES[each.kind]}; (* {each.explained} *)")
    parts |= {"set": _sides(block, set_to)["inputs"], "get": _sides(block, get)["outputs"]}
    return {f"{name}.st": filled("block_st", block, name, functions=functions, run=run, **parts)}


def python_files(block: Block, name: str) -> dict[str, str]:
    """A module that needs nothing but Python."""
    source = python_functions(block.source())
    if block.kind == "law":
        return {f"{name}.py": filled("python", block, name, source=source)}
    parts = _sides(block, lambda each: f'    "{each.name}": {each.index},  # {each.explained}')
    run = f"{block.steps}({_c_tables(block)}, self.w, time)"
    return {f"{name}.py": filled("block_python", block, name, source=source, run=run, **parts)}


def js_files(block: Block, name: str) -> dict[str, str]:
    """A module of ES2020 that imports nothing; `name`: of the file.

    It exports `NUMBERS`, an object of the typed arrays `constants`, `cells`, `pieces`, `levels` and `start`
    (without tables the first and the last). For a disc or a controller it also has `INPUTS` and `OUTPUTS`,
    the index in the row by name, and `Block`: `new Block(numbers = NUMBERS)` has the row `w`, `advance(time)`
    and `step(time, inputs)`, which returns the outputs by name. For a law it also exports `flow`, and the
    functions of one chamber, which take the arrays.
    """
    head = filled("head_js", block, name, source=js_functions(block.source()))
    if block.kind == "law":
        return {f"{name}.mjs": filled("js", block, name, head=head)}
    parts = _sides(block, lambda each: f"    {each.name}: {each.index}, // {each.explained}")
    arrays = f"n.constants, {'n.cells, n.pieces, n.levels, ' if block.tables else ''}this.w"
    run = f"{block.steps}({arrays}, time);"
    return {f"{name}.mjs": filled("block_js", block, name, head=head, run=run, **parts)}


def csv_files(law: CompactLaw, name: str, *, points: int, highest: float) -> dict[str, str]:
    """A grid of fills and pressures, for programs that interpolate, with the interpolation error.

    The opposite chamber holds the rest of the pair's liquid.

    Args: `points`: number on each axis. `highest`: gauge pressure of the gas at the end of the grid, Pa.
    """
    fills, pressures = np.linspace(0.0, law.max_fill_ratio, points), np.linspace(0.0, highest, points)
    answers = {
        key: law.answer(fill_ratio=key[0], gas_pressure=key[1], primed=key[2])
        for key in product(fills.tolist(), pressures.tolist(), (False, True))
    }

    # Errors of interpolation in the middle of cells of one regime, m/s; the other cells have several.
    errors, cells = [], list(product(range(points - 1), range(points - 1), (False, True)))
    for i, j, primed in cells:
        corners = [
            answers[float(fills[i + a]), float(pressures[j + b]), primed] for a, b in product((0, 1), (0, 1))
        ]
        fill, pressure = float(fills[i : i + 2].mean()), float(pressures[j : j + 2].mean())
        middle = law.answer(fill_ratio=fill, gas_pressure=pressure, primed=primed)
        if {each.regime for each in corners} == {middle.regime}:
            errors.append(abs(middle.velocity - sum(each.velocity for each in corners) / 4))
    largest = float(np.max(errors)) if errors else 0.0
    most = float(np.quantile(errors, 0.95)) if errors else 0.0
    mixed = (len(cells) - len(errors)) / len(cells)

    head = (
        f"Flow law of a liquid-ring balancer, made by ringbalance from {plain_name(law.scene)}.",
        *tabulation(law).splitlines(),
        "units: fill ratios in 1, gauge pressures in Pa, velocities in m/s; uncertainty expanded (95 %)",
        "regime: 0 blocked, 1 siphon, 2 separated, 3 reverse",
        "status: 0 ok, 1 extrapolated, 2 blocked, 4 invalid",
        f"opposite fill ratio: {law.max_fill_ratio!r} less the fill ratio",
        "error of bilinear interpolation in the middle of cells whose corners have one regime: at most "
        f"{largest:.2g} m/s, 95 % below {most:.2g} m/s",
        f"cells with more than one regime, of no use for interpolation: {100 * mixed:.1f} %",
    )
    lines = [*(f"# {line.strip()}" for line in head), ",".join(COLUMNS)]
    x, p, full = (np.array(column) for column in zip(*answers, strict=True))
    flow = law.calibrated.evaluate(fill_ratio=x, gas_pressure=p, primed=full)
    for ((fill, pressure, primed), answer), width in zip(
        answers.items(), flow.uncertainty.tolist(), strict=True
    ):
        values = (answer.velocity, width, answer.regime, answer.status, int(answer.primed))
        lines.append(f"{fill!r},{pressure!r},{int(primed)}," + ",".join(map(repr, values)))
    return {f"{name}.csv": "\n".join(lines) + "\n"}


def filled(frame: str, block: Block, name: str, **parts: str) -> str:
    """Template filled with a block. Args: `parts`: further substitutions of that template."""
    language = next((each for each in ("st", "python", "js") if frame.endswith(each)), "c")
    bits = _BITS[language == "js"] if block.flat is None else _CLOSE
    most = next((each.range["max"] for each in block.variables if each.range.get("unit") == "1"), "")
    return Template(template(frame)).substitute(
        title=f"{block.title}, made by ringbalance from {plain_name(block.scene)}.",
        facts=block.facts.replace("\n   ", "\n * ") if language == "js" else block.facts,
        kind=block.kind,
        name=name,
        upper=name.upper(),
        bits=bits,
        more="" if block.flat is None else f"{_CLOSE} ",
        legend=_comment(block.legend, language),
        maths="sqrt" if block.flat is None else ", ".join(sorted(MATHS)),
        range=RANGE,
        most=most,
        count=len(block.constants),
        last=len(block.constants) - 1,
        row=len(block.start),
        last_of_row=len(block.start) - 1,
        constants=_lines(list(map(_writer(language), block.constants))),
        tables="".join(_declared(block, language)),
        start=_lines(list(map(_writer(language), block.start))),
        **parts,
    )


def template(name: str) -> str:
    """Text of a template."""
    return files("ringbalance.export").joinpath(f"templates/{name}.txt").read_text(encoding="utf-8")


def plain_name(scene: str) -> str:
    """File name of a scene without characters that could end a comment."""
    return re.sub(r"[^\w./ -]", "_", scene.replace("\\", "/").rpartition("/")[2], flags=re.ASCII)


def _sides(block: Block, line: Callable[[Variable], str]) -> dict[str, str]:
    """Lines of the inputs and of the outputs."""
    sides = {"inputs": True, "outputs": False}
    return {
        side: "\n".join(line(each) for each in block.variables if each.input is is_input)
        for side, is_input in sides.items()
    }


def _c_tables(block: Block) -> str:
    return "CONSTANTS, CELL_ROWS, PIECES, LEVELS" if block.tables else "CONSTANTS"


def _tables(block: Block) -> list[tuple[str, Sequence[Any]]]:
    """Tables of its law, if it has one, by their types in `translate`."""
    return list(zip(_NUMBERS, block.tables, strict=True)) if block.tables else []


def _st_array(kind: str, rows: Sequence[Any]) -> str:
    """Declaration of a table in structured text, after ARRAY."""
    width = "" if kind == "Cells" else f", 0..{PER_PIECE - 1}"
    return f"[0..{len(rows) - 1}{width}] OF {_NUMBERS[kind]['st']}"


def _declared(block: Block, language: str) -> Iterator[str]:
    """Declarations of all tables."""
    for kind, rows in _tables(block):
        of = _NUMBERS[kind]
        if kind == "Cells":
            name, text, width = "CELL_ROWS", _lines([str(row) for row in rows], per_line=20), ""
        else:
            if kind == "Pieces" and language in ("st", "js"):
                # The shortest decimals that are these numbers in single precision.
                rows = [[float(str(np.float32(value))) for value in row] for row in rows]
            row_text = {"c": "    {{{}}}", "python": "    ({})"}.get(language, "    {}")
            texts = (row_text.format(", ".join(map(_writer(language), row))) for row in rows)
            name, text, width = kind.upper(), ",\n".join(texts), f"[{PER_PIECE}]"
        yield {
            "c": f"static const {of['c']} {name}[{len(rows)}]{width} = {{\n{text}\n}};\n",
            "st": f"    {of['st_name']} : ARRAY{_st_array(kind, rows)} := [\n{text}\n    ];\n",
            "js": f"    {of['js']}([\n{text}\n    ]),\n",
            "python": f"{name} = (\n{text},\n)\n",
        }[language]


def _comment(lines: Sequence[str], language: str) -> str:
    """Comment of some lines in C or structured text."""
    first, last = ("(*", "*)") if language == "st" else ("/*", "*/")
    text = "\n   ".join(lines).replace(last, f"{last[0]} {last[1]}")
    return f"{first} {text} {last}\n" if lines else ""


def _writer(language: str) -> Callable[[float], str]:
    """Writer of a number; C's hexadecimal numbers are short and leave nothing to round."""
    return exact_text if language == "c" else number_text


def _lines(texts: Sequence[str], per_line: int = 4) -> str:
    rows = [texts[at : at + per_line] for at in range(0, len(texts), per_line)]
    return ",\n".join("    " + ", ".join(row) for row in rows)
