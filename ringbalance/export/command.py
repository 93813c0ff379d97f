"""The command `ringbalance export`."""

from __future__ import annotations

from importlib.util import find_spec
from types import MappingProxyType, SimpleNamespace
from typing import Final

from ringbalance.export.blocks import controller_block, disc_block, law_block
from ringbalance.export.compact import CompactLaw, compact_law
from ringbalance.export.fmu import fmu_bytes
from ringbalance.export.grid import csv_files
from ringbalance.export.hosts import c_files, identifier, js_files, python_files, st_files
from ringbalance.export.libraries import EXTRA
from ringbalance.physics.gas import applied_pressure
from ringbalance.reduced_model.calibration import chamber_and_law
from ringbalance.scene.faults import SceneError
from ringbalance.scene.loader import load_scene
from ringbalance.scene.narrowing import liquid_ring_scene
from ringbalance.scene.platform.files import staged
from ringbalance.scene.platform.terminal import activity, print_message, results_console

HOSTS: Final = MappingProxyType({"simulink": "fmi2", "openmodelica": "fmi2", "twincat": "st"})
"""Format by name of a program that takes it."""
_GRID_POINTS: Final = 41
"""Points on each axis of a grid."""
_GRID_END: Final = 1.5
"""Gas pressure at which a grid ends, over the scene's."""
_GRID_END_WITHOUT_PRESSURE_PA: Final = 1e6
"""Gas pressure at which the grid of a scene without one ends."""


def export(options: SimpleNamespace) -> int:
    """Run the command `export`: the flow law, the disc or the controller for another program."""
    cross = options.all_systems
    options.to = HOSTS.get(options.to, options.to)
    if options.points is not None and options.to != "csv":
        raise _refusal("--points", options.points, f"{options.to} has no grid", "--to csv")
    if cross and options.to not in ("fmi2", "fmi3"):
        raise _refusal("--all-systems", True, f"{options.to} has no libraries", "--to fmi2 or fmi3")
    if cross and find_spec("ziglang") is None:
        problem = "the cross-compiler is not installed"
        raise _refusal("--all-systems", True, problem, f'pip install "ringbalance[{EXTRA}]"')
    if options.to == "csv" and options.block != "law":
        raise _refusal("--block", options.block, "csv is a table of the law", "--block law")
    called = identifier(
        options.name or options.scene.stem + ("" if options.block == "law" else f"_{options.block}")
    )
    if options.name and options.name != called:
        allowed = "lower-case letters, digits and single underscores, a letter first; no word of Python"
        raise _refusal("--name", options.name, "it names functions in every language", allowed)
    scene = liquid_ring_scene(load_scene(options.scene))
    with staged(options.out) as folder:
        compact: CompactLaw | None = None
        if options.block == "controller" and scene.controller.kind != "law_based":
            block = controller_block(scene)
        else:
            with activity("export", "calibrating ..."):
                law = chamber_and_law(scene)[1]
                if options.block == "controller":
                    block = controller_block(scene, law)
                elif options.block == "disc":
                    block = disc_block(scene, law)
                else:
                    compact = compact_law(scene=scene, law=law)
                    block = law_block(compact)
        if options.to == "csv" and compact is not None:
            pressure = applied_pressure(scene.gas)
            highest = _GRID_END * pressure if pressure > 0 else _GRID_END_WITHOUT_PRESSURE_PA
            texts = csv_files(compact, called, points=options.points or _GRID_POINTS, highest=highest)
            files = {file: text.encode() for file, text in texts.items()}
        elif options.to == "fmi2" or options.to == "fmi3":
            with activity("export", "compiling ..."):
                unit, runs = fmu_bytes(block, called, options.to, all_systems=cross)
                if not runs:
                    print_message("no C compiler here: the unit holds its source alone")
            files = {f"{called}.fmu": unit}
        else:
            writers = {"c": c_files, "st": st_files, "python": python_files, "js": js_files}
            texts = writers[options.to](block, called)
            files = {file: text.encode() for file, text in texts.items()}
        for file, content in files.items():
            (folder / file).write_bytes(content)
    for file in files:
        results_console().print(str(options.out / file), highlight=False)
    exact = f", velocities within {compact.departure:.1e} of the calibrated law's" if compact else ""
    print_message(f"{block.size} bytes of constants{exact}")
    return 0


def _refusal(option: str, value: object, problem: str, allowed: str) -> SceneError:
    return SceneError.of_option(option=option, value=value, problem=problem, allowed=allowed)
