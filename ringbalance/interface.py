"""Parts that the functions of the Python interface and the commands share."""

from __future__ import annotations

import json as json_format
from collections.abc import Callable
from functools import wraps
from inspect import signature
from numbers import Integral
from pathlib import Path
from typing import Any, Final, ParamSpec, TypeVar

from ringbalance.commands import COMMANDS
from ringbalance.results.result import Result, print_rows
from ringbalance.scene.changes import checked_scene
from ringbalance.scene.faults import SceneError
from ringbalance.scene.loader import load_scene
from ringbalance.scene.narrowing import AnyScene, with_tolerance
from ringbalance.scene.registry import registered

P = ParamSpec("P")
R = TypeVar("R")
SCENES: Final = ("scene", "first", "second")
"""Names of arguments that are scenes."""
_CALIBRATED: Final = "calibrated"


def checked(function: Callable[P, R], *, module: str | None = None) -> Callable[P, R]:
    """Make a function of the Python interface refuse a scene that was changed without its checks.

    Args: `module`: in which the result stands, for pickling, if not that of the function.
    """
    names = tuple(signature(function).parameters)

    @wraps(function)
    def call(*args: P.args, **options: P.kwargs) -> R:
        arguments: dict[str, Any] = {**dict(zip(names, args, strict=False)), **options}
        for name in SCENES:
            if name in arguments:
                checked_scene(arguments[name])
        return function(*args, **options)

    call.__module__ = module or function.__module__
    return call


def check_counts(command: str, **counts: int) -> None:
    """Raises: ValueError: no whole number, or fewer than the command's option of that name takes."""
    for name, count in counts.items():
        limits = COMMANDS[command].options[name].limits
        if limits and (not isinstance(count, Integral) or count < limits.least):
            raise ValueError(f"`{name}` is a whole number of at least {limits.least}, not {count!r}")


def opened(path: Path, tolerance: str | None, seed: int | None = None) -> AnyScene:
    """The scene of a file with the tolerance and the seed of the options of these names."""
    scene = load_scene(path)
    return with_tolerance(scene if seed is None else scene.with_values({"run.seed": seed}), tolerance)


def law_for(scene: AnyScene, law: str) -> str | None:
    """Law of the option `--law` for the balancer of a scene, None for its own calibrated one.

    Raises: SceneError: the balancer has no flow law.
    """
    if law == _CALIBRATED:
        return None
    if "flow_law" in getattr(registered("balancer", scene.balancer), "options", ()):
        return law
    problem = f"the balancer of {scene.source} has no flow law"
    raise SceneError.of_option(
        option="--law", value=law, problem=problem, allowed="this option with a liquid ring alone"
    )


def print_result(result: Result, *, json: bool, headline: bool = True) -> None:
    """Print a result as one JSON document or as rows, see `Rows.view`."""
    if json:
        print(json_format.dumps(result.to_dict(), allow_nan=False))
    else:
        print_rows(result.rows(), headline=headline)
