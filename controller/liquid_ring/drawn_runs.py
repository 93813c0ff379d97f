"""Closed-loop runs of drawn devices of a liquid ring, a device made once for all settings that are tried."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, fields, replace
from functools import cached_property, lru_cache
from itertools import groupby
from typing import Any, Final

import numpy as np

from ringbalance.controller.algorithms.built_in import BuiltIn
from ringbalance.controller.algorithms.law_based import controller_of
from ringbalance.controller.balancer import FURTHER, Draws, Outcomes, RunResult, Settings
from ringbalance.controller.liquid_ring.devices import Device, Spread, devices
from ringbalance.controller.liquid_ring.plant import LiquidRing
from ringbalance.controller.loop_plan import LoopPlan
from ringbalance.controller.loop_records import AT_REST, IDLE, NOTICEABLE, RISING
from ringbalance.controller.rotor import Rotors
from ringbalance.controller.simulation import Outcome
from ringbalance.controller.terms import dynamics_of, run_terms
from ringbalance.physics.gas import compression_work
from ringbalance.reduced_model.calibration import calibrated_model
from ringbalance.reduced_model.chamber.tilted_ring import check_ring
from ringbalance.reduced_model.injection.dynamics import Dynamics, empty_plants
from ringbalance.reduced_model.injection.limits import hold_liquid, residual_fills, stalled_fills
from ringbalance.reduced_model.law.flow_law import BalancerModel
from ringbalance.reduced_model.terms import HELD
from ringbalance.scene.arrays import Records
from ringbalance.scene.designs import Designs, alike
from ringbalance.scene.draws import run_noise
from ringbalance.scene.models import Scene
from ringbalance.scene.origins import with_values_at

RELATIVE_ERROR: Final = 1e-4
"""Allowed to one step of a run's states: an injection then ends within 1e-6 in fill of a single run's, and
within 3e-5 without inertia."""
MOST_SAMPLES: Final = 100_000
"""Of one run without a trace."""
_GROUPS: Final = (0, 4, 16, 32, 64)
"""Between which numbers, of each 64 that follow each other, devices are made at once: each has the same bits
whichever are asked for, and of a design that four devices refuse no more are made.
"""
_KEPT: Final = 32
"""Groups of devices, and groups under a pressure."""
_OUT_OF_REACH: Final = 2.0
"""Times the limit that remain with chambers emptied to their residual fills, from which on a run need not
be carried out: none settles, and each would take its whole time limit.  Beyond the fill where the gas stalls
a long injection still takes some liquid."""


@dataclass(frozen=True, kw_only=True, eq=False)
class _Setting:
    """One of the settings that are tried."""

    place: int
    scene: Scene
    """The scene's own device with it."""
    controller: BuiltIn


@dataclass(frozen=True, kw_only=True, eq=False)
class DrawnRuns:
    """What runs of a scene's devices under a law share."""

    scene: Scene
    model: BalancerModel
    spread: Spread
    limit: float
    """Amplitude to come below, m, whatever the controller rests at."""
    rotors: Rotors | None = None
    """Of the devices; None: their own, drawn."""
    bare: bool = False
    """Whether the model's law does not know what the scene's uncertain inputs do to it."""

    @cached_property
    def informed(self) -> BalancerModel:
        """The model with that, which the law-based algorithm asks for."""
        return calibrated_model(self.scene, checked=False) if self.bare else self.model

    @cached_property
    def terms(self) -> tuple[str, ...]:
        """Names of the terms that runs model, of all devices alike."""
        return run_terms(scene=self.scene, model=self.model)

    def outcomes(
        self, settings: Sequence[Settings], draws: Draws, *, further: float = FURTHER
    ) -> tuple[Outcomes, ...]:
        """One a setting.

        Args: `settings`: of the gas pressure and of keys of [controller].
        Raises: SceneError: a rotor too slow to form a ring.
        """
        check_ring(self.scene)
        asked = [self._setting(place, each) for place, each in enumerate(settings)]
        ended: list[list[RunResult]] = [[] for _ in asked]
        drawn: list[Device] = []
        for group, numbers in groupby(draws.numbers, _group):
            some = list(numbers)
            made = self._devices(group) if draws.devices else self._as_given(group)
            drawn += [made[group.index(number)] for number in some]
            for pressure, tried in _grouped(asked, lambda each: each.scene.gas.pressure):
                under = self._under(made, pressure)
                for number in some:
                    for at, done in self._runs(under[group.index(number)], tried, draws, further):
                        ended[at].append(done)
        devices_drawn: dict[str, Any] = {
            "numbers": tuple(device.number for device in drawn),
            "inputs": [device.inputs for device in drawn],
            "clipped": [name for device in drawn for name in device.clipped],
        }
        return tuple(Outcomes.of(results, **devices_drawn) for results in ended)

    def _setting(self, place: int, setting: Settings) -> _Setting:
        scene = with_values_at(self.scene, setting)
        model = self.informed if scene.controller.kind == "law_based" else self.model
        controller = controller_of(scene, model, relative_error=RELATIVE_ERROR)
        return _Setting(place=place, scene=scene, controller=controller)

    def _runs(
        self, under: _Under, asked: Sequence[_Setting], draws: Draws, further: float
    ) -> Iterator[tuple[int, RunResult]]:
        """Place of a setting and how the device's run under it ended."""
        if not draws.whole and under.beyond_disc > _OUT_OF_REACH * self.limit:
            yield from ((each.place, _at_best(under)) for each in asked)
            return
        for settings, tried in _grouped(asked, lambda each: replace(each.scene.controller, proportional=1)):
            plan = LoopPlan.of(
                scene=replace(under.scene, controller=settings),
                model=under.device.model,
                plant=under.plant,
                controller=tried[0].controller,
                most_samples=MOST_SAMPLES,
                further=further,
                moments=under.device.moments,
            )
            plan.loop["limit"] = self.limit
            plan.loop["time_limit"] = min(self.scene.run.time_limit, draws.until)
            gains = [each.scene.controller.proportional for each in tried]
            seed, number = self.scene.run.seed, under.device.number
            # The scene as it is has the noise of a single run of it, from the next seed for each number.
            noise = [
                run_noise(seed, number) if draws.devices else np.random.default_rng(seed + number)
                for _ in (() if plan.loop["exact"][0] else gains)
            ]
            runs = under.carried(plan, gains, noise=noise)
            for each, run in zip(tried, runs, strict=True):
                yield each.place, _result(under, run, limit=self.limit)

    def device(self, number: int) -> Device:
        """One of the devices."""
        group = _group(number)
        return self._devices(group)[group.index(number)]

    def _as_given(self, group: range) -> tuple[Device, ...]:
        """The scene's own device, over and over."""
        own = Device(
            number=0, scene=self.scene, model=self.model, speed=1.0, moment=1.0, inputs={}, clipped=()
        )
        return tuple(replace(own, number=number) for number in group)

    def __getstate__(self) -> dict[str, Any]:
        """What is kept stays behind."""
        return {each.name: getattr(self, each.name) for each in fields(self)}

    @cached_property
    def _devices(self) -> Callable[[range], tuple[Device, ...]]:
        """Of a group; the last ones are kept, as a search runs the same again and again."""

        def made(group: range) -> tuple[Device, ...]:
            seed, rotors = self.scene.run.seed, self.rotors
            return devices(self.scene, self.model, self.spread, group, seed=seed, rotors=rotors)

        return lru_cache(_KEPT)(made)

    @cached_property
    def _under(self) -> Callable[[tuple[Device, ...], float], tuple[_Under, ...]]:
        """By devices and gas pressure of the settings; kept likewise."""

        def made(drawn: tuple[Device, ...], pressure: float) -> tuple[_Under, ...]:
            settings = replace(self.scene, gas=replace(self.scene.gas, pressure=pressure))
            scenes = [each.under(settings, of=self.scene) for each in drawn]
            found: dict[int, _Under] = {}
            for places in alike(scenes):
                some = [(drawn[place], scenes[place]) for place in places]
                found |= zip(places, _under(*zip(*some, strict=True), modelled=self.terms), strict=True)
            return tuple(found[place] for place in range(len(drawn)))

        return lru_cache(_KEPT)(made)


@dataclass(frozen=True, kw_only=True, eq=False)
class _Under:
    """A device under one gas pressure."""

    device: Device
    scene: Scene
    plant: Records
    """Type `PLANT`, shape (1,)."""
    residual: float
    """Fill of a driven chamber at which gas enters its port."""
    unreachable: float
    """Vibration that remains with the liquid where the gas can bring it, m."""
    beyond_disc: float
    """The same with gas that empties a chamber to its residual fill, m."""
    usable_moment: float
    """Towards its own unbalance, kg m."""
    unbalance: float
    """kg m."""

    @classmethod
    def of(
        cls, device: Device, scene: Scene, plant: Records, dynamics: Dynamics, residual: float, stalled: float
    ) -> _Under:
        total = 2 * scene.disc.initial_fill
        least = min(max(residual, stalled), total / 2)
        ring = LiquidRing(model=device.model, chambers=scene.disc.chambers, dynamics=dynamics, total=total)
        return cls(
            device=device,
            scene=scene,
            plant=plant,
            residual=residual,
            unreachable=ring.unreachable_vibration(rotor=scene.rotor, least_fill=least),
            beyond_disc=ring.unreachable_vibration(rotor=scene.rotor, least_fill=residual),
            usable_moment=device.moment
            * ring.moment_towards(-scene.rotor.initial_unbalance, least_fill=least),
            unbalance=device.moment * abs(scene.rotor.initial_unbalance),
        )

    def carried(
        self, plan: LoopPlan, gains: Sequence[float], *, noise: Sequence[np.random.Generator]
    ) -> Records:
        """Runs to their ends, one for each gain. Args: `noise`: of each sensor; none where it is exact."""
        runs = plan.runs(len(gains))
        runs["speed"], runs["proportional"] = self.device.speed, gains
        runs["gain"] = self.scene.rotor.influence
        runs["residual_fill"] = self.residual
        plan.carry(runs, noise)
        return runs


def _under(drawn: Sequence[Device], scenes: Sequence[Scene], *, modelled: Sequence[str]) -> Iterator[_Under]:
    """Devices under one gas pressure whose scenes are alike; with each its scene there."""
    plants, stack = empty_plants(len(drawn)), Designs.stacked(scenes)
    # What is held in the tube follows from the other terms, of all devices at once.
    before = [term for term in modelled if term != HELD]
    dynamics = [
        dynamics_of(scene=scene, model=device.model, modelled=before, checked=True)
        for device, scene in zip(drawn, scenes, strict=True)
    ]
    for place, (each, scene) in enumerate(zip(dynamics, scenes, strict=True)):
        each.fill(plants[place : place + 1], total=2 * scene.disc.initial_fill, relative_error=RELATIVE_ERROR)
    if HELD in modelled:
        hold_liquid(plants, stack)
    stalled, residual = np.zeros(len(drawn)), residual_fills(plants, stack)
    stalled_fills(plants, stalled)
    rows = zip(drawn, scenes, dynamics, residual.tolist(), stalled.tolist(), strict=True)
    for place, (device, scene, each, drawn_to, stalls_at) in enumerate(rows):
        yield _Under.of(device, scene, plants[place : place + 1], each, drawn_to, stalls_at)


def _result(under: _Under, run: np.void, *, limit: float) -> RunResult:
    """What a run comes to."""
    gas = under.scene.gas
    rests = run["cause"] == AT_REST and run["since"] < math.inf
    settled = run["settled"] > 0 or rests
    since = run["held_since"] if run["settled"] > 0 else run["since"]
    work = compression_work(
        pressure_volume=float(run["gas"]),
        pressure=gas.pressure + gas.ambient_pressure,
        ambient_pressure=gas.ambient_pressure,
    )
    return RunResult(
        settling_time=float(since) if settled else math.inf,
        final_amplitude=float(run["amplitude"]),
        energy=work,
        usable_moment=under.usable_moment,
        unbalance=under.unbalance,
        ended=str(Outcome.SETTLED if settled else _why(under, run, limit)),
    )


def _at_best(under: _Under) -> RunResult:
    """With the liquid at its best, of a device whose chambers cannot bring it to the limit."""
    return RunResult(
        settling_time=math.inf,
        final_amplitude=under.unreachable,
        energy=math.nan,
        usable_moment=under.usable_moment,
        unbalance=under.unbalance,
        ended=str(Outcome.CAPACITY_EXCEEDED),
    )


def _why(under: _Under, run: np.void, limit: float) -> Outcome:
    """What kept a run from settling."""
    if under.beyond_disc > limit:
        return Outcome.CAPACITY_EXCEEDED
    if under.unreachable > limit:
        return Outcome.STALLED
    if run["drains"] or run["drift"] > NOTICEABLE:
        return Outcome.DRIFTING
    if run["cause"] == RISING:
        return Outcome.DIVERGING
    if run["lost"] > 0:
        return Outcome.HOVERING
    return Outcome.GAS_TIME_TOO_SHORT if run["cause"] == IDLE else Outcome.TIME_LIMIT


def _group(number: int) -> range:
    """Numbers of the devices that are made with one."""
    start, place = number - number % _GROUPS[-1], number % _GROUPS[-1]
    after = next(each for each in range(len(_GROUPS)) if _GROUPS[each] > place)
    return range(start + _GROUPS[after - 1], start + _GROUPS[after])


def _grouped(settings: Sequence[_Setting], key: Any) -> Iterator[tuple[Any, list[_Setting]]]:
    """Settings that are alike in a key, in the order of the first of each."""
    groups: dict[Any, list[_Setting]] = {}
    for each in settings:
        groups.setdefault(key(each), []).append(each)
    yield from groups.items()
