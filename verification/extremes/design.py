"""The axes along which a scene is taken to its extremes, the scene file of a point on them, and many points.

The designed set has points spread evenly over all axes of the extremes at once, and the work of judging them.
"""

from __future__ import annotations

import hashlib
import json
import logging
import math
from collections.abc import Callable, Generator, Mapping, Sequence
from contextlib import closing
from copy import deepcopy
from dataclasses import asdict, dataclass
from functools import cache, cached_property, partial
from importlib.resources import files
from pathlib import Path
from typing import Any, Final, Literal

import numpy as np
import numpy.typing as npt
from scipy.stats.qmc import Sobol

from ringbalance.mesh.geometry import liquid_first_moment, surface_radius
from ringbalance.scene.arrays import FloatArray
from ringbalance.scene.faults import SceneError
from ringbalance.scene.loader import scene_from
from ringbalance.scene.models import Scene
from ringbalance.scene.narrowing import liquid_ring_scene
from ringbalance.scene.platform.files import write_whole
from ringbalance.scene.platform.processes import beside
from ringbalance.scene.toml import toml_bytes
from ringbalance.verification.extremes.point import (
    GAS_TIME,
    PERIODS,
    SOUND,
    Defect,
    Ending,
    Judgement,
    judge_point,
)

Document = dict[str, Any]
Values = Mapping[str, float]
"""By axis, in the axis' unit."""
_ON_SHAFT: Final = 0.5
"""Of the axis "place", from which the gas pressure is one on the shaft."""
_TABLES: Final = ("environment", "gas", "sensor", "controller", "run", "accuracy")
"""That a scene file may leave out."""


@dataclass(frozen=True)
class Axis:
    """One input, from one end of what anyone might ask for to a step beyond the other."""

    name: str
    title: str
    unit: str
    low: float
    high: float
    usual: tuple[float, float]
    """Ends of the range where most discs are; the rest of the axis lies beyond it on one or both sides."""
    spacing: Literal["log", "linear"] = "log"

    def share(self, value: float) -> float:
        """How far along the axis a value in `unit` stands, within [0, 1]."""
        if self.spacing == "linear":
            return (value - self.low) / (self.high - self.low)
        return math.log(value / self.low) / math.log(self.high / self.low)

    def at(self, share: npt.ArrayLike) -> FloatArray:
        """Values in `unit` at fractions of the way along the axis."""
        s = np.asarray(share, dtype=np.float64)
        if self.spacing == "linear":
            return np.asarray(self.low + s * (self.high - self.low), dtype=np.float64)
        return np.asarray(self.low * (self.high / self.low) ** s, dtype=np.float64)


AXES: Final = (
    Axis("speed", "speed", "rpm", 1.0, 3e5, usual=(300.0, 6e4)),
    Axis("fill", "largest fill ratio", "1", 1e-6, 1.0, usual=(0.05, 0.9)),
    Axis("angle", "central angle", "deg", 5.0, 89.0, usual=(10.0, 85.0), spacing="linear"),
    Axis("plate", "plate thickness over that which closes the chamber", "1", 0.0, 1.05, (0.0, 0.8), "linear"),
    Axis("viscosity", "kinematic viscosity", "m^2/s", 1e-7, 1e-2, usual=(1e-7, 1e-3)),
    Axis("bore", "bore", "mm", 0.1, 20.0, usual=(0.3, 6.0)),
    Axis("roughness", "roughness over bore", "1", 1e-7, 0.06, usual=(1e-6, 0.02)),
    Axis("pressure", "gas pressure over the column to the siphon crest", "1", 0.0, 4.0, (0.8, 3.0), "linear"),
    Axis(
        "place", "gas pressure on the shaft from a half up", "1", 0.0, 1.0, usual=(0.0, 0.4), spacing="linear"
    ),
    Axis("unbalance", "unbalance over what one pair can carry", "1", 0.01, 1.5, usual=(0.05, 0.9)),
    Axis("gain", "controller gain over the scene's", "1", 1e-4, 1e3, usual=(0.01, 10.0)),
    Axis("noise", "sensor noise over the limit", "1", 1e-4, 10.0, usual=(1e-3, 0.5)),
    Axis("period", "controller period", "s", 1e-3, 100.0, usual=(0.05, 5.0)),
    Axis("tolerance", "tolerance", "1", 1e-10, 0.1, usual=(1e-4, 0.1)),
    # Without gravity there is a closed form to compare the half-widths with.
    Axis("gravity", "gravity over standard gravity", "1", 0.0, 2.0, usual=(0.0, 0.0), spacing="linear"),
)
"""What a designed set varies together, each after those that it hangs on."""


def _closing(scene: Scene, angle: float) -> float:
    """Plate thickness that closes a chamber of a central angle, m."""
    return scene.disc.inner_radius * math.sin(min(angle, math.pi) / 2)


def _column(scene: Scene, speed: float) -> float:
    """Pressure of a column from the siphon crest to the wall, Pa."""
    hump = scene.tube.hump_radius or scene.disc.inner_radius
    return scene.liquid.density * speed**2 * (scene.disc.outer_radius**2 - hump**2) / 2


def varied(document: Mapping[str, Any], *, scene: Scene, values: Mapping[str, float]) -> Document:
    """The document of a scene's own file with some axes set.

    What hangs on a value follows it: four chambers for any central angle, bends that the bore can take, and a
    tube that reaches over the crest.
    """
    changed: Document = {table: {} for table in _TABLES} | deepcopy(dict(document))
    for axis in AXES:
        if axis.name in values and axis.name in _SETTERS:
            _SETTERS[axis.name](changed, float(values[axis.name]), scene, values)
    for name, (table, key, factor, unit) in _PLAIN.items():
        if name in values:
            changed[table][key] = f"{factor * float(values[name])!r} {unit}"
    return changed


def fitted(
    document: Mapping[str, Any], *, scene: Scene, made: Scene, values: Mapping[str, float]
) -> Document:
    """The document of `varied` with a rotor that suits what its disc can balance, and the loop's axes set.

    A disc that carries less liquid is put on a lighter rotor: its influence coefficient grows so that all
    liquid of a pair makes the same vibration, and limit, gain and noise mean what they meant before.
    Args: `scene`: the scene that was varied. `made`: the scene that the document makes.
    """
    changed = deepcopy(dict(document))
    lighter = _capacity(scene) / _capacity(made)
    rotor, control = changed["rotor"], changed["controller"]
    rotor["influence_coefficient"] = _influence(lighter * scene.rotor.influence_coefficient)
    if "assumed_influence_coefficient" in control:
        believed = lighter * scene.controller.assumed_influence_coefficient
        control["assumed_influence_coefficient"] = _influence(believed)
    rotor["initial_vibration"] = _vibration(scene=scene, values=values)
    control["proportional"] = f"{values.get('gain', 1.0) * scene.controller.proportional!r} s/m"
    noise = values.get("noise", scene.sensor.amplitude_noise / scene.controller.limit)
    changed["sensor"]["amplitude_noise"] = f"{noise * scene.controller.limit!r} m"
    return changed


def _influence(coefficient: float) -> str:
    return f"{coefficient!r} m/(kg*m)"


def _vibration(*, scene: Scene, values: Mapping[str, float]) -> Document:
    before, phase = scene.rotor.initial_amplitude, scene.rotor.initial_phase
    amplitude = values["unbalance"] * _capacity(scene) if "unbalance" in values else before
    return {"amplitude": f"{amplitude!r} m", "phase": f"{math.degrees(phase)!r} deg"}


def _capacity(scene: Scene) -> float:
    """Vibration that all liquid of a pair in one chamber balances, m."""
    a = surface_radius(disc=scene.disc, fill_ratio=scene.disc.max_fill_ratio)
    moment = (
        scene.liquid.density * scene.disc.axial_width * liquid_first_moment(disc=scene.disc, surface_radius=a)
    )
    return float(scene.rotor.influence_coefficient * moment)


def _set_fill(document: Document, value: float, _: Scene, __: Values) -> None:
    document["disc"] |= {"max_fill_ratio": value, "initial_fill": value / 2}


def _set_plate(document: Document, value: float, scene: Scene, values: Values) -> None:
    angle = math.radians(values["angle"]) if "angle" in values else scene.disc.central_angle
    document["disc"]["plate_thickness"] = f"{value * _closing(scene, angle)!r} m"


def _set_angle(document: Document, value: float, _: Scene, __: Values) -> None:
    document["disc"] |= {"central_angle": f"{value!r} deg", "chambers": 4}
    document["controller"].pop("sequence", None)


def _set_viscosity(document: Document, value: float, scene: Scene, _: Values) -> None:
    liquid = scene.liquid
    document["liquid"] = {
        "density": f"{liquid.density!r} kg/m^3",
        "kinematic_viscosity": f"{value!r} m^2/s",
        "vapour_pressure": f"{liquid.vapour_pressure!r} Pa",
    }


def _set_bore(document: Document, value: float, scene: Scene, _: Values) -> None:
    tube = document["tube"]
    tube["bore"] = f"{value!r} mm"
    bends = [f"{max(1e3 * bend.radius, value)!r} mm" for bend in scene.tube.bends]
    tube["bends"] = [
        {"angle": f"{math.degrees(bend.angle)!r} deg", "radius": radius}
        for bend, radius in zip(scene.tube.bends, bends, strict=True)
    ]
    # Two right-angled bends of that radius need no more than this beside the legs.
    tube["length"] = f"{1e3 * scene.tube.length + 4 * value!r} mm"


def _set_roughness(document: Document, value: float, scene: Scene, values: Values) -> None:
    bore = 1e-3 * values["bore"] if "bore" in values else scene.tube.bore
    document["tube"]["roughness"] = f"{value * bore!r} m"


def _set_pressure(document: Document, value: float, scene: Scene, values: Values) -> None:
    speed = math.pi / 30 * values["speed"] if "speed" in values else scene.rotor.speed
    document["gas"]["pressure"] = f"{value * _column(scene, speed)!r} Pa"


def _set_place(document: Document, value: float, _: Scene, __: Values) -> None:
    document["gas"]["measured_at"] = "chamber" if value < _ON_SHAFT else "shaft"


def _set_tolerance(document: Document, value: float, _: Scene, __: Values) -> None:
    document["accuracy"] = {"tolerance": f"{100 * value!r} %"}


_SETTERS: Final = {
    "fill": _set_fill,
    "plate": _set_plate,
    "angle": _set_angle,
    "viscosity": _set_viscosity,
    "bore": _set_bore,
    "roughness": _set_roughness,
    "pressure": _set_pressure,
    "place": _set_place,
    "tolerance": _set_tolerance,
}
"""What hangs on the whole scene, such as the unbalance, is set by `fitted` when that is made."""
_PLAIN: Final = {
    "speed": ("rotor", "speed", 1.0, "rpm"),
    "period": ("controller", "period", 1.0, "s"),
    "gravity": ("environment", "gravity", 9.80665, "m/s^2"),
}
"""Table, key, factor and unit of an axis on which nothing hangs."""


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
