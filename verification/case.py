"""A case's text and criteria, `case.toml`, as a validated record: the claim stands before the result.

Numbers come into its prose from the evidence alone, at placeholders {name}, {name:unit} or
{name:unit:format}, such as {stall:MPa}, {low:%:.1f} or {count:1:d}.
"""

from __future__ import annotations

import math
import re
import tomllib
from collections.abc import Mapping
from dataclasses import dataclass, field
from types import MappingProxyType
from typing import Annotated, Any, Final, Literal

from ringbalance.scene.faults import SceneError
from ringbalance.scene.typed_record import Condition, record_from
from ringbalance.verification.standing import SUBJECTS
from ringbalance.verification.verdicts import VOCABULARY, Kind, Metric, Role, Verdict

Text = Annotated[str, Condition.text(r".{3,}", "a text of three characters or more")]
CAUSES: Final[Mapping[str, str]] = MappingProxyType(
    {
        "": "",
        "plates": "support plates left out",
        "tube": "tube and siphon crest not given",
        "settings": "controller settings not given",
        "gas_pressure": "gas pressure not raised with the density",
        "two_masses": "transferred mass taken for the difference of two",
        "gravity": "surface at rest left out",
        "gas_hole": "hole of the gas not given",
        "eccentric_masses": "own mass of the eccentric masses left out",
        "friction": "friction left to the regulator",
        "force": "force of the turning masses left out",
        "drives": "drives taken to hold the masses",
        "cost": "neither vibration nor power in the cost",
    }
)
"""Common causes of a claim's departure, as readers see them."""
Identifier = Annotated[
    str, Condition.text(r"[a-z][a-z0-9_]*", "small letters, digits and underscores, first a letter")
]
Basis = Literal["total", "per unit depth", "pointwise", "ratio", "count", "time"]
_ReferenceKind = Literal[
    "printed number",
    "printed formula",
    "closed form",
    "manufactured solution",
    "published data",
    "conservation law",
    "independent calculation",
    "definition",
]
NEEDS_REFERENCE: tuple[Metric, ...] = ("validation", "within_uncertainty", "relative", "absolute")
_UNITS = {
    "": (1.0, ""),
    "1": (1.0, ""),
    "%": (100.0, " %"),
    "MPa": (1e-6, " MPa"),
    "kPa": (1e-3, " kPa"),
    "Pa": (1.0, " Pa"),
    "m": (1.0, " m"),
    "mm": (1e3, " mm"),
    "um": (1e6, " µm"),
    "ml": (1e6, " ml"),
    "g mm": (1e6, " g mm"),
    "m/s": (1.0, " m/s"),
    "s": (1.0, " s"),
    "ms": (1e3, " ms"),
    "g": (1e3, " g"),
    "kg/m^3": (1.0, " kg/m³"),
    "rpm": (30 / math.pi, " rpm"),
    "deg": (180 / math.pi, "°"),
    "N": (1.0, " N"),
    "cSt": (1e6, " mm²/s"),
    "um/(g*mm)": (1.0, " µm/(g mm)"),
}
_PLACEHOLDER = re.compile(r"\{([a-z][a-z0-9_]*)(?::([^:{}]*))?(?::([^{}]*))?\}")


class CaseError(Exception):
    """A case.toml, or its code, that is not what a case must be; each line names the file and one error."""


@dataclass(frozen=True, kw_only=True)
class _ReferenceText:
    """Source of the reference and its uncertainty."""

    kind: _ReferenceKind
    source: Text
    uncertainty: Text
    doubts: tuple[Text, ...] = ()


@dataclass(frozen=True, kw_only=True)
class RestsOn:
    """An input that decides a claim, by its scene path; varied over its range unless given or measured."""

    path: Annotated[str, Condition.text(r"[a-z_]+\.[a-z_]+", "table.key")]
    low: float | None = None
    """Smallest and largest value, SI, where this claim has its own reason for them."""
    high: float | None = None
    documented: bool = False
    """True if the documented range counts even where the scene states one, such as for an input that was
    inferred from this very claim."""
    covered: str = ""
    """Reason why the case is not computed at the ends of its range: something else accounts for it."""
    why: str = ""
    """Reason for a range of its own, or for taking the documented one."""

    def __post_init__(self) -> None:
        ranged = self.low is not None
        if ranged != (self.high is not None) or bool(self.why) != (ranged or self.documented):
            raise ValueError(f"{self.path}: low, high and why, or documented and why, or the path alone")


@dataclass(frozen=True, kw_only=True)
class _LeftOut:
    """Readings that a validation does not judge; the case's numbers `<name>_points` and so on count them."""

    name: Identifier
    why: Text
    """Text after their number, such as "of shorter tubes, which flow leaves before it has developed"."""
    taught: bool = False
    """True if a coefficient was fitted to them: then they are no predictions and count in no total."""


@dataclass(frozen=True, kw_only=True)
class JudgedQuantity:
    """One judged number, with a limit and the reason for it, both set before the result."""

    name: Identifier
    title: Text
    unit: Annotated[str, Condition.text(r".+", 'a unit, or "1"')]
    basis: Basis
    metric: Metric
    limit: float
    why: Text
    judges: Role = "number"
    """Subject judged: a claim's number, the idea behind it, or one reading of an ambiguous claim."""
    correction: str = ""
    """Named correction after which a claim's number is reproduced."""
    against: str = ""
    """Note on the number compared with a claim, such as "by Eq. 12", where the paper does not print it."""


@dataclass(frozen=True, kw_only=True)
class Mutation:
    """A mutation that must change the verdict: built into the computation by name, or a changed scene."""

    id: Identifier
    what: Text
    expect: Verdict
    scene: Mapping[str, float | Literal["absent"]] = field(default_factory=dict)
    """Overrides of scene quantities in SI, such as "disc.plate_thickness" = 0.0; "absent" removes one."""
    cost: Literal["light", "heavy"] = "light"


@dataclass(frozen=True, kw_only=True)
class _Study:
    """Function of the program that computes a case."""

    of: Annotated[str, Condition.text(r"[a-z0-9_]+(\.[a-z0-9_]+){2,}", "folder.module.function")]
    settings: Mapping[str, Any] = field(default_factory=dict)
    """Further arguments by name, where several cases share it."""


@dataclass(frozen=True, kw_only=True)
class CaseDefinition:
    """Text and criteria of a case: everything that is not computed."""

    id: Identifier
    paper: Literal["liquid_ring", "eccentric_mass"] = "liquid_ring"
    """Paper of a claim, or of the balancer that a check belongs to."""
    number: int | None = None
    """Number of the claim, from 1 in each paper."""
    order: int | None = None
    """Position in the report of a case that is no claim; claims go by their number."""
    kind: Kind
    about: tuple[Identifier, ...] = ()
    """Subjects that the case is evidence for, keys of `SUBJECTS`; claims are evidence for none."""
    title: Text
    claim: Text
    """One sentence: what is claimed, or required of the program."""
    protects: Text
    assumes: tuple[Text, ...]
    does_not_cover: tuple[Text, ...]
    explanation: str = ""
    """The result and its reason, with placeholders for its numbers."""
    consequence: Mapping[str, Text] = field(default_factory=dict)
    """One sentence for a designer, by verdict, or "default"."""
    equations: tuple[Text, ...] = ()
    reference: _ReferenceText
    study: _Study | None = None
    """The function that computes it; a user's own case has a `case.py`."""
    judged_on: Literal["scene", "paper"] = "scene"
    """Judged system: the scene at hand, or the paper's own disc or rotor with eccentric masses."""
    shape: Literal["any", "sector"] = "any"
    """Chambers that can be judged: imported ones too, or only the sector between plates of the keys."""
    cause: str = ""
    """Reason why a claim does not simply hold, one of `CAUSES`; shared by claims that fail together."""
    judgement: str = ""
    """Reason why the criteria lead to this verdict and no other, where that may be disputed."""
    rests_on: tuple[RestsOn, ...] = ()
    """Inputs that decide the claim."""
    left_out: tuple[_LeftOut, ...] = ()
    """Readings in the sources of a validation on which no verdict rests."""
    headline: bool = False
    cost: Literal["light", "heavy"] = "light"
    quantity: tuple[JudgedQuantity, ...]
    must_fail: tuple[Mutation, ...]

    @classmethod
    def parse(cls, text: str, *, source: str) -> CaseDefinition:
        """Read a case.toml. Raises: CaseError: not TOML, or not a case, with all errors at once."""
        try:
            return record_from(CaseDefinition, tomllib.loads(text), file=source)
        except tomllib.TOMLDecodeError as error:
            raise CaseError(f"{source}: {error}") from error
        except SceneError as error:
            raise CaseError(str(error)) from error

    @property
    def prose(self) -> tuple[str, ...]:
        """Texts that may hold placeholders."""
        return (self.explanation, self.judgement, *self.consequence.values(), *self.reference.doubts)

    def consequence_of(self, verdict: Verdict) -> str:
        """The sentence for a designer that goes with a verdict, placeholders still in it."""
        return self.consequence.get(verdict.value, self.consequence.get("default", ""))

    def __post_init__(self) -> None:
        """Raises: ValueError: keys that contradict each other."""
        if not (self.quantity and self.must_fail):
            raise ValueError("at least one quantity and one must_fail are needed")
        if (self.number is None) == (self.kind == "claim"):
            raise ValueError("a claim has a number, and nothing else has one")
        if self.order is not None and self.kind == "claim":
            raise ValueError("a claim has no order: its place in the report follows from its number")
        unknown = [subject for subject in self.about if subject not in SUBJECTS]
        if unknown or (self.kind == "claim" and self.about):
            raise ValueError(f"about: a case that is no claim may name some of {', '.join(SUBJECTS)}")
        _unique("quantity", [quantity.name for quantity in self.quantity])
        _unique("rests_on", [needed.path for needed in self.rests_on])
        _unique("left_out", [readings.name for readings in self.left_out])
        if self.left_out and self.kind != "validation":
            raise ValueError("left_out: only a validation leaves readings out")
        _unique("must_fail", [mutation.id for mutation in self.must_fail])
        self._check_quantities_and_mutations()
        self._check_claim_and_consequence()
        for text in self.prose:
            placeholders(text)

    def _check_quantities_and_mutations(self) -> None:
        for quantity in self.quantity:
            if quantity.metric == "validation" and self.kind not in ("claim", "validation"):
                raise ValueError(
                    f'{quantity.name}: metric "validation" is for claims and validation; '
                    'use "within_uncertainty"'
                )
            if quantity.metric in NEEDS_REFERENCE and quantity.limit <= 0:
                raise ValueError(f"{quantity.name}: limit must be positive")
        for mutation in self.must_fail:
            if mutation.expect not in VOCABULARY[self.kind] or mutation.expect is Verdict.NOT_RUN:
                raise ValueError(f'{mutation.id}: a {self.kind} case cannot come out "{mutation.expect}"')
            if self.kind.endswith("verification") and mutation.expect is not Verdict.FAILED:
                raise ValueError(f'{mutation.id}: a mutation of a {self.kind} case must come out "failed"')

    def _check_claim_and_consequence(self) -> None:
        ideas = [quantity for quantity in self.quantity if quantity.judges == "idea"]
        plain = all(q.judges == "number" and not q.correction for q in self.quantity)
        if self.kind != "claim" and not (plain and not self.cause and not self.rests_on):
            raise ValueError("judges, correction, cause and rests_on are for claims")
        if self.cause not in CAUSES:
            raise ValueError(f"cause: one of {', '.join(filter(None, CAUSES))}")
        if any(quantity.correction for quantity in self.quantity) and not ideas:
            raise ValueError("a correction needs a quantity that judges the idea")
        verdicts = [verdict.value for verdict in VOCABULARY[self.kind]]
        unknown = [key for key in self.consequence if key not in (*verdicts, "default")]
        if unknown:
            raise ValueError(f'consequence: "{unknown[0]}" is no verdict of a {self.kind} case')
        missing = [word for word in verdicts if word != "not run" and word not in self.consequence]
        if self.consequence and missing and "default" not in self.consequence:
            raise ValueError(f'consequence: nothing for "{missing[0]}", and no default')


def _unique(what: str, names: list[str]) -> None:
    if len(set(names)) != len(names):
        raise ValueError(f"{what}: a name stands twice in {names}")


def placeholders(text: str) -> tuple[str, ...]:
    """Names of the numbers that a text asks for, in order of appearance.

    Raises: ValueError: a unit that is not known, or braces that are not a placeholder.
    """
    for match in _PLACEHOLDER.finditer(text):
        if (match[2] or "") not in _UNITS:
            raise ValueError(f"placeholder {match[0]} has an unknown unit; known: {', '.join(_UNITS)}")
    rest = _PLACEHOLDER.sub("", text)
    if "{" in rest or "}" in rest:
        raise ValueError(f"braces that are no placeholder in: {text}")
    return tuple(match[1] for match in _PLACEHOLDER.finditer(text))


def fill(text: str, numbers: Mapping[str, float]) -> str:
    """A text with SI values put in by name.

    Each is written in the unit that its placeholder names, with four significant digits unless the
    placeholder has a format, and joined to its unit by a no-break space.
    Raises: ValueError: a number that is missing or not finite.
    """

    def number(match: re.Match[str]) -> str:
        name, unit, style = match[1], match[2] or "", match[3] or "#.4g"
        if name not in numbers:
            raise ValueError(f'the evidence holds no number "{name}"')
        if not math.isfinite(numbers[name]):
            raise ValueError(f'the number "{name}" is not finite')
        factor, symbol = _UNITS[unit]
        value = numbers[name] * factor
        digits = format(round(value) if style.endswith("d") else value, style)
        if style.startswith("#"):
            digits = digits.rstrip(".")
        if "e" not in digits:
            digits = digits.replace("-", "\u2212")
        return digits + symbol.replace(" ", "\u00a0")

    return _PLACEHOLDER.sub(number, text)
