"""A disc whose chamber is imported, from the chamber's calibration to its uncertainties."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from block_discs import imported, turned
from quantities import parts_of, sides_of

from ringbalance.physics.pressure.loads import ImportedRing, solved_ring
from ringbalance.reduced_model.calibration import calibrate
from ringbalance.reduced_model.chamber import element_check
from ringbalance.reduced_model.chamber.calibration import calibrate_chamber
from ringbalance.reduced_model.chamber.contributions import unmodelled_fractions
from ringbalance.reduced_model.chamber.values import share_across
from ringbalance.reduced_model.documents import calibration_document
from ringbalance.reduced_model.law.files import load_law
from ringbalance.reduced_model.law.making import nominal_law
from ringbalance.scene.models import Scene
from ringbalance.scene.origins import InputUncertainty
from scenes import with_tables

FILLS = np.array([0.1, 0.25, 0.5])


@pytest.fixture(scope="module")
def scene(paper_scene: Scene) -> Scene:
    """The paper's scene with its own chamber imported, which has no plate thickness to be uncertain."""
    known = tuple(one for one in paper_scene.uncertainty if one.quantity != "plate_thickness")
    return replace(paper_scene, disc=imported(paper_scene.disc), uncertainty=known)


def aside(scene: Scene, angle: float) -> Scene:
    """The chamber's mesh turned about the shaft, and not what is said to be its middle."""
    return replace(scene, disc=turned(scene.disc, angle=angle))


def only_width(scene: Scene) -> Scene:
    """The scene with no other uncertain input than the width."""
    stated = InputUncertainty(quantity="axial_width", half_width=0.01, relative=True)
    exact = replace(scene.liquid, density_uncertainty=0.0, viscosity_uncertainty=0.0)
    return replace(scene, liquid=exact, uncertainty=(stated,))


def test_an_imported_chamber_is_calibrated_as_the_built_in_one(scene: Scene, paper_scene: Scene) -> None:
    own, built_in = calibrate_chamber(scene), calibrate_chamber(paper_scene)
    for name in ("wall_pressure", "moment"):
        values, expected = getattr(own, name), getattr(built_in, name)
        width = values.uncertainty + expected.uncertainty
        # Of the table of integrals.
        assert np.all(np.abs(values.value - expected.value) <= width + 1e-7 * expected.value.max())
    assert float(own.moment_per_mass.value) == pytest.approx(float(built_in.moment_per_mass.value), rel=1e-5)
    assert own.volume == pytest.approx(built_in.volume, rel=1e-6)
    width, expected = (
        calibrate_chamber(each).moment.inputs[-1] for each in map(only_width, (scene, paper_scene))
    )
    assert width == pytest.approx(expected, rel=1e-5)


def test_its_check_by_finite_elements_agrees(scene: Scene) -> None:
    check = calibrate_chamber(scene).check
    assert check.status.ok
    assert set(check.difference) == {"wall_pressure", "hydrostatic_pressure", "moment"}


def test_its_check_notices_a_pressure_that_is_off(scene: Scene, monkeypatch: pytest.MonkeyPatch) -> None:
    def spoiled(**given: Any) -> ImportedRing:
        ring = solved_ring(**given)
        pressure = replace(ring.wall_pressure, value=1.001 * ring.wall_pressure.value)
        return replace(ring, wall_pressure=pressure)

    sound = calibrate_chamber(scene)
    monkeypatch.setattr(element_check, "solved_ring", spoiled)
    found = calibrate_chamber(scene)
    assert not found.check.status.ok
    assert found.check.excess == pytest.approx(1e-3, rel=0.1)
    # It counts where it was noticed, and nowhere else.
    wall = found.wall_pressure
    assert not wall.status.ok
    np.testing.assert_allclose(wall.numerical[1:] / wall.value[1:], found.check.excess, rtol=1e-6)
    assert found.moment_per_mass.status == sound.moment_per_mass.status
    assert found.moment_per_mass.uncertainty == sound.moment_per_mass.uncertainty
    for name in ("moment", "hydrostatic_pressure"):
        np.testing.assert_array_equal(getattr(found, name).uncertainty, getattr(sound, name).uncertainty)


def test_only_what_the_size_exceeds_that_along_the_middle_by_is_uncertain(scene: Scene) -> None:
    """A symmetric chamber whose middle is given 5 deg beside it has cos(5 deg) of its moment along that."""
    angle = np.radians(5.0)
    beside = aside(scene, angle)
    np.testing.assert_allclose(share_across(beside.disc, FILLS), np.tan(angle), rtol=1e-6)
    assert np.all(np.abs(share_across(scene.disc, FILLS)) < 1e-9)
    more, less = (unmodelled_fractions(s, FILLS)["moments"] for s in (beside, scene))
    np.testing.assert_allclose(more - less, 1 / np.cos(angle) - 1, rtol=1e-3)


def test_the_law_turns_the_moment_of_a_chamber_beside_its_middle(scene: Scene) -> None:
    angle, x, y = 0.3, np.array([0.1, 0.3, 0.45]), np.array([0.4, 0.2, 0.0])
    own, law = (nominal_law(s, gravity=False).moment for s in (scene, aside(scene, angle)))
    assert own.across is None
    expected = own.pair_moment(fill_ratio=x, opposite_fill_ratio=y) * np.exp(1j * angle)
    np.testing.assert_allclose(law.pair_vector(fill_ratio=x, opposite_fill_ratio=y), expected, rtol=1e-7)


def test_a_saved_law_keeps_the_moment_across(scene: Scene, tmp_path: Path) -> None:
    law = nominal_law(aside(scene, 0.3), gravity=False)
    back = load_law(law.save(tmp_path / "law.json"))
    first, second = (each.moment.pair_vector(fill_ratio=0.4, opposite_fill_ratio=0.1) for each in (law, back))
    assert first == second
    assert complex(first).imag == pytest.approx(np.tan(0.3) * complex(first).real)


def test_the_angle_of_the_moment_is_reported(scene: Scene) -> None:
    calibration = calibrate(aside(scene, np.radians(2.0)))
    told = calibration_document(calibration)["chamber"]["moment_angle_rad"]
    np.testing.assert_allclose(told, np.radians(2.0), rtol=1e-5)
    (aside_by,) = (each for each in calibration.rows().findings if each.code == "moment_aside")
    assert aside_by.values["angle_equal"] == pytest.approx(np.radians(2.0), rel=1e-5)


def test_a_gas_pressure_at_which_nothing_flows(scene: Scene) -> None:
    """No gas is drawn into a port on the wall, but no liquid leaves a chamber either: a pair can use none."""
    found = calibrate(with_tables(scene, gas={"pressure": 0.1e6}))
    answers = found.answers
    assert answers.residual_fill_ratio == 0
    assert answers.least_fill_ratio == pytest.approx(scene.disc.initial_fill)
    assert found.quantities["usable_moment"].value == answers.reach == 0
    assert answers.moment > 0


def test_both_ends_of_an_interval_move_the_chamber(scene: Scene) -> None:
    """Half of an interval lies on each side of what the chamber's size moves in proportion."""
    known = calibrate(scene).quantities
    for name in ("lambda", "wall_pressure", "moment"):
        sides = sides_of(known[name])
        assert min(sides) > 0.97 * max(sides), name
        assert max(sides) == pytest.approx(parts_of(known[name]).total, rel=0.03), name
