"""Functions that not every language has, from those that all have."""

from math import atan, exp, log, sqrt
from typing import Final

HALF_TURN: Final = 3.141592653589793


def larger(a: float, b: float) -> float:
    """The larger of two numbers."""
    return b if a < b else a


def smaller(a: float, b: float) -> float:
    """The smaller of two numbers."""
    return b if b < a else a


def host_hypot(x: float, y: float) -> float:
    """Length of a vector."""
    return sqrt(x * x + y * y)


def host_copysign(size: float, sign: float) -> float:
    """A size with the sign of another number, plus for a zero."""
    return -abs(size) if sign < 0 else abs(size)


def modulo(a: float, b: float) -> float:
    """Remainder of a within 0 and b, b excluded."""
    rest = a - float(int(a / b)) * b
    if rest < 0:
        rest = rest + b
    return 0.0 if rest >= b else rest


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
