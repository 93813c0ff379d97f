"""Points spread evenly over all axes of the extremes at once, and the work of judging them."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import asdict, dataclass
from functools import cache, cached_property, partial
from importlib.resources import files
from multiprocessing import get_context
from pathlib import Path
from typing import Any, Final

from scipy.stats import qmc

from ringbalance.scene.faults import SceneError
from ringbalance.scene.files import write_whole
from ringbalance.scene.loader import scene_from
from ringbalance.scene.models import Scene
from ringbalance.scene.narrowing import liquid_ring_scene
from ringbalance.verification.extremes_axes import AXES, fitted, toml_bytes, varied
from ringbalance.verification.extremes_point import SOUND, Defect, Ending, Judgement, judge_point, refusal

Point = Mapping[str, float]
Progress = Callable[[int, int], None]
"""Called with the points done and their number."""

USUAL_SHARE: Final = 0.75
"""Of the coordinates, drawn from where most discs are; else all but a few points would be refused."""
PERIODS: Final = 20
"""Of the controller that a point's closed loop may take."""
GAS_TIME: Final = 0.2
"""s, beyond those: a short period with long gas times is no reason for hundreds of operations."""
CHUNK: Final = 20


@dataclass(frozen=True, kw_only=True)
class Base:
    """The scene from which points are varied."""

    document: Mapping[str, Any]
    """Of its file."""
    file: str
    defect: Defect = SOUND

    @cached_property
    def scene(self) -> Scene:
        """The scene itself, before anything is varied; read once for all points."""
        return _made(self.document, self.file)


def design(*, count: int, seed: int) -> tuple[Point, ...]:
    """A designed set: a scrambled Sobol sequence over all axes.

    Args:
        count: of points; a longer set begins with a shorter one.
        seed: of the scrambling.

    Returns:
        Points: values by axis, in the axis' unit.

    Source: Sobol's sequence, scrambled after Owen, as in scipy.stats.qmc.
    """
    size = 1 << max(count - 1, 0).bit_length()
    shares = qmc.Sobol(2 * len(AXES), rng=seed).random(size)[:count]
    return tuple(_point(row[: len(AXES)], row[len(AXES) :]) for row in shares)


def _point(shares: Sequence[float], kinds: Sequence[float]) -> Point:
    values = {}
    for axis, share, kind in zip(AXES, shares, kinds, strict=True):
        low, high = (axis.share(end) for end in axis.usual)
        place = low + share * (high - low) if kind < USUAL_SHARE else share
        values[axis.name] = float(axis.at(place))
    return values


def judge(base: Base, point: Point) -> Judgement:
    """Judge the scene at one point.

    Args:
        base: the scene.
        point: values by axis.

    Returns:
        Judgement.
    """
    scene = base.scene
    document = varied(base.document, scene=scene, values=point)
    period = point.get("period", scene.controller.period)
    longest = PERIODS * period + GAS_TIME
    document["run"]["time_limit"] = f"{longest!r} s"
    try:
        document = fitted(document, scene=scene, made=_made(document, base.file), values=point)
    except SceneError as error:
        return refusal(error)
    return judge_point(document, file=base.file, defect=base.defect)


def _made(document: Mapping[str, Any], file: str) -> Scene:
    return liquid_ring_scene(scene_from(content=toml_bytes(document), file=file))


def judged(
    base: Base,
    points: Sequence[Point],
    *,
    workers: int = 1,
    progress: Progress | None = None,
    kept: Path | None = None,
) -> tuple[Judgement, ...]:
    """Judge many points, side by side, and keep what is done.

    Args:
        base: the scene.
        points: to be judged.
        workers: processes.
        progress: called after each chunk; None for silence.
        kept: file of judgements done, one a line, from which an interrupted run goes on; None for none.

    Returns:
        Judgements, in the order of the points whatever the number of workers.

    Raises:
        OSError: the kept file cannot be read or written.
    """
    done = _done(kept, base, points)
    rest = [points[start : start + CHUNK] for start in range(len(done), len(points), CHUNK)]
    for chunk in _chunks(base, rest, workers):
        done += chunk
        if kept is not None:
            _keep(kept, base, points, done)
        if progress is not None:
            progress(len(done), len(points))
    return tuple(done)


def _chunks(base: Base, rest: Sequence[Sequence[Point]], workers: int) -> Iterator[list[Judgement]]:
    work = partial(_judge_all, base)
    if workers == 1 or len(rest) < 2:
        yield from map(work, rest)
        return
    with ProcessPoolExecutor(workers, mp_context=get_context("spawn")) as pool:
        try:
            yield from pool.map(work, rest)
        finally:
            pool.shutdown(wait=False, cancel_futures=True)


def _judge_all(base: Base, points: Sequence[Point]) -> list[Judgement]:
    return [judge(base, point) for point in points]


def _key(base: Base, points: Sequence[Point]) -> str:
    """What kept judgements belong to; a set that goes on where a shorter one ended has the same beginning."""
    first = [dict(point) for point in points[:CHUNK]]
    text = json.dumps([_sources(), dict(base.document), first], sort_keys=True)
    return hashlib.sha256(text.encode()).hexdigest()


@cache
def _sources() -> str:
    """Digest of the program itself: what another version found is not gone on with."""
    found = hashlib.sha256()
    for room in sorted(Path(str(files("ringbalance"))).iterdir()):
        for file in sorted(room.rglob("*.py")) if room.is_dir() else [room]:
            found.update(file.read_bytes())
    return found.hexdigest()


def _done(kept: Path | None, base: Base, points: Sequence[Point]) -> list[Judgement]:
    """Judgements kept from an interrupted run of the same points, in whole chunks."""
    if kept is None or not kept.is_file():
        return []
    document = json.loads(kept.read_text(encoding="utf-8"))
    if document.get("key") != _key(base, points):
        return []
    records = document["judgements"][: len(points)]
    whole = len(records) if len(records) == len(points) else len(records) // CHUNK * CHUNK
    return [_judgement(record) for record in records[:whole]]


def _judgement(record: Mapping[str, Any]) -> Judgement:
    return Judgement(
        **{
            **record,
            "ending": Ending(record["ending"]),
            "violations": tuple(record["violations"]),
        }
    )


def _keep(kept: Path, base: Base, points: Sequence[Point], done: Sequence[Judgement]) -> None:
    document = {"key": _key(base, points), "judgements": [asdict(judgement) for judgement in done]}
    write_whole(kept, json.dumps(document, allow_nan=False))
