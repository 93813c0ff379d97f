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
from ringbalance.results.rows import Finding
from ringbalance.scene.faults import SceneError
from ringbalance.scene.loader import load_scene
from ringbalance.scene.models import Scene
from ringbalance.scene.narrowing import liquid_ring_scene
from ringbalance.scene.origins import SceneFile
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
    masses = scene.balancer == "eccentric_mass"
    if masses and cross:
        problem = "blocks of eccentric masses need sin and cos of each system's own library"
        allowed = "no such option, or a build from the unit's sources there"
        raise _refusal("--all-systems", True, problem, allowed)
    if masses and options.points is not None:
        raise _refusal("--points", options.points, "the matrices of a loop are no grid", "none")
    if options.to == "csv" and kind != kinds[0]:
        raise _refusal("--block", kind, f"csv is a table of the {kinds[0]}", f"--block {kinds[0]}")
    called = identifier(options.name or options.scene.stem + ("" if kind == "law" else f"_{kind}"))
    if options.name and options.name != called:
        allowed = "lower-case letters, digits and single underscores, a letter first; no word of Python"
        raise _refusal("--name", options.name, "it names functions in every language", allowed)
    with staged(options.out) as folder:
        # The masses' blocks load the compiler.
        block, compact = (
            (imported("ringbalance.export.masses:BLOCKS")[kind](scene), None)
            if masses
            else _ring_block(liquid_ring_scene(scene), kind)
        )
        if options.to in ("fmi2", "fmi3"):
            with activity("export", "compiling ..."):
                unit, runs = fmu_bytes(block, called, options.to, all_systems=cross)
                if not runs:
                    print_message("no C compiler here: the unit holds its source alone")
            files = {f"{called}.fmu": unit}
        else:
            writers = {"c": c_files, "st": st_files, "python": python_files, "js": js_files}
            if options.to != "csv":
                texts = writers[options.to](block, called)
            elif compact is None:
                loop = imported("ringbalance.controller.eccentric_mass.loop_matrices:eccentric_loop")(scene)
                texts = {f"{called}.csv": loop.csv}
            else:
                pressure = max(applied_pressure(liquid_ring_scene(scene).gas), 0.0)
                end = _GRID_END * pressure or _GRID_END_WITHOUT_PRESSURE_PA
                texts = csv_files(compact, called, points=options.points or _GRID_POINTS, highest=end)
            files = {file: text.encode() for file, text in texts.items()}
        for file, content in files.items():
            (folder / file).write_bytes(content)
    _warn_of_loop(scene, kind)
    for file in files:
        results_console().print(str(options.out / file), highlight=False)
    exact = f", velocities within {compact.departure:.1e} of the calibrated law's" if compact else ""
    print_message(f"{block.size} bytes of constants{exact}")
    return 0


def _warn_of_loop(scene: SceneFile, kind: str) -> None:
    """Say that the loop of an exported controller's settings is unstable or close to it."""
    if kind != "controller":
        return
    if scene.balancer == "eccentric_mass":
        for each in imported("ringbalance.controller.eccentric_mass.run_record:unstable_loops")(scene):
            print_message(each.text)
        return
    ring = liquid_ring_scene(scene)
    if ring.controller.kind != "target_vector":
        return
    law = chamber_and_law(ring, checked=False, varied=False)[1]
    loop = imported("ringbalance.controller.liquid_ring.linear_loop:linear_loop")(ring, flow_law=law)
    if loop.zone == "D":
        margins = {"gain": loop.margins.gain_factor, "phase": loop.margins.phase}
        state = "near instability" if loop.stable else "unstable"
        for each in (Finding(code="loop_zone_d", values={"state": state, **margins}), *loop.findings):
            print_message(each.text)


def _ring_block(scene: Scene, kind: str) -> tuple[Block, CompactLaw | None]:
    """Block of a liquid ring, and the law that it is."""
    if kind == "controller" and scene.controller.kind != "law_based":
        return controller_block(scene), None
    with activity("export", "calibrating ..."):
        law = chamber_and_law(scene)[1]
        if kind != "law":
            return (controller_block if kind == "controller" else disc_block)(scene, law), None
        compact = compact_law(scene=scene, law=law)
    return law_block(compact), compact


def _refusal(option: str, value: object, problem: str, allowed: str) -> SceneError:
    return SceneError.of_option(option=option, value=value, problem=problem, allowed=allowed)
