"""Records, complex numbers and tuples as numbers in a row."""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import Any, Final

import numpy as np

from ringbalance.export.translate import NUMBER, TRUTH, WHOLE

FINITE_INFINITY: Final = 1e150
"""Number in place of an infinity, with a finite square."""
COMPLEX: Final = ("real", "imag")
_KINDS: Final = {bool: TRUTH, np.bool_: TRUTH, int: WHOLE, np.int64: WHOLE, float: NUMBER, np.float64: NUMBER}


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
        names, parts = _parts(value)
        if hasattr(value, "_fields"):
            owner = re.sub(r"(?<=[a-z])(?=[A-Z])", "_", type(value).__name__.strip("_")).lower()
        inner = tuple(cls.of(each, names[i] if names else owner) for i, each in enumerate(parts))
        return cls(sum(each.size for each in inner), "", inner, names, owner)

    def start(self, part: int) -> int:
        """Place of a part."""
        return sum(each.size for each in self.parts[:part])

    def index(self, path: str) -> int:
        """Place of a number, such as "memory.friction.1.arm"."""
        step, _, rest = path.partition(".")
        if not step:
            return 0
        part = int(step) if step.isdigit() else self.names.index(step)
        return self.start(part) + self.parts[part].index(rest)


def _parts(value: Any) -> tuple[tuple[str, ...], list[Any]]:
    """Parts of a value with their names, if it has some."""
    if isinstance(value, complex):
        return COMPLEX, [float(value.real), float(value.imag)]
    names = tuple(
        getattr(value, "_fields", ()) or (value.dtype.names or () if isinstance(value, np.void) else ())
    )
    return names, [value[i] for i in range(len(value))]


def numbers_of(value: Any) -> list[float]:
    """Numbers of a value, in the order of its layout."""
    if type(value) in _KINDS:
        return [min(max(float(value), -FINITE_INFINITY), FINITE_INFINITY)]
    return [number for each in _parts(value)[1] for number in numbers_of(each)]
