"""The package map, the links, the data files, the version and the locks say the same thing everywhere."""

from __future__ import annotations

import fnmatch
import re
import tomllib
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import pytest

import ringbalance

REQUIREMENT = re.compile(r"^([A-Za-z0-9._-]+)==")


@pytest.fixture(scope="module")
def project(root: Path) -> Mapping[str, Any]:
    return tomllib.loads((root / "pyproject.toml").read_text())


def folders_with_code(root: Path, room: str) -> set[str]:
    """Dotted package names below one top folder, as its files have it."""
    return {
        ".".join(("ringbalance", *path.parent.relative_to(root).parts))
        for path in (root / room).rglob("*.py")
    }


def missing_data(folder: Path, patterns: list[str]) -> list[str]:
    """Files of a package folder, sub-packages left out, that no package-data pattern brings along."""
    packages = [path.parent for path in folder.rglob("*.py") if path.parent != folder]
    return [
        str(path.relative_to(folder))
        for path in sorted(folder.rglob("*"))
        if path.is_file()
        and path.suffix not in {".py", ".pyc"}
        and not any(package in path.parents for package in packages)
        and not any(fnmatch.fnmatch(str(path.relative_to(folder)), pattern) for pattern in patterns)
    ]


def lock_faults(text: str) -> list[str]:
    """Lines of a lock file that name a host, or requirements without a hash."""
    entries = text.replace("\\\n", " ").splitlines()
    found = [f"a host: {entry}" for entry in entries if "://" in entry or entry.startswith("-")]
    found += [f"no hash: {entry}" for entry in entries if entry.strip() and "--hash=sha256:" not in entry]
    return found


def locked(text: str) -> set[str]:
    """Names of the requirements in a lock file, normalised."""
    return {
        match[1].lower().replace("_", "-") for line in text.splitlines() if (match := REQUIREMENT.match(line))
    }


def required(requirements: list[str]) -> set[str]:
    """Names of requirements such as `numpy>=2.0`, normalised."""
    return {re.split(r"[<>=!~\[; ]", text)[0].lower().replace("_", "-") for text in requirements}


def test_the_package_list_is_the_folders(
    project: Mapping[str, Any], root: Path, room_order: tuple[str, ...]
) -> None:
    folders = {"ringbalance"}.union(*(folders_with_code(root, room) for room in (*room_order, "scenes")))
    assert sorted(project["tool"]["setuptools"]["packages"]) == sorted(folders)


def test_every_room_is_mapped_and_linked(
    project: Mapping[str, Any], root: Path, room_order: tuple[str, ...]
) -> None:
    mapped = project["tool"]["setuptools"]["package-dir"]
    for room in (*room_order, "scenes"):
        assert mapped[f"ringbalance.{room}"] == room
        assert (root / "ringbalance" / room).readlink() == Path("..") / room


def test_every_data_file_is_packaged(project: Mapping[str, Any], root: Path) -> None:
    settings = project["tool"]["setuptools"]
    for package in settings["packages"]:
        if package != "ringbalance":
            folder = root.joinpath(*package.split(".")[1:])
            patterns = settings["package-data"].get(package, []) + settings["package-data"].get("*", [])
            assert missing_data(folder, patterns) == [], package


def test_a_forgotten_data_file_is_seen(tmp_path: Path) -> None:
    for name in ("data/a.csv", "data/b.txt", "inner/module.py", "inner/c.csv"):
        (tmp_path / name).parent.mkdir(exist_ok=True)
        (tmp_path / name).touch()
    assert missing_data(tmp_path, ["data/*.csv"]) == ["data/b.txt"]


def test_one_version_everywhere(project: Mapping[str, Any], root: Path) -> None:
    version = project["project"]["version"]
    assert ringbalance.__version__ == version
    assert f"\nversion: {version}\n" in (root / "CITATION.cff").read_text()
    assert f"\n## [{version}]" in (root / "CHANGELOG.md").read_text()


@pytest.mark.parametrize("name", ["lock.txt", "lock-all.txt", "bootstrap.txt"])
def test_locks_have_hashes_and_no_host(root: Path, name: str) -> None:
    text = (root / "requirements" / name).read_text()
    assert len(locked(text)) >= 2
    assert lock_faults(text) == []


def test_locks_hold_what_the_project_asks_for(project: Mapping[str, Any], root: Path) -> None:
    run = required(project["project"]["dependencies"]) | required(project["dependency-groups"]["dev"])
    extras = {
        name for extra in project["project"]["optional-dependencies"].values() for name in required(extra)
    }
    assert run - locked((root / "requirements/lock.txt").read_text()) == set()
    assert run | extras <= locked((root / "requirements/lock-all.txt").read_text())


@pytest.mark.parametrize(
    "text",
    [
        "numpy==2.0\n",
        "--index-url https://host/simple\nnumpy==2.0 --hash=sha256:aa\n",
        "a @ https://h/a.whl --hash=sha256:a",
    ],
)
def test_lock_faults_are_seen(text: str) -> None:
    assert lock_faults(text) != []


def test_a_sound_lock_is_let_through() -> None:
    text = "numpy==2.0 ; python_version < '3.12' \\\n    --hash=sha256:aa \\\n    --hash=sha256:bb\n"
    assert lock_faults(text) == []
    assert locked(text) == {"numpy"}
    assert required(["Scikit_Fem[all]>=12"]) == {"scikit-fem"}
