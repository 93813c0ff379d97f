"""The compact law as files of other programs: a frame around one source."""

from __future__ import annotations

import inspect
import re
from importlib.resources import files
from string import Template
from typing import Final

from ringbalance.export import point
from ringbalance.export.compact import VELOCITIES, CompactLaw
from ringbalance.export.translate import Source, c_functions, number_text, st_functions

_PER_LINE: Final = 4
_RANGE: Final = "{:g} to {:g} m/s".format(*VELOCITIES)


def identifier(text: str) -> str:
    """A name that every language takes."""
    name = re.sub(r"_+", "_", re.sub(r"[^0-9a-z]", "_", text.lower())).strip("_") or "law"
    return f"law_{name}" if name[0].isdigit() else name


def c_files(law: CompactLaw, name: str) -> dict[str, str]:
    """Text of the source and of the header by file name; `name`: of file and functions."""
    functions = c_functions(Source.of(point))
    return {
        f"{name}.h": filled("h", law, name),
        f"{name}.c": filled("c", law, name, functions=functions),
    }


def st_files(law: CompactLaw, name: str) -> dict[str, str]:
    """Structured text: functions, and a function block `FB_name`."""
    sizes = {"Law": len(law.constants), "Query": point.PLACES_OF_QUERY}
    functions = st_functions(Source.of(point), prefix=name, sizes=sizes)
    return {f"{name}.st": filled("st", law, name, functions=functions)}


def python_files(law: CompactLaw, name: str) -> dict[str, str]:
    """A module that needs nothing but Python."""
    source = inspect.getsource(point).split('"""\n', 1)[1]
    return {f"{name}.py": filled("python", law, name, source=source.strip())}


def facts(law: CompactLaw) -> str:
    """What a law holds and how exact it is, in sentences."""
    return (
        f"{len(law.constants)} constants, {8 * len(law.constants)} bytes; velocities {_RANGE}, beyond\n"
        f"   extrapolated. Largest error of tabulation: {law.departure:.1e} of a velocity,\n"
        f"   {law.level_error:.1e} Pa of a chamber's level; both are part of the uncertainty."
    )


def filled(template: str, law: CompactLaw, name: str, **parts: str) -> str:
    """A template with a law in it. Args: `parts`: further words of that template."""
    text = files("ringbalance.export").joinpath(f"templates/{template}.txt").read_text(encoding="utf-8")
    return Template(text).substitute(
        title=f"Flow law of a liquid-ring balancer, calibrated by ringbalance from {_named(law)}.",
        facts=facts(law),
        name=name,
        upper=name.upper(),
        range=_RANGE,
        most=number_text(law.max_fill_ratio),
        count=len(law.constants),
        last=len(law.constants) - 1,
        last_of_query=point.PLACES_OF_QUERY - 1,
        constants=_lines([number_text(value) for value in law.constants]),
        **parts,
    )


def _named(law: CompactLaw) -> str:
    """The scene's file without what could end a comment."""
    return re.sub(r"[^\w./ -]", "_", law.scene.replace("\\", "/").rpartition("/")[2], flags=re.ASCII)


def _lines(values: list[str]) -> str:
    rows = [values[at : at + _PER_LINE] for at in range(0, len(values), _PER_LINE)]
    return ",\n".join("    " + ", ".join(row) for row in rows)
