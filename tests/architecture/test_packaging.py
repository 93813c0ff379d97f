"""Package map, links, data files, version and locks agree everywhere; set-up says what is missing."""

from __future__ import annotations

import fnmatch
import json
import re
import subprocess
import sys
import tomllib
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import pytest
from other_pythons import supported
from packaging.requirements import Requirement
from packaging.specifiers import SpecifierSet
from packaging.utils import canonicalize_name

import ringbalance


@pytest.fixture(scope="module")
def project(root: Path) -> Mapping[str, Any]:
    return tomllib.loads((root / "pyproject.toml").read_text())


def packages_below(folder: Path, *, place: Path) -> set[str]:
    """Dotted package names below a folder: its folders with an `__init__.py`, named from the place given."""
    return {
        ".".join(("ringbalance", *path.parent.relative_to(place).parts))
        for path in folder.rglob("__init__.py")
        if not any(above.is_symlink() for above in path.relative_to(place).parents)
    }


def missing_data(folder: Path, patterns: list[str]) -> list[str]:
    """Files of a package folder, sub-packages left out, that neither the package nor its data bring along."""
    packages = [path.parent for path in folder.rglob("__init__.py") if path.parent != folder]
    return [
        str(path.relative_to(folder))
        for path in sorted(folder.rglob("*"))
        if path.is_file()
        and path.suffix != ".pyc"
        and (path.suffix != ".py" or path.parent != folder)
        and not any(package in path.parents for package in packages)
        and not any(fnmatch.fnmatch(str(path.relative_to(folder)), pattern) for pattern in patterns)
    ]


def lock_faults(text: str) -> list[str]:
    """Lines of a lock file that name a host, or requirements without a hash."""
    entries = text.replace("\\\n", " ").splitlines()
    found = [f"a host: {entry}" for entry in entries if "://" in entry or entry.startswith("-")]
    found += [f"no hash: {entry}" for entry in entries if entry.strip() and "--hash=sha256:" not in entry]
    return found


def pins(text: str, version: str) -> dict[str, list[str]]:
    """Versions that a lock file pins for a minor version of Python, by normalised name."""
    environment = {"python_version": version, "python_full_version": f"{version}.0"}
    result: dict[str, list[str]] = {}
    for line in text.replace("\\\n", " ").splitlines():
        entry = Requirement(line.split("--hash")[0])
        if entry.marker is None or entry.marker.evaluate(environment):
            result.setdefault(canonicalize_name(entry.name), []).append(str(entry.specifier).lstrip("="))
    return result


def pin_errors(text: str, version: str, requirements: list[str]) -> list[str]:
    """Requirements that a lock file does not pin exactly once, within bounds, for a version of Python."""
    pinned = pins(text, version)
    errors = [f"{name} pinned as {found}" for name, found in pinned.items() if len(found) != 1]
    for requirement in map(Requirement, requirements):
        found = pinned.get(canonicalize_name(requirement.name), [])
        if not found or not all(requirement.specifier.contains(one) for one in found):
            errors.append(f"{requirement} is not met by {found}")
    return errors


def test_the_package_list_is_the_folders(
    project: Mapping[str, Any], root: Path, linked: tuple[str, ...]
) -> None:
    within = packages_below(root / "ringbalance", place=root / "ringbalance")
    folders = within.union(*(packages_below(root / name, place=root) for name in linked))
    assert sorted(project["tool"]["setuptools"]["packages"]) == sorted(folders)


def test_every_folder_at_the_root_is_mapped_and_linked(
    project: Mapping[str, Any], root: Path, linked: tuple[str, ...]
) -> None:
    assert project["tool"]["setuptools"]["package-dir"] == {f"ringbalance.{name}": name for name in linked}
    # A source distribution has no links: pip follows the map alone.
    if (root / ".git").exists():
        links = {path.name: path.readlink() for path in (root / "ringbalance").iterdir() if path.is_symlink()}
        assert links == {name: Path("..") / name for name in linked}


def test_every_data_file_is_packaged(project: Mapping[str, Any], root: Path, linked: tuple[str, ...]) -> None:
    settings = project["tool"]["setuptools"]
    for package in settings["packages"]:
        if package != "ringbalance":
            parts = package.split(".")
            folder = root.joinpath(*parts[1:] if parts[1] in linked else parts)
            patterns = settings["package-data"].get(package, []) + settings["package-data"].get("*", [])
            assert missing_data(folder, patterns) == [], package


def test_a_forgotten_data_file_is_seen(tmp_path: Path) -> None:
    names = ("data/a.csv", "data/b.txt", "inner/__init__.py", "inner/c.csv", "module.py", "loose/case.py")
    for name in names:
        (tmp_path / name).parent.mkdir(exist_ok=True)
        (tmp_path / name).touch()
    assert missing_data(tmp_path, ["data/*.csv"]) == ["data/b.txt", "loose/case.py"]


def test_one_version_everywhere(project: Mapping[str, Any], root: Path) -> None:
    version = project["project"]["version"]
    assert ringbalance.__version__ == version
    assert f"\nversion: {version}\n" in (root / "CITATION.cff").read_text()
    assert f"\n## [{version}]" in (root / "CHANGELOG.md").read_text()
    assert json.loads((root / "codemeta.json").read_text())["version"] == version


def test_each_licence_has_its_text_and_each_transcription_its_licence(
    project: Mapping[str, Any], root: Path
) -> None:
    annotations = tomllib.loads((root / "REUSE.toml").read_text())["annotations"]
    licences = {entry["SPDX-License-Identifier"] for entry in annotations}
    assert {path.stem for path in (root / "LICENSES").iterdir()} == licences
    assert set(project["project"]["license"].split(" AND ")) == licences
    assert {*re.findall(r"license: (\S+)", (root / "CITATION.cff").read_text())} == licences
    named = json.loads((root / "codemeta.json").read_text())["license"]
    assert {each.rpartition("/")[2] for each in named} == licences
    assert (root / "LICENSE").read_text() == (root / "LICENSES/BSD-3-Clause.txt").read_text()
    stated = {
        str(path.relative_to(root)): match[1].replace(" ", "-")
        for path in sorted((root / "verification/validation/data").glob("*.csv"))
        if (match := re.search(r'^# licence = ".*the transcription (.*)"$', path.read_text(), re.MULTILINE))
    }
    annotated = {path: e["SPDX-License-Identifier"] for e in annotations[1:] for path in e["path"]}
    assert stated == annotated != {}


@pytest.mark.parametrize("name", ["lock.txt", "lock-all.txt", "bootstrap.txt"])
def test_locks_have_hashes_and_no_host(root: Path, name: str) -> None:
    text = (root / "requirements" / name).read_text()
    assert text.count("==") >= 2
    assert lock_faults(text) == []


def test_locks_serve_every_supported_python(project: Mapping[str, Any], root: Path) -> None:
    requirements = project["project"]["dependencies"] + project["dependency-groups"]["dev"]
    extras = [one for extra in project["project"]["optional-dependencies"].values() for one in extra]
    versions = supported(project["project"]["classifiers"])
    assert len(versions) >= 3
    assert all(f"{version}.0" in SpecifierSet(project["project"]["requires-python"]) for version in versions)
    for version in versions:
        text, text_all = ((root / "requirements" / name).read_text() for name in ("lock.txt", "lock-all.txt"))
        assert pin_errors(text, version, requirements) == [], version
        assert pin_errors(text_all, version, requirements + extras) == [], version
        bootstrap = (root / "requirements/bootstrap.txt").read_text()
        assert pin_errors(bootstrap, version, project["build-system"]["requires"]) == [], version


@pytest.mark.parametrize(
    "text",
    [
        "numpy==2.0\n",
        "--index-url https://host/simple\nnumpy==2.0 --hash=sha256:aa\n",
    ],
)
def test_a_host_and_a_missing_hash_are_seen(text: str) -> None:
    assert len(lock_faults(text)) >= 1


@pytest.mark.parametrize(
    "pinned",
    [
        "numpy==1.9",
        "numpy==2.4\nnumpy==2.5 ; python_version < '3.13'",
        "numpy==2.4 ; python_version < '3.12'",
    ],
)
def test_a_wrong_pin_is_seen(pinned: str) -> None:
    assert len(pin_errors(pinned, "3.12", ["NumPy>=2.0"])) >= 1


@pytest.mark.parametrize("sudo", [True, False])
def test_the_line_to_run_says_sudo_only_where_it_exists(root: Path, tmp_path: Path, sudo: bool) -> None:
    for name, line in (("id", "echo 1000"), *([("sudo", "exit 1")] if sudo else [])):
        (tmp_path / name).write_text(f"#!/bin/sh\n{line}\n")
        (tmp_path / name).chmod(0o755)
    command = ["/bin/sh", "-c", ". tools/debian_packages.sh; debian_packages 'a thing' some-package"]
    result = subprocess.run(
        command, cwd=root, env={"PATH": str(tmp_path)}, capture_output=True, text=True, check=False
    )
    assert result.returncode == 1
    assert "a thing is missing" in result.stdout
    assert ("sudo" in result.stdout) == sudo
    assert ("as root" in result.stdout) != sudo
    assert "apt-get install -y --no-install-recommends some-package" in result.stdout


def test_no_room_is_imported_by_its_folder_s_name(root: Path, linked: tuple[str, ...]) -> None:
    code = """
import importlib, sys
for room in sys.argv[1:]:
    try:
        importlib.import_module(room)
    except ImportError as error:
        assert f"import ringbalance.{room}, not {room}" in str(error), error
    else:
        raise AssertionError(room)
"""
    command = [sys.executable, "-P", "-c", f"import sys; sys.path.insert(0, {str(root)!r})\n{code}", *linked]
    result = subprocess.run(command, capture_output=True, text=True, check=False)
    assert result.returncode == 0, result.stderr
