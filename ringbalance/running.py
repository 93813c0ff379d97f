"""Runs a command: checks its options, reads its scene, shows its progress and prints its result."""

from __future__ import annotations

import json as json_format
import os
from collections.abc import Callable, Mapping
from functools import wraps
from inspect import signature
from numbers import Integral
from pathlib import Path
from types import SimpleNamespace
from typing import Any, Final, ParamSpec, TypeVar

from ringbalance.commands import COMMANDS, Option
from ringbalance.results.result import Result, print_rows
from ringbalance.scene.changes import checked_scene, file_text
from ringbalance.scene.faults import SceneError
from ringbalance.scene.loader import load_scene
from ringbalance.scene.narrowing import AnyScene, with_tolerance
from ringbalance.scene.platform.files import check_file, write_whole
from ringbalance.scene.platform.terminal import activity, print_message
from ringbalance.scene.registry import imported, registered

P = ParamSpec("P")
R = TypeVar("R")
_CALIBRATED: Final = "calibrated"
_SCENES: Final = ("scene", "first", "second")


def checked(function: Callable[P, R]) -> Callable[P, R]:
    """Make a function of the Python interface refuse a scene that was changed without its checks."""
    names = tuple(signature(function).parameters)

    @wraps(function)
    def call(*args: P.args, **options: P.kwargs) -> R:
        given: dict[str, Any] = {**dict(zip(names, args, strict=False)), **options}
        for name in _SCENES:
            if name in given:
                checked_scene(given[name])
        return function(*args, **options)

    return call


def check_counts(command: str, **counts: int) -> None:
    """Raises: ValueError: no whole number, or fewer than the command's option of that name takes."""
    for name, count in counts.items():
        limits = COMMANDS[command].options[name].limits
        if limits and (not isinstance(count, Integral) or count < limits.least):
            raise ValueError(f"`{name}` is a whole number of at least {limits.least}, not {count!r}")


def run_command(name: str, /, **given: Any) -> int:
    """Run a command; an option that is not given has its default. Returns: Exit code."""
    command = COMMANDS[name]
    options = {key: each.default for key, each in command.options.items()} | given
    _check_options(command.options, options)
    target = imported(command.target)
    if not command.begin:
        return int(target(SimpleNamespace(**options)))
    options |= {key: opened(options[key], options.get("tolerance")) for key in _SCENES if key in options}
    if options.get("workers", 1) is None:
        options["workers"] = os.cpu_count() or 1
    if "law" in options and "scene" in options:
        options["flow_law"] = law_for(options["scene"], options["law"])
    # The scene was read just now: its tolerance alone may differ from the file's.
    work = getattr(target, "__wrapped__", target)
    with activity(name, command.begin) as shown:
        options["progress"] = shown.show
        result = work(**{key: options[key] for key in signature(work).parameters if key in options})
    save, law = options.get("save"), getattr(result, "flow_law", None)
    if save and law:
        law.save(save)
    elif save and getattr(result, "judgement", result):
        # Not of a search that could judge no design.
        write_whole(save, file_text(result.recommended_scene, to=save.parent))
    print_result(result, json=options["json"], headline=command.headline)
    if save and law:
        print_message(f"law written to {save}")
    return 0 if getattr(result, "succeeded", True) else 1


def _check_options(declared: Mapping[str, Option], options: Mapping[str, Any]) -> None:
    """Raises: SceneError: a value that is not allowed. OSError: a file that cannot be written."""
    for key, option in declared.items():
        value, limits = options[key], option.limits
        if value is None:
            continue
        if limits and not limits.least <= value <= limits.most:
            raise SceneError.of_option(
                option=f"--{key}", value=value, problem=limits.problem, allowed=limits.allowed
            )
        if option.ending is None:
            continue
        if not value.name.lower().endswith(option.ending):
            problem, allowed = (
                "this name does not say what is written",
                f"a file name that ends in {option.ending}",
            )
            raise SceneError.of_option(option=f"--{key}", value=str(value), problem=problem, allowed=allowed)
        check_file(value, apart_from=options.get("scene"))


def opened(path: Path, tolerance: str | None) -> AnyScene:
    """The scene of a file with the tolerance of the option `--tolerance`."""
    return with_tolerance(load_scene(path), tolerance)


def law_for(scene: AnyScene, law: str) -> str | None:
    """Law of the option `--law` for the balancer of a scene, None for its own calibrated one.

    Raises: SceneError: the balancer has no flow law.
    """
    if law == _CALIBRATED:
        return None
    if "flow_law" in registered("balancer", scene.balancer).options:
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
