"""Numbers that other packages wrap, recognised by their methods alone.

With a unit, as pint has them, with a standard deviation, as uncertainties has them, or with both.
"""

from __future__ import annotations

from typing import Any, Final

NO_UNIT: Final = "dimensionless"


def plain_number(value: Any, unit: str) -> tuple[Any, float]:
    """The number in a unit, and its standard deviation, zero where it has none; other values as they are.

    Args: `unit`: as scene files have it.
    Raises: ValueError: a quantity of another dimension.
    """
    if hasattr(value, "magnitude") and hasattr(value, "to"):
        try:
            value = value.to(unit or NO_UNIT).magnitude
        except Exception as error:
            raise ValueError(f"{value} is nothing in {unit or 'numbers without a unit'}: {error}") from error
    if hasattr(value, "nominal_value") and hasattr(value, "std_dev"):
        return value.nominal_value, float(value.std_dev)
    return value, 0.0
