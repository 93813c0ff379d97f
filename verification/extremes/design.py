"""Points spread evenly over all axes of the extremes at once, and the work of judging them."""

from __future__ import annotations

import hashlib
import json
import logging
from collections.abc import Callable, Generator, Mapping, Sequence
from contextlib import closing
from dataclasses import asdict, dataclass
from functools import cache, cached_property, partial
from importlib.resources import files
from pathlib import Path
from typing import Any, Final

from scipy.stats.qmc import Sobol

from ringbalance.scene.faults import SceneError
from ringbalance.scene.loader import scene_from
from ringbalance.scene.models import Scene
from ringbalance.scene.narrowing import liquid_ring_scene
from ringbalance.scene.platform.files import write_whole
from ringbalance.scene.platform.processes import beside
from ringbalance.scene.toml import toml_bytes
from ringbalance.verification.extremes.axes import AXES, fitted, varied
from ringbalance.verification.extremes.point import (
    GAS_TIME,
    PERIODS,
    SOUND,
    Defect,
    Ending,
    Judgement,
    judge_point,
)

Point = Mapping[str, float]
Progress = Callable[[int, int], None]
"""Called with the points done and their number."""

USUAL_SHARE: Final = 0.75
"""Of the coordinates, drawn from where most discs are; else all but a few points would be refused."""
CHUNK: Final = 20
_LOG: Final = logging.getLogger("ringbalance")


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

    def judge(self, point: Point) -> Judgement:
        """Judge the scene at one point."""
        scene = self.scene
        document = varied(self.document, scene=scene, values=point)
        period = point.get("period", scene.controller.period)
        longest = PERIODS * period + GAS_TIME
        document["run"]["time_limit"] = f"{longest!r} s"
        try:
            document = fitted(document, scene=scene, made=_made(document, self.file), values=point)
        except SceneError as error:
            return Judgement.refused(error)
        return judge_point(document, file=self.file, defect=self.defect)

    def judged(
        self,
        points: Sequence[Point],
        *,
        workers: int = 1,
        progress: Progress | None = None,
        kept: Path | None = None,
    ) -> tuple[Judgement, ...]:
        """Judge many points on several processes, in their order.

        Args: `progress`: called after each chunk. `kept`: file of judgements done, from which an interrupted
            run resumes; a damaged one is written again, with a note on standard error.
        Raises: OSError: the kept file cannot be read or written.
        """
        done = _done(kept, self, points)
        rest = [points[start : start + CHUNK] for start in range(len(done), len(points), CHUNK)]
        with closing(_chunks(self, rest, workers)) as chunks:
            for chunk in chunks:
                done += chunk
                if kept is not None:
                    _keep(kept, self, points, done)
                if progress is not None:
                    progress(len(done), len(points))
        return tuple(done)


def design(*, count: int, seed: int) -> tuple[Point, ...]:
    """A designed set over all axes; a longer one begins with a shorter one.

    Source: Sobol's sequence, scrambled after Owen, as in scipy.stats.qmc.
    """
    size = 1 << max(count - 1, 0).bit_length()
    shares = Sobol(2 * len(AXES), rng=seed).random(size)[:count]
    return tuple(_point(row[: len(AXES)], row[len(AXES) :]) for row in shares)


def _point(shares: Sequence[float], kinds: Sequence[float]) -> Point:
    values = {}
    for axis, share, kind in zip(AXES, shares, kinds, strict=True):
        low, high = (axis.share(end) for end in axis.usual)
        place = low + share * (high - low) if kind < USUAL_SHARE else share
        values[axis.name] = float(axis.at(place))
    return values


def _made(document: Mapping[str, Any], file: str) -> Scene:
    return liquid_ring_scene(scene_from(content=toml_bytes(document), file=file))


def _chunks(
    base: Base, rest: Sequence[Sequence[Point]], workers: int
) -> Generator[list[Judgement], None, None]:
    work = partial(_judge_all, base)
    # This process only waits, so that judgements are kept as soon as they come.
    with beside(workers + 1 if workers > 1 and len(rest) > 1 else 1) as pool:
        if pool is None:
            yield from map(work, rest)
            return
        started = [pool.submit(work, points) for points in rest]
        for points, future in zip(rest, started, strict=True):
            yield pool.result(future, partial(work, points))


def _judge_all(base: Base, points: Sequence[Point]) -> list[Judgement]:
    return [base.judge(point) for point in points]


def _key(base: Base, points: Sequence[Point]) -> str:
    """What kept judgements belong to; a set that continues where a shorter one ended has the same
    beginning."""
    first = [dict(point) for point in points[:CHUNK]]
    text = json.dumps([_sources(), dict(base.document), first], sort_keys=True)
    return hashlib.sha256(text.encode()).hexdigest()


@cache
def _sources() -> str:
    """Digest of the program itself: what another version found is not reused."""
    found = hashlib.sha256()
    for room in sorted(Path(str(files("ringbalance"))).iterdir()):
        for file in sorted(room.rglob("*.py")) if room.is_dir() else [room]:
            found.update(file.read_bytes())
    return found.hexdigest()


def _done(kept: Path | None, base: Base, points: Sequence[Point]) -> list[Judgement]:
    """Judgements kept from an interrupted run of the same points, in whole chunks; none of a damaged file."""
    if kept is None or not kept.is_file():
        return []
    try:
        document = json.loads(kept.read_bytes())
        key, judgements = document["key"], document["judgements"]
        whole = document["digest"] == _digest(judgements)
    except (ValueError, KeyError, TypeError, RecursionError):
        key, judgements, whole = None, [], False
    if not whole:
        _LOG.warning("ringbalance: %s is damaged and not used; its points are judged again", kept)
    if not whole or key != _key(base, points):
        return []
    records = judgements[: len(points)]
    size = len(records) if len(records) == len(points) else len(records) // CHUNK * CHUNK
    return [_judgement(record) for record in records[:size]]


def _digest(judgements: object) -> str:
    """By which a file is known to be as it was written."""
    return hashlib.sha256(json.dumps(judgements, sort_keys=True).encode()).hexdigest()


def _judgement(record: Mapping[str, Any]) -> Judgement:
    return Judgement(
        **{
            **record,
            "ending": Ending(record["ending"]),
            "violations": tuple(record["violations"]),
        }
    )


def _keep(kept: Path, base: Base, points: Sequence[Point], done: Sequence[Judgement]) -> None:
    judgements = [asdict(judgement) for judgement in done]
    document = {"key": _key(base, points), "digest": _digest(judgements), "judgements": judgements}
    write_whole(kept, json.dumps(document, allow_nan=False))
