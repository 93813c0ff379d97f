"""Inputs that nobody gave widen a claim, and can only take a verdict away."""

from __future__ import annotations

import dataclasses

import pytest
from hypothesis import given
from hypothesis import strategies as st

from ringbalance.scene.models import Scene
from ringbalance.scene.origins import InputUncertainty
from ringbalance.verification.assumptions import assumptions_of, widened
from ringbalance.verification.case import CaseDefinition, RestsOn
from ringbalance.verification.catalogue import case_code, load_case
from ringbalance.verification.evidence import Evidence, Found, Level, Reference
from ringbalance.verification.runner import run_definition
from ringbalance.verification.verdicts import Metric, Verdict, judge_quantity

BORE = RestsOn(path="tube.bore")


def with_origin(scene: Scene, path: str, origin: str) -> Scene:
    others = [pair for pair in scene.origins if pair[0] != path]
    return dataclasses.replace(scene, origins=(*others, (path, origin)))  # type: ignore[arg-type]


def stating(scene: Scene, quantity: str, half_width: float) -> Scene:
    stated = InputUncertainty(quantity=quantity, half_width=half_width, relative=True)
    return dataclasses.replace(scene, uncertainty=(stated,))


@pytest.mark.parametrize(("origin", "named"), [("given", 0), ("measured", 0), ("assumed", 1), ("default", 1)])
def test_what_somebody_vouches_for_is_no_assumption(paper_scene: Scene, origin: str, named: int) -> None:
    assert len(assumptions_of([BORE], with_origin(paper_scene, "tube.bore", origin))) == named


def test_an_assumed_part_has_the_wider_range_and_an_inferred_value_the_stated_one(paper_scene: Scene) -> None:
    def ends(origin: str, share: float) -> tuple[float, float]:
        scene = stating(with_origin(paper_scene, "tube.bore", origin), "bore", share)
        (bore,) = assumptions_of([BORE], scene)
        return bore.low / bore.value, bore.high / bore.value

    assert ends("assumed", 0.01) == pytest.approx((0.5, 1.5))
    assert ends("assumed", 0.9) == pytest.approx((0.1, 1.9))
    assert ends("inferred", 0.01) == pytest.approx((0.99, 1.01))


def test_a_range_of_its_own_goes_first_and_none_at_all_is_an_error(paper_scene: Scene) -> None:
    scene = stating(with_origin(paper_scene, "tube.bore", "inferred"), "bore", 0.01)
    (assumption,) = assumptions_of([RestsOn(path="tube.bore", low=1e-3, high=2e-3, why="so")], scene)
    assert (assumption.low, assumption.high, assumption.why) == (1e-3, 2e-3, "so")
    with pytest.raises(ValueError, match=r"environment\.gravity: nobody gave it"):
        assumptions_of([RestsOn(path="environment.gravity")], dataclasses.replace(scene, uncertainty=()))


def test_half_a_range_is_refused() -> None:
    for text in ({"low": 1.0}, {"low": 1.0, "high": 2.0}, {"documented": True}, {"why": "so"}):
        with pytest.raises(ValueError, match="low, high and why"):
            RestsOn(path="tube.bore", **text)


class Thick:
    """Ten, and as much more as the plates are thicker than those of the paper."""

    def __init__(self, *, per_mm: float, offset: float = 0.0, shared: bool = False) -> None:
        self.per_mm, self.offset, self.shared = per_mm, offset, shared

    def _more(self, scene: Scene) -> float:
        return self.per_mm * (1e3 * scene.disc.plate_thickness - 2.777)

    def compute(self, scene: Scene, level: Level, defect: str | None = None) -> Evidence:  # noqa: ARG002
        number = Found(value=10.0 + self.offset + self._more(scene))
        reference = 10.0 + (self._more(scene) if self.shared else 0.0)
        return Evidence(quantities={"answer": number.against(reference)}, numbers={"doubt": 0.0})


RESTS = (
    '[[rests_on]]\npath = "disc.plate_thickness"\nlow = 2.577e-3\nhigh = 2.977e-3\nwhy = "so"\n\n[[quantity]]'
)


@pytest.mark.parametrize(
    ("per_mm", "offset", "shared", "expected"),
    [
        (0.0, 0.0, False, "confirmed"),
        (1.0, 0.0, False, "confirmed"),
        (5.0, 0.0, False, "inconclusive"),
        (5.0, 0.0, True, "confirmed"),
        (0.0, 2.0, False, "refuted"),
        (5.0, 2.0, False, "refuted"),
        (15.0, 2.0, False, "inconclusive"),
        (15.0, 2.0, True, "refuted"),
    ],
)
def test_a_claim_is_decided_where_it_is_so_over_the_whole_range(
    claim_text: str, paper_scene: Scene, per_mm: float, offset: float, shared: bool, expected: str
) -> None:
    """Over 0.2 mm either way; a departure of 5 % of ten is what the case lets pass."""
    definition = CaseDefinition.parse(claim_text.replace("[[quantity]]", RESTS, 1), source="x")
    code = Thick(per_mm=per_mm, offset=offset, shared=shared)
    result = run_definition(definition, code, scene=paper_scene)
    assert result.verdict == expected
    assert [each.path for each in result.assumptions] == ["disc.plate_thickness"]
    given_by_all = with_origin(paper_scene, "disc.plate_thickness", "given")
    alone = run_definition(definition, code, scene=given_by_all)
    assert alone.verdict == ("refuted" if offset else "confirmed")
    assert alone.assumptions == ()


numbers = st.floats(-20.0, 20.0)
widths = st.floats(0.0, 5.0)


@given(
    metric=st.sampled_from(["validation", "at_most", "at_least"]),
    value=numbers,
    corrected=st.none() | numbers,
    half_width=widths,
    reach=st.tuples(widths, widths),
    wider=st.floats(1.0, 100.0),
)
def test_widening_an_assumption_only_weakens(
    metric: Metric,
    value: float,
    corrected: float | None,
    half_width: float,
    reach: tuple[float, float],
    wider: float,
) -> None:
    def verdict(factor: float) -> Verdict:
        number = Found(value=value, input=half_width, corrected=corrected)
        number = number.moved(-factor * reach[0], factor * reach[1])
        reference = Reference(value=10.0, uncertainty=0.1)
        return judge_quantity(kind="claim", metric=metric, limit=0.5, number=number.against(reference))[0]

    assert verdict(wider) in (verdict(1.0), Verdict.INCONCLUSIVE)
    assert verdict(1.0) in (verdict(0.0), Verdict.INCONCLUSIVE)


CHEAP = (
    "claim_01_volume",
    "claim_02_ring_radius",
    "claim_03_chamber_moment",
    "claim_04_disc_capacity",
    "claim_05_density",
    "claim_06_wall_pressure",
    "claim_08_velocity_departure",
    "claim_10_working_pressure",
    "claim_11_lambda",
    "claim_12_correction_mass",
    "claim_13_explicit_segments",
    "claim_18_gas_hole",
    "claim_20_rectangular_element",
)
NUMBERS = {
    "disc": ("plate_thickness",),
    "liquid": ("kinematic_viscosity", "vapour_pressure"),
    "tube": ("bore", "hump_radius", "hump_position", "length", "roughness"),
    "gas": ("ambient_pressure",),
    "rotor": ("influence_coefficient", "lag_angle"),
    "sensor": ("amplitude_noise", "phase_noise"),
}


@pytest.mark.parametrize("case", CHEAP)
def test_no_verdict_rests_on_an_assumption_that_it_does_not_name(paper_scene: Scene, case: str) -> None:
    definition: CaseDefinition = load_case(case)
    named = {needed.path for needed in definition.rests_on}
    changed = paper_scene
    for table, keys in NUMBERS.items():
        part = getattr(changed, table)
        new = {key: 1.02 * getattr(part, key) for key in keys if f"{table}.{key}" not in named}
        changed = dataclasses.replace(changed, **{table: dataclasses.replace(part, **new)})
    code = case_code(case)
    errors = []
    for scene in (paper_scene, changed):
        evidence = code.compute(scene, "light")
        errors.append({name: number.error for name, number in evidence.quantities.items()})
    for quantity in definition.quantity:
        against = evidence.quantities[quantity.name].reference
        passes = quantity.limit * (1.0 if against is None else against.value)
        moved = errors[1][quantity.name] - errors[0][quantity.name]
        assert abs(moved) <= 0.01 * abs(passes) + 1e-9, quantity.name


@pytest.mark.parametrize(("per_mm", "reach"), [(5.0, (-1.0, 1.0)), (-5.0, (-1.0, 1.0)), (0.0, (0.0, 0.0))])
def test_an_assumed_range_reaches_both_ways(
    paper_scene: Scene, per_mm: float, reach: tuple[float, float]
) -> None:
    """0.2 mm either way of a plate, five a millimetre: one down and one up."""
    code, thickness = (
        Thick(per_mm=per_mm),
        RestsOn(path="disc.plate_thickness", low=2.577e-3, high=2.977e-3, why="so"),
    )
    scene = with_origin(paper_scene, "disc.plate_thickness", "assumed")
    wider = widened(
        code.compute(scene, "light"),
        scene,
        assumptions_of([thickness], scene),
        at=lambda moved: code.compute(moved, "light"),
    )
    assert wider.quantities["answer"].reach == pytest.approx(reach, abs=1e-9)
