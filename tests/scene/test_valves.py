"""Valves: flows of data sheets against numbers that makers print and against ISO 6358; the catalogue."""

from __future__ import annotations

import logging
import math
from collections.abc import Iterator
from pathlib import Path

import pytest

import ringbalance as rb
from ringbalance.physics.gas import flow_shape
from ringbalance.reduced_model.gas_line import line_ends
from ringbalance.scene.loader import scene_from
from ringbalance.scene.models import Scene
from ringbalance.scene.valves import USUAL_CRITICAL_RATIO, find_valve, known_valves, sonic_conductance

LITRE_PER_MINUTE = 1e-3 / 60
# Source: SMC, CAT. EUS11-83 B-UK, Flow Characteristics: C, l/(s bar), b, Cv and Q, l/min (ANR).
PRINTED = {
    "SMC SY3000": (1.1, 0.28, 0.29, 276),
    "SMC SY5000": (2.8, 0.37, 0.90, 746),
    "SMC SY7000": (4.5, 0.28, 1.4, 1130),
    "SMC SY9000": (10, 0.29, 2.5, 2527),
}


def of_paper(**gas: object) -> Scene:
    """The paper's scene, read from a file with other keys of [gas]."""
    paper = rb.load_scene(rb.bundled_scene("liquid_ring_paper"))
    changed = paper.with_values({f"gas.{key}": value for key, value in gas.items()})
    assert isinstance(changed, Scene)
    return changed


@pytest.mark.parametrize("name", PRINTED)
def test_the_nominal_flow_that_a_maker_prints_gives_the_conductance_that_it_prints(name: str) -> None:
    """The limit is half a digit of C, since Q is printed to four digits and follows from C."""
    conductance, ratio, _, flow = PRINTED[name]
    answer = sonic_conductance("nominal_flow", flow * LITRE_PER_MINUTE, critical_ratio=ratio)
    assert 1e8 * answer == pytest.approx(conductance, rel=2e-3)


@pytest.mark.parametrize("ratio", [0.05, 0.3, 0.5, 6 / 7, 0.95])
def test_the_nominal_flow_is_that_of_the_line_that_the_loop_runs(ratio: float) -> None:
    flow = 180 * LITRE_PER_MINUTE
    answer = sonic_conductance("nominal_flow", flow, critical_ratio=ratio)
    assert answer * 7e5 * flow_shape(6 / 7, ratio) == pytest.approx(flow, rel=1e-12)


@pytest.mark.parametrize("name", PRINTED)
def test_a_flow_coefficient_gives_the_printed_conductance_within_a_fifth(name: str) -> None:
    conductance, ratio, coefficient, _ = PRINTED[name]
    answer = 1e8 * sonic_conductance("Cv", coefficient, critical_ratio=ratio)
    assert 0.8 < conductance / answer < 1.03
    assert sonic_conductance("Kv", 0.865 * coefficient, critical_ratio=ratio) == pytest.approx(1e-8 * answer)


def test_a_flow_coefficient_passes_what_iec_60534_prints_of_choked_gas() -> None:
    """W = N6 Kv Y (x_T p_1 rho_1)^(1/2), kg/h, with N6 = 31.6 in bar, Y = 2/3 and x_T = 1 - b."""
    density = 101325 / (8.314462 / 0.02896 * 273.15) * 7e5 / 101325 * 273.15 / 293.15
    mass = 31.6 * (2 / 3) * math.sqrt(0.7 * 7.0 * density) / 3600
    reference = 1e5 / (8.314462 / 0.02896 * 293.15)
    answer = sonic_conductance("Kv", 1.0, critical_ratio=0.3)
    assert answer == pytest.approx(mass / (reference * 7e5), rel=3e-3)  # N6 has three digits
    assert answer == pytest.approx(4.50e-8, rel=1e-3)  # as docs/scene-file.md says
    assert sonic_conductance("Cv", 1.0, critical_ratio=0.3) == pytest.approx(3.89e-8, rel=1e-3)


def test_the_catalogue_has_a_source_for_each_valve_and_one_flow() -> None:
    valves = known_valves()
    assert len(valves) >= 8
    assert len({name.split()[0] for name in valves}) >= 3
    for valve in valves.values():
        conductance, ratio = valve.iso_6358
        assert len(valve.flows) == 1
        assert 1e-10 < conductance <= 1e-7
        assert 0 < ratio < 0.5
        assert valve.name.split()[0] in valve.source
    for name, (conductance, ratio, _, _) in PRINTED.items():
        assert valves[name].iso_6358 == (pytest.approx(1e-8 * conductance), ratio)


def test_a_valve_is_named_as_it_is_written_anywhere() -> None:
    assert find_valve("ckd m4ga2-r") is known_valves()["CKD M4GA2 R"]
    assert find_valve("CKD M4GA2") is None


def test_a_scene_with_a_named_valve_is_that_with_its_numbers() -> None:
    named = of_paper(valve="SMC SY5000", valve_lag="9 ms")
    stated = of_paper(conductance="2.8 l/(s*bar)", critical_ratio=0.37, valve_lag="9 ms")
    for key in ("conductance", "critical_ratio", "valve_lag"):
        assert getattr(named.gas, key) == getattr(stated.gas, key)
    assert named.origin_of("gas.conductance") == named.origin_of("gas.critical_ratio") == "derived"
    assert named.origin_of("gas.valve_lag") == "given"
    assert not {"gas.conductance", "gas.critical_ratio"} & {*named.defaulted}
    assert "CAT. EUS11-83 B-UK" in named.remark
    assert not stated.remark


def test_what_the_scene_states_precedes_the_catalogue() -> None:
    gas = of_paper(valve="Festo MH1 3/2", critical_ratio=0.2, valve_lag="9 ms").gas
    assert (gas.critical_ratio, gas.valve_lag) == (0.2, 9e-3)
    assert gas.conductance == pytest.approx(10 * LITRE_PER_MINUTE / 7e5 / flow_shape(6 / 7, 0.2))
    assert of_paper(valve="Festo MH1 3/2").gas.valve_lag == 4e-3


def test_an_unstated_critical_ratio_is_said_and_is_a_default() -> None:
    for stated in ({"conductance": "1 l/(s*bar)"}, {"nominal_flow": "180 l/min"}, {"Kv": 0.2}, {"Cv": 0.2}):
        scene = of_paper(**stated)
        assert scene.gas.critical_ratio == USUAL_CRITICAL_RATIO
        assert "b = 0.3 (ISO 6358), as no critical ratio is stated" in scene.remark
        assert "gas.critical_ratio" in scene.defaulted
    assert "C = 0.708 l/(s*bar)" in of_paper(nominal_flow="180 l/min").remark
    at_hand = rb.load_scene(rb.bundled_scene("liquid_ring_paper")).with_values(
        {"design.valves": [{"name": "V1", "Kv": 0.2, "valve_lag": 2e-3}]}
    )
    assert at_hand.remark == "[design] valves: b = 0.3 of V1, as no critical ratio is stated"


def test_a_pressure_that_the_valve_is_not_made_for_is_said() -> None:
    assert "it is made for -0.9 to 8 bar, and gas.pressure is 9 bar" in (
        of_paper(valve="Festo MHA2-MS1H-3/2", pressure="9 bar").remark
    )
    assert "made for" not in of_paper(valve="Festo MHA2-MS1H-3/2", pressure="8 bar").remark


@pytest.mark.parametrize("name", list(known_valves()))
def test_a_valve_with_two_outlets_needs_one_of_them_plugged(name: str) -> None:
    ways = known_valves()[name].kind.split()[0]
    assert ways.strip(",") in ("5/2", "3/2", "two")
    plugged = "it is a 5/2 valve: one for each chamber, with one outlet plugged"
    assert (plugged in of_paper(valve=name).remark) is (ways.strip(",") == "5/2")


def test_a_lag_that_is_not_stated_is_assumed_and_said() -> None:
    """One rule for each valve, whatever states its flow; a stated lag of 0 is a stated one."""
    flow = {"conductance": "1 l/(s*bar)", "critical_ratio": 0.3}
    stated = ({"valve": "CKD M4GA2 R"}, flow, {"nominal_flow": "180 l/min"}, {"Kv": 0.2}, {"Cv": 0.2})
    for keys, lag in (*((each, 20) for each in stated), ({"valve": "SMC SY3000"}, 12)):
        scene = of_paper(**keys)
        assert scene.gas.valve_lag == pytest.approx(1e-3 * lag)
        assert scene.origin_of("gas.valve_lag") == "assumed"
        assert f"a valve_lag of {lag} ms is assumed, as none is stated" in scene.remark
        assert len(line_ends(scene)) == 1
    assert of_paper().gas.valve_lag is None
    for keys in ({**flow, "valve_lag": "0 ms"}, {"valve": "SMC SX3000", "critical_ratio": 0.3}):
        assert "assumed" not in of_paper(**keys).remark
    kept = of_paper(valve="SMC SY3000").with_values({"gas.conductance": 2e-9})
    assert (kept.gas.valve_lag, kept.origin_of("gas.valve_lag")) == (12e-3, "assumed")
    with pytest.raises(rb.SceneError, match=r"a valve_lag that .* is assumed"):
        of_paper(**flow).with_values({"controller.period": "15 ms"})


def test_a_flow_replaces_what_stated_it_before() -> None:
    """A sweep or a remedy changes one key, and the scene stays one that states its flow once."""
    named = of_paper(valve="Festo MH1 3/2", valve_lag="9 ms")
    faster = named.with_values({"gas.conductance": 2e-9})
    assert (faster.gas.conductance, faster.gas.critical_ratio, faster.gas.valve_lag) == (2e-9, 0.3, 9e-3)
    assert faster.gas.valve is None
    other = of_paper(conductance="1 l/(s*bar)", critical_ratio=0.5, valve_lag="9 ms")
    other = other.with_values({"gas.valve": "SMC SY3000"})
    assert (other.gas.conductance, other.gas.critical_ratio, other.gas.valve_lag) == (1.1e-8, 0.28, 9e-3)


@pytest.fixture
def said(caplog: pytest.LogCaptureFixture) -> Iterator[pytest.LogCaptureFixture]:
    with caplog.at_level(logging.WARNING, logger="ringbalance"):
        yield caplog


def test_every_command_says_the_conversion_where_it_reads_the_scene(
    tmp_path: Path, said: pytest.LogCaptureFixture
) -> None:
    text = rb.bundled_scene("liquid_ring_paper").read_text(encoding="utf-8")
    file = tmp_path / "my.toml"
    file.write_text(text.replace("[gas]", '[gas]\nnominal_flow = "180 l/min"'), encoding="utf-8")
    rb.load_scene(file)
    assert said.messages == [
        f'{file}: [gas] nominal_flow = "180 l/min" is C = 0.708 l/(s*bar) with b = 0.3 (ISO 6358), as no '
        "critical ratio is stated; a valve_lag of 20 ms is assumed, as none is stated: ask the seller"
    ]
    rb.load_scene(rb.bundled_scene("grinding_spindle"))
    assert len(said.messages) == 1


def test_a_file_that_states_a_flow_twice_is_refused() -> None:
    text = rb.bundled_scene("liquid_ring_paper").read_text(encoding="utf-8")
    for first, second in (("conductance", "nominal_flow"), ("nominal_flow", "Kv"), ("Cv", "valve")):
        values = {"conductance": '"1 l/(s*bar)"', "nominal_flow": '"180 l/min"', "valve": '"SMC SY3000"'}
        lines = "\n".join(f"{key} = {values.get(key, 0.2)}" for key in (first, second))
        with pytest.raises(rb.SceneError, match=rf"\[gas\] {second} = .*: {first} states the flow"):
            scene_from(content=text.replace("[gas]", f"[gas]\n{lines}").encode(), file="my.toml")
