"""Random scenes over the allowed ranges: a strict document and a documented exit code, whatever comes."""

from __future__ import annotations

import json
import math
import random
from collections.abc import Iterator
from functools import cache
from pathlib import Path
from typing import Any

import pytest
from quantities import by_key, half_width

from ringbalance.cli import main
from ringbalance.mesh.geometry import half_angle, surface_radius
from ringbalance.scene import SceneError, liquid_ring_scene, scene_from
from ringbalance.scene.models import Scene

pytestmark = pytest.mark.faults

SCENES = 25
SEED = 41


def between(draw: random.Random, low: float, high: float) -> float:
    """A number of which every decade is as likely."""
    return math.exp(draw.uniform(math.log(low), math.log(high)))


def disc_of(draw: random.Random) -> dict[str, Any]:
    """Discs of a centimetre to ten metres, chambers of any width, rings of any depth."""
    outer = between(draw, 0.005, 10.0)
    inner = outer * (1 - draw.choice([between(draw, 1e-6, 0.9), draw.uniform(0.05, 0.8)]))
    chambers = draw.choice([2, 4, 6, 26])
    angle = 360 / chambers * draw.choice([1.0, between(draw, 1e-4, 1.0)])
    closed = inner * math.sin(math.radians(min(angle, 180.0)) / 2)
    return {
        "outer_radius": f"{1e3 * outer!r} mm",
        "inner_radius": f"{1e3 * inner!r} mm",
        "axial_width": f"{1e3 * outer * between(draw, 0.01, 3.0)!r} mm",
        "central_angle": f"{angle!r} deg",
        "chambers": chambers,
        "plate_thickness": f"{1e3 * closed * draw.choice([0.0, draw.uniform(0.0, 0.999)])!r} mm",
        "max_fill_ratio": draw.choice([between(draw, 1e-8, 1.0), draw.uniform(0.05, 1.0)]),
    }


def document_of(draw: random.Random) -> dict[str, dict[str, Any]]:
    """A scene of which much does not fit together; those that do are kept."""
    disc = disc_of(draw)
    outer = float(disc["outer_radius"].split()[0])
    speed = between(draw, 1.0, 1e5)
    noise, lag = draw.choice([0.0, between(draw, 1e-5, 1.0)]), draw.choice([0.0, between(draw, 1e-5, 0.1)])
    rim = min(1000 * (speed * outer / 1e3) ** 2, 1e9)
    return {
        "disc": disc,
        "liquid": {
            "density": f"{between(draw, 1e-2, 1e5)} kg/m^3",
            "kinematic_viscosity": f"{between(draw, 1e-9, 1.0)} m^2/s",
        },
        "tube": {
            "bore": f"{outer * between(draw, 1e-4, 0.3)!r} mm",
            "length": f"{outer * between(draw, 2.0, 50.0)!r} mm",
            "roughness": f"{between(draw, 1e-4, 1.0)} um",
            "hump_gas": draw.choice(["vented", "trapped"]),
            "extra_loss": between(draw, 1e-6, 1e6),
        },
        "gas": {
            "pressure": f"{draw.choice([0.0, between(draw, 0.01, 10.0)]) * rim} Pa",
            "valve_lag": f"{lag} s",
        },
        "environment": {"shaft": draw.choice(["horizontal", "horizontal", "horizontal", "vertical"])},
        "rotor": {
            "speed": f"{speed} rad/s",
            "influence_coefficient": f"{between(draw, 1e-6, 10.0)} um/(g*mm)",
            "initial_vibration": {"amplitude": f"{between(draw, 0.01, 1e4)} um", "phase": "90 deg"},
        },
        "sensor": {"amplitude_noise": f"{noise} um"},
        "controller": {
            "kind": draw.choice(["target_vector", "trial", "law_based"]),
            "limit": f"{noise + between(draw, 1e-3, 10.0)} um",
            "period": f"{lag + between(draw, 0.05, 10.0)} s",
        },
        "uncertainty": {key: f"{between(draw, 0.01, 20.0)} %" for key in ("outer_radius", "bore", "speed")},
        "run": {"time_limit": "20 s"},
        "accuracy": {"tolerance": between(draw, 1e-2, 0.5)},
    }


def toml_of(value: Any) -> str:
    """One value; a string needs no escapes here."""
    if isinstance(value, dict):
        return "{ " + ", ".join(f"{key} = {toml_of(item)}" for key, item in value.items()) + " }"
    return f'"{value}"' if isinstance(value, str) else repr(value)


@cache
def scenes() -> list[tuple[str, Scene]]:
    """The first scenes of the seed that load, with their texts."""
    draw = random.Random(SEED)
    loaded: list[tuple[str, Scene]] = []
    while len(loaded) < SCENES:
        tables = document_of(draw)
        text = "\n".join(
            f"[{table}]\n" + "\n".join(f"{key} = {toml_of(value)}" for key, value in content.items())
            for table, content in tables.items()
        )
        try:
            scene = liquid_ring_scene(scene_from(content=text.encode(), file="random.toml"))
        except SceneError:
            continue
        loaded.append((text, scene))
    return loaded


def numbers(value: Any, path: str = "") -> Iterator[tuple[str, float]]:
    """Every number of a document with where it stands."""
    if isinstance(value, dict):
        for key, item in value.items():
            yield from numbers(item, f"{path}.{key}")
    elif isinstance(value, list):
        for item in value:
            yield from numbers(item, path)
    elif isinstance(value, int | float):
        yield path, float(value)


@pytest.mark.parametrize("number", range(SCENES))
def test_a_random_scene_is_answered(number: int, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    text, scene = scenes()[number]
    file = tmp_path / "random.toml"
    file.write_text(text)
    for command in ("calibrate", "simulate"):
        code = main([command, str(file), "--json"])
        shown = capsys.readouterr()
        if code == 2:
            assert "random.toml: [" in shown.err
            assert not shown.out
            continue
        assert code in ((0,) if command == "calibrate" else (0, 1))
        document = json.loads(shown.out, parse_constant=pytest.fail)
        assert all(math.isfinite(value) for _, value in numbers(document))
        assert all(value >= 0 for path, value in numbers(document) if "uncertainty" in path)
        if command == "calibrate":
            a = float(surface_radius(disc=scene.disc, fill_ratio=scene.disc.max_fill_ratio / 2))
            alpha = float(half_angle(disc=scene.disc, radius=a))
            lever, exact = by_key(document)["lambda"], 2 * a * math.sin(alpha) / alpha
            width = half_width(lever) + scene.tolerance * exact
            assert abs(lever["value"] - exact) <= width
