"""All cases, in the order in which they are reported; a case that stands here is never dropped."""

from __future__ import annotations

import difflib
import re
from collections.abc import Mapping
from functools import lru_cache
from importlib.resources import files

from ringbalance.verification.case import CaseDefinition, parse_case
from ringbalance.verification.cases.bent_tube_3d import case as bent_tube_3d
from ringbalance.verification.cases.claim_01_volume import case as claim_01_volume
from ringbalance.verification.cases.claim_02_ring_radius import case as claim_02_ring_radius
from ringbalance.verification.cases.claim_03_chamber_moment import case as claim_03_chamber_moment
from ringbalance.verification.cases.claim_04_disc_capacity import case as claim_04_disc_capacity
from ringbalance.verification.cases.claim_05_density import case as claim_05_density
from ringbalance.verification.cases.claim_06_wall_pressure import case as claim_06_wall_pressure
from ringbalance.verification.cases.claim_07_bernoulli import case as claim_07_bernoulli
from ringbalance.verification.cases.claim_08_velocity_departure import case as claim_08_velocity_departure
from ringbalance.verification.cases.claim_09_drag_coefficient import case as claim_09_drag_coefficient
from ringbalance.verification.cases.claim_10_working_pressure import case as claim_10_working_pressure
from ringbalance.verification.cases.claim_11_lambda import case as claim_11_lambda
from ringbalance.verification.cases.claim_12_correction_mass import case as claim_12_correction_mass
from ringbalance.verification.cases.claim_13_explicit_segments import case as claim_13_explicit_segments
from ringbalance.verification.cases.claim_14_trial_algorithm import case as claim_14_trial_algorithm
from ringbalance.verification.cases.claim_15_proportional_gain import case as claim_15_proportional_gain
from ringbalance.verification.cases.claim_16_five_seconds import case as claim_16_five_seconds
from ringbalance.verification.cases.claim_17_faster import case as claim_17_faster
from ringbalance.verification.cases.claim_18_gas_hole import case as claim_18_gas_hole
from ringbalance.verification.cases.claim_19_denser_liquid import case as claim_19_denser_liquid
from ringbalance.verification.cases.claim_20_rectangular_element import case as claim_20_rectangular_element
from ringbalance.verification.cases.conservation import case as conservation
from ringbalance.verification.cases.coverage import case as coverage
from ringbalance.verification.cases.developing_flow import case as developing_flow
from ringbalance.verification.cases.extremes import case as extremes
from ringbalance.verification.cases.friction_blend import case as friction_blend
from ringbalance.verification.cases.gci_behaviour import case as gci_behaviour
from ringbalance.verification.cases.gci_celik2008 import case as gci_celik2008
from ringbalance.verification.cases.gravity_circle_2d import case as gravity_circle_2d
from ringbalance.verification.cases.gravity_paraboloid_3d import case as gravity_paraboloid_3d
from ringbalance.verification.cases.independent_routes import case as independent_routes
from ringbalance.verification.cases.integrator_orders import case as integrator_orders
from ringbalance.verification.cases.manufactured_2d import case as manufactured_2d
from ringbalance.verification.cases.manufactured_3d import case as manufactured_3d
from ringbalance.verification.cases.manufactured_flow import case as manufactured_flow
from ringbalance.verification.cases.mixing_length import case as mixing_length
from ringbalance.verification.cases.model_choice import case as model_choice
from ringbalance.verification.cases.rotating_section import case as rotating_section
from ringbalance.verification.cases.sloshing import case as sloshing
from ringbalance.verification.evidence import CaseCode

_CODE: Mapping[str, CaseCode] = {
    "manufactured_2d": manufactured_2d,
    "manufactured_3d": manufactured_3d,
    "gravity_circle_2d": gravity_circle_2d,
    "gravity_paraboloid_3d": gravity_paraboloid_3d,
    "conservation": conservation,
    "manufactured_flow": manufactured_flow,
    "rotating_section": rotating_section,
    "developing_flow": developing_flow,
    "sloshing": sloshing,
    "gci_celik2008": gci_celik2008,
    "gci_behaviour": gci_behaviour,
    "independent_routes": independent_routes,
    "integrator_orders": integrator_orders,
    "friction_blend": friction_blend,
    "mixing_length": mixing_length,
    "model_choice": model_choice,
    "coverage": coverage,
    "bent_tube_3d": bent_tube_3d,
    "extremes": extremes,
    "claim_01_volume": claim_01_volume,
    "claim_02_ring_radius": claim_02_ring_radius,
    "claim_03_chamber_moment": claim_03_chamber_moment,
    "claim_04_disc_capacity": claim_04_disc_capacity,
    "claim_05_density": claim_05_density,
    "claim_06_wall_pressure": claim_06_wall_pressure,
    "claim_07_bernoulli": claim_07_bernoulli,
    "claim_08_velocity_departure": claim_08_velocity_departure,
    "claim_09_drag_coefficient": claim_09_drag_coefficient,
    "claim_10_working_pressure": claim_10_working_pressure,
    "claim_11_lambda": claim_11_lambda,
    "claim_12_correction_mass": claim_12_correction_mass,
    "claim_13_explicit_segments": claim_13_explicit_segments,
    "claim_14_trial_algorithm": claim_14_trial_algorithm,
    "claim_15_proportional_gain": claim_15_proportional_gain,
    "claim_16_five_seconds": claim_16_five_seconds,
    "claim_17_faster": claim_17_faster,
    "claim_18_gas_hole": claim_18_gas_hole,
    "claim_19_denser_liquid": claim_19_denser_liquid,
    "claim_20_rectangular_element": claim_20_rectangular_element,
}
"""Case id, which is its folder's name, to its code."""


class UnknownCaseError(KeyError):
    """A case id that the catalogue does not hold."""

    def __str__(self) -> str:
        return str(self.args[0])


def case_code(case_id: str) -> CaseCode:
    """The two functions of a case.

    Args:
        case_id: its id.

    Returns:
        Its `case.py`.

    Raises:
        UnknownCaseError: no case of that id; the text names the nearest one.
    """
    _check_known(case_id)
    return _CODE[case_id]


@lru_cache(maxsize=64)
def load_case(case_id: str) -> CaseDefinition:
    """The text and criteria of a case.

    Args:
        case_id: its id.

    Returns:
        CaseDefinition.

    Raises:
        UnknownCaseError: no case of that id.
        CaseError: its case.toml is not what a case must be.
    """
    _check_known(case_id)
    path = files("ringbalance.verification.cases") / case_id / "case.toml"
    definition = parse_case(path.read_text(encoding="utf-8"), source=f"{case_id}/case.toml")
    if definition.id != case_id:
        raise ValueError(f'{case_id}/case.toml gives its id as "{definition.id}"')
    return definition


def load_cases() -> tuple[CaseDefinition, ...]:
    """All cases of the catalogue.

    Returns:
        Definitions, numerical verification first, then the claims by number.
    """
    return tuple(load_case(case_id) for case_id in _CODE)


def _check_known(case_id: str) -> None:
    if case_id in _CODE:
        return
    near = _by_number(case_id) or difflib.get_close_matches(case_id, _CODE, n=1, cutoff=0.5)
    guess = f', did you mean "{near[0]}"?' if near else "."
    raise UnknownCaseError(f'unknown case "{case_id}"{guess} `ringbalance verify --list` names them all.')


def _by_number(case_id: str) -> list[str]:
    """A claim may be asked for by its number alone."""
    number = re.fullmatch(r"(?:claim)?_?0*(\d+)\w*", case_id)
    wanted = f"claim_{int(number[1]):02d}_" if number else None
    return [known for known in _CODE if wanted and known.startswith(wanted)]
