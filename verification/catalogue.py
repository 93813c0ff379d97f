"""All cases, in the order in which they are reported; a case that stands here is never dropped."""

from __future__ import annotations

import difflib
from collections.abc import Mapping
from functools import lru_cache
from importlib.resources import files

from ringbalance.verification.case import CaseDefinition, parse_case
from ringbalance.verification.cases.claim_01_volume import case as claim_01_volume
from ringbalance.verification.cases.claim_02_ring_radius import case as claim_02_ring_radius
from ringbalance.verification.cases.claim_12_correction_mass import case as claim_12_correction_mass
from ringbalance.verification.cases.claim_13_explicit_segments import case as claim_13_explicit_segments
from ringbalance.verification.cases.claim_18_gas_hole import case as claim_18_gas_hole
from ringbalance.verification.cases.manufactured_2d import case as manufactured_2d
from ringbalance.verification.cases.manufactured_3d import case as manufactured_3d
from ringbalance.verification.evidence import CaseCode

_CODE: Mapping[str, CaseCode] = {
    "manufactured_2d": manufactured_2d,
    "manufactured_3d": manufactured_3d,
    "claim_01_volume": claim_01_volume,
    "claim_02_ring_radius": claim_02_ring_radius,
    "claim_12_correction_mass": claim_12_correction_mass,
    "claim_13_explicit_segments": claim_13_explicit_segments,
    "claim_18_gas_hole": claim_18_gas_hole,
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
    near = difflib.get_close_matches(case_id, _CODE, n=1)
    guess = f', did you mean "{near[0]}"?' if near else "."
    raise UnknownCaseError(f'unknown case "{case_id}"{guess} `ringbalance verify --list` names them all.')
