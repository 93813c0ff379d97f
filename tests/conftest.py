"""Shared by all tests: one thread, no display, Hypothesis examples that are the same on every run."""

from __future__ import annotations

import os
import subprocess
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Final, cast

import ball_balancer
import pytest
from hypothesis import settings

import ringbalance
from ringbalance.scene import registry

if TYPE_CHECKING:
    from ringbalance.scene.models import Scene

# None of the imports above brings numpy or matplotlib; both read these when they are imported.
for _name in ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ.setdefault(_name, "1")
os.environ["MPLBACKEND"] = "Agg"

settings.register_profile("ci", derandomize=True, deadline=None, max_examples=25, database=None)
settings.register_profile("dev", deadline=None, max_examples=200)
settings.load_profile(os.environ.get("HYPOTHESIS_PROFILE", "ci"))

_FOLDER: Final = Path(__file__).parent
_ROOT: Final = _FOLDER.parent.resolve()
_FIRST: Final = (
    "verification/test_cases.py",
    "physics",
    "mesh",
    "reduced_model",
    "reports/test_report.py",
    "reports/test_eccentric_report.py",
    "controller",
    "identification",
    "design",
    "reports",
    "verification",
)
"""Beside the cases, which take longest and compile most, what compiles nothing; last what is short."""


def _place(item: pytest.Item) -> int:
    path = item.path.relative_to(_FOLDER)
    names = {path.as_posix(), path.parts[0]}
    return next((index for index, name in enumerate(_FIRST) if name in names), len(_FIRST))


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Modules in the order in which processes take them: nothing is compiled in two of them at once."""
    items.sort(key=_place)


@pytest.fixture(scope="session")
def paper_scene() -> Scene:
    """The liquid-ring paper's disc, as bundled."""
    return cast("Scene", ringbalance.load_scene(ringbalance.bundled_scene("liquid_ring_paper")))


@pytest.fixture(scope="module")
def ball_registered() -> Iterator[None]:
    """The balancer of docs/examples, known while the tests of one module run."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(registry, "_PATHS", dict(registry._PATHS))
        ball_balancer.register()
        yield


@pytest.fixture(scope="session")
def tracked_files() -> tuple[Path, ...]:
    """Files that git tracks or would track; symbolic links are left out."""
    command = [
        "git",
        "-c",
        "safe.directory=*",
        "ls-files",
        "--cached",
        "--others",
        "--exclude-standard",
        "-z",
    ]
    listing = subprocess.run(command, cwd=_ROOT, capture_output=True, text=True, check=False)
    if listing.returncode != 0:
        pytest.skip(f"not a git checkout: {listing.stderr.strip()}")
    paths = [_ROOT / name for name in sorted(set(listing.stdout.split("\0"))) if name]
    return tuple(path for path in paths if path.is_file() and not path.is_symlink())
