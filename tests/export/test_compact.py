"""The compact law beside the calibrated one, and what it answers where there is nothing to answer."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from law_queries import answers, queries

from ringbalance.export import compact
from ringbalance.export.compact import MAX_BYTES, TOLERANCE, CompactLaw, compact_law
from ringbalance.mesh.geometry import surface_radius
from ringbalance.reduced_model.calibration import chamber_and_law
from ringbalance.reduced_model.law.calibrated_law import CalibratedLaw
from ringbalance.reduced_model.law.flow_law import Regime
from ringbalance.reduced_model.pieces import point, query
from ringbalance.scene.fitted import Fitted, FittedQuantity
from ringbalance.scene.loader import load_scene
from ringbalance.scene.models import Scene
from ringbalance.scenes import __file__ as scenes

Both = tuple[CalibratedLaw, CompactLaw]
OK, EXTRAPOLATED, BLOCKED, INVALID = 0, 1, 2, 4


def test_it_is_small_and_within_its_tolerance_of_the_calibrated_law(laws: Both) -> None:
    law, compact = laws
    assert compact.size <= 4096 == MAX_BYTES
    asked = queries(law, 6000)
    x, y, p, primed = asked
    right = law.evaluate(fill_ratio=x, opposite_fill_ratio=y, gas_pressure=p, primed=primed.astype(bool))
    velocity, regime, status, after = np.array(list(answers(compact, asked))).T
    flows = (right.velocity != 0) & (status != EXTRAPOLATED)
    assert np.count_nonzero(flows) > 1000
    assert np.all(np.abs(velocity - right.velocity)[flows] <= TOLERANCE * np.abs(right.velocity)[flows])
    assert np.array_equal(velocity != 0, right.velocity != 0)
    assert np.array_equal(after, right.primed)
    # Next to where a column separates the tabulation decides; half-widths are the law's alone.
    known = right.regime != Regime.UNDECIDED
    assert np.count_nonzero(regime[known] != right.regime[known]) <= 12
    assert np.all(np.isin(regime[~known], (Regime.SIPHON, Regime.SEPARATED)))
    assert np.array_equal(status == BLOCKED, right.velocity == 0)


def test_a_chamber_has_its_surface_and_its_moment(laws: Both, paper_scene: Scene) -> None:
    law, compact = laws
    fill = np.linspace(0.0, law.max_fill_ratio, 57)
    tables = compact.constants, compact.tables.cells, compact.tables.pieces
    moment = [query.moment(*tables, each) for each in fill.tolist()]
    right = law.moment.chamber_moment(fill)
    assert moment == pytest.approx(right, abs=2e-5 * float(np.max(np.abs(right))))
    if compact.scene == paper_scene.file:
        radius = [query.surface_radius(*tables, each) for each in fill.tolist()]
        assert radius == pytest.approx(surface_radius(disc=paper_scene.disc, fill_ratio=fill), rel=1e-5)


def test_what_lies_outside_is_extrapolated_or_invalid_and_never_refused(six: Both) -> None:
    _, law = six
    most = law.max_fill_ratio

    def status(fill: float, pressure: float) -> int:
        return law.answer(fill_ratio=fill, opposite_fill_ratio=0.1, gas_pressure=pressure).status

    assert status(0.3, 0.0) == BLOCKED
    assert [status(fill, 3e5) for fill in (most + 0.01, -0.01, np.inf)] == [EXTRAPOLATED] * 3
    assert status(most, 1e11) == EXTRAPOLATED
    assert [status(0.3, p) for p in (np.nan, -1e6, 2e12)] == [INVALID] * 3
    assert law.answer(fill_ratio=np.nan, gas_pressure=3e5).velocity == 0.0
    clamped = law.answer(fill_ratio=most + 0.01, opposite_fill_ratio=0.1, gas_pressure=3e5)
    inside = law.answer(fill_ratio=most, opposite_fill_ratio=0.1, gas_pressure=3e5)
    assert clamped.velocity == inside.velocity


def test_a_moment_has_the_largest_half_width_of_its_piece(laws: Both) -> None:
    law, made = laws
    fill = np.linspace(0.0, law.max_fill_ratio, 57)
    tables = made.constants, made.tables.cells, made.tables.pieces
    widths = np.array([query.moment_uncertainty(*tables, each) for each in fill.tolist()])
    right = law.moment.half_width(fill)
    assert np.all(widths >= (1 - 1e-6) * right)
    largest = np.max(law.moment.half_width(np.linspace(0.0, law.max_fill_ratio, 641)))
    assert np.all(widths <= (1 + 1e-6) * largest)


def test_inputs_that_were_fitted_together_hinder_no_export(paper_scene: Scene) -> None:
    quantity = FittedQuantity(quantity="tube.bore", unit="m", standard_deviation=1e-5, correlations=(1.0,))
    scene = replace(paper_scene, fitted=Fitted(quantities=(quantity,)))
    assert compact_law(scene=scene, law=chamber_and_law(scene)[1]).departure <= TOLERANCE


def test_rough_levels_are_called_so(six: Both, monkeypatch: pytest.MonkeyPatch) -> None:
    """Hydrostatic pressures far rougher than an export has them: none departs further than is said."""
    law, exact = six
    scene = load_scene(scenes.replace("__init__.py", "six_chamber.toml"))
    assert isinstance(scene, Scene)
    monkeypatch.setattr(compact, "_LEVEL_ERROR", 1e8 * compact._LEVEL_ERROR)
    rough = compact_law(scene=scene, law=law)
    fills = np.linspace(1e-3, 0.999 * law.max_fill_ratio, 500)
    tables = rough.constants, rough.tables.cells, rough.tables.levels
    levels = np.array([point.level(*tables, fill) for fill in fills.tolist()])
    departure = np.abs(levels - law.hydrostatic_pressure(fills))
    assert rough.level_error > 1e3 * exact.level_error
    # The error is looked for at samples.
    assert np.max(departure) <= 1.02 * rough.level_error


ODD = """
balancer = "liquid_ring"
disc.outer_radius = "{} mm"
disc.inner_radius = "{} mm"
disc.axial_width = "{} mm"
disc.chambers = {}
disc.max_fill_ratio = {}
disc.initial_fill = {}
liquid = {{ density = "{} kg/m^3", kinematic_viscosity = "{} m^2/s", vapour_pressure = "2 kPa" }}
tube.bore = "{} mm"
tube.length = "{} mm"
tube.hump_radius = "{} mm"
tube.hump_shape = "{}"
tube.hump_gas = "trapped"
tube.hump_position = {}
gas = {{ pressure = "1 MPa" }}
rotor = {{ speed = "{} rad/s" }}
"""


@pytest.mark.parametrize(
    "numbers",
    [
        # Friction is known to 136 % in the transition and to 1 % below it.
        (208, 117, 114, 8, 0.0026, 0.0013, 2888, 8.092e-7, 0.0515, 831, 204, "point", 0.47, 97),
        # So many pieces that none of the levels would have room.
        (405.5, 61.14, 0.815, 4, 0.5, 0.25, 4666, 1.967e-8, 1.0561, 1817.5, 288.2, "arc", 0.767, 126.7),
    ],
)
def test_odd_discs_have_a_compact_law(tmp_path: Path, numbers: tuple[float | str, ...]) -> None:
    file = tmp_path / "odd.toml"
    file.write_text(ODD.format(*numbers))
    scene = load_scene(file)
    assert isinstance(scene, Scene)
    law = chamber_and_law(scene)[1]
    made = compact_law(scene=scene, law=law)
    assert made.size <= MAX_BYTES
    # Where levels would have no room, velocities are tabulated less exactly, and the export says how much.
    assert made.departure <= 3 * TOLERANCE
