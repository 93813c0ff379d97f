"""Whatever stands in a file, loading it ends in a sound scene or in a SceneError, never in anything else."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping
from dataclasses import fields, is_dataclass
from typing import Any

from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from ringbalance.controller.eccentric_mass.scene_records import ECCENTRIC_MASS, EccentricScene
from ringbalance.scene import AnyScene, SceneError, bundled_scene, liquid_ring_scene, scene_from
from ringbalance.scene.keys.schema import LIQUID_RING
from ringbalance.scene.units import DIMENSIONS

TABLES = tuple(LIQUID_RING.tables)
PATHS, DRIVEN_PATHS = (
    [(name, key) for name, table in schema.tables.items() for key in (*table.keys, "colour")]
    for schema in (LIQUID_RING, ECCENTRIC_MASS)
)
UNITS = sorted({unit for kind in DIMENSIONS.values() for unit in kind.units})
NUMBERS = st.one_of(
    st.floats(allow_nan=True, allow_infinity=True).map(str),
    st.floats(1e-3, 1e3).map(str),
    st.sampled_from(["0", "-1", "1e300", "-1e300", "1e999999", "1e-999999", "nan", "inf", "9" * 50]),
)
QUANTITIES = st.tuples(NUMBERS, st.sampled_from(UNITS)).map(" ".join)
LEAVES = st.one_of(
    QUANTITIES,
    st.text(max_size=20),
    st.booleans(),
    st.integers(-(2**70), 2**70),
    st.integers(-3, 30),
    st.floats(),
    st.floats(0, 1),
)
JUNK = st.recursive(
    LEAVES,
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.text(max_size=8), inner, max_size=3),
    max_leaves=4,
)
FUZZ = settings(
    max_examples=100,
    deadline=None,
    derandomize=True,
    suppress_health_check=[HealthCheck.function_scoped_fixture],
)


def _loaded(content: bytes) -> AnyScene | None:
    try:
        return scene_from(content=content, file="my_disc.toml")
    except SceneError as error:
        lines = str(error).splitlines()
        if not error.faults or len(lines) != len(error.faults) or not all(map(str.isprintable, lines)):
            raise AssertionError("a fault is not one printable line") from error
    return None


def _numbers(record: object) -> Iterator[float]:
    if isinstance(record, float):
        yield record
    if isinstance(record, tuple):
        for item in record:
            yield from _numbers(item)
    if is_dataclass(record):
        for field in fields(record):
            yield from _numbers(getattr(record, field.name))


def _assert_sound(scene: AnyScene | None) -> None:
    if scene is None:
        return
    assert all(map(math.isfinite, _numbers(scene)))
    if isinstance(scene, EccentricScene):
        assert scene.rotor.mass >= scene.imbalance.mass >= 0
        assert scene.sensor.step <= scene.lqr.step
        assert scene.rotor.speed_profile
        return
    scene = liquid_ring_scene(scene)
    disc, tube = scene.disc, scene.tube
    assert 0 < disc.inner_radius < disc.outer_radius
    assert math.asin(disc.plate_thickness / disc.inner_radius) < disc.central_angle / 2
    assert disc.chambers % 2 == 0
    assert disc.chambers * disc.central_angle <= 2 * math.pi * 1.0001
    assert 2 * disc.initial_fill == disc.max_fill_ratio or math.isclose(
        2 * disc.initial_fill, disc.max_fill_ratio
    )
    assert disc.inner_radius < tube.port_radius <= disc.outer_radius
    assert tube.hump_radius is None or 0 < tube.hump_radius < tube.port_radius
    assert all(tube.bore <= 2.001 * bend.radius for bend in tube.bends)
    assert scene.liquid.density > 0
    assert scene.liquid.kinematic_viscosity > 0
    assert 0 <= scene.liquid.vapour_pressure < scene.gas.ambient_pressure
    assert scene.gas.pressure >= 0
    assert scene.rotor.speed > 0
    assert scene.controller.minimum_gas_time < scene.controller.maximum_gas_time
    assert 0 < scene.tolerance < 1


@given(changes=st.lists(st.tuples(st.sampled_from(PATHS), JUNK), min_size=1, max_size=3))
@FUZZ
def test_junk_in_place_of_values(
    changes: list[tuple[tuple[str, str], Any]],
    newcomer_document: dict[str, Any],
    as_toml: Callable[[Mapping[str, Any]], str],
) -> None:
    document = {table: dict(content) for table, content in newcomer_document.items()}
    for (table, key), value in changes:
        document.setdefault(table, {})[key] = value
    _assert_sound(_loaded(as_toml(document).encode()))


@given(changes=st.lists(st.tuples(st.sampled_from(DRIVEN_PATHS), JUNK), min_size=1, max_size=3))
@FUZZ
def test_junk_in_place_of_values_of_eccentric_masses(
    changes: list[tuple[tuple[str, str], Any]],
    driven_document: dict[str, Any],
    as_toml: Callable[[Mapping[str, Any]], str],
) -> None:
    document = {
        key: dict(value) if isinstance(value, dict) else value for key, value in driven_document.items()
    }
    for (table, key), value in changes:
        document.setdefault(table, {})[key] = value
    _assert_sound(_loaded(as_toml(document).encode()))


@given(changes=st.lists(st.tuples(st.integers(0, 999), st.floats(0, 3)), min_size=1, max_size=3))
@FUZZ
def test_scaled_values(
    changes: list[tuple[int, float]],
    paper_document: dict[str, Any],
    as_toml: Callable[[Mapping[str, Any]], str],
) -> None:
    """Quantities of the paper's scene, some of them scaled: many pass, and those that do are sound."""
    document = {
        key: dict(value) if isinstance(value, dict) else value for key, value in paper_document.items()
    }
    paths = [
        (table, key)
        for table, content in document.items()
        if isinstance(content, dict)
        for key, value in content.items()
        if isinstance(value, str) and value[0].isdigit()
    ]
    for index, factor in changes:
        table, key = paths[index % len(paths)]
        number, unit = document[table][key].split(" ", 1)
        document[table][key] = f"{float(number) * factor} {unit}"
    _assert_sound(_loaded(as_toml(document).encode()))


@given(table=st.sampled_from((*TABLES, "name", "balancer", "colour")), value=JUNK)
@FUZZ
def test_junk_in_place_of_tables(
    table: str,
    value: Any,
    newcomer_document: dict[str, Any],
    as_toml: Callable[[Mapping[str, Any]], str],
) -> None:
    _assert_sound(_loaded(as_toml({**newcomer_document, table: value}).encode()))


@given(at=st.integers(0, 10**6), deleted=st.integers(0, 40), inserted=st.binary(max_size=10))
@FUZZ
def test_damaged_files(at: int, deleted: int, inserted: bytes) -> None:
    whole = bundled_scene("liquid_ring_paper").read_bytes()
    start = at % len(whole)
    _assert_sound(_loaded(whole[:start] + inserted + whole[start + deleted :]))
