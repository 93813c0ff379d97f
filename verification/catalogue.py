"""All cases, in the order in which they are reported; a case that stands here is never dropped."""

from __future__ import annotations

import difflib
import re
from functools import lru_cache
from importlib.resources import files
from typing import Final, cast

from ringbalance.verification import cases
from ringbalance.verification.case import CaseDefinition, parse_case
from ringbalance.verification.evidence import CaseCode

CASES: Final = (
    "manufactured_2d",
    "manufactured_3d",
    "gravity_circle_2d",
    "gravity_paraboloid_3d",
    "conservation",
    "manufactured_flow",
    "rotating_section",
    "developing_flow",
    "sloshing",
    "gci_celik2008",
    "gci_behaviour",
    "independent_routes",
    "integrator_orders",
    "friction_blend",
    "mixing_length",
    "model_choice",
    "model_choice_many",
    "coverage",
    "bent_tube_3d",
    "extremes",
    "claim_01_volume",
    "claim_02_ring_radius",
    "claim_03_chamber_moment",
    "claim_04_disc_capacity",
    "claim_05_density",
    "claim_06_wall_pressure",
    "claim_07_bernoulli",
    "claim_08_velocity_departure",
    "claim_09_drag_coefficient",
    "claim_10_working_pressure",
    "claim_11_lambda",
    "claim_12_correction_mass",
    "claim_13_explicit_segments",
    "claim_14_trial_algorithm",
    "claim_15_proportional_gain",
    "claim_16_five_seconds",
    "claim_17_faster",
    "claim_18_gas_hole",
    "claim_19_denser_liquid",
    "claim_20_rectangular_element",
    "driven_fig4_imbalance",
    "driven_fig5_friction",
    "driven_fig6_effort",
    "driven_fig7_positioning",
    "driven_fig8_fine_tuning",
    "driven_fig9_run_up",
    "driven_bound",
)
"""Ids, which are the names of their folders: numerical verification first, then claims, paper by paper."""


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
    return cast(CaseCode, getattr(cases, f"{case_id}_code"))


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
    path = files(cases) / case_id / "case.toml"
    definition = parse_case(path.read_text(encoding="utf-8"), source=f"{case_id}/case.toml")
    if definition.id != case_id:
        raise ValueError(f'{case_id}/case.toml gives its id as "{definition.id}"')
    return definition


def load_cases() -> tuple[CaseDefinition, ...]:
    """All cases of the catalogue.

    Returns:
        Definitions, numerical verification first, then the claims by number.
    """
    return tuple(load_case(case_id) for case_id in CASES)


def _check_known(case_id: str) -> None:
    if case_id in CASES:
        return
    near = _by_number(case_id) or difflib.get_close_matches(case_id, CASES, n=1, cutoff=0.5)
    guess = f', did you mean "{near[0]}"?' if near else "."
    raise UnknownCaseError(f'unknown case "{case_id}"{guess} `ringbalance verify --list` names them all.')


def _by_number(case_id: str) -> list[str]:
    """A claim may be asked for by its number alone."""
    number = re.fullmatch(r"(?:claim)?_?0*(\d+)\w*", case_id)
    wanted = f"claim_{int(number[1]):02d}_" if number else None
    return [known for known in CASES if wanted and known.startswith(wanted)]
