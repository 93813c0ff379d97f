"""The whole report: evidence, figures, fields, pictures and page, put in place once all of it is there."""

from __future__ import annotations

import json
import time
from collections.abc import Callable, Iterator
from concurrent.futures import Future
from contextlib import contextmanager
from dataclasses import dataclass, field
from functools import partial
from itertools import product
from pathlib import Path
from types import MappingProxyType
from typing import Any, Final

import numpy as np

from ringbalance.reports.evidence import Progress, collect_evidence, collect_run
from ringbalance.reports.page import DOCUMENTS, case_views, page_content, render_pages
from ringbalance.reports.pages.cases import TABLES, is_long, table_file
from ringbalance.reports.pages.standing import evidence_text
from ringbalance.reports.pictures.opengl import OpenGL
from ringbalance.reports.pictures.process import FOLDERS, start_drawing, write_fields
from ringbalance.reports.saved import saved_cases
from ringbalance.reports.section import Record
from ringbalance.reports.sections import section_view, sections_of
from ringbalance.reports.summary import judged_sentences, lead_sentence
from ringbalance.reports.traced import untraced
from ringbalance.results.result import csv_text
from ringbalance.scene import AnyScene, Scene, liquid_ring_scene
from ringbalance.scene.platform.files import staged
from ringbalance.scene.platform.garbage import seldom_collected
from ringbalance.scene.platform.processes import Workers, beside
from ringbalance.verification.evidence import Level
from ringbalance.verification.runner import paper_scene

FILES: Final = ("evidence.json", *DOCUMENTS)
"""Of a report, the page last: where it is, all else is."""


_WITH_LIQUID: Final = MappingProxyType({"liquid_ring": liquid_ring_scene})
"""Balancers whose report calibrates, compares laws and has fields and pictures."""


@dataclass(frozen=True, kw_only=True)
class Report:
    """A finished report."""

    page: Path
    """report.html."""
    evidence: Record
    """What evidence.json holds."""

    @property
    def sound(self) -> bool:
        """False when a check of this program failed."""
        return not any(
            case.get("broken") or (case["kind"] == "code_verification" and case["verdict"] == "failed")
            for case in self.evidence["verification"]
        )

    @property
    def summary(self) -> list[str]:
        """What to say of it in a few sentences, and why it has no pictures where it has none."""
        pictures, lines = self.evidence["pictures"], judged_sentences(self.evidence)
        if not self.evidence.get("balancer"):
            lines.append(lead_sentence(self.evidence))
        return [untraced(line) for line in lines] + ([] if pictures["drawn"] else [pictures["text"]])


@dataclass(kw_only=True)
class _Views:
    """What the page shows of cases and annex, made by a worker while this process goes on.

    A section that no worker has begun when this process has nothing else to do, it makes itself.
    """

    pool: Workers | None
    cases: list[Future[Record]] = field(default_factory=list)
    sections: dict[str, Future[Record | None]] = field(default_factory=dict)
    _text: str = ""

    def begin_cases(self, cases: list[Record]) -> None:
        """Called with all cases as soon as they are judged."""
        if self.pool is not None:
            # As they read back from the evidence's file.
            self.cases = [self.pool.submit(case_views, json.loads(json.dumps(cases)))]

    def begin_annex(self, evidence: Record, text: str) -> None:
        """Called with the whole evidence, which `text` is in its file."""
        self._text = text
        if self.pool is not None:
            names = [section.name for section in sections_of(evidence) if section.place == "annex"]
            self.sections = {name: self.pool.submit(section_view, name, text) for name in names}

    def of_cases(self, cases: list[Record]) -> Record:
        if self.pool is None or not self.cases:
            return case_views(cases)
        return self.pool.result(self.cases[0], partial(case_views, cases))

    def of_sections(self, evidence: Record) -> dict[str, Record | None]:
        own = [section for section in sections_of(evidence) if section.name not in self.sections]
        views = {section.name: section.view(evidence) for section in own}
        for name, begun in reversed(self.sections.items()):
            views[name] = self._made(begun, partial(section_view, name, self._text))
        return views

    def _made(self, begun: Future[Record | None], here: Callable[[], Record | None]) -> Record | None:
        return here() if self.pool is None else self.pool.taken(begun, here)


def write_report(
    scene: AnyScene,
    out: Path | str,
    *,
    level: Level = "light",
    scene_text: str = "",
    workers: int | Workers = 1,
    progress: Progress | None = None,
    opengl: OpenGL | None = None,
) -> Report:
    """Verify, calibrate, simulate and draw a scene into one folder.

    Args: `scene_text`: the scene file's own text, for the appendix. `workers`: processes, this one included,
    or those that are at work already.
    Raises: SceneError: a scene that cannot be calibrated or simulated; nothing is written.
    Raises: OSError: the folder cannot be written, or holds an evidence.json that is none; known before the
    work.
    """
    folder, start = Path(out), time.perf_counter()
    saved = saved_cases(folder)
    with (
        seldom_collected(),
        staged(folder, files=FILES, folders=(*FOLDERS, TABLES)) as stage,
        beside(workers, loading=paper_scene) as pool,
    ):
        views = _Views(pool=pool)
        common: dict[str, Any] = {"level": level, "pool": pool, "progress": progress}
        common["scene_text"] = scene_text
        if narrowed := _WITH_LIQUID.get(scene.balancer):
            ring = narrowed(scene)
            with _pictures(ring, stage, opengl) as pictures:
                evidence = collect_evidence(ring, saved=saved, judged=views.begin_cases, **common)
                _tell(progress, "pictures")
                evidence["pictures"] = pictures()
        else:
            evidence = collect_run(scene, **common)
        _tell(progress, "page")
        evidence["times"]["total_s"] = round(time.perf_counter() - start, 1)
        evidence = _write_page(evidence, stage, views)
    return Report(page=folder / "report.html", evidence=evidence)


@contextmanager
def _pictures(scene: Scene, stage: Path, opengl: OpenGL | None) -> Iterator[Callable[[], Record]]:
    """Draws while the body runs; called, what is given waits for the record of the pictures."""
    drawing = start_drawing(
        scene=scene, fields=write_fields(scene=scene, folder=stage), folder=stage, opengl=opengl
    )
    try:
        yield drawing.finish
    finally:
        drawing.stop()


def _tell(progress: Progress | None, stage: str) -> None:
    if progress is not None:
        progress(stage)


def _write_page(evidence: Record, stage: Path, views: _Views) -> Record:
    """Evidence, figures and page; the page is made of the evidence as it reads back from its file."""
    text = evidence_text(evidence)
    kept: Record = json.loads(text)
    views.begin_annex(kept, text)
    (stage / "evidence.json").write_text(text, encoding="utf-8")
    figures = stage / "figures"
    figures.mkdir(exist_ok=True)
    names = [item[theme] for item in evidence["pictures"]["files"] for theme in ("light", "dark")]
    pictures = {name: (figures / name).read_bytes() for name in names}
    content = page_content(kept, pictures=pictures, views_of=views.of_cases, sections_by=views.of_sections)
    for drawing in content.drawings:
        (figures / f"{drawing.name}.svg").write_text(drawing.standalone(), encoding="utf-8")
    (stage / TABLES).mkdir()
    for name, table in csv_tables(kept).items():
        (stage / TABLES / name).write_text(table, encoding="utf-8")
    for name, page in render_pages(content).items():
        (stage / name).write_text(page, encoding="utf-8")
    return kept


def csv_tables(evidence: Record) -> dict[str, str]:
    """Contents of the files by name: tables of cases, the map of k, the operating map, the sampled loops.

    SI units, which stand in the heads. The same evidence gives the same bytes.
    """
    tables: dict[str, Record] = {
        table_file(case, table): {
            f"{name} [{table['units'].get(name, '1')}]": values for name, values in table["columns"].items()
        }
        for case in evidence["verification"]
        for table in case.get("tables") or []
        if is_long(table)
    }
    if drag := (evidence.get("fifty") or {}).get("map"):
        tables["map_of_k.csv"] = _drag_map(drag)
    if operation := evidence.get("operation"):
        tables["operating_map.csv"] = _operating_map(operation)
    for law, run in evidence["closed_loop"].items():
        tables[f"loop_{law}.csv"] = {
            "time [s]": run["time_s"],
            "amplitude [m]": run["amplitude_m"],
            "phase [rad]": run.get("phase_rad") or [None] * len(run["time_s"]),
        }
    return {name: csv_text(columns) for name, columns in tables.items()}


def _drag_map(drag: Record) -> Record:
    bores, viscosities = drag["bore_m"], drag["kinematic_viscosity_m2_s"]
    return {
        "bore [m]": np.repeat(bores, len(viscosities)).tolist(),
        "kinematic viscosity [m^2/s]": np.tile(viscosities, len(bores)).tolist(),
        "k [1]": np.ravel(drag["k"]).tolist(),
        "expanded uncertainty of k [1]": np.ravel(drag["k_uncertainty"]).tolist(),
    }


def _operating_map(operation: Record) -> Record:
    places = list(product(operation["gas_pressure_Pa"], operation["fill_ratio"]))
    return {
        "gas pressure [Pa]": [pressure for pressure, _ in places],
        "fill ratio [1]": [fill for _, fill in places],
        "regime": [operation["regimes"][int(sign)] for row in operation["regime"] for sign in row],
    }
