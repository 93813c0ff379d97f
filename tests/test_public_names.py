"""The names that a Python user types, as the documentation promises them."""

from __future__ import annotations

import ast
from pathlib import Path

import numpy as np
import pytest

import ringbalance as rb
from ringbalance.scene.models import Scene


def promised_for_type_checkers() -> dict[str, str]:
    """Name to module, as `ringbalance/__init__.py` tells type checkers."""
    tree = ast.parse(Path(rb.__file__).read_text())
    blocks = [node for node in tree.body if isinstance(node, ast.If)]
    imports = [node for block in blocks for node in block.body if isinstance(node, ast.ImportFrom)]
    return {alias.name: node.module or "" for node in imports for alias in node.names}


def test_type_checkers_see_what_is_loaded() -> None:
    assert promised_for_type_checkers() == rb._HOME


@pytest.mark.parametrize("name", sorted(rb._HOME))
def test_every_name_is_there(name: str) -> None:
    assert callable(getattr(rb, name))


def test_an_unknown_name_is_refused() -> None:
    with pytest.raises(AttributeError, match="no attribute 'calibrat'"):
        _ = rb.calibrat


def test_a_saved_law_runs_as_the_fresh_one(paper_scene: Scene, tmp_path: Path) -> None:
    """The steps of the README: calibrate, evaluate, save, load, simulate."""
    scene = paper_scene.with_values({"run.time_limit": "5 s"})
    law = rb.calibrate(scene).flow_law
    flow = law.evaluate(fill_ratio=[0.1, 0.25], gas_pressure=0.7e6)
    assert flow.velocity.shape == (2,)
    law.save(tmp_path / "law.json")
    fresh = rb.simulate(scene, flow_law=law)
    for run in (rb.simulate(scene), rb.simulate(scene, flow_law=rb.load_law(tmp_path / "law.json"))):
        np.testing.assert_array_equal(run.amplitude, fresh.amplitude)
    paper = rb.simulate(scene, flow_law=rb.paper_law(scene))
    assert not np.array_equal(paper.amplitude, fresh.amplitude)


def test_simulate_models_the_terms_asked_for(paper_scene: Scene) -> None:
    scene = paper_scene.with_values({"run.time_limit": "2 s"})
    law = rb.calibrate(scene).flow_law
    assert rb.simulate(scene, flow_law=law, modelled=[]).terms_modelled == ()
    assert rb.simulate(scene, flow_law=law, modelled=["tube inertia"]).terms_modelled == ("tube inertia",)
    with pytest.raises(ValueError, match="surface tension"):
        rb.simulate(scene, flow_law=law, modelled=["surface tension"])
    eccentric = rb.load_scene(rb.bundled_scene("driven_masses_small"))
    with pytest.raises(ValueError, match="has no modelled"):
        rb.simulate(eccentric, modelled=["tube inertia"])  # type: ignore[call-overload]


def test_star_and_dir_give_the_interface_and_nothing_else() -> None:
    names: dict[str, object] = {}
    exec("from ringbalance import *", names)
    names.pop("__builtins__")
    assert set(names) == set(rb.__all__) == set(rb._HOME)
    assert dir(rb) == sorted(rb.__all__)
    studies = {"calibrate", "simulate", "tune", "fit", "compare", "trade", "extremes", "plot"}
    assert studies | {"write_report", "load_law"} <= set(names)
