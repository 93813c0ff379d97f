"""Checks that hold for every balancer, as scikit-learn's `check_estimator` has them for every estimator."""

from __future__ import annotations

import cmath
import math
import pickle
from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from typing import Any, Final

import numpy as np

from ringbalance.controller.balancer import AS_GIVEN, Balancer, Draws, Outcomes, balancer_of
from ringbalance.controller.standard_balancer import StandardBalancer, StandardRun
from ringbalance.results.result import Result, Rows, Table
from ringbalance.results.rows import Finding
from ringbalance.scene.faults import SceneError
from ringbalance.scene.units import DIMENSIONS

_UNITS: Final = {unit for kind in DIMENSIONS.values() for unit in kind.units} | {"1"}
_SPAN_S: Final = 7.5
_ANGLES: Final = (0.0, math.pi / 8, math.pi / 4, 3 * math.pi / 8)
"""Directions of the unbalance, from the scene's: one is near the worst of a disc of four chambers or more."""
Check = Callable[[Balancer], Iterator[str]]
"""Function that yields what is wrong; its docstring says what must hold."""


def _differ(first: Outcomes, second: Outcomes) -> bool:
    names = ("settled", "settling_time", "final_amplitude")
    return not all(np.array_equal(getattr(first, name), getattr(second, name)) for name in names)


def inputs(balancer: Balancer) -> Iterator[str]:
    """Inputs have paths of their own, values, half-widths and known units; one at least is uncertain."""
    listed = balancer.inputs()
    if len({each.path for each in listed}) < len(listed):
        yield "two inputs have one path"
    for each in listed:
        if not (math.isfinite(each.value) and 0 <= each.half_width < math.inf):
            yield f"{each.path} is {each.value} with a half-width of {each.half_width}"
        if each.unit not in _UNITS:
            yield f"the unit of {each.path} is {each.unit}"
    if not any(each.half_width > 0 for each in listed):
        yield "no input is uncertain: state some in [uncertainty]"


def settings(balancer: Balancer) -> Iterator[str]:
    """There are settings, each within its bounds."""
    listed = balancer.settings()
    if not listed:
        yield "there are none"
    for each in listed:
        if not each.lowest < each.value < each.highest:
            yield f"{each.path} is {each.value}, its bounds are {each.lowest} and {each.highest}"


def stated_settings(balancer: Balancer) -> Iterator[str]:
    """The settings that the scene states give the results of no settings."""
    stated, draws = {each.path: each.value for each in balancer.settings()}, Draws.first(2)
    if _differ(balancer.run(stated, draws), balancer.run({}, draws)):
        yield "other results"


def effects(balancer: Balancer) -> Iterator[str]:
    """A setting, 1.3 times as large, has an effect, as the spread of each uncertain input has."""
    stated = balancer.run({}, AS_GIVEN, trace=True)
    changed = ({each.path: 1.3 * each.value} for each in balancer.settings())
    if not any(_differ(balancer.run(each, AS_GIVEN, trace=True), stated) for each in changed):
        yield "no setting has one"
    if not isinstance(balancer, StandardBalancer):
        return
    scene, outcomes = balancer.scene, balancer.run({}, Draws.first(3))
    for each in scene.uncertainty:
        rest = tuple(other for other in scene.uncertainty if other is not each)
        if not _differ(balancer.on_scene(replace(scene, uncertainty=rest)).run({}, Draws.first(3)), outcomes):
            yield f"{each.quantity} has none on a drawn device"


def repeatable(balancer: Balancer) -> Iterator[str]:
    """A further balancer of the scene gives the same results for the same draws."""
    if _differ(balancer.run({}, Draws.first(3)), balancer_of(balancer.scene).run({}, Draws.first(3))):
        yield "other results"


def numbers(balancer: Balancer) -> Iterator[str]:
    """A number is the same device, alone and among others."""
    several, alone = balancer.run({}, Draws.first(3)), balancer.run({}, Draws(numbers=(2,)))
    names = ("final_amplitude", "settling_time")
    if any(getattr(several, name)[2] != getattr(alone, name)[0] for name in names):
        yield "device 2 ends otherwise alone than after devices 0 and 1"


def devices(balancer: Balancer) -> Iterator[str]:
    """Drawn devices differ."""
    if np.unique(balancer.run({}, Draws.first(3)).final_amplitude).size < 3:
        yield "two of three end at the same amplitude"


def settling_times(balancer: Balancer) -> Iterator[str]:
    """Settling times are positive, and finite where a device has settled, whose `ended` is "settled"."""
    outcomes = balancer.run({}, Draws.first(3))
    for time, ended in zip(outcomes.settling_time, outcomes.ended, strict=True):
        if not time >= 0 or math.isfinite(time) != (ended == "settled"):
            yield f"a device settles after {time} s and ends as {ended}"


def one_run(balancer: Balancer) -> Iterator[str]:
    """Result, document and history of a traced run are those of one run."""
    outcomes = balancer.run({}, AS_GIVEN, trace=True)
    (traced,) = outcomes.traced
    run, columns = traced.run, balancer.history(traced.run)
    document, settled = run.to_dict(), bool(outcomes.settled[0])
    pairs = (("balancer", balancer.scene.balancer), ("settled", settled), ("status", run.status))
    for key, value in pairs:
        if document.get(key) != value:
            yield f"{key} is {document.get(key)!r} in the document of the run, and {value!r}"
    if bool(run.settled) != settled:
        yield f"settled is {run.settled} of the run and {settled} of its result"
    if not run.status:
        yield "the status is empty"
    if not traced.energy >= 0:
        yield f"the energy is {traced.energy} J"
    if not traced.worst_amplitude >= outcomes.final_amplitude[0] * (1 - 1e-9):
        yield "the worst amplitude is smaller than the last"
    if "time_s" not in columns or len({len(column) for column in columns.values()}) > 1:
        yield "the history has no time_s, or columns of several lengths"


def traces(balancer: Balancer) -> Iterator[str]:
    """A result does not depend on whether its run is traced."""
    draws = Draws.first(2, devices=False)
    plain, traced = (balancer.run({}, draws, trace=trace) for trace in (False, True))
    if not np.array_equal(plain.settled, traced.settled) or not np.allclose(
        plain.settling_time, traced.settling_time, rtol=1e-4
    ):
        yield "other results"


def untraced(balancer: Balancer) -> Iterator[str]:
    """Runs are kept only where they are traced."""
    if balancer.run({}, Draws.first(1, devices=False)).traced:
        yield "a run that is not traced is kept"


def rotor(balancer: Balancer) -> Iterator[str]:
    """On its own rotor a balancer has that rotor."""
    common = balancer.rotor()
    again = balancer.on_rotor(common).rotor()
    for name in ("speed", "influence", "unbalance", "limit", "noise"):
        before, after = getattr(common, name), getattr(again, name)
        if not cmath.isclose(before, after, rel_tol=0 if name in ("limit", "noise") else 1e-6):
            yield f"{name} is {after} in place of {before}"


def reach(balancer: Balancer) -> Iterator[str]:
    """Runs cancel nine tenths of the stated reach in any direction, no more in the worst, and hold a peak."""
    stated = next((each.value for each in balancer.quantities() if each.key == "reach"), None)
    if stated is None or not 0 < stated < math.inf:
        yield f"the quantity reach is {stated}"
        return
    common = balancer.rotor()
    small = common.limit / abs(common.influence)

    def left(size: float) -> list[float]:
        phases = (cmath.phase(common.unbalance) + angle for angle in _ANGLES)
        turned = (replace(common, unbalance=cmath.rect(size, phase)) for phase in phases)
        runs = (balancer.on_rotor(each).run({}, AS_GIVEN) for each in turned)
        return [float(run.final_amplitude[0]) / abs(common.influence) for run in runs]

    if (most := max(left(0.9 * stated))) > small:
        after = f"after {balancer.span():.3g} s"
        yield f"of 0.9 of a reach of {stated:.4g} kg m runs leave {most:.3g} kg m {after}"
    # That of the scene, which the balancer is for, and one beyond reach by more than the limit leaves.
    sizes = {abs(common.unbalance), 2 * stated + 2 * small}
    if (cancelled := max(size - max(left(size)) for size in sizes)) > 1.1 * stated:
        yield f"the reach is {stated:.4g} kg m, and runs cancel {cancelled:.3g} kg m in any direction"
    # In some directions a balancer may form more than its reach; what it forms on the way it also holds.
    (traced,) = balancer.run({}, AS_GIVEN, trace=True).traced
    if not isinstance(traced.run, StandardRun):
        return
    peak = complex(max(traced.run.correction, key=abs))
    if abs(peak) > 1.1 * stated:
        against = replace(common, unbalance=-0.9 * peak)
        run = balancer.on_rotor(against).run({}, AS_GIVEN)
        if run.final_amplitude[0] / abs(common.influence) > small:
            yield f"the reach is {stated:.4g} kg m, and a run passes through {abs(peak):.4g} kg m"


def span(balancer: Balancer) -> Iterator[str]:
    """Runs last as long as is asked for, and measure as often as is stated."""
    if not math.isclose(reached := balancer.lasting(_SPAN_S).span(), _SPAN_S):
        yield f"{reached} s in place of {_SPAN_S} s"
    stated = balancer.sampling_time()
    if not 0 <= stated < math.inf:
        yield f"the sampling time is {stated:.4g} s"
        return
    (traced,) = balancer.run({}, AS_GIVEN, trace=True).traced
    steps = np.diff(np.unique(traced.run.measured)) if isinstance(traced.run, StandardRun) else ()
    if len(steps) and not min(steps) * (1 - 1e-6) <= stated <= max(steps) * (1 + 1e-6):
        yield f"the sampling time is {stated:.4g} s, and runs measure every {np.median(steps):.4g} s"


def pickles(balancer: Balancer) -> Iterator[str]:
    """A pickled balancer gives the same results, as in another process."""
    again = pickle.loads(pickle.dumps(balancer))
    if _differ(again.run({}, Draws.first(2)), balancer.run({}, Draws.first(2))):
        yield "other results"


def options(balancer: Balancer) -> Iterator[str]:
    """An option that it does not have is refused."""
    with suppress(ValueError):
        balancer_of(balancer.scene, colour="red")
        yield "colour is taken"


def checked_scene(balancer: Balancer) -> Iterator[str]:
    """Its scene takes other values through its checks, and a record that was changed past them is refused."""
    scene = balancer.scene
    if scene.with_values({"run.seed": 5}).run.seed != 5:
        yield "another run.seed is not taken"
    with suppress(SceneError):
        replace(scene, run=replace(scene.run, seed=6)).with_values({"run.seed": 7})
        yield "a changed record is taken"


def description(balancer: Balancer) -> Iterator[str]:
    """Its scene describes itself in two lines or more."""
    text = repr(balancer.scene)
    if len(text.splitlines()) < 2 or balancer.scene.source not in text:
        yield f"it says {text!r}"


CHECKS: Final[tuple[Check, ...]] = (
    inputs,
    settings,
    stated_settings,
    effects,
    repeatable,
    numbers,
    devices,
    settling_times,
    one_run,
    traces,
    untraced,
    rotor,
    reach,
    span,
    pickles,
    options,
    checked_scene,
    description,
)
"""Each is called with the balancer of a scene that was read."""


class Raised(str):
    """Problem that ended a check."""

    __slots__ = ()


def problems_of(check: Check, balancer: Balancer) -> tuple[str, ...]:
    """Problems that a check finds; an exception is one of them."""
    try:
        return tuple(check(balancer))
    except SceneError as error:
        return (Raised(error),)
    except Exception as error:  # Whatever another package raises is the result of the check.
        return (Raised(f"{type(error).__name__}: {error}"),)


@dataclass(frozen=True, kw_only=True, repr=False)
class BalancerChecks(Result):
    """Result of all checks of a balancer."""

    name: str
    source: str
    """Scene on which it was checked."""
    problems: Sequence[tuple[Check, tuple[str, ...]]]
    """Checks, each with its problems."""

    @property
    def succeeded(self) -> bool:
        """True if every check passes."""
        return not any(problems for _, problems in self.problems)

    def _states(self) -> Iterator[tuple[Check, str, str]]:
        """Each check with its state and what is wrong; what ended several checks is said once."""
        said = set()
        for check, problems in self.problems:
            if problems and isinstance(problems[0], Raised) and problems in said:
                yield check, "not reached", ""
            else:
                yield check, "failed" if problems else "passed", "; ".join(problems)
            said.add(problems)

    def _finding(self) -> Finding:
        values: dict[str, Any] = {"name": self.name, "count": len(self.problems), "source": self.source}
        states = [state for _, state, _ in self._states()]
        values |= {"failed": states.count("failed"), "unreached": states.count("not reached")}
        if values["unreached"]:
            return Finding(code="balancer_unreached", values=values)
        return Finding(code="balancer_unsound" if values["failed"] else "balancer_sound", values=values)

    def rows(self) -> Rows:
        """Verdict, and a line for each check."""
        lines = [(f"{check.__doc__}", state, problem) for check, state, problem in self._states()]
        table = Table(heads=("must hold", "", "problem"), rows=lines)
        title = f"Balancer {self.name}"
        return Rows(title=title, quantities=(), findings=(self._finding(),), tables=(table,))

    def to_dict(self) -> dict[str, Any]:
        """The document that `ringbalance check-balancer --json` prints."""
        return {
            "balancer": self.name,
            "scene": self.source,
            "passed": self.succeeded,
            "checks": [
                {
                    "name": check.__name__,
                    "holds": check.__doc__,
                    "passed": not problems,
                    "problems": [*problems],
                }
                for check, problems in self.problems
            ],
            "findings": [self._finding().document()],
        }
