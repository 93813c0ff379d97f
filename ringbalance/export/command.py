"""The command `ringbalance export`."""

from __future__ import annotations

from importlib.util import find_spec
from types import MappingProxyType, SimpleNamespace
from typing import Final

from ringbalance.export.blocks import Block, controller_block, disc_block, law_block
from ringbalance.export.compact import CompactLaw, compact_law
from ringbalance.export.fmu import fmu_bytes
from ringbalance.export.hosts import c_files, csv_files, identifier, js_files, python_files, st_files
from ringbalance.export.libraries import EXTRA
from ringbalance.physics.gas import applied_pressure
from ringbalance.reduced_model.calibration import chamber_and_law
from ringbalance.scene.faults import SceneError
from ringbalance.scene.loader import load_scene
from ringbalance.scene.models import Scene
from ringbalance.scene.narrowing import AnyScene, liquid_ring_scene
from ringbalance.scene.platform.files import staged
from ringbalance.scene.platform.terminal import activity, print_message, results_console
from ringbalance.scene.registry import imported

HOSTS: Final = MappingProxyType({"simulink": "fmi2", "openmodelica": "fmi2", "twincat": "st"})
"""Format by name of a program that takes it."""
_KINDS: Final = {"liquid_ring": ("law", "disc", "controller"), "eccentric_mass": ("controller", "plant")}
"""Blocks of each balancer, the default first."""
_GRID_POINTS: Final = 41
"""Points on each axis of a grid."""
_GRID_END: Final = 1.5
"""Gas pressure at which a grid ends, over the scene's."""
_GRID_END_WITHOUT_PRESSURE_PA: Final = 1e6
"""Gas pressure at which the grid of a scene without one ends."""


def export(options: SimpleNamespace) -> int:
    """Run the command `export`: a block of the scene's balancer for another program."""
    cross = options.all_systems
    options.to = HOSTS.get(options.to, options.to)
    if options.points is not None and options.to != "csv":
        raise _refusal("--points", options.points, f"{options.to} has no grid", "--to csv")
    if cross and options.to not in ("fmi2", "fmi3"):
        raise _refusal("--all-systems", True, f"{options.to} has no libraries", "--to fmi2 or fmi3")
    if cross and find_spec("ziglang") is None:
        problem = "the cross-compiler is not installed"
        raise _refusal("--all-systems", True, problem, f'pip install "ringbalance[{EXTRA}]"')
    scene = load_scene(options.scene)
    kinds = _KINDS.get(scene.balancer, _KINDS["liquid_ring"])
    kind = options.block or kinds[0]
    if kind not in kinds:
        raise _refusal("--block", kind, f"a scene of {scene.balancer} has none", " or ".join(kinds))
    if cross and scene.balancer == "eccentric_mass":
        problem = "blocks of eccentric masses need sin and cos of each system's own library"
        raise _refusal(
            "--all-systems", True, problem, "no such option, or a build from the unit's sources there"
        )
    if options.to == "csv" and kind != kinds[0]:
        raise _refusal("--block", kind, f"csv is a table of the {kinds[0]}", f"--block {kinds[0]}")
    called = identifier(options.name or options.scene.stem + ("" if kind == "law" else f"_{kind}"))
    if options.name and options.name != called:
        allowed = "lower-case letters, digits and single underscores, a letter first; no word of Python"
        raise _refusal("--name", options.name, "it names functions in every language", allowed)
    with staged(options.out) as folder:
        compact: CompactLaw | None = None
        if scene.balancer == "eccentric_mass":
            texts, block = _of_masses(scene, kind, options, called)
        else:
            texts, block, compact = _of_ring(liquid_ring_scene(scene), kind, options, called)
        if options.to == "fmi2" or options.to == "fmi3":
            with activity("export", "compiling ..."):
                unit, runs = fmu_bytes(block, called, options.to, all_systems=cross)
                if not runs:
                    print_message("no C compiler here: the unit holds its source alone")
            files = {f"{called}.fmu": unit}
        else:
            if options.to != "csv":
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


def _of_ring(
    scene: Scene, kind: str, options: SimpleNamespace, called: str
) -> tuple[dict[str, str], Block, CompactLaw | None]:
    """Table, if that is what is asked for, block, and the law that it is."""
    if kind == "controller" and scene.controller.kind != "law_based":
        return {}, controller_block(scene), None
    with activity("export", "calibrating ..."):
        law = chamber_and_law(scene)[1]
        if kind != "law":
            return {}, (controller_block if kind == "controller" else disc_block)(scene, law), None
        compact = compact_law(scene=scene, law=law)
    texts: dict[str, str] = {}
    if options.to == "csv":
        pressure = applied_pressure(scene.gas)
        highest = _GRID_END * pressure if pressure > 0 else _GRID_END_WITHOUT_PRESSURE_PA
        texts = csv_files(compact, called, points=options.points or _GRID_POINTS, highest=highest)
    return texts, law_block(compact), compact


def _of_masses(
    scene: AnyScene, kind: str, options: SimpleNamespace, called: str
) -> tuple[dict[str, str], Block]:
    """Table of the loop's matrices, if that is what is asked for, and block."""
    if options.points is not None:
        raise _refusal("--points", options.points, "the matrices of a loop are no grid", "none")
    # These load the compiler.
    block: Block = imported("ringbalance.export.masses:BLOCKS")[kind](scene)
    if options.to != "csv":
        return {}, block
    loop = imported("ringbalance.controller.eccentric_mass.loop_matrices:eccentric_loop")(scene)
    return {f"{called}.csv": loop.csv}, block


def _refusal(option: str, value: object, problem: str, allowed: str) -> SceneError:
    return SceneError.of_option(option=option, value=value, problem=problem, allowed=allowed)
