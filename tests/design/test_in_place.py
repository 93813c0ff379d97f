"""Design within the disc of a scene: what may vary, and the answer that a report shows."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import ringbalance as rb
from ringbalance.controller.balancer import balancer_of
from ringbalance.controller.judging.judge import judged_all
from ringbalance.design.designing import Design, Effect
from ringbalance.design.in_place import kept_design, within_disc
from ringbalance.design.space import Space
from ringbalance.reduced_model.residual_liquid import Holding
from ringbalance.results.requirements import MET, Proportion
from ringbalance.scene.models import Scene
from ringbalance.scene.narrowing import liquid_ring_scene
from ringbalance.scene.platform import kept_code


def test_the_size_stays_and_all_else_that_can_be_changed_is_open(paper_scene: Scene) -> None:
    space = Space.of(within_disc(paper_scene))
    assert not space.sized
    ranges = {path: ends for axis in space.axes for path, ends in axis.ranges.items()}
    assert set(ranges) == {"tube.bore", "gas.pressure", "tube.hump_radius"}
    assert ranges["gas.pressure"].high == paper_scene.gas.pressure
    # A crest up to this radius is sure to hold the liquid, and one a tenth of a millimetre above is not.
    crest = ranges["tube.hump_radius"]
    assert crest.low == paper_scene.disc.inner_radius
    for radius, holds in ((crest.high, True), (crest.high + 1e-4, False)):
        changed = paper_scene.with_values({"tube.hump_radius": radius, "tube.length": "80 mm"})
        assert Holding.of(changed, fill_ratio=changed.disc.max_fill_ratio).holds is holds
    assert len(space.parts["valve"].names) == 3
    assert "as in the scene" not in space.parts["valve"].names


def test_what_the_scene_states_stays(paper_scene: Scene) -> None:
    valve = {"gas.conductance": "1 l/(s*bar)", "gas.critical_ratio": 0.3, "gas.valve_lag": "5 ms"}
    # The scene's own valve is the only one, unless it does not suffice.
    valved = paper_scene.with_values(valve)
    assert "valve" not in Space.of(within_disc(valved)).parts
    assert Space.of(within_disc(valved, other_valves=True)).parts["valve"].names[0] == "as in the scene"
    stated = {
        "design.outer_radius": "60 mm",
        "design.pressure": "0.9 MPa",
        "design.valves": [{"name": "V", "conductance": "1 l/(s*bar)", "valve_lag": "5 ms"}],
        "design.vary": ["tube.bore=0.8mm,1mm"],
    }
    space = Space.of(within_disc(paper_scene.with_values(stated)))
    assert set(space.paths) == {
        *("tube.bore", "gas.pressure", "gas.conductance", "gas.critical_ratio", "gas.valve_lag")
    }
    assert space.parts["valve"].names == ("V",)
    (pressure,) = (axis.ranges["gas.pressure"] for axis in space.axes if "gas.pressure" in axis.paths)
    assert pressure.high == 0.9e6


def test_a_limited_crater_opens_the_gas_hole(paper_scene: Scene) -> None:
    hole = {"disc.gas_hole_diameter": "2 mm", "disc.gas_hole_radius": "24 mm"}
    assert "disc.gas_hole_diameter" not in Space.of(within_disc(paper_scene.with_values(hole))).paths
    limited = paper_scene.with_values({**hole, "requirement.crater": 0.5})
    space = Space.of(within_disc(limited))
    (ends,) = (
        axis.ranges["disc.gas_hole_diameter"] for axis in space.axes if "disc.gas_hole_diameter" in axis.paths
    )
    assert (ends.low, ends.high) == pytest.approx((2e-3, 6e-3))


def test_the_answer_is_kept_for_the_values_of_the_scene(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path))
    kept_code.trusted.cache_clear()
    sound = {"name": "sound", "conductance": "1.5 l/(s*bar)", "critical_ratio": 0.36, "valve_lag": "20 ms"}
    scene = rb.load_scene(rb.bundled_scene("spindle_design")).with_values(
        {
            "design.vary": ["tube.bore=0.9mm", "gas.pressure=0.4MPa"],
            "design.pressure": None,
            "design.valves": [sound],
            "requirement.fraction": 0.7,
        }
    )
    assert kept_design(scene) is None
    design = rb.find_design(scene, in_place=True)
    answer = kept_design(scene)
    assert answer is not None
    assert answer["verdict"] == MET
    assert answer["changes"]["tube.bore"] == 0.9e-3
    assert design.judgement is not None
    assert answer["fraction"] == design.judgement.fraction.document()
    assert scene.with_values(answer["changes"]).values_sha256 == design.recommended_scene.values_sha256
    # Beside it stand the results of the scene's own disc.
    assert isinstance(design, Design)
    assert design.unchanged is not None
    (own,) = judged_all(balancer_of(scene), [{}])
    assert design.unchanged[0].fraction == own.fraction
    document = design.to_dict()
    assert document["unchanged"]["fraction"] == own.fraction.document()
    assert document["unchanged"]["reach_kg_m"] > 0
    energies = design.judgement.outcomes.energy[design.judgement.outcomes.settled]
    assert document["energy_J"] == pytest.approx(np.median(energies))
    (table,) = (each for each in design.rows().tables if each.caption.startswith("Beside the scene's own"))
    assert [row[0] for row in table.rows] == ["the scene's own", "designed"]
    # A weaker supply that serves too few is said.
    few, many = (
        Effect(path="gas.pressure", changes={"gas.pressure": 3e5}, met=Proportion(count=count, of=256))
        for count in (94, 250)
    )
    weak = replace(design, effects=(few, many))
    (finding,) = (each for each in weak.rows().findings if each.code == "design_pressure")
    assert "not at 0.3 MPa: there, all else as it is, 36.7 % of 256 devices" in finding.text
    # A lag that is assumed is marked in the saved scene, a stated one is not.
    assert design.assumed == ()
    unstated = scene.with_values(
        {"design.valves": [{key: each for key, each in sound.items() if key != "valve_lag"}]}
    )
    on_sale = replace(design, space=replace(design.space, scene=liquid_ring_scene(unstated)))
    assert on_sale.recommended_scene.origin_of("gas.valve_lag") == "assumed"
    assert on_sale.recommended_scene.origin_of("gas.conductance") == "given"
    (finding,) = (each for each in on_sale.rows().findings if each.code == "design_lag")
    assert "20 ms of sound" in finding.text
    # Another scene has no answer, and what was damaged is none.
    assert kept_design(scene.with_values({"tube.bore": "1.3 mm"})) is None
    (file,) = (path for path in (tmp_path / "ringbalance" / "designs").rglob("*") if path.is_file())
    file.write_bytes(b"no answer")
    assert kept_design(scene) is None
