"""All cases, found by their folders, in the order in which they are reported."""

from __future__ import annotations

import difflib
import re
from collections.abc import Sequence
from functools import lru_cache, partial
from importlib.resources import files
from types import SimpleNamespace
from typing import Final, cast

from ringbalance.verification import cases
from ringbalance.verification.case import CaseDefinition, CaseError
from ringbalance.verification.evidence import CaseCode

_PAPERS: Final = ("liquid_ring", "eccentric_mass")


@lru_cache(maxsize=1)
def case_ids() -> tuple[str, ...]:
    """Ids of all cases: the names of the folders that hold a case.toml, sorted."""
    folders = (item for item in files(cases).iterdir() if item.is_dir())
    return tuple(sorted(item.name for item in folders if (item / "case.toml").is_file()))


class UnknownCaseError(KeyError):
    """A case id that the catalogue does not hold."""

    def __str__(self) -> str:
        return str(self.args[0])


def case_code(case_id: str) -> CaseCode:
    """The function that a case's text names, with `<name>_ends` where there is one; else its `case.py`.

    Raises: UnknownCaseError: no such id; the text names the nearest one.
    """
    study = load_case(case_id).study
    if study is None:
        return cast(CaseCode, getattr(cases, f"cases.{case_id}.case"))
    place, _, name = study.of.rpartition(".")
    module = getattr(cases, place)
    compute = partial(getattr(module, name), **study.settings)
    return cast(CaseCode, SimpleNamespace(compute=compute, ends=getattr(module, f"{name}_ends", None)))


@lru_cache(maxsize=64)
def load_case(case_id: str) -> CaseDefinition:
    """The text and criteria of a case. Raises: UnknownCaseError, or CaseError: its case.toml is not one."""
    _check_known(case_id)
    path = files(cases) / case_id / "case.toml"
    definition = CaseDefinition.parse(path.read_text(encoding="utf-8"), source=f"{case_id}/case.toml")
    if definition.id != case_id:
        raise CaseError(f'{case_id}/case.toml: it gives its id as "{definition.id}"')
    return definition


def load_cases() -> tuple[CaseDefinition, ...]:
    """All cases in the order of the report: first by `order`, then the claims by paper and number."""
    return tuple(sorted(map(load_case, case_ids()), key=place))


def place(definition: CaseDefinition) -> tuple[bool, int, int, str]:
    """By which cases are sorted for the report."""
    claim = definition.kind == "claim"
    position = definition.number if claim else definition.order
    return claim, _PAPERS.index(definition.paper) if claim else 0, position or 0, definition.id


def _check_known(case_id: str) -> None:
    if case_id in case_ids():
        return
    raise unknown_case(case_id, case_ids())


def unknown_case(case_id: str, known: Sequence[str]) -> UnknownCaseError:
    """The error of an id that is none of those known, with the nearest."""
    near = _by_number(case_id) or difflib.get_close_matches(case_id, known, n=1, cutoff=0.5)
    guess = f', did you mean "{near[0]}"?' if near else "."
    return UnknownCaseError(f'unknown case "{case_id}"{guess} `ringbalance verify --list` names them all.')


def _by_number(case_id: str) -> list[str]:
    """A claim may be asked for by its number alone."""
    number = re.fullmatch(r"(?:claim)?_?0*(\d+)\w*", case_id)
    wanted = f"claim_{int(number[1]):02d}_" if number else None
    return [known for known in case_ids() if wanted and known.startswith(wanted)]
