"""Following a flow along a parameter: secant predictor, Newton corrector, steps that recover from failure."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

from ringbalance.physics.results import Status, StatusCode
from ringbalance.verification.navier_stokes.newton import FlowSolution

Solve = Callable[[float, FlowSolution], FlowSolution]
FirstSolve = Callable[[float, FlowSolution | None], FlowSolution]
_EASY = 2.0
"""Parameter up to which a start from rest converges."""


@dataclass(frozen=True, kw_only=True)
class StepRule:
    """Steps in the parameter, in the parameter's own unit."""

    first: float = 1.0
    smallest: float = 1 / 64
    largest: float = float("inf")
    """Where several flows exist for one parameter, long steps can land on another branch."""
    growth: float = 1.6
    """Factor after an easy step; a failed step is halved."""
    easy_iterations: int = 6
    """Newton iterations up to which a step counts as easy."""


@dataclass(frozen=True, kw_only=True, eq=False)
class _FlowPath:
    """Flows at the targets that were reached, in order."""

    solutions: tuple[FlowSolution, ...]
    status: Status
    solves: int
    failures: int
    """Steps that had to be repeated with half their length."""


@dataclass(eq=False)
class _Walk:
    """Where the path is: the last two flows and the present step."""

    at: float
    flow: FlowSolution
    step: float
    before: float | None = None
    flow_before: FlowSolution | None = None
    solves: int = 0
    failures: int = 0


def _predicted(walk: _Walk, parameter: float) -> FlowSolution:
    if walk.flow_before is None or walk.before is None:
        return walk.flow
    share = (parameter - walk.at) / (walk.at - walk.before)
    vector = walk.flow.vector + share * (walk.flow.vector - walk.flow_before.vector)
    gradient = walk.flow.driving_gradient
    gradient += share * (gradient - walk.flow_before.driving_gradient)
    return replace(walk.flow, vector=vector, driving_gradient=gradient)


def _advance(walk: _Walk, solve: Solve, target: float, rule: StepRule) -> bool:
    """One step towards the target; false when even the smallest step fails."""
    remaining = target - walk.at
    full = min(walk.step, abs(remaining))
    # A sliver left over would make the secant through it worthless.
    full = abs(remaining) if abs(remaining) - full < 0.1 * full else full
    parameter = target if full == abs(remaining) else walk.at + full * (1 if remaining > 0 else -1)
    flow = solve(parameter, _predicted(walk, parameter))
    walk.solves += 1
    if not flow.status.ok:
        walk.failures += 1
        walk.step = full / 2
        return walk.step >= rule.smallest
    easy = flow.statistics.iterations <= rule.easy_iterations
    walk.before, walk.flow_before = walk.at, walk.flow
    walk.at, walk.flow = parameter, flow
    walk.step = min(max(walk.step, full) * (rule.growth if easy else 1.0), rule.largest)
    return True


def follow(
    *,
    solve: Solve,
    start: FlowSolution,
    start_at: float,
    targets: Sequence[float],
    rule: StepRule | None = None,
) -> _FlowPath:
    """Flows at the targets, each reached from the one before; a failed step is halved, an easy one grows.

    Args: `solve`: flow at a parameter from a predicted start. `start`: a converged flow. `start_at`: its
        parameter. `targets`: parameters to reach, in monotone order.
    Returns: The flows reached; the status says NOT_CONVERGED, and where, when a target was not reached.
    """
    rule = rule or StepRule()
    walk = _Walk(at=start_at, flow=start, step=rule.first)
    reached: list[FlowSolution] = []
    status = Status()
    for target in targets:
        while walk.at != target and _advance(walk, solve, target, rule):
            pass
        if walk.at != target:
            text = f"the path ended at {walk.at:.6g} on its way to {target:.6g}"
            remedy = "refine the mesh or take smaller steps"
            status = Status(code=StatusCode.NOT_CONVERGED, text=f"{text}; {remedy}")
            break
        reached.append(walk.flow)
    return _FlowPath(solutions=tuple(reached), status=status, solves=walk.solves, failures=walk.failures)


def flow_at(*, solve: FirstSolve, parameter: float, first: float) -> FlowSolution:
    """Flow at a parameter, followed from where a start from rest converges. Raises: ArithmeticError: none."""
    flow = solve(min(parameter, _EASY), None)
    status = flow.status
    if parameter > _EASY and status.ok:
        rule = StepRule(first=first, smallest=0.02, largest=3.0)
        path = follow(solve=solve, start=flow, start_at=_EASY, targets=[parameter], rule=rule)
        flow, status = path.solutions[-1] if path.solutions else flow, path.status
    if not status.ok:
        raise ArithmeticError(f"the flow was not found: {status.text}")
    return flow
