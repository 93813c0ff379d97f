"""All cases, by their folders: the program's in the order in which they are reported, and a user's own.

An error in a user's own case is a `CaseError` in one sentence and does not stop other cases.
"""

from __future__ import annotations

import dataclasses
import difflib
import inspect
import re
import sys
import traceback
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache, partial
from importlib.resources import files
from importlib.util import module_from_spec, spec_from_file_location
from pathlib import Path
from types import ModuleType, SimpleNamespace
from typing import Any, Final, SupportsFloat, cast

import numpy as np

from ringbalance.verification import cases
from ringbalance.verification.case import CaseDefinition, CaseError
from ringbalance.verification.evidence import (
    CaseCode,
    Evidence,
    Found,
    Level,
    NotRunError,
    Reference,
)

_PAPERS: Final = ("liquid_ring", "eccentric_mass")
_TEXT: Final = "case.toml"
_CODE: Final = "case.py"
_JUDGED: Final = (NotRunError, ValueError, ArithmeticError, RuntimeError)
"""Errors that the run of a case turns into a verdict."""


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
    """The function that a case's text names, with `<name>_ends` where there is one.

    Raises: UnknownCaseError: no such id; the text names the nearest one.
    """
    study = load_case(case_id).study
    assert study is not None, f"{case_id}: no [study]"
    module_name, _, name = study.of.rpartition(".")
    module = getattr(cases, module_name)
    compute = partial(getattr(module, name), **study.settings)
    return cast(CaseCode, SimpleNamespace(compute=compute, ends=getattr(module, f"{name}_ends", None)))


@lru_cache(maxsize=64)
def load_case(case_id: str) -> CaseDefinition:
    """Text and criteria of a case. Raises: UnknownCaseError: no such id; CaseError: an invalid case.toml."""
    if case_id not in case_ids():
        raise unknown_case(case_id, case_ids())
    path = files(cases) / case_id / "case.toml"
    definition = CaseDefinition.parse(path.read_text(encoding="utf-8"), source=f"{case_id}/case.toml")
    if definition.id != case_id:
        raise CaseError(f'{case_id}/case.toml: it gives its id as "{definition.id}"')
    return definition


def load_cases() -> tuple[CaseDefinition, ...]:
    """All cases in the order of the report: first by `order`, then the claims by paper and number."""
    return tuple(sorted(map(load_case, case_ids()), key=report_order))


def report_order(definition: CaseDefinition) -> tuple[bool, int, int, str]:
    """Key by which cases are sorted for the report."""
    claim = definition.kind == "claim"
    position = definition.number if claim else definition.order
    return claim, _PAPERS.index(definition.paper) if claim else 0, position or 0, definition.id


def unknown_case(case_id: str, ids: Sequence[str]) -> UnknownCaseError:
    """Error for an id that is not among `ids`; its text names the nearest one."""
    # A claim may be asked for by its number alone.
    number = re.fullmatch(r"(?:claim)?_?0*(\d+)\w*", case_id)
    start = f"claim_{int(number[1]):02d}_" if number else None
    near = [name for name in case_ids() if start and name.startswith(start)]
    near = near or difflib.get_close_matches(case_id, ids, n=1, cutoff=0.5)
    guess = f', did you mean "{near[0]}"?' if near else "."
    return UnknownCaseError(f'unknown case "{case_id}"{guess} `ringbalance verify --list` names them all.')


@dataclass(frozen=True, kw_only=True)
class OwnCase:
    """A case of a user's own, in a folder outside the program that holds `case.toml` and `case.py`."""

    folder: Path
    definition: CaseDefinition

    def code(self) -> CaseCode:
        """Load its functions. Raises: CaseError: they cannot be loaded, or take other arguments."""
        path = self.folder / _CODE
        spec = spec_from_file_location(f"own_case_{self.folder.name}", path)
        if spec is None or spec.loader is None or not path.is_file():
            raise CaseError(f"{path}: there is no such file")
        # The module is not entered in `sys.modules`: each run loads it again.
        module = module_from_spec(spec)
        writes, sys.dont_write_bytecode = sys.dont_write_bytecode, True
        try:
            spec.loader.exec_module(module)
        except Exception as error:
            raise CaseError(f"{path}: {_described(error, path)}") from error
        finally:
            sys.dont_write_bytecode = writes
        compute = getattr(module, "compute", None)
        if not callable(compute):
            raise CaseError(f"{path}: there is no function compute(scene, level, defect=None)")
        takes_defect = len(inspect.signature(compute).parameters) > 2
        built_in = [mutation.id for mutation in self.definition.must_fail if not mutation.scene]
        if built_in and not takes_defect:
            raise CaseError(
                f"{path}: compute takes no third argument, the mutation to build in; mutation "
                f'"{built_in[0]}" needs it, because it changes no value of the scene'
            )
        judged = tuple(quantity.name for quantity in self.definition.quantity)
        return _Code(path=path, module=module, judged=judged, takes_defect=takes_defect)


@dataclass(frozen=True, kw_only=True)
class _Code:
    """Code of a user's own case, whose functions may return plain numbers."""

    path: Path
    module: ModuleType
    judged: tuple[str, ...]
    """Names of the quantities that case.toml judges."""
    takes_defect: bool

    def compute(self, scene: Any, level: Level, defect: str | None = None) -> Evidence:
        """Evidence from the case's functions. Raises: CaseError: they fail or return another type."""
        arguments = (scene, level, defect) if self.takes_defect else (scene, level)
        evidence = self._called(self.module.compute, *arguments)
        if isinstance(evidence, Mapping):
            evidence = Evidence(quantities=self._records("compute", evidence, Found))
        if not isinstance(evidence, Evidence):
            raise CaseError(
                f"{self.path}: compute gives {_kind(evidence)}, not an Evidence or numbers by quantity"
            )
        self._check_names("compute", evidence.quantities, complete=True)
        references = getattr(self.module, "reference", {})
        references = self._called(references, scene) if callable(references) else references
        if not isinstance(references, Mapping):
            raise CaseError(f"{self.path}: reference gives {_kind(references)}, not references by quantity")
        self._check_names("reference", references, complete=False)
        references = self._records("reference", references, Reference)
        quantities = {
            name: number.against(references[name]) if name in references else number
            for name, number in evidence.quantities.items()
        }
        return dataclasses.replace(evidence, quantities=quantities)

    def _called(self, function: Callable[..., Any], *arguments: Any) -> Any:
        try:
            return function(*arguments)
        except (*_JUDGED, CaseError):
            raise
        except Exception as error:
            raise CaseError(f"{self.path}: {_described(error, self.path)}") from error

    def _records(self, function: str, values: Mapping[str, Any], kind: Callable[..., Any]) -> dict[str, Any]:
        """Records of a kind by name; plain numbers, numpy's included, are converted."""
        records = {}
        for name, value in values.items():
            if type(value) is kind:
                records[name] = value
            elif isinstance(value, SupportsFloat) and not isinstance(value, str) and not np.ndim(value):  # type: ignore[arg-type]
                records[name] = kind(value=float(value))
            else:
                raise CaseError(
                    f'{self.path}: {function} gives {_kind(value)} for "{name}", not a number or a '
                    f"{kind.__name__}"
                )
        return records

    def _check_names(self, function: str, values: Mapping[str, Any], *, complete: bool) -> None:
        unknown = [name for name in values if name not in self.judged]
        missing = [name for name in self.judged if name not in values] if complete else []
        if unknown or missing:
            what = f'gives "{unknown[0]}", which is not judged' if unknown else f'lacks "{missing[0]}"'
            raise CaseError(f"{self.path}: {function} {what}; {_TEXT} judges {', '.join(self.judged)}")


def own_cases(folder: Path) -> tuple[list[OwnCase], list[CaseError]]:
    """Cases in a folder, by name, or the case that the folder is, and the errors of unreadable ones."""
    if (folder / _TEXT).is_file():
        folders = [folder]
    else:
        try:
            folders = sorted(path.parent for path in folder.glob(f"*/{_TEXT}"))
        except OSError:
            folders = []
    cases, errors = [], []
    for case_folder in folders:
        path = case_folder / _TEXT
        try:
            text = path.read_text(encoding="utf-8")
            cases.append(OwnCase(folder=case_folder, definition=CaseDefinition.parse(text, source=str(path))))
        except (OSError, UnicodeDecodeError) as error:
            errors.append(CaseError(f"{path}: it cannot be read: {error}"))
        except CaseError as error:
            errors.append(error)
    if not folders:
        errors.append(CaseError(f"{folder}: there is no folder with a {_TEXT} in it"))
    return cases, errors


def _described(error: Exception, path: Path) -> str:
    """An exception in one line, with the line of the case's own file that it comes from."""
    source = str(path.absolute())
    lines = [frame.lineno for frame in traceback.extract_tb(error.__traceback__) if frame.filename == source]
    line = error.lineno if isinstance(error, SyntaxError) else lines[-1] if lines else None
    position = "" if line is None else f"line {line}: "
    return f"{position}{type(error).__name__}: {' '.join(str(error).split())}"


def _kind(value: object) -> str:
    return f"a value of type {type(value).__name__}"
