"""What the page shows, from the evidence alone: texts, tables and figures, each made once."""

from __future__ import annotations

import base64
import io
import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import partial
from itertools import groupby
from types import MappingProxyType
from typing import Final

from PIL import Image

from ringbalance.reduced_model.calibration_record import UNSTATED
from ringbalance.reports import summary
from ringbalance.reports.equations import equation_svg, equations
from ringbalance.reports.figure import Drawing
from ringbalance.reports.pages.cases import case_view
from ringbalance.reports.pages.eccentric import BALANCER
from ringbalance.reports.prose import named_with_origin, states_uncertainty
from ringbalance.reports.section import Record
from ringbalance.reports.sections import drawings_in, section_views, viewed
from ringbalance.reports.traced import known_width, placed
from ringbalance.results.numbers import (
    PLUS_MINUS,
    measured,
)

Facts = tuple[tuple[str, str], ...]
"""Labels and texts."""

ANNEX: Final = "annex.html"
DOCUMENTS: Final[Mapping[str, Record]] = MappingProxyType(
    {
        ANNEX: {
            "place": "annex",
            "kind": "Verification annex",
            "other": {"file": "report.html", "title": "The report"},
        },
        "report.html": {
            "place": "report",
            "kind": "Verification report",
            "other": {"file": ANNEX, "title": "Annex: evidence and details"},
        },
    }
)
"""The documents by file name; the report last, for where it is, all else is."""
_LEADING: Final = re.compile(r"\d+(?:\.\d+)?")
_PICTURE_WIDTH: Final = 1000
_PICTURE_QUALITY: Final = 80
_PICTURE_EFFORT: Final = 2
"""Of 6; more saves a twentieth of the bytes in twice the time."""


def _scene_groups(rows: list[Record]) -> list[tuple[str, list[Record]]]:
    told = ({**row, "value": _as_known(row)} for row in rows)
    return [(name, list(group)) for name, group in groupby(told, key=lambda row: row["group"])]


def _as_known(row: Record) -> str:
    """A value of the scene; one that the program supplied has no more digits than its uncertainty leaves."""
    text: str = row["value"]
    value, width = _LEADING.match(text), _LEADING.match(row["uncertainty"])
    if row["origin"] != "default" or value is None or width is None:
        return text
    share = 0.01 * float(value[0]) if row["uncertainty"].endswith("%") else 1.0
    known, _, _ = measured(float(value[0]), share * float(width[0])).partition(PLUS_MINUS)
    return known + text[value.end() :]


@dataclass(frozen=True, kw_only=True)
class PageContent:
    """Everything that the templates need."""

    context: Record
    drawings: tuple[Drawing, ...]
    """Every figure on the page, for files of their own."""


def case_views(cases: list[Record]) -> Record:
    """What the page shows of the cases but the second balancer's, by id."""
    evidence = {"verification": cases}
    return {case["id"]: case_view(case) for case in (*summary.claims(evidence), *summary.checks(evidence))}


def page_content(
    evidence: Record,
    *,
    pictures: Mapping[str, bytes] | None = None,
    views_of: Callable[[list[Record]], Record] = case_views,
    sections_by: Callable[[Record], Mapping[str, Record | None]] = section_views,
) -> PageContent:
    """Turn the evidence into texts, tables and figures.

    Args: `pictures`: PNG bytes by the file names that the evidence lists; a picture that is missing is left
    out. `views_of`, `sections_by`: what `case_views` and `section_views` answer, perhaps made by another
    process while this one draws the rest.
    Raises: KeyError: an evidence document that lacks a part.
    """
    if evidence.get("balancer") == BALANCER:
        sections = viewed(evidence, sections_by(evidence))
        cases = summary.claims(evidence, paper=BALANCER)
        claims = [{**case_view(case), "elsewhere": False} for case in cases]
        context = {**_frame(evidence, sections), "claims": claims}
        return PageContent(context=context, drawings=tuple(drawings_in([sections, claims])))
    sections = viewed(evidence, sections_by(evidence))
    views = views_of(evidence["verification"])
    claims = [
        {**views[case["id"]], "elsewhere": summary.elsewhere(case, evidence)}
        for case in summary.claims(evidence)
    ]
    checks = [views[case["id"]] for case in summary.checks(evidence)]
    context = {
        **_frame(evidence, sections),
        "tallies": _tallies(evidence),
        "causes": summary.common_causes(summary.claims(evidence)),
        "equations": _equations(),
        "pictures": _pictures(evidence["pictures"], pictures or {}),
        "claims": claims,
        "checks": checks,
    }
    own = [[case["order_plot"], *case["drawings"]] for case in (*claims, *checks)]
    drawings = drawings_in([sections, *own])
    return PageContent(context=context, drawings=tuple(drawings))


def _frame(evidence: Record, sections: list[Record]) -> Record:
    """What the page of any scene has."""
    return {
        "e": placed(evidence),
        "known": partial(known_width, stated=states_uncertainty(evidence)),
        "named": partial(named_with_origin, evidence),
        "unstated": UNSTATED,
        "scene": evidence["scene"],
        "sections": sections,
        "stamp": _stamp(evidence),
        "running_head": _running_head(evidence),
        "scene_groups": _scene_groups(evidence["scene"]["table"]),
        "product": f"ringbalance {evidence['versions']['ringbalance']}",
    }


def _stamp(evidence: Record) -> Facts:
    return (
        ("Scene", evidence["scene"]["file"]),
        ("Hash", evidence["scene"]["sha256"][:12]),
        ("Effort", evidence["level"]),
        ("Date", evidence["times"]["date"]),
        ("ringbalance", evidence["versions"]["ringbalance"]),
    )


def _running_head(evidence: Record) -> str:
    scene = evidence["scene"]
    return f"{scene['name']}, scene {scene['sha256'][:12]}, {evidence['times']['date']}"


def _tallies(evidence: Record) -> Record:
    return {
        "lead": summary.lead_sentence(evidence),
        "claims": summary.verdict_counts(summary.claims(evidence), summary.CLAIM_VERDICTS),
        "checks": summary.verdict_counts(summary.checks(evidence), summary.CHECK_VERDICTS),
    }


def _equations() -> Record:
    return {
        name: {"svg": equation_svg(item.latex, item.words, f"eq-{name}"), "source": item.source}
        for name, item in equations().items()
    }


def _data_address(content: bytes) -> str:
    """A picture as part of the page, packed: a quarter of the bytes, and no difference to the eye."""
    packed = io.BytesIO()
    with Image.open(io.BytesIO(content)) as picture:
        picture.thumbnail((_PICTURE_WIDTH, _PICTURE_WIDTH))
        picture.save(packed, format="WEBP", quality=_PICTURE_QUALITY, method=_PICTURE_EFFORT)
    return "data:image/webp;base64," + base64.b64encode(packed.getvalue()).decode("ascii")


def _pictures(record: Record, contents: Mapping[str, bytes]) -> Record:
    """Pictures by name, with their bytes; one that lacks a variant is left out."""
    shown_pictures: Record = {"text": record["text"], "disc": None, "pressure": None, "tube": None}
    for item in record["files"]:
        if item["light"] in contents and item["dark"] in contents:
            variants = {key: _data_address(contents[item[key]]) for key in ("light", "dark")}
            shown_pictures[item["name"]] = {**item, **variants}
    return shown_pictures
