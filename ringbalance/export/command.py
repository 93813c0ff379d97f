"""The command `ringbalance export`."""

from __future__ import annotations

from importlib.util import find_spec
from types import SimpleNamespace
from typing import Final

from ringbalance.export.blocks import Block, Kind, controller_block, disc_block, law_block
from ringbalance.export.compact import CompactLaw, compact_law
from ringbalance.export.fmu import fmu_bytes
from ringbalance.export.grid import csv_files
from ringbalance.export.hosts import c_files, identifier, python_files, st_files
from ringbalance.export.libraries import EXTRA
from ringbalance.reduced_model.calibration import chamber_and_law
from ringbalance.scene.faults import SceneError
from ringbalance.scene.loader import load_scene
from ringbalance.scene.models import Scene
from ringbalance.scene.narrowing import liquid_ring_scene
from ringbalance.scene.platform.files import staged
from ringbalance.scene.platform.terminal import activity, print_message, results_console

_POINTS: Final = 41
"""Of each axis of a grid."""
_BEYOND: Final = 1.5
"""Of the scene's gas pressure, where a grid ends."""
_WITHOUT_PRESSURE: Final = 1e6
"""Pa, where it ends for a scene without one."""


def export(options: SimpleNamespace) -> int:
    """Run the command `export`: the flow law, the disc or the controller for another program."""
    if options.points is not None and options.to != "csv":
        problem = f"{options.to} has no grid"
        raise SceneError.of_option(
            option="--points", value=options.points, problem=problem, allowed="--to csv"
        )
    if options.all_systems and options.to not in ("fmi2", "fmi3"):
        problem, allowed = f"{options.to} has no libraries", "--to fmi2 or fmi3"
        raise SceneError.of_option(option="--all-systems", value=True, problem=problem, allowed=allowed)
    if options.all_systems and find_spec("ziglang") is None:
        problem, allowed = "the cross-compiler is not installed", f'pip install "ringbalance[{EXTRA}]"'
        raise SceneError.of_option(option="--all-systems", value=True, problem=problem, allowed=allowed)
    if options.to == "csv" and options.block != "law":
        problem = "csv is a table of the law"
        raise SceneError.of_option(
            option="--block", value=options.block, problem=problem, allowed="--block law"
        )
    called = identifier(
        options.name or options.scene.stem + ("" if options.block == "law" else f"_{options.block}")
    )
    if options.name and options.name != called:
        problem = "it names functions in every language"
        allowed = "lower-case letters, digits and single underscores, a letter first; no word of Python"
        raise SceneError.of_option(option="--name", value=options.name, problem=problem, allowed=allowed)
    given = liquid_ring_scene(load_scene(options.scene))
    with staged(options.out) as folder:
        exported, compact = _block(given, options.block)
        if options.to == "csv" and compact is not None:
            pressure = given.gas.pressure
            highest = _BEYOND * pressure if pressure > 0 else _WITHOUT_PRESSURE
            texts = csv_files(compact, called, points=options.points or _POINTS, highest=highest)
            files = {file: text.encode() for file, text in texts.items()}
        elif options.to == "fmi2" or options.to == "fmi3":
            with activity("export", "compiling ..."):
                unit, runs = fmu_bytes(exported, called, options.to, all_systems=options.all_systems)
                if not runs:
                    print_message("no C compiler here: the unit holds its source alone")
            files = {f"{called}.fmu": unit}
        else:
            texts = {"c": c_files, "st": st_files, "python": python_files}[options.to](exported, called)
            files = {file: text.encode() for file, text in texts.items()}
        for file, content in files.items():
            (folder / file).write_bytes(content)
    for file in files:
        results_console().print(str(options.out / file), highlight=False)
    exact = f", velocities within {compact.departure:.1e} of the calibrated law's" if compact else ""
    print_message(f"{exported.size} bytes of constants{exact}")
    return 0


def _block(scene: Scene, block: Kind) -> tuple[Block, CompactLaw | None]:
    """The block, and the law of a block of the law."""
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
