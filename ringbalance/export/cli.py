"""The command `ringbalance export`."""

from __future__ import annotations

from importlib.util import find_spec
from pathlib import Path
from typing import Final, Literal

from ringbalance.export.blocks import Block, Kind, controller_block, disc_block, law_block
from ringbalance.export.compact import CompactLaw, compact_law
from ringbalance.export.fmu import fmu_bytes
from ringbalance.export.grid import csv_files
from ringbalance.export.hosts import c_files, identifier, python_files, st_files
from ringbalance.export.libraries import EXTRA, Version
from ringbalance.reduced_model.calibration import chamber_and_law
from ringbalance.scene.faults import SceneError
from ringbalance.scene.loader import load_scene
from ringbalance.scene.models import Scene
from ringbalance.scene.narrowing import liquid_ring_scene
from ringbalance.scene.platform.files import staged
from ringbalance.scene.platform.terminal import activity, print_message, results_console

Text = Literal["c", "st", "csv", "python"]
Host = Literal[Text, Version]
POINTS: Final = 41
MOST_POINTS: Final = 1001
_BEYOND: Final = 1.5
"""Of the scene's gas pressure, where a grid ends."""
_WITHOUT_PRESSURE: Final = 1e6
"""Pa, where it ends for a scene without one."""


def export(
    scene: Path,
    *,
    to: Host,
    block: Kind = "law",
    out: Path = Path("out"),
    name: str = "",
    points: int | None = None,
    all_systems: bool = False,
) -> int:
    """Write the calibrated flow law, the disc or the controller for another program, the same bits in each.

    Args:
        scene: the scene file.
        to: c (C99), fmi2 or fmi3 (a unit for co-simulation, FMI 2.0 or 3.0), st (IEC 61131-3 structured
            text), python (a module that imports nothing of others), or csv (a grid).
        block: law (velocity and regime of a query), disc (fills, gas and moment of all chambers in time,
            and the rotor's vibration), or controller (the scene's algorithm with its settings).
        out: folder for the files.
        name: of files and functions; default that of the scene.
        points: of each axis of the grid of csv, 2 to 1001; default 41.
        all_systems: units with libraries for Linux, macOS and Windows; needs the extra export-all.

    Returns:
        Exit code 0.

    Raises:
        SceneError: a scene or an option that cannot be used.
        OSError: a file that cannot be written.
    """
    _check_points(to, points)
    _check_systems(to, all_systems)
    if to == "csv" and block != "law":
        raise SceneError.of_option(
            option="--block", value=block, problem="csv is a table of the law", allowed="--block law"
        )
    called = _checked_name(name) if name else identifier(scene.stem + ("" if block == "law" else f"_{block}"))
    given = liquid_ring_scene(load_scene(scene))
    with staged(out) as folder:
        made, compact = _made(given, block)
        if to == "csv" and compact is not None:
            files = _encoded(csv_files(compact, called, points=points or POINTS, highest=_highest(given)))
        elif to == "fmi2" or to == "fmi3":
            with activity("export", "compiling ..."):
                files = _unit(made, called, to, all_systems)
        else:
            files = _encoded({"c": c_files, "st": st_files, "python": python_files}[to](made, called))
        for file, content in files.items():
            (folder / file).write_bytes(content)
    for file in files:
        results_console().print(str(out / file), highlight=False)
    size = f"{made.size} bytes of constants"
    exact = f", velocities within {compact.departure:.1e} of the calibrated law's" if compact else ""
    print_message(size + exact)
    return 0


def _made(scene: Scene, block: Kind) -> tuple[Block, CompactLaw | None]:
    if block == "controller" and scene.controller.kind != "law_based":
        return controller_block(scene), None
    with activity("export", "calibrating ..."):
        law = chamber_and_law(scene)[1]
        if block == "controller":
            return controller_block(scene, law), None
        if block == "disc":
            return disc_block(scene, law), None
        compact = compact_law(scene=scene, law=law)
        return law_block(compact), compact


def _highest(scene: Scene) -> float:
    """Gas pressure that a grid ends at, Pa."""
    return _BEYOND * scene.gas.pressure if scene.gas.pressure > 0 else _WITHOUT_PRESSURE


def _encoded(texts: dict[str, str]) -> dict[str, bytes]:
    return {file: text.encode() for file, text in texts.items()}


def _unit(block: Block, name: str, version: Version, all_systems: bool) -> dict[str, bytes]:
    unit, runs = fmu_bytes(block, name, version, all_systems=all_systems)
    if not runs:
        print_message("no C compiler here: the unit holds its source alone")
    return {f"{name}.fmu": unit}


def _check_systems(to: Host, all_systems: bool) -> None:
    if not all_systems:
        return
    option, value = "--all-systems", True
    if to not in ("fmi2", "fmi3"):
        problem = f"{to} has no libraries"
        raise SceneError.of_option(option=option, value=value, problem=problem, allowed="--to fmi2 or fmi3")
    if find_spec("ziglang") is None:
        problem, allowed = "the cross-compiler is not installed", f'pip install "ringbalance[{EXTRA}]"'
        raise SceneError.of_option(option=option, value=value, problem=problem, allowed=allowed)


def _check_points(to: Host, points: int | None) -> None:
    if points is None:
        return
    if to != "csv":
        problem = f"{to} has no grid"
        raise SceneError.of_option(option="--points", value=points, problem=problem, allowed="--to csv")
    if not 2 <= points <= MOST_POINTS:
        problem, allowed = "no grid has so many points on an axis", f"2 to {MOST_POINTS}"
        raise SceneError.of_option(option="--points", value=points, problem=problem, allowed=allowed)


def _checked_name(name: str) -> str:
    if name != identifier(name):
        raise SceneError.of_option(
            option="--name",
            value=name,
            problem="it names functions in every language",
            allowed="lower-case letters, digits and single underscores, a letter first; no word of Python",
        )
    return name
