"""Compiled functions: the same numbers as the plain ones, kept, and made again when a source changes."""

from __future__ import annotations

import math
import os
import subprocess
import sys
from importlib.util import module_from_spec, spec_from_file_location
from pathlib import Path
from typing import Any, cast

import numpy as np
import pytest

from ringbalance.controller import compiled_loop, loop_records
from ringbalance.controller.eccentric_mass import memory
from ringbalance.controller.liquid_ring import plant
from ringbalance.reduced_model.injection import dynamics, moment
from ringbalance.reduced_model.law import flow_law
from ringbalance.scene.platform.compiled import _compiled_sources, compiled
from ringbalance.scene.platform.kept_code import KeptCode


def _sum_of_sines(values: np.ndarray[Any, np.dtype[np.float64]], factor: float) -> float:
    total = 0.0
    for value in values:
        total += math.sin(factor * value)
    return total


def test_compiled_function_gives_the_plain_ones_bits() -> None:
    values = np.linspace(-3.0, 7.0, 1001)
    fast = compiled(_sum_of_sines)
    assert fast(values, 1.7) == _sum_of_sines(values, 1.7)
    assert cast(Any, fast).py_func is _sum_of_sines


def test_division_by_zero_is_infinite_as_in_numpy() -> None:
    def share(part: float, whole: float) -> float:
        return part / whole

    assert compiled(share)(1.0, 0.0) == math.inf


def test_without_compilation_functions_stay_plain() -> None:
    text = (
        "from ringbalance.controller.eccentric_mass.plant import plant_step\n"
        "assert type(plant_step).__name__ == 'function'\n"
    )
    environment = {**os.environ, "NUMBA_DISABLE_JIT": "1"}
    subprocess.run([sys.executable, "-c", text], env=environment, check=True)


def test_what_compiled_code_alone_calls_has_no_machine_code_of_its_own() -> None:
    def squared(x: float) -> float:
        return x * x

    inner = cast(Any, compiled(squared))

    def doubled(x: float) -> float:
        return 2 * float(inner(x))

    outer = cast(Any, compiled(doubled))
    assert outer(3.0) == 18.0
    (within,) = inner._inner.overloads.values()
    (whole,) = outer.overloads.values()
    known = whole.library.codegen._engine.is_symbol_defined
    assert known(whole.fndesc.llvm_func_name)
    assert not known(within.fndesc.llvm_func_name)


PROGRAM = """
import numba
from numba.core import config
from ringbalance.scene.platform.compiled import compiled, _compiled_sources
from ringbalance.controller import compiled_loop
from ringbalance.reduced_model.injection import moment
before = config.CACHE_DIR
def twice(x):
    return 2 * x
fast = compiled(twice)
assert fast(2.0) == 4.0
assert config.CACHE_DIR == before
print(fast._cache.cache_path if hasattr(fast, "_cache") and fast._cache else "")
"""


def _run(tmp_path: Path, **more: str) -> str:
    script = tmp_path / "program.py"
    script.write_text(PROGRAM)
    done = subprocess.run(
        [sys.executable, str(script)],
        env={**os.environ, **more},
        capture_output=True,
        text=True,
        check=True,
        timeout=120,
    )
    return done.stdout.strip()


def test_every_compiled_functions_source_tells_stale_code() -> None:
    modules = (compiled_loop, moment)
    functions = [
        one.py_func for module in modules for one in vars(module).values() if hasattr(one, "py_func")
    ]
    files = {Path(function.__code__.co_filename).resolve() for function in functions}
    assert "moment.py" in {file.name for file in files}
    sources = {path.resolve() for path in _compiled_sources()}
    assert files <= sources
    # Compiled code has the values of constants in it.
    constants = (loop_records, dynamics, memory, plant, flow_law)
    assert {Path(str(module.__file__)).resolve() for module in constants} <= sources


@pytest.mark.parametrize(("name", "shared"), [("ringbalance.copied", True), ("copied", False)])
def test_copies_of_the_program_share_kept_code(tmp_path: Path, name: str, shared: bool) -> None:
    keys = set()
    for folder in ("first", "second"):
        (tmp_path / folder).mkdir()
        path = tmp_path / folder / "copied.py"
        path.write_text("def twice(x):\n    return 2 * x\n")
        spec = spec_from_file_location(name, path)
        assert spec is not None
        assert spec.loader is not None
        module = module_from_spec(spec)
        spec.loader.exec_module(module)
        keys.add(KeptCode(module.twice, "digest")._path("float64").name)
    assert (len(keys) == 1) is shared


def test_compiled_functions_are_kept_in_the_users_folder(tmp_path: Path) -> None:
    home = tmp_path / "kept"
    folder = _run(tmp_path, NUMBA_CACHE_DIR=str(home))
    assert folder.startswith(str(home / "ringbalance"))
    assert list(home.rglob("*.nbc")), "nothing was kept"


def test_a_folder_that_cannot_be_written_is_no_obstacle(tmp_path: Path) -> None:
    blocked = tmp_path / "file"
    blocked.write_text("not a folder")
    _run(tmp_path, NUMBA_CACHE_DIR=str(blocked))
    assert not list(tmp_path.rglob("*.nbc")), "nor may another folder take its place"
