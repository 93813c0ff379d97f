"""Report and annex, self-contained, from the evidence alone: nothing is calculated, nothing is fetched."""

from __future__ import annotations

import base64
import io
import re
from collections import Counter
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from functools import cache, partial
from importlib.resources import files
from itertools import groupby
from types import MappingProxyType
from typing import Final

import jinja2
from markupsafe import Markup, escape
from PIL import Image

from ringbalance.reports import summary
from ringbalance.reports.figure import DARK, LIGHT, Drawing
from ringbalance.reports.pages.cases import FILTERS as QUANTITY_FILTERS
from ringbalance.reports.pages.cases import deciding
from ringbalance.reports.prose import (
    GLYPHS,
    equation_svg,
    equations,
    input_name,
    key_words,
    named_with_origin,
    opening,
    paths_named,
    share_glyphs,
)
from ringbalance.reports.section import Record
from ringbalance.reports.sections import CASES_VIEW, PREFIXES, drawings_in, numbered, views_of
from ringbalance.reports.traced import (
    FILTERS,
    budgets_of,
    finished,
    listing_of,
    placed,
    states_uncertainty,
    table_of,
)
from ringbalance.results.numbers import (
    PLUS_MINUS,
    believed,
    measured,
)
from ringbalance.results.rows import series
from ringbalance.scene.describe import usual_name

_UNSTATED: Final = (
    "The scene states no uncertainty of its inputs, so ± does not include them; a value without ± is known "
    "no better than the inputs."
)
_ANNEX: Final = "annex.html"
DOCUMENTS: Final[Mapping[str, Record]] = MappingProxyType(
    {
        _ANNEX: {
            "name": "annex",
            "kind": "Annex",
            "other": {"file": "report.html", "title": "The report"},
        },
        "report.html": {
            "name": "report",
            "kind": "Design report",
            "other": {"file": _ANNEX, "title": "Annex: evidence and details"},
        },
    }
)
"""The documents by file name; the report is written last: where it exists, all other files do."""
_LEADING: Final = re.compile(r"\d+(?:\.\d+)?")
_WEBP_WIDTH_PIXELS: Final = 800
_WEBP: Final[Record] = {"format": "WEBP", "quality": 70, "method": 6}


def _scene_groups(rows: list[Record]) -> list[tuple[str, list[Record]]]:
    """Rows of values by group; defaults of the program with no more digits than are certain."""
    shown = []
    for row in rows:
        text: str = row["value"]
        value, width = _LEADING.match(text), _LEADING.match(row["uncertainty"])
        if row["origin"] == "default" and value is not None and width is not None:
            share = 0.01 * float(value[0]) if row["uncertainty"].endswith("%") else 1.0
            digits, _, _ = measured(float(value[0]), share * float(width[0])).partition(PLUS_MINUS)
            text = digits + text[value.end() :]
        shown.append({**row, "value": text})
    return [(name, list(group)) for name, group in groupby(shown, key=lambda row: row["group"])]


def _is_plain(row: Record) -> bool:
    return row["origin"] == "default" and not row["uncertainty"]


@dataclass(frozen=True, kw_only=True)
class _PageContent:
    """Context of the templates, and all figures of the pages, to be written as files."""

    context: Record
    drawings: tuple[Drawing, ...]


def page_content(
    evidence: Record,
    *,
    pictures: Mapping[str, bytes] | None = None,
    views: Mapping[str, Record | None] | None = None,
) -> _PageContent:
    """Turn the evidence into texts, tables and figures.

    Args: `pictures`: PNG bytes by the file names that the evidence lists; a picture that is missing is left
    out. `views`: result of `views_of`, perhaps from another process.
    Raises: KeyError: an evidence document that lacks a part.
    """
    views = views_of(evidence) if views is None else views
    sections, of_cases = numbered(evidence, views), views[CASES_VIEW] or {}
    cases = {
        case["id"]: {
            **of_cases[case["id"]],
            "quantities": placed(case.get("quantities") or [], f"{CASES_VIEW}.{case['id']}.quantities"),
            # All claims on eccentric masses are judged on the paper's rotor.
            "elsewhere": case.get("paper") != "eccentric_mass" and summary.elsewhere(case, evidence),
        }
        for case in evidence[CASES_VIEW]
    }
    claims = summary.claims(evidence)
    scene, date = evidence["scene"], evidence["times"]["date"]
    program = evidence["versions"]["ringbalance"]
    context = {
        "e": placed(evidence),
        "known": partial(believed, stated=states_uncertainty(evidence)),
        "named": partial(named_with_origin, evidence),
        "unstated": _UNSTATED,
        "budgets": budgets_of(placed(evidence)),
        "scene": scene,
        "papers": summary.is_papers(evidence),
        "stamp": (
            ("Scene", scene["file"]),
            ("Hash", scene["sha256"][:12]),
            ("Effort", evidence["level"]),
            ("Date", date),
            ("ringbalance", program),
        ),
        "running_head": f"{scene['name']}, scene {scene['sha256'][:12]}, {date}",
        # Defaults without an uncertainty are listed in the annex.
        "scene_groups": {
            document: _scene_groups([row for row in scene["table"] if _is_plain(row) is in_annex])
            for document, in_annex in (("report", False), ("annex", True))
        },
        "product": f"ringbalance {program}",
        "sections": sections,
        "claims": [cases[case["id"]] for case in claims],
        "checks": [cases[case["id"]] for case in summary.checks(evidence)],
        "tallies": summary.tallies(evidence),
        "causes": summary.common_causes(claims),
        "equations": {
            name: {"svg": equation_svg(item.latex, item.words, f"eq-{name}"), "source": item.source}
            for name, item in equations().items()
        },
        "pictures": _pictures(evidence["pictures"], pictures or {}),
    }
    return _PageContent(context=context, drawings=tuple(drawings_in([sections, of_cases])))


def _pictures(record: Record, contents: Mapping[str, bytes]) -> Record:
    """Pictures by name, packed as data addresses; one that lacks a variant is left out."""
    pictures: Record = {"text": record["text"], "disc": None, "pressure": None}
    for item in record["files"]:
        if item["light"] not in contents or item["dark"] not in contents:
            continue
        variants = {}
        for key in ("light", "dark"):
            # A quarter of the bytes without a visible difference.
            packed = io.BytesIO()
            with Image.open(io.BytesIO(contents[item[key]])) as picture:
                picture.thumbnail((_WEBP_WIDTH_PIXELS, _WEBP_WIDTH_PIXELS))
                picture.save(packed, **_WEBP)
            variants[key] = "data:image/webp;base64," + base64.b64encode(packed.getvalue()).decode("ascii")
        pictures[item["name"]] = {**item, **variants}
    return pictures


_STYLED: Final = re.compile(r'(<(?:path|g|text|tspan|use|rect|line|polyline|image)\b[^>]*?) style="([^"]*)"')
_PART_ID: Final = re.compile(r'(<(?:path|g|defs|text)\b[^>]*?)( id="([^"]*)")')
_CLASSES: Final = "/* classes */"


def render(evidence: Record, *, pictures: Mapping[str, bytes] | None = None) -> dict[str, str]:
    """The self-contained HTML documents by file name, the report last: `render_pages` of `page_content`."""
    return render_pages(page_content(evidence, pictures=pictures))


def render_pages(content: _PageContent, *, documents: Iterable[str] = tuple(DOCUMENTS)) -> dict[str, str]:
    """Fill the template once for each document."""
    colours = ["".join(f"{key}:{value};" for key, value in scheme.items()) for scheme in (LIGHT, DARK)]
    # All but plain characters are escaped, so that a scene's name cannot end its string.
    head: str = content.context["running_head"]
    escaped = "".join(c if c.isalnum() or c in " .,-()" else f"\\{ord(c):x} " for c in head)
    style = _template("style.css").replace("{{ running_head }}", escaped)
    style = style.replace("{{ figure_light }}", colours[0]).replace("{{ figure_dark }}", colours[1])
    pages = {}
    for file in documents:
        document = DOCUMENTS[file]
        template = _environment().get_template("report.html")
        page = template.render(
            content.context,
            document=document,
            numbered=_Numbers(PREFIXES[document["name"]]),
            annex_file=_ANNEX,
            sections=[s for s in content.context["sections"] if s["document"] == document["name"]],
            style=Markup(style),
            glyphs=Markup(GLYPHS),
        )
        pages[file] = _share_styles(share_glyphs(page)) + "\n"
    return pages


def terminal_lines(evidence: Record) -> list[str]:
    """Summary of a report in a few sentences, for a terminal."""
    context = {"e": placed(evidence), "tallies": summary.tallies(evidence)}
    text = _environment().get_template("terminal.txt").render(context)
    return [str(Markup(line).striptags()) for line in text.splitlines() if line.strip()]


@cache
def _environment() -> jinja2.Environment:
    """Environment of the templates, each compiled once."""
    environment = jinja2.Environment(
        loader=jinja2.FunctionLoader(_template),
        autoescape=True,
        undefined=jinja2.StrictUndefined,
        finalize=finished,
    )
    environment.filters |= {
        "tone": summary.tone,
        "verbatim": escape,
        "series": series,
        "opening": opening,
        "as_in": lambda name, names: names.get(name, name),
        "sentence": lambda text: f"{opening(text).rstrip('.')}.",
        "input_name": input_name,
        "key_words": key_words,
        "paths_named": paths_named,
        "usual_name": usual_name,
        **FILTERS,
        **QUANTITY_FILTERS,
    }
    environment.globals |= {"table_of": table_of, "listing_of": listing_of, "deciding": deciding}
    environment.tests |= {"verdict": summary.TONES.__contains__}
    return environment


class _Numbers:
    """Numbers of a document's figures, tables and equations, in the order in which they are set."""

    def __init__(self, prefix: str) -> None:
        self._prefix = prefix
        self._counts: Counter[str] = Counter()

    def __call__(self, kind: str, form: str = "") -> str:
        self._counts[kind] += 1
        number = f"{self._prefix}{self._counts[kind]}"
        return form % number if form else f"{kind} {number}"


def _share_styles(page: str) -> str:
    """Replace the styles that drawings repeat by classes, and drop ids that nothing refers to."""
    used = {*re.findall(r"[#(]#?([\w.-]+)[\")]", page)}
    page = _PART_ID.sub(lambda match: match[1] + (match[2] if match[3] in used else ""), page)
    names: dict[str, str] = {}

    def with_class(match: re.Match[str]) -> str:
        tag, style = match.groups()
        if " class=" in tag:
            return match[0]
        return f'{tag} class="{names.setdefault(style, f"s{len(names)}")}"'

    page = _STYLED.sub(with_class, page)
    rules = "".join(f".{name}{{{style}}}" for style, name in names.items())
    return page.replace(_CLASSES, rules, 1)


def _template(name: str) -> str:
    # One of another package is named "package:file".
    package, _, file = name.rpartition(":")
    folder = files(package) if package else files("ringbalance.reports") / "templates"
    return (folder / file).read_text(encoding="utf-8")
