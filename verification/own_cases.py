"""Cases of a user's own, in folders outside the program: read, loaded and run, or refused in one sentence.

A folder holds `case.toml` and `case.py`.  What is wrong with one is a `CaseError` and stops no other.
"""

from __future__ import annotations

import dataclasses
import inspect
import sys
import traceback
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from importlib.util import module_from_spec, spec_from_file_location
from pathlib import Path
from types import ModuleType
from typing import Any, Final, SupportsFloat, cast

import numpy as np

from ringbalance.verification.case import CaseDefinition, CaseError
from ringbalance.verification.evidence import Evidence, Found, Level, NotRunError, Reference, as_found
from ringbalance.verification.result import CaseResult
from ringbalance.verification.runner import run_on, scene_of

TEXT: Final = "case.toml"
CODE: Final = "case.py"
_JUDGED: Final = (NotRunError, ValueError, ArithmeticError, RuntimeError)
"""What the run of a case makes a verdict of."""


@dataclass(frozen=True, kw_only=True)
class OwnCase:
    """A case with its text and its code."""

    folder: Path
    definition: CaseDefinition

    def run(self, scene: Any, *, level: Level = "light", mutations: bool = False) -> CaseResult:
        """The case judged on a scene, as `run_case` judges one of the program's.

        Raises: CaseError: its code cannot be loaded, or gives something else than a case must.
        """
        given = scene_of(self.definition, scene)
        return run_on(self.definition, self._code(), scene=given, level=level, mutations=mutations)

    def _code(self) -> _Code:
        path = self.folder / CODE
        module = _loaded(path)
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
    """What the run of a case asks for, from functions that may give plain numbers."""

    path: Path
    module: ModuleType
    judged: tuple[str, ...]
    """Names of the quantities that case.toml judges."""
    takes_defect: bool

    def compute(self, scene: Any, level: Level, defect: str | None = None) -> Evidence:
        """As `CaseCode.compute`."""
        arguments = (scene, level, defect) if self.takes_defect else (scene, level)
        found = self._called(self.module.compute, *arguments)
        if isinstance(found, Mapping):
            found = Evidence(found=self._numbers("compute", found, Found, as_found))
        if not isinstance(found, Evidence):
            raise CaseError(
                f"{self.path}: compute gives {_kind(found)}, not an Evidence or numbers by quantity"
            )
        self._check_names("compute", found.found, complete=True)
        return dataclasses.replace(found, reference={**found.reference, **self._reference(scene)})

    def _reference(self, scene: Any) -> Mapping[str, Reference]:
        """What judged quantities are compared with, by name; nothing where the case has none."""
        given = getattr(self.module, "reference", {})
        values = self._called(given, scene) if callable(given) else given
        if not isinstance(values, Mapping):
            raise CaseError(f"{self.path}: reference gives {_kind(values)}, not references by quantity")
        self._check_names("reference", values, complete=False)
        return self._numbers("reference", values, Reference, _as_references)

    def _called(self, function: Callable[..., Any], *arguments: Any) -> Any:
        try:
            return function(*arguments)
        except (*_JUDGED, CaseError):
            raise
        except Exception as error:
            raise CaseError(f"{self.path}: {_described(error, self.path)}") from error

    def _numbers(
        self, where: str, values: Mapping[str, Any], kind: type, made: Callable[..., Any]
    ) -> Mapping[str, Any]:
        """Records by name, plain numbers made into such."""
        plain = {name: _number(value) for name, value in values.items() if not isinstance(value, kind)}
        for name, number in plain.items():
            if number is None:
                raise CaseError(
                    f'{self.path}: {where} gives {_kind(values[name])} for "{name}", not a number or a '
                    f"{kind.__name__}"
                )
        return {**values, **made(**plain)}

    def _check_names(self, where: str, values: Mapping[str, Any], *, complete: bool) -> None:
        strange = [name for name in values if name not in self.judged]
        missing = [name for name in self.judged if name not in values] if complete else []
        if strange or missing:
            what = f'gives "{strange[0]}", which is not judged' if strange else f'lacks "{missing[0]}"'
            raise CaseError(f"{self.path}: {where} {what}; {TEXT} judges {', '.join(self.judged)}")


def own_cases(folder: Path) -> tuple[list[OwnCase], list[CaseError]]:
    """The cases in a folder, or the one that it is, by name, and what is wrong with others."""
    folders = [folder] if (folder / TEXT).is_file() else _below(folder)
    cases, errors = [], []
    for place in folders:
        try:
            cases.append(OwnCase(folder=place, definition=_definition(place / TEXT)))
        except CaseError as error:
            errors.append(error)
    if not folders:
        errors.append(CaseError(f"{folder}: there is no folder with a {TEXT} in it"))
    return cases, errors


def _below(folder: Path) -> list[Path]:
    try:
        return sorted(path.parent for path in folder.glob(f"*/{TEXT}"))
    except OSError:
        return []


def _definition(path: Path) -> CaseDefinition:
    try:
        text = path.read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError) as error:
        raise CaseError(f"{path}: it cannot be read: {error}") from error
    return CaseDefinition.parse(text, source=str(path))


def _loaded(path: Path) -> ModuleType:
    """A file's module, not entered in `sys.modules`: each run has one of its own."""
    spec = spec_from_file_location(f"own_case_{path.parent.name}", path)
    if spec is None or spec.loader is None or not path.is_file():
        raise CaseError(f"{path}: there is no such file")
    module = module_from_spec(spec)
    writes, sys.dont_write_bytecode = sys.dont_write_bytecode, True
    try:
        spec.loader.exec_module(module)
    except Exception as error:
        raise CaseError(f"{path}: {_described(error, path)}") from error
    finally:
        sys.dont_write_bytecode = writes
    return module


def _number(value: object) -> float | None:
    """A number, of numpy's too; None for what is none."""
    if isinstance(value, str) or not isinstance(value, SupportsFloat) or np.ndim(cast(Any, value)):
        return None
    return float(value)


def _as_references(**values: float) -> Mapping[str, Reference]:
    return {name: Reference(value=value) for name, value in values.items()}


def _described(error: Exception, path: Path) -> str:
    """An exception in one line, with the line of the case's own file that it comes from."""
    lines = [
        frame.lineno for frame in traceback.extract_tb(error.__traceback__) if frame.filename == str(path)
    ]
    line = error.lineno if isinstance(error, SyntaxError) else lines[-1] if lines else None
    place = "" if line is None else f"line {line}: "
    return f"{place}{type(error).__name__}: {' '.join(str(error).split())}"


def _kind(value: object) -> str:
    return f"a value of type {type(value).__name__}"
