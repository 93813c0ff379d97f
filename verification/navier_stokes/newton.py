"""Flows by Newton's method with the exact Jacobian, and by continuation in a parameter.

The prescribed flow rate borders the matrix by one row and column, solved with a second right-hand side: a
dense row inside the matrix would ruin the sparse factors.  Eliminating along the diagonal keeps these three
to four times sparser than partial pivoting does, because fill-in gives the pressure block its diagonal in
time.  It is not safe by construction, so every solve checks its residual, refines it, and falls back on
partial pivoting when that does not help.
Continuation uses a secant predictor and repeats a failed step with half its length.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from typing import Any, Self

import numpy as np
from scipy.sparse.linalg import splu

from ringbalance.physics.results import Statistics, Status, StatusCode
from ringbalance.scene.arrays import FloatArray
from ringbalance.verification.navier_stokes.flow import Coefficients, FlowSystem

_GOOD, _USABLE = 1e-12, 1e-8
"""Relative residuals: below the first no refinement, above the second a retry with pivoting."""
_MAX_REFINEMENTS = 3
_KEEP_FACTORS_BELOW = 1e-3
"""Relative change below which the next step reuses the factors: the contraction is then at least that."""


class Factors:
    """Sparse factors of a square CSC matrix of symmetric pattern. Raises: RuntimeError: it is singular."""

    def __init__(self, matrix: Any) -> None:
        self.matrix, self.pivoted = matrix, False
        try:
            symmetric = {"SymmetricMode": True}
            self.factors = splu(matrix, permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options=symmetric)
        except RuntimeError:
            self.factors, self.pivoted = splu(matrix, permc_spec="COLAMD"), True

    def solve(self, right: FloatArray) -> FloatArray:
        """Solution of A x = b, refined, with pivots if need be. Raises: RuntimeError: A is singular."""
        scale = float(np.abs(right).max()) or 1.0
        x, gap = np.asarray(self.factors.solve(right), dtype=np.float64), np.inf
        for _ in range(_MAX_REFINEMENTS):
            residual = right - self.matrix @ x
            gap, before = float(np.abs(residual).max()) / scale, gap
            if gap <= _GOOD or not gap < before / 2:
                break
            x = x + self.factors.solve(residual)
        if not gap <= _USABLE and not self.pivoted:
            self.factors, self.pivoted = splu(self.matrix, permc_spec="COLAMD"), True
            return self.solve(right)
        return x


@dataclass(frozen=True, kw_only=True)
class NewtonSettings:
    """Criteria by which Newton's method stops."""

    tolerance: float = 1e-9
    """Largest change of a velocity over the largest velocity, below which the flow has converged."""
    max_iterations: int = 20


@dataclass(frozen=True, kw_only=True, eq=False)
class FlowSolution:
    """Velocity and pressure of a flow, with the status of its solve."""

    vector: FloatArray
    """Full vector of unknowns; a start for a neighbouring solve."""
    velocity: FloatArray
    """Nodal, shape (components, velocity nodes)."""
    pressure: FloatArray
    """Nodal, shape (pressure nodes,)."""
    driving_gradient: float = 0.0
    """G that drives the prescribed flow rate, 0 without one."""
    status: Status = field(default_factory=Status)
    statistics: Statistics = field(default_factory=Statistics)

    @classmethod
    def of(cls, system: FlowSystem, vector: FloatArray, **more: Any) -> Self:
        """A flow from its full vector of unknowns, and further fields."""
        velocity, pressure = system.split(vector)
        return cls(vector=vector, velocity=velocity, pressure=pressure, **more)


def solve_flow(
    *,
    system: FlowSystem,
    coefficients: Coefficients,
    flow_rate: float = 0.0,
    start: FlowSolution | None = None,
    settings: NewtonSettings | None = None,
    progress: Callable[[str], None] | None = None,
) -> FlowSolution:
    """Steady flow of a system by Newton's method with the exact derivative, at first from the Stokes flow.

    Args: `flow_rate`: integral of the system's flow component over the domain; unused without one. `start`: a
        flow of the same system. `progress`: called with a short text on each iteration.
    Returns: The flow; its status says NOT_CONVERGED, with a remedy, when Newton's method failed.
    Raises: ValueError: viscosity not above zero, or a start of another system.
    """
    if not coefficients.viscosity > 0.0:
        raise ValueError("viscosity must be above zero")
    if start is not None and start.vector.size != system.unknowns:
        raise ValueError("start belongs to another system")
    settings, free = settings or NewtonSettings(), system.free
    vector, gradient, iterations = system.fixed_values.copy(), 0.0, 0
    stages = [coefficients]
    if start is not None:
        vector[free], gradient = start.vector[free], start.driving_gradient
    elif coefficients.inertia != 0.0:
        stages = [replace(coefficients, inertia=0.0), coefficients]
    for stage in stages:
        linear = system.linear_matrix(stage)
        vector, gradient, steps, problem = _iterate(
            system, linear, stage.inertia, vector, gradient, flow_rate, settings, progress
        )
        iterations += steps
        if problem:
            break
    finite = np.isfinite(vector)
    if not np.all(finite):
        problem = problem or "the iteration diverged"
    vector = np.where(finite, vector, 0.0)
    if system.enclosed:
        # Nothing else fixes the pressure's level: its mean is zero.
        pressure = vector[-system.mean_load.size :]
        pressure -= float(system.mean_load @ pressure) / float(system.mean_load.sum())
    residual = np.abs(_residual(system, linear, stage.inertia, vector, gradient))
    at_walls = np.delete(residual, free)
    status = Status()
    if problem:
        remedy = "start from the solution of a neighbouring, less convective case, or refine the mesh"
        status = Status(code=StatusCode.NOT_CONVERGED, text=f"{problem}; {remedy}")
    statistics = Statistics(
        unknowns=int(free.size),
        iterations=iterations,
        relative_residual=float(residual[free].max() / (at_walls.max() or 1.0)),
    )
    return FlowSolution.of(system, vector, driving_gradient=gradient, status=status, statistics=statistics)


def _residual(
    system: FlowSystem, linear: Any, inertia: float, vector: FloatArray, gradient: float
) -> FloatArray:
    """Imbalance of each equation, full vector."""
    residual = np.asarray(linear @ vector, dtype=np.float64) - system.source
    if system.flow_load is not None:
        residual -= gradient * system.flow_load
    if inertia != 0.0:
        residual += inertia * system.convection_vector(vector)
    if system.enclosed:
        # A discrete boundary flow that does not sum to zero is spread evenly instead of
        # becoming a point source at the pinned node.
        mass = residual[-system.mean_load.size :]
        mass -= mass.sum() / system.mean_load.sum() * system.mean_load
    return residual


def _iterate(
    system: FlowSystem,
    linear: Any,
    inertia: float,
    vector: FloatArray,
    gradient: float,
    flow_rate: float,
    settings: NewtonSettings,
    progress: Callable[[str], None] | None,
) -> tuple[FloatArray, float, int, str]:
    """Take Newton steps until they are small. Returns: Flow, gradient, iterations, and the problem or ""."""
    free, factors, contracting, update = system.free, None, True, np.inf
    for iteration in range(1, settings.max_iterations + 1):
        # Contracting: well below the step before, so that the old factors are good for another step.
        keep = inertia == 0.0 or (update < _KEEP_FACTORS_BELOW and contracting)
        change = np.zeros_like(vector)
        try:
            if factors is None or not keep:
                jacobian = linear
                if inertia != 0.0:
                    jacobian = jacobian + inertia * system.convection_matrix(vector)
                factors = Factors(system.free_part(jacobian))
                if system.flow_load is not None:
                    bordering = factors.solve(system.flow_load[free])
            change[free] = factors.solve(-_residual(system, linear, inertia, vector, gradient)[free])
        except RuntimeError as error:
            return vector, gradient, iteration - 1, f"the matrix could not be factorized ({error})"
        if system.flow_load is not None:
            missing = flow_rate - float(system.flow_load @ (vector + change))
            share = missing / float(system.flow_load[free] @ bordering)
            change[free] += share * bordering
            gradient += share
        vector = vector + change
        largest, moved = (float(np.abs(system.split(each)[0]).max()) for each in (vector, change))
        before, update = update, moved / largest if largest > 0.0 else 0.0
        contracting = update < 0.1 * before
        if progress is not None:
            progress(f"Newton iteration {iteration}: relative change {update:.1e}")
        if not np.isfinite(update) or update > 1e8:
            return vector, gradient, iteration, "the iteration diverged"
        if update <= settings.tolerance:
            return vector, gradient, iteration, ""
    problem = f"no convergence in {settings.max_iterations} iterations (last relative change {update:.1e})"
    return vector, gradient, settings.max_iterations, problem


Solve = Callable[[float, FlowSolution | None], FlowSolution]
"""Flow at a parameter from a predicted start, or from rest."""
_EASY = 2.0
"""Parameter up to which a start from rest converges."""
_EASY_ITERATIONS, _GROWTH = 6, 1.6
"""Newton iterations up to which a step counts as easy, and the factor of the next; a failed one is halved."""


@dataclass(frozen=True, kw_only=True)
class StepRule:
    """Steps in the parameter, in the parameter's own unit."""

    first: float = 1.0
    smallest: float = 1 / 64
    largest: float = float("inf")
    """Longest step: with several flows for one parameter a longer one can land on another branch."""


@dataclass(frozen=True, kw_only=True, eq=False)
class _FlowPath:
    """Flows at the targets that were reached, in order."""

    solutions: tuple[FlowSolution, ...]
    status: Status
    """NOT_CONVERGED, and where, when a target was not reached."""
    failures: int
    """Steps that had to be repeated with half their length."""


def follow(
    *,
    solve: Solve,
    start: FlowSolution,
    start_at: float,
    targets: Sequence[float],
    rule: StepRule | None = None,
) -> _FlowPath:
    """Flows at the targets, each reached from the one before; a failed step is halved, an easy one grows.

    Args: `start`: a converged flow. `start_at`: its parameter. `targets`: parameters to reach, in monotone
        order.
    """
    rule = rule or StepRule()
    at, flow, step, failures = start_at, start, rule.first, 0
    before: tuple[float, FlowSolution] | None = None
    reached: list[FlowSolution] = []
    for target in targets:
        while at != target and step >= rule.smallest:
            remaining = abs(target - at)
            length = min(step, remaining)
            # A very short last step would spoil the secant through it.
            length = remaining if remaining - length < 0.1 * length else length
            parameter = target if length == remaining else at + length * (1 if target > at else -1)
            predicted = flow
            if before is not None:
                share = (parameter - at) / (at - before[0])
                gradient, earlier = flow.driving_gradient, before[1]
                predicted = replace(
                    flow,
                    vector=flow.vector + share * (flow.vector - earlier.vector),
                    driving_gradient=gradient + share * (gradient - earlier.driving_gradient),
                )
            solution = solve(parameter, predicted)
            if not solution.status.ok:
                failures, step = failures + 1, length / 2
                continue
            before, at, flow = (at, flow), parameter, solution
            easy = flow.statistics.iterations <= _EASY_ITERATIONS
            step = min(max(step, length) * (_GROWTH if easy else 1.0), rule.largest)
        if at != target:
            text = f"the path ended at {at:.6g} on its way to {target:.6g}"
            remedy = "refine the mesh or take smaller steps"
            status = Status(code=StatusCode.NOT_CONVERGED, text=f"{text}; {remedy}")
            return _FlowPath(solutions=tuple(reached), status=status, failures=failures)
        reached.append(flow)
    return _FlowPath(solutions=tuple(reached), status=Status(), failures=failures)


def flow_at(*, solve: Solve, parameter: float, first: float) -> FlowSolution:
    """Flow at a parameter, by continuation from a start from rest. Raises: ArithmeticError: not found."""
    flow = solve(min(parameter, _EASY), None)
    status = flow.status
    if parameter > _EASY and status.ok:
        rule = StepRule(first=first, smallest=0.02, largest=3.0)
        path = follow(solve=solve, start=flow, start_at=_EASY, targets=[parameter], rule=rule)
        flow, status = path.solutions[-1] if path.solutions else flow, path.status
    if not status.ok:
        raise ArithmeticError(f"the flow was not found: {status.text}")
    return flow
