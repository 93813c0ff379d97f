"""Run a command: check its options, read its scene, show its progress and print its result."""

from __future__ import annotations

import os
from collections.abc import Mapping
from inspect import signature
from json import dumps
from types import SimpleNamespace
from typing import Any, Final

from ringbalance.commands import COMMANDS, ShellCommand
from ringbalance.interface import SCENES, law_for, opened, print_result
from ringbalance.scene.changes import file_text
from ringbalance.scene.faults import SceneError
from ringbalance.scene.platform.files import check_file, write_whole
from ringbalance.scene.platform.terminal import activity, print_message
from ringbalance.scene.registry import imported

TARGETS: Final = {
    "report": "ringbalance.reporting:report",
    "calibrate": "ringbalance.calibration:calibrate",
    "simulate": "ringbalance.face:simulate_file",
    "tune": "ringbalance.face:tune",
    "export": "ringbalance.export.command:export",
    "panel": "ringbalance.showing:panel_file",
    "sweep": "ringbalance.designs:sweep_file",
    "design": "ringbalance.search:find_design",
    "fit": "ringbalance.fitting:fit_files",
    "verify": "ringbalance.verification.command:verify",
    "compare": "ringbalance.face:compare_under",
    "trade": "ringbalance.studies:trade",
    "extremes": "ringbalance.studies:extremes_file",
    "plot": "ringbalance.reporting:plot_file",
    "check-balancer": "ringbalance.face:check_balancer",
    "doctor": "ringbalance.doctor:doctor",
}
"""Module and function of each command, imported when it runs."""


def run_command(name: str, /, **settings: Any) -> int:
    """Run a command; options without a setting have their defaults. Returns: Exit code."""
    command = COMMANDS[name]
    options = {key: each.default for key, each in command.options.items()} | settings
    _check_options(command, options)
    target = imported(TARGETS[name])
    if not command.begin:
        return int(target(SimpleNamespace(**options)))
    changes = options.get("tolerance"), options.get("seed")
    options |= {key: opened(options[key], *changes) for key in SCENES if options.get(key)}
    if options.get("valves"):
        options["scene"] = imported("ringbalance.design.choices:with_valves")(
            options["scene"], options["valves"]
        )
    if options.get("workers", 1) is None:
        options["workers"] = os.cpu_count() or 1
    if "law" in options and "scene" in options:
        options["flow_law"] = law_for(options["scene"], options["law"])
    file = options["out"] / f"{name}.json" if options.get("out") else None
    if file is not None:
        check_file(file)
    # No second check: the scene was read just now, and only its tolerance may differ from the file's.
    work = getattr(target, "__wrapped__", target)
    with activity(name, command.begin) as shown:
        options["progress"] = shown.show
        result = work(**{key: options[key] for key in signature(work).parameters if key in options})
    # A search that could judge no design has nothing to save or to draw.
    save, law, judged = (
        options.get("save"),
        getattr(result, "flow_law", None),
        getattr(result, "judgement", result),
    )
    if save and law:
        law.save(save)
    elif save and judged:
        write_whole(save, file_text(result.recommended_scene, to=save.parent))
    if options.get("plot") and judged:
        result.plot(options["plot"])
    print_result(result, json=options["json"], headline=command.headline)
    if file is not None:
        write_whole(file, dumps(result.to_dict(), allow_nan=False) + "\n")
        print_message(f"written to {file}")
    if save and law:
        print_message(f"law written to {save}")
    return 0 if getattr(result, "succeeded", True) else 1


def _check_options(command: ShellCommand, options: Mapping[str, Any]) -> None:
    """Refuse numbers outside their limits, and files of another kind or that cannot be written."""
    for key, option in command.options.items():
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
            problem = "this name does not say what is written"
            allowed = f"a file name that ends in {option.ending}"
            raise SceneError.of_option(option=f"--{key}", value=str(value), problem=problem, allowed=allowed)
        check_file(value, apart_from=options.get("scene"))
