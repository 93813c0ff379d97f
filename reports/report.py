"""The whole report: evidence, figures, fields, pictures and page, put in place once all of it is there."""

from __future__ import annotations

import json
import time
from collections.abc import Callable, Iterator
from concurrent.futures import Future
from contextlib import contextmanager
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Final

from ringbalance.reports.eccentric_evidence import collect_eccentric
from ringbalance.reports.evidence import Progress, collect_evidence
from ringbalance.reports.page import DOCUMENTS, case_views, page_content
from ringbalance.reports.pages.document import evidence_text
from ringbalance.reports.pictures.opengl import OpenGL
from ringbalance.reports.pictures.process import FOLDERS, start_drawing, write_fields
from ringbalance.reports.pictures.view import VIEW, view_page
from ringbalance.reports.render import render_pages
from ringbalance.reports.saved import saved_cases
from ringbalance.reports.section import Level, Record
from ringbalance.reports.tables import FOLDER as TABLES
from ringbalance.reports.tables import csv_tables
from ringbalance.scene import AnyScene, Scene
from ringbalance.scene.eccentric_models import EccentricScene
from ringbalance.scene.platform.files import staged
from ringbalance.scene.platform.processes import Workers, beside

FILES: Final = ("evidence.json", *DOCUMENTS)
"""Of a report, the page last: where it is, all else is."""


@dataclass(frozen=True, kw_only=True)
class Report:
    """A finished report."""

    page: Path
    """report.html."""
    evidence: Record
    """What evidence.json holds."""

    @property
    def sound(self) -> bool:
        """False when a code-verification case failed, or the loop settled under neither law.

        A loop that settles under the paper's law alone is a finding, not a fault.
        """
        failed = any(
            case.get("broken") or (case["kind"] == "code_verification" and case["verdict"] == "failed")
            for case in self.evidence["verification"]
        )
        return not failed and any(run["settled"] for run in self.evidence["closed_loop"].values())


@dataclass(kw_only=True)
class _CaseViews:
    """What the page shows of the cases, made by a worker while this process goes on."""

    pool: Workers | None
    begun: Future[Record] | None = None

    def begin(self, cases: list[Record]) -> None:
        if self.pool is not None:
            # As they read back from the evidence's file.
            self.begun = self.pool.submit(case_views, json.loads(json.dumps(cases)))

    def of(self, cases: list[Record]) -> Record:
        if self.pool is None or self.begun is None:
            return case_views(cases)
        return self.pool.result(self.begun, partial(case_views, cases))


def write_report(
    scene: AnyScene,
    out: Path | str,
    *,
    level: Level = "light",
    scene_text: str = "",
    workers: int = 1,
    progress: Progress | None = None,
    opengl: OpenGL | None = None,
    interactive: bool = False,
) -> Report:
    """Verify, calibrate, simulate and draw a scene into one folder.

    Args: `scene_text`: the scene file's own text, for the appendix. `interactive`: whether a liquid ring's
    view.html is written, too.
    Raises: SceneError: a scene that cannot be calibrated or simulated; nothing is written.
    Raises: OSError: the folder cannot be written, or holds an evidence.json that is none; known before the
    work.
    """
    folder, start = Path(out), time.perf_counter()
    saved = saved_cases(folder)
    with staged(folder, files=FILES, folders=(*FOLDERS, TABLES)) as stage, beside(workers) as pool:
        views = _CaseViews(pool=pool)
        if isinstance(scene, EccentricScene):
            evidence = collect_eccentric(
                scene, level=level, scene_text=scene_text, pool=pool, progress=progress
            )
        else:
            if interactive:
                (stage / VIEW).write_text(view_page(scene), encoding="utf-8")
            with _pictures(scene, stage, opengl) as pictures:
                evidence = collect_evidence(
                    scene,
                    level=level,
                    scene_text=scene_text,
                    saved=saved,
                    pool=pool,
                    progress=progress,
                    judged=views.begin,
                )
                _tell(progress, "pictures")
                evidence["pictures"] = pictures()
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


def _write_page(evidence: Record, stage: Path, views: _CaseViews) -> Record:
    """Evidence, figures and page; the page is made of the evidence as it reads back from its file."""
    text = evidence_text(evidence)
    kept: Record = json.loads(text)
    (stage / "evidence.json").write_text(text, encoding="utf-8")
    figures = stage / "figures"
    figures.mkdir(exist_ok=True)
    names = [item[theme] for item in evidence["pictures"]["files"] for theme in ("light", "dark")]
    pictures = {name: (figures / name).read_bytes() for name in names}
    content = page_content(kept, pictures=pictures, views_of=views.of)
    for drawing in content.drawings:
        (figures / f"{drawing.name}.svg").write_text(drawing.standalone(), encoding="utf-8")
    (stage / TABLES).mkdir()
    for name, table in csv_tables(kept).items():
        (stage / TABLES / name).write_text(table, encoding="utf-8")
    for name, page in render_pages(content).items():
        (stage / name).write_text(page, encoding="utf-8")
    return kept
