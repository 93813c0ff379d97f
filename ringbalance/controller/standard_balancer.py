"""Ready base of a balancer whose correction moves on a rotor with an influence coefficient.

The rotor turns at constant speed in steady vibration, V = alpha (U_0 + U_c(t)), in its own frame: a balancer
has only to say how its correction U_c moves from what it measures of V, and the largest it can form.
"""

from __future__ import annotations

import cmath
import math
import numbers
import traceback
from abc import abstractmethod
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Annotated, Any, ClassVar, Final, Self, get_type_hints

import numpy as np

from ringbalance.controller.balancer import (
    ENERGY_NONE,
    Balancer,
    Draws,
    Outcomes,
    Progress,
    RunResult,
    Setting,
    Settings,
)
from ringbalance.controller.rotor import CommonRotor, Rotors, rotor_fault
from ringbalance.controller.trials import SearchAxis, Trials, rounded
from ringbalance.results.result import Rows
from ringbalance.results.rows import Finding, Quantity
from ringbalance.scene.arrays import ComplexArray, FloatArray, within_since
from ringbalance.scene.draws import deviates, quantiles, run_noise
from ringbalance.scene.faults import SceneError
from ringbalance.scene.keys.declaration import UNCERTAIN, keys_of, needed, standard
from ringbalance.scene.keys.fields import (
    Influence,
    Length,
    PositiveLength,
    PositiveRate,
    PositiveUnbalance,
    Turn,
)
from ringbalance.scene.keys.schema import Schema, TableSchema
from ringbalance.scene.kinds import Check, SceneKind, reader_of
from ringbalance.scene.origins import SceneFile, value_at, with_values_at
from ringbalance.scene.uncertain import NORMAL_95

_SETTING_FACTOR: Final = 30.0
"""Largest factor on a setting that is tried, up and down."""
_SETTING_LEVELS: Final = 9
_MOVES: Final = "pairs (time in s, complex moment in kg m), the first at 0 s, finite, at times that increase"
Measure = Callable[[complex], complex]
"""Measured vibration, m, under a correction, kg m, both complex in the rotor's frame."""


@dataclass(frozen=True, kw_only=True)
class StandardRotor:
    """Rotor at constant speed, in steady vibration."""

    speed: Annotated[PositiveRate, needed("of the rotor")]
    influence_coefficient: Annotated[Influence, needed("vibration per unbalance"), UNCERTAIN]
    lag_angle: Annotated[Turn, needed("of the vibration behind the unbalance"), UNCERTAIN]
    unbalance: Annotated[PositiveUnbalance, needed("to be balanced"), UNCERTAIN]
    phase: Annotated[Turn, standard("0 deg", "of the unbalance in the rotor's frame"), UNCERTAIN]

    @property
    def influence(self) -> complex:
        """alpha, m/(kg m)."""
        return cmath.rect(self.influence_coefficient, -self.lag_angle)


@dataclass(frozen=True, kw_only=True)
class MeasuredVibration:
    """Measured vibration, and what counts as balanced."""

    limit: Annotated[PositiveLength, needed("amplitude to come below")]
    noise: Annotated[
        Length, standard("0 mm", "standard deviation of each component of the measured vibration")
    ]


@dataclass(frozen=True, kw_only=True, repr=False)
class StandardScene(SceneFile):
    """Scene of a `StandardBalancer`, in SI units; a subclass adds its own records and the word `balancer`."""

    rotor: StandardRotor
    vibration: MeasuredVibration


def standard_kind(
    scene: type[StandardScene], *, checks: tuple[Check, ...] = (), example: str = "", **tables: str
) -> SceneKind:
    """Kind of scene with the tables of a record's fields.

    Args: `checks`: rules for combinations of values. `example`: text of a scene file, which
        `ringbalance check-balancer` runs. `tables`: description of each table beside [rotor] and
        [vibration].
    """
    texts = {"rotor": "the rotor", **tables, "vibration": "what is measured, and what is required"}
    records = get_type_hints(scene)
    schema = Schema.of(
        {name: TableSchema.of(records[name], text) for name, text in texts.items()},
        balancer=needed(f'"{scene.balancer}"'),
        scene=scene,
    )
    main = tuple(tuple(f"{name}.{key}" for key in keys_of(records[name])) for name in tables)
    return SceneKind(
        schema=schema,
        read=reader_of(schema, checks),
        main=main,
        usual_units={"angle": "deg", "length": "mm"},
        example=example,
    )


@dataclass(frozen=True, kw_only=True, eq=False)
class StandardRun:
    """One run of a `StandardBalancer`."""

    balancer: str
    time: FloatArray
    """Instants, s; a correction holds from its own to the next."""
    vibration: ComplexArray
    """True vibration in the rotor's frame, m zero-to-peak."""
    correction: ComplexArray
    """kg m, in the rotor's frame."""
    limit: float
    """Amplitude to come below, m."""
    measured: tuple[float, ...] = ()
    """Instants of the measurements, s."""
    findings: tuple[Finding, ...] = ()
    """The end of the run first."""

    @property
    def amplitude(self) -> FloatArray:
        """Amplitude of the true vibration, m zero-to-peak."""
        return np.abs(self.vibration)

    @property
    def settling_time(self) -> float | None:
        """Time from which on the amplitude is within the limit to the end, s; None: not settled."""
        return within_since(self.time, self.amplitude, limit=self.limit)

    @property
    def settled(self) -> bool:
        """True if the amplitude came below the limit and stayed."""
        return self.settling_time is not None

    @property
    def status(self) -> str:
        """Sentence on how the run ended."""
        return self.findings[0].text

    def to_dict(self) -> dict[str, Any]:
        """The run as a JSON document in SI."""
        return {
            "balancer": self.balancer,
            "settled": self.settled,
            "settling_time_s": self.settling_time,
            "status": self.status,
            "limit_m": self.limit,
            "time_s": self.time.tolist(),
            "amplitude_m": self.amplitude.tolist(),
            "phase_rad": np.angle(self.vibration).tolist(),
            "findings": [each.document() for each in self.findings],
        }


class StandardBalancer(Balancer):
    """Balancer on a rotor with an influence coefficient; a subclass gives `reach` and `corrections`.

    A drawn device has each uncertain input of the scene, positive ones log-normal and angles normal, and
    noise of its own.
    """

    energy_kind = ENERGY_NONE
    scene: Any
    """Scene, a `StandardScene`."""
    setting_paths: ClassVar[tuple[str, ...]] = ()
    """Paths of the settings that are searched, from a thirtieth to thirty times the scene's value."""

    @abstractmethod
    def reach(self, device: Any) -> float:
        """Largest unbalance that a device, given as its scene, cancels in every direction, kg m."""

    @abstractmethod
    def corrections(self, device: Any, *, assumed: Any, measure: Measure) -> Iterator[tuple[float, complex]]:
        """Instants from 0 s on, s, each with the correction from then on, kg m complex in the rotor's frame.

        Args: `device`: scene of the device as it is. `assumed`: scene for which its controller is configured,
            with the settings. `measure`: see `Measure`. The last correction stays to the end of the run.
        """

    def scattered(self, device: Any, random: np.random.Generator) -> Any:  # noqa: ARG002
        """A drawn device with whatever else varies, such as where its parts lie at the start."""
        return device

    def findings(self, run: StandardRun, device: Any) -> tuple[Finding, ...]:  # noqa: ARG002
        """Findings on a run besides how it ended; sentences of the balancer's own have codes "name.code"."""
        return ()

    def energy(self, run: StandardRun, device: Any) -> float:  # noqa: ARG002
        """Energy that a run took, J; shown where `energy_kind` is the code of another sentence."""
        return 0.0

    def check_rotor(self, rotor: CommonRotor) -> None:
        """Raise a `rotor_fault` for a rotor on which the balancer cannot work; default: none."""

    def settings(self) -> tuple[Setting, ...]:
        """The settings of `setting_paths`."""
        pairs = ((path, value_at(self.scene, path)) for path in self.setting_paths)
        return tuple(Setting.about(path, value, factor=_SETTING_FACTOR) for path, value in pairs)

    def trials(self) -> tuple[Trials, ...]:
        """All settings at levels between their bounds."""
        listed = self.settings()
        levels = tuple(np.geomspace(1 / _SETTING_FACTOR, _SETTING_FACTOR, _SETTING_LEVELS).tolist())
        axes = tuple(SearchAxis(name=each.path, levels=levels, first=(0, 2, 4, 6, 8)) for each in listed)

        def settings(point: Mapping[str, float]) -> dict[str, float]:
            return {each.path: rounded(point[each.path] * each.value) for each in listed}

        return (Trials(kind=self.scene.balancer, axes=axes, settings=settings),) if axes else ()

    def run(
        self, settings: Settings, draws: Draws, *, trace: bool = False, progress: Progress | None = None
    ) -> Outcomes:
        assumed, span = with_values_at(self.scene, settings), self.span()
        results, inputs = [], []
        for count, number in enumerate(draws.numbers):
            if progress is not None:
                progress(count * span, len(draws.numbers) * span)
            seed = assumed.run.seed
            random = run_noise(seed, number) if draws.devices else np.random.default_rng(seed + number)
            device, drawn_inputs = self._device(assumed, number, random) if draws.devices else (assumed, {})
            run = self._run(device, assumed, random)
            settled = run.settling_time
            results.append(
                RunResult(
                    run=run,
                    settling_time=math.inf if settled is None else settled,
                    final_amplitude=float(run.amplitude[-1]),
                    energy=self.energy(run, device),
                    usable_moment=self.reach(device),
                    unbalance=device.rotor.unbalance,
                    ended="settled" if run.settled else run.findings[0].code,
                    worst_amplitude=float(np.max(run.amplitude)),
                )
            )
            inputs.append(drawn_inputs)
        return Outcomes.of(results, numbers=draws.numbers, inputs=inputs, trace=trace)

    def _device(self, scene: Any, number: int, random: np.random.Generator) -> tuple[Any, dict[str, float]]:
        """Scene of a drawn device, and the quantiles of its inputs by path."""
        values, inputs = {}, {}
        for each in type(self)(scene).inputs():
            if not each.half_width:
                continue
            (normal,) = deviates(each.path, (number,), seed=scene.run.seed) / NORMAL_95
            linear = each.unit == "rad" or each.value <= 0
            change = each.half_width * float(normal)
            values[each.path] = each.value + change if linear else each.value * math.exp(change / each.value)
            inputs[each.path] = float(quantiles(each.path, (number,), seed=scene.run.seed)[0])
        device = self.scattered(with_values_at(scene, values), random)
        return (device if self._rotors is None else _on(device, self._rotors(number))), inputs

    def _run(self, device: Any, assumed: Any, random: np.random.Generator) -> StandardRun:
        rotor, noise, span = device.rotor, device.vibration.noise, float(device.run.time_limit)
        unbalance = cmath.rect(rotor.unbalance, rotor.phase)

        moves: list[tuple[float, complex]] = []
        measured: list[float] = []

        def measure(correction: complex) -> complex:
            measured.append(moves[-1][0] if moves else 0.0)
            parts = random.standard_normal(2)
            return complex(rotor.influence * (unbalance + correction) + noise * complex(*parts))

        try:
            for move in self.corrections(device, assumed=assumed, measure=measure):
                if not _is_move(move):
                    raise self._wrong(f"yields {move!r}")
                time, correction = float(move[0]), complex(move[1])
                after = f", after {moves[-1][0]:z.4g} s" if moves else ""
                due = time > moves[-1][0] if moves else time == 0
                if not (due and cmath.isfinite(correction)):
                    raise self._wrong(f"yields the correction {correction:.4g} kg m at {time:z.4g} s{after}")
                if time > span:
                    break
                moves.append((time, correction))
        except SceneError:
            raise
        except Exception as error:  # Whatever another package raises.
            frame = traceback.extract_tb(error.__traceback__)[-1]
            problem = f"raises {type(error).__name__}: {error} ({Path(frame.filename).name}:{frame.lineno})"
            raise self._wrong(problem) from error
        if not moves:
            raise self._wrong("yields nothing")
        if moves[-1][0] < span:
            moves.append((span, moves[-1][1]))
        times, corrections = (np.array(column) for column in zip(*moves, strict=True))
        run = StandardRun(
            balancer=assumed.balancer,
            time=times,
            vibration=rotor.influence * (unbalance + corrections),
            correction=corrections,
            limit=device.vibration.limit,
            measured=tuple(measured),
        )
        end = {"final_amplitude": float(run.amplitude[-1]), "limit": run.limit, "time": span}
        if run.settled:
            ended = Finding(code="within_limit", values={**end, "settling_time": run.settling_time})
        elif (reach := self.reach(device)) < rotor.unbalance:
            ended = Finding(code="beyond_reach", values={**end, "reach": reach, "unbalance": rotor.unbalance})
        else:
            ended = Finding(code="above_limit", values=end)
        return replace(run, findings=(ended, *self.findings(run, device)))

    def _wrong(self, problem: str) -> SceneError:
        name = f"{type(self).__module__}.{type(self).__qualname__}.corrections"
        return SceneError.of_file(self.scene.file, f"{name} {problem}", _MOVES)

    def rotor(self, number: int | None = None) -> CommonRotor:
        scene = self.scene
        if number is not None:
            scene, _ = self._device(scene, number, run_noise(scene.run.seed, number))
        return CommonRotor(
            source=scene.source,
            speed=scene.rotor.speed,
            influence=scene.rotor.influence,
            unbalance=cmath.rect(scene.rotor.unbalance, scene.rotor.phase),
            mass=None,
            noise=scene.vibration.noise,
            limit=scene.vibration.limit,
        )

    def on_rotor(self, rotor: CommonRotor, rotors: Rotors | None = None) -> Self:
        if rotor.runout is not None:
            problem = f"the sensor of {rotor.source} has runout, which this balancer does not model"
            raise rotor_fault(self.scene, "vibration", problem, "a comparison without sensor.runout")
        self.check_rotor(rotor)
        vibration = replace(self.scene.vibration, limit=rotor.limit, noise=rotor.noise)
        return type(self)(replace(_on(self.scene, rotor), vibration=vibration), rotors)

    def sampling_time(self) -> float:
        """Time between two instants at which `corrections` measures, s; 0: it measures nothing."""
        return 0.0

    def lasting(self, span: float) -> Self:
        return type(self)(replace(self.scene, run=replace(self.scene.run, time_limit=span)), self._rotors)

    def quantities(self) -> tuple[Quantity, ...]:
        reach = self.reach(self.scene)
        return (Quantity(key="reach", name="usable moment in any direction", unit="kg m", value=reach),)

    def rows(self, run: StandardRun) -> Rows:
        """Amplitude at the end and settling time, and the findings."""
        rows = (
            ("final_amplitude", "amplitude at the end", "m", float(run.amplitude[-1])),
            ("settling_time", "settling time", "s", run.settling_time),
        )
        return Rows(
            title=self.scene.name,
            quantities=tuple(
                Quantity(key=key, name=name, unit=unit, value=value, origin="simulated")
                for key, name, unit, value in rows
            ),
            findings=run.findings,
        )

    def history(self, run: StandardRun) -> Mapping[str, Sequence[Any]]:
        """Vibration and correction over time."""
        return {
            "time_s": run.time.tolist(),
            "amplitude_m": run.amplitude.tolist(),
            "phase_rad": np.angle(run.vibration).tolist(),
            "correction_kg_m": np.abs(run.correction).tolist(),
            "correction_angle_rad": np.angle(run.correction).tolist(),
        }


def _is_move(move: object) -> bool:
    """True for a pair of a real and a complex number, of Python or NumPy."""
    kinds = (numbers.Real, numbers.Complex)
    return isinstance(move, Sequence) and len(move) == 2 and all(map(isinstance, move, kinds))


def _on(scene: Any, rotor: CommonRotor) -> Any:
    """Give a scene another rotor's speed, influence coefficient and unbalance."""
    changed = replace(
        scene.rotor,
        speed=rotor.speed,
        influence_coefficient=abs(rotor.influence),
        lag_angle=-cmath.phase(rotor.influence),
        unbalance=abs(rotor.unbalance),
        phase=cmath.phase(rotor.unbalance),
    )
    return replace(scene, rotor=changed)
