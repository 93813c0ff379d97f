"""LaTeX set as SVG paths."""

from __future__ import annotations

import warnings

with warnings.catch_warnings():
    # ziamath finds its font by importlib.resources.path, which Python 3.11 (and no other) calls deprecated.
    warnings.filterwarnings("ignore", message="path is deprecated", category=DeprecationWarning)
    from ziamath.zmath import Latex


_MARGIN = 1.0
"""Margin around the equation, px."""


def typeset(latex: str) -> str:
    """One equation as an SVG document in the current text colour, 16 px high.

    Raises: ValueError: LaTeX that cannot be set.
    """
    return _set(latex).svg()


def typeset_inline(latex: str) -> str:
    """One equation as by `typeset`, with its base line on that of the surrounding text."""
    depth = _set(latex).getyofst() - _MARGIN
    return typeset(latex).replace("<svg ", f'<svg style="vertical-align: {depth:.2f}px" ', 1)


def _set(latex: str) -> Latex:
    try:
        return Latex(latex, size=16, color="currentColor")
    # The library has no error class of its own: wrong LaTeX may raise any exception.
    except Exception as error:
        raise ValueError(f"this equation cannot be set: {latex}") from error
