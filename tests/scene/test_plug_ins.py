"""Balancers of other packages: loaded for their own scenes alone; a broken one takes nothing else down."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest
from own_balancers import EXAMPLE, described, install_balls

SAY = """
import sys
import ringbalance as rb
try:
    print(rb.load_scene(sys.argv[1]).balancer, "loaded")
    rb.tune(rb.load_scene(sys.argv[1])) if len(sys.argv) > 2 else None
except rb.SceneError as error:
    print(error)
print(sorted({"ball_balancer", "broken", "importlib.metadata"} & set(sys.modules)))
"""
KIND = "scene='ball_balancer.scene_keys:KIND'"
CLASS = "balancer='ball_balancer.balancer:BallBalancer'"


def said(folder: Path, *words: str) -> list[str]:
    """Lines of a fresh interpreter that loads a scene with the packages of a folder installed."""
    environment = {**os.environ, "PYTHONPATH": str(folder), "PYTHONDONTWRITEBYTECODE": "1"}
    child = subprocess.run(
        [sys.executable, "-c", SAY, *words], env=environment, capture_output=True, text=True, check=False
    )
    assert child.returncode == 0, child.stderr
    return child.stdout.splitlines()


@pytest.fixture
def beside(tmp_path: Path) -> Path:
    folder = tmp_path / "site"
    install_balls(folder)
    return folder


def scene(tmp_path: Path, balancer: str) -> str:
    path = tmp_path / "my.toml"
    text = EXAMPLE.decode().replace('balancer = "ball"', f'balancer = "{balancer}"')
    path.write_text(text)
    return str(path)


def test_an_installed_balancer_is_loaded_for_its_scene(beside: Path, tmp_path: Path) -> None:
    assert said(beside, scene(tmp_path, "ball"))[0] == "ball loaded"


def test_a_scene_of_the_program_loads_no_other_package(beside: Path) -> None:
    assert said(beside, "liquid_ring_paper") == ["liquid_ring loaded", "[]"]


def test_an_unknown_balancer_names_what_is_installed(beside: Path, tmp_path: Path) -> None:
    line, modules = said(beside, scene(tmp_path, "balls"))
    assert line.endswith(
        'my.toml: balancer = "balls": no balancer of this name is installed (did you mean "ball"?); '
        'allowed: "liquid_ring", "eccentric_mass", "ball" (of ball-balancer 1.0)'
    )
    assert "ball_balancer" not in modules


@pytest.mark.parametrize(
    ("code", "problem"),
    [
        ("import nothing_of_this_name", "ModuleNotFoundError: No module named 'nothing_of_this_name'"),
        ("raise SystemExit(3)", "SystemExit: 3"),
        ("", "AttributeError: module 'broken' has no attribute 'register'"),
        ("register = 3", "TypeError: 'int' object is not callable"),
        ("def register(): pass", "LookupError: broken:register registers no balancer of that name"),
        (
            f"def register(): rb.register('liquid_ring', {KIND}, {CLASS})",
            'ValueError: the name "liquid_ring" is taken by another balancer',
        ),
        (
            f"def register(): rb.register('trim', scene='broken:KIND', {CLASS})",
            "broken:KIND: AttributeError: module 'broken' has no attribute 'KIND'",
        ),
        (
            f"KIND = 3\ndef register(): rb.register('trim', scene='broken:KIND', {CLASS})",
            "its scene is no ringbalance.scene.kinds.SceneKind",
        ),
    ],
)
def test_a_broken_package_is_named_and_nothing_else_fails(
    beside: Path, tmp_path: Path, code: str, problem: str
) -> None:
    described(beside, "trim-weight", "0.1", {"trim": "broken:register"})
    (beside / "broken.py").write_text(f"import ringbalance as rb\n{code}\n")
    assert said(beside, scene(tmp_path, "trim"))[0] == (
        f'package trim-weight 0.1: its balancer "trim" cannot be used: {problem}; '
        "allowed: scenes of other balancers until that is mended"
    )
    assert said(beside, scene(tmp_path, "ball"))[0] == "ball loaded"
    assert said(beside, "six_chamber")[0] == "liquid_ring loaded"


@pytest.mark.parametrize(
    ("code", "problem"),
    [
        ("Balls = dict", "<class 'dict'> is no subclass of ringbalance.controller.balancer.Balancer"),
        (
            "from ringbalance.controller.balancer import Balancer\n"
            "class Balls(Balancer):\n"
            "    run = settings = on_scene = rotor = on_rotor = rows = lasting = None",
            "Balls has no history, quantities, sampling_time",
        ),
    ],
)
def test_a_class_of_another_type_is_named(beside: Path, tmp_path: Path, code: str, problem: str) -> None:
    for metadata in beside.glob("*.dist-info"):
        (metadata / "entry_points.txt").write_text("[ringbalance.balancers]\nball = broken:register\n")
    (beside / "broken.py").write_text(
        f"import ringbalance as rb\n{code}\n"
        f"def register(): rb.register('ball', {KIND}, balancer='broken:Balls')\n"
    )
    lines = said(beside, scene(tmp_path, "ball"), "tune")
    assert lines[0] == "ball loaded"
    assert lines[1].startswith(f'package ball-balancer 1.0: its balancer "ball" cannot be used: {problem};')


def test_one_name_in_two_packages_is_refused_with_both_named(beside: Path, tmp_path: Path) -> None:
    described(beside, "other-balls", "2.0", {"ball": "ball_balancer:register"})
    assert said(beside, scene(tmp_path, "ball"))[0].startswith(
        'package ball-balancer 1.0 and other-balls 2.0: its balancer "ball" cannot be used: '
        "ValueError: each of these packages brings a balancer of that name; uninstall the others;"
    )
