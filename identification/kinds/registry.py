"""Every kind of measurement by its name in the data, for `fit` and `verify --data`, and an empty file of one.

A new kind is one entry in the module of its balancer, or of test benches.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from types import MappingProxyType
from typing import Final

from ringbalance.identification.kinds.bench import BENCH
from ringbalance.identification.kinds.eccentric_mass import ECCENTRIC_MASS
from ringbalance.identification.kinds.kind import Column, Kind
from ringbalance.identification.kinds.liquid_ring import LIQUID_RING
from ringbalance.scene.faults import SceneError, did_you_mean

AMPLITUDES: Final[Mapping[str, float]] = MappingProxyType(
    {"zero_to_peak": 1.0, "peak_to_peak": 0.5, "rms": 2**0.5}
)
"""Convention of an amplitude to the factor that makes it zero to peak; of a harmonic vibration."""
KINDS: Final[Mapping[str, Kind]] = MappingProxyType({**LIQUID_RING, **ECCENTRIC_MASS, **BENCH})


def kinds_of(balancer: str) -> tuple[str, ...]:
    """Names of the kinds that the scenes of a balancer predict; of an empty one those of test benches."""
    own = tuple(name for name, kind in KINDS.items() if balancer == kind.balancer)
    return own or tuple(name for name, kind in KINDS.items() if kind.any_rotor)


def template(name: str) -> str:
    """Text of a file of one kind that lacks only its rows; lines that begin with ## explain the columns.

    Raises: SceneError: no such kind.
    """
    if name not in KINDS:
        problem, allowed = f"there is no such kind of data{did_you_mean(name, KINDS)}", ", ".join(KINDS)
        raise SceneError.of_option(option="--template", value=name, problem=problem, allowed=allowed)
    kind = KINDS[name]
    needed = [column for column in kind.columns if not column.optional and not _is_other(column, kind)]
    heads = [*(["chamber"] if kind.has_chamber else []), *(column.head for column in needed), "series"]
    return "\n".join([*_first_lines(name, kind), "##", *_explained(kind), ",".join(heads)]) + "\n"


def _is_other(column: Column, kind: Kind) -> bool:
    """Whether it may stand in place of a column that the template has."""
    return column.name in kind.one_of[1:]


def _first_lines(name: str, kind: Kind) -> Iterator[str]:
    yield f'# kind = "{name}"  # {kind.title}'
    yield '# source = ""  # rig, run and date'
    if not kind.balancer:
        yield "# uncertainty = 0.02  # expanded (95 %), relative to the measured values"
        return
    amplitudes = [column for column in kind.measured if column.amplitude]
    if amplitudes:
        yield f'# amplitude = ""  # {", ".join(AMPLITUDES)}: how every amplitude in the file is counted'
    measured = amplitudes or [column for column in kind.measured if not _is_other(column, kind)]
    stated = ", ".join(f'{column.name} = "1 {column.unit}"' for column in measured)
    yield f"## uncertainty = {{ {stated} }}  # expanded (95 %), or relative such as 0.02; absent: estimated"


def _explained(kind: Kind) -> Iterator[str]:
    """A line for each column that the file may have."""
    if kind.has_chamber:
        yield "## chamber: letter of the driven chamber, A for the first"
    for column in kind.columns:
        word = "or " if _is_other(column, kind) else "optional " if column.optional else ""
        yield f"## {word}{column.head}: {column.meaning}"
    widths = ", ".join(column.name for column in kind.uncertainties() if column.dimension)
    yield f"## optional {widths or 'uncertainty'}: expanded uncertainty (95 %) of each row"
    yield "## series: run, rig or day that a row belongs to; rows in the order in which they were measured"
    yield "## optional note: any remark; tells apart rows that are otherwise the same"
