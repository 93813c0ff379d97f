"""What to change in the control algorithm: a key of the scene, or for the caller's own algorithm its gain."""

from __future__ import annotations


def raised_gain(own: str) -> str:
    """Args: `own`: name of the caller's algorithm; empty for that of the scene."""
    return f"let {own} open the valves for longer" if own else "raise controller.proportional"


def lowered_gain(own: str, to_gain: str) -> str:
    """Args: `own`: as `raised_gain`. `to_gain`: " to ..." of the scene's algorithm."""
    if own:
        return f"let {own} open the valves for less time"
    return f"lower controller.proportional{to_gain}"
