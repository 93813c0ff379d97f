"""A block as files of other programs: a frame around one source."""

from __future__ import annotations

import keyword
import re
from importlib.resources import files
from string import Template
from typing import Final

from ringbalance.export.blocks import RANGE, Block, Variable
from ringbalance.export.translate import (
    PER_PIECE,
    c_functions,
    exact_text,
    number_text,
    python_functions,
    st_functions,
)

_PER_LINE: Final = 4
_OF_CHAMBER: Final = ("surface_radius", "moment", "moment_uncertainty")
"""Functions of the law for one chamber, which a caller may ask for by themselves."""
_ST_TYPES: Final = {"Real": "LREAL", "Integer": "DINT", "Boolean": "BOOL"}


_TAKEN: Final = frozenset(keyword.kwlist) | {"math", "collections"}
"""Names that a Python module cannot have, or that hide one that it imports."""


def identifier(text: str) -> str:
    """A name that every language takes."""
    name = re.sub(r"_+", "_", re.sub(r"[^0-9a-z]", "_", text.lower())).strip("_") or "law"
    return f"law_{name}" if name[0].isdigit() or name in _TAKEN else name


def c_files(block: Block, name: str) -> dict[str, str]:
    """Text of the source and of the header by file name; `name`: of file and functions."""
    if block.kind == "law":
        head = _head(block, name, ("answer", *_OF_CHAMBER))
        return {f"{name}.h": filled("h", block, name), f"{name}.c": filled("c", block, name, head=head)}
    return block_c_files(block, name)


def block_c_files(block: Block, name: str) -> dict[str, str]:
    """The same with the names that all blocks have."""
    upper = name.upper()
    last = block.variables[-1]
    places = [
        f"    {upper}_{each.name.upper()} = {each.place}{',' * (each is not last)} /* {each.explained} */"
        for each in block.variables
    ]
    run = f"{block.steps}({_rows(block)}, s->w{', time' if block.timed else ''});"
    source = filled("block_c", block, name, head=_head(block, name), run=run)
    header = filled("block_h", block, name, places="\n".join(places))
    return {f"{name}.h": header, f"{name}.c": source}


def _head(block: Block, name: str, entries: tuple[str, ...] = ()) -> str:
    functions = c_functions(block.source(entries))
    return filled("head_c", block, name, functions=functions)


def st_files(block: Block, name: str) -> dict[str, str]:
    """Structured text: functions, and a function block `FB_name`."""
    ends = {"Law": f"0..{len(block.constants) - 1}", "Query": f"0..{len(block.start) - 1}"}
    sizes = {**ends, "Pieces": f"0..{len(block.pieces) - 1}, 0..{PER_PIECE - 1}"}
    entries = ("answer", *_OF_CHAMBER) if block.kind == "law" else ()
    functions = st_functions(block.source(entries), prefix=name, sizes=sizes)
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
        run=f"{block.steps}({'c, p' if block.pieces else 'c'}, w, elapsed)",
    )
    return {f"{name}.st": text}


def _rows(block: Block) -> str:
    return "CONSTANTS, PIECES" if block.pieces else "CONSTANTS"


def _sides(block: Block) -> tuple[list[Variable], list[Variable]]:
    """Inputs and outputs."""
    every = block.variables
    return [each for each in every if each.input], [each for each in every if not each.input]


def _st_declared(each: Variable) -> str:
    return f"    {each.name} : {_ST_TYPES[each.kind]}; (* {each.explained} *)"


def _st_set(each: Variable) -> str:
    if each.kind == "Boolean":
        return f"w[{each.place}] := 0.0;\nIF {each.name} THEN\n    w[{each.place}] := 1.0;\nEND_IF;"
    return f"w[{each.place}] := {each.name};"


def _st_get(each: Variable) -> str:
    value = f"w[{each.place}]"
    if each.kind == "Boolean":
        return f"{each.name} := {value} <> 0.0;"
    return f"{each.name} := LREAL_TO_DINT({value});" if each.kind == "Integer" else f"{each.name} := {value};"


def python_files(block: Block, name: str) -> dict[str, str]:
    """A module that needs nothing but Python."""
    law = block.kind == "law"
    source = python_functions(block.source(("answer", *_OF_CHAMBER) if law else ()))
    if law:
        return {f"{name}.py": filled("python", block, name, source=source)}
    inputs, outputs = (
        "\n".join(f'    "{v.name}": {v.place},  # {v.explained}' for v in side) for side in _sides(block)
    )
    run = f"{block.steps}({_rows(block)}, self.w, time)"
    text = filled(
        "block_python", block, name, source=source, inputs=inputs, outputs=outputs, run=run, kind=block.kind
    )
    return {f"{name}.py": text}


_DECLARED: Final = {
    "c": ("static const double PIECES[{count}][{width}] = {{\n{rows}\n}};\n", "    {{{}}}"),
    "st": ("    p : ARRAY[0..{last}, 0..{end}] OF LREAL := [\n{rows}\n    ];\n", "    {}"),
    "python": ("PIECES = (\n{rows},\n)\n", "    ({})"),
}
"""How a language declares rows of polynomials, and one of them."""


def _pieces(block: Block, language: str) -> str:
    whole, one = _DECLARED[language]
    rows = ",\n".join(one.format(", ".join(map(_TEXT[language], row))) for row in block.pieces)
    count = len(block.pieces)
    sizes = {"count": count, "last": count - 1, "width": PER_PIECE, "end": PER_PIECE - 1}
    return whole.format(rows=rows, **sizes) if rows else ""


_TEXT: Final = {"c": exact_text, "st": number_text, "python": number_text}
"""How a language writes a number; C's hexadecimal ones are short and leave nothing to round."""


def template(name: str) -> str:
    """Text of a template."""
    return files("ringbalance.export").joinpath(f"templates/{name}.txt").read_text(encoding="utf-8")


def filled(frame: str, block: Block, name: str, **parts: str) -> str:
    """A template with a block in it. Args: `parts`: further words of that template."""
    text = template(frame)
    language = next((each for each in _DECLARED if frame.endswith(each)), "c")
    most = next((each.range["max"] for each in block.variables if each.range.get("unit") == "1"), "")
    return Template(text).substitute(
        title=f"{block.title}, made by ringbalance from {plain_name(block.scene)}.",
        facts=block.facts,
        name=name,
        upper=name.upper(),
        range=RANGE,
        most=most,
        count=len(block.constants),
        last=len(block.constants) - 1,
        row=len(block.start),
        last_of_row=len(block.start) - 1,
        constants=_lines(block.constants, language),
        pieces=_pieces(block, language),
        start=_lines(block.start, language),
        **parts,
    )


def plain_name(scene: str) -> str:
    """A scene's file without what could end a comment."""
    return re.sub(r"[^\w./ -]", "_", scene.replace("\\", "/").rpartition("/")[2], flags=re.ASCII)


def _lines(values: tuple[float, ...], language: str) -> str:
    texts = [_TEXT[language](value) for value in values]
    rows = [texts[at : at + _PER_LINE] for at in range(0, len(texts), _PER_LINE)]
    return ",\n".join("    " + ", ".join(row) for row in rows)
