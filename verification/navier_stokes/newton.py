"""Flows by Newton's method with the exact Jacobian, and followed along a parameter.

The prescribed flow rate borders the matrix by one row and column, solved with a second right-hand side: a
dense row inside the matrix would ruin the sparse factors.  Eliminating along the diagonal keeps these three
to four times sparser than partial pivoting does, because fill-in gives the pressure block its diagonal in
time.  It is not safe by construction, so every solve checks its residual, refines it, and falls back on
partial pivoting when that does not help.
A path is followed with a secant predictor, and steps that recover from failure.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any, Self

import numpy as np
from scipy.sparse.linalg import splu

from ringbalance.physics.results import Statistics, Status, StatusCode
from ringbalance.scene.arrays import FloatArray
from ringbalance.verification.navier_stokes.flow import Coefficients, FlowSystem

_GOOD, _USABLE, _REFINEMENTS = 1e-12, 1e-8, 3
"""Relative residuals: of a solution that is as good as it gets, and of one that will do; attempts between."""


class Factors:
    """Sparse factors of a square CSC matrix of symmetric pattern. Raises: RuntimeError: it is singular."""

    def __init__(self, matrix: Any) -> None:
        self.matrix, self.pivoted = matrix, False
        try:
            symmetric = {"SymmetricMode": True}
            self.factors = splu(matrix, permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options=symmetric)
        except RuntimeError:
            self._pivot()

    def _pivot(self) -> None:
        self.factors, self.pivoted = splu(self.matrix, permc_spec="COLAMD"), True

    def solve(self, right: FloatArray) -> FloatArray:
        """Solution of A x = b, refined, with pivots if need be. Raises: RuntimeError: A is singular."""
        x, gap = self._refined(right)
        if gap > _USABLE and not self.pivoted:
            self._pivot()
            x, gap = self._refined(right)
        return x

    def _refined(self, right: FloatArray) -> tuple[FloatArray, float]:
        """Solution with up to three refinements, and its relative residual."""
        scale = float(np.abs(right).max()) or 1.0
        x, gap = np.asarray(self.factors.solve(right), dtype=np.float64), np.inf
        for _ in range(_REFINEMENTS):
            residual = right - self.matrix @ x
            gap, before = float(np.abs(residual).max()) / scale, gap
            if gap <= _GOOD or not gap < before / 2:
                break
            x = x + self.factors.solve(residual)
        return x, gap if np.isfinite(gap) else np.inf


@dataclass(frozen=True, kw_only=True)
class NewtonSettings:
    """When Newton's method stops, and when it keeps its factors."""

    tolerance: float = 1e-9
    """Largest change of a velocity over the largest velocity at which it has converged."""
    max_iterations: int = 20
    keep_factors_below: float = 1e-3
    """Relative change below which the next step reuses the factors: the contraction is then at least that."""


@dataclass(frozen=True, kw_only=True, eq=False)
class FlowSolution:
    """Velocity and pressure of a flow, with how the solve ended."""

    vector: FloatArray
    """Full vector of unknowns; a start for a neighbouring solve."""
    velocity: FloatArray
    """Nodal, shape (components, velocity nodes)."""
    pressure: FloatArray
    """Nodal, shape (pressure nodes,)."""
    driving_gradient: float
    """G that drives the prescribed flow rate, 0 without one."""
    status: Status
    statistics: Statistics

    @classmethod
    def of(
        cls,
        system: FlowSystem,
        vector: FloatArray,
        *,
        driving_gradient: float = 0.0,
        status: Status | None = None,
        statistics: Statistics | None = None,
    ) -> Self:
        """A flow by its full vector."""
        velocity, pressure = system.split(vector)
        return cls(
            vector=vector,
            velocity=velocity,
            pressure=pressure,
            driving_gradient=driving_gradient,
            status=status or Status(),
            statistics=statistics or Statistics(),
        )


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
    settings = settings or NewtonSettings()
    if start is None:
        creeping = _Newton(system, replace(coefficients, inertia=0.0), flow_rate, progress)
        creeping.iterate(settings)
        if creeping.problem or coefficients.inertia == 0.0:
            return creeping.solution()
        newton = _Newton(system, coefficients, flow_rate, progress, creeping)
    else:
        newton = _Newton(system, coefficients, flow_rate, progress)
        newton.vector[system.free] = start.vector[system.free]
        newton.gradient = start.driving_gradient
    newton.iterate(settings)
    return newton.solution()


class _Newton:
    """Working state of one Newton solve."""

    def __init__(
        self,
        system: FlowSystem,
        coefficients: Coefficients,
        flow_rate: float,
        progress: Callable[[str], None] | None,
        before: _Newton | None = None,
    ) -> None:
        self.system, self.inertia, self.flow_rate = system, coefficients.inertia, flow_rate
        self.linear, self.progress = system.linear_matrix(coefficients), progress
        self.vector: FloatArray = system.fixed_values.copy() if before is None else before.vector
        self.gradient: float = 0.0 if before is None else before.gradient
        self.iterations: int = 0 if before is None else before.iterations
        self.update, self.contracting, self.problem = np.inf, True, ""

    def iterate(self, settings: NewtonSettings) -> None:
        """Take steps until they are small; `problem` says what went wrong."""
        factors: Factors | None = None
        for _ in range(settings.max_iterations):
            # Contracting: well below the step before, so that old factors may serve once more.
            keep = self.inertia == 0.0 or (self.update < settings.keep_factors_below and self.contracting)
            try:
                if factors is None or not keep:
                    factors = self._factors()
                self._step(factors)
            except RuntimeError as error:
                self.problem = f"the matrix could not be factorized ({error})"
                return
            if not np.isfinite(self.update) or self.update > 1e8:
                self.problem = "the iteration diverged"
                return
            if self.update <= settings.tolerance:
                return
        change = f"last relative change {self.update:.1e}"
        self.problem = f"no convergence in {settings.max_iterations} iterations ({change})"

    def _residual(self) -> FloatArray:
        system = self.system
        residual = np.asarray(self.linear @ self.vector, dtype=np.float64) - system.source
        if system.flow_load is not None:
            residual -= self.gradient * system.flow_load
        if self.inertia != 0.0:
            residual += self.inertia * system.convection_vector(self.vector)
        if system.enclosed:
            # A boundary flow that does not close in the discrete sense is spread evenly instead of
            # becoming a point source at the pinned node.
            mass = residual[-system.mean_load.size :]
            mass -= mass.sum() / system.mean_load.sum() * system.mean_load
        return residual

    def _factors(self) -> Factors:
        system, jacobian = self.system, self.linear
        if self.inertia != 0.0:
            jacobian = jacobian + self.inertia * system.convection_matrix(self.vector)
        factors = Factors(system.free_part(jacobian))
        if system.flow_load is not None:
            self.bordering = factors.solve(system.flow_load[system.free])
        return factors

    def _step(self, factors: Factors) -> None:
        system = self.system
        change = np.zeros_like(self.vector)
        change[system.free] = factors.solve(-self._residual()[system.free])
        if system.flow_load is not None:
            border = system.flow_load[system.free]
            missing = self.flow_rate - float(system.flow_load @ (self.vector + change))
            share = missing / float(border @ self.bordering)
            change[system.free] += share * self.bordering
            self.gradient += share
        self.vector = self.vector + change
        largest, moved = (float(np.abs(system.split(each)[0]).max()) for each in (self.vector, change))
        before, self.update = self.update, moved / largest if largest > 0.0 else 0.0
        self.contracting = self.update < 0.1 * before
        self.iterations += 1
        if self.progress is not None:
            self.progress(f"Newton iteration {self.iterations}: relative change {self.update:.1e}")

    def solution(self) -> FlowSolution:
        """The flow as it is, with a mean pressure of zero where nothing else fixes its level."""
        system = self.system
        if not np.all(np.isfinite(self.vector)):
            self.problem = self.problem or "the iteration diverged"
        self.vector = np.where(np.isfinite(self.vector), self.vector, 0.0)
        if system.enclosed:
            pressure = self.vector[-system.mean_load.size :]
            pressure -= float(system.mean_load @ pressure) / float(system.mean_load.sum())
        residual = np.abs(self._residual())
        at_walls = np.delete(residual, system.free)
        status = Status()
        if self.problem:
            remedy = "start from the solution of a neighbouring, less convective case, or refine the mesh"
            status = Status(code=StatusCode.NOT_CONVERGED, text=f"{self.problem}; {remedy}")
        return FlowSolution.of(
            system,
            self.vector,
            driving_gradient=self.gradient,
            status=status,
            statistics=Statistics(
                unknowns=int(system.free.size),
                iterations=self.iterations,
                relative_residual=float(residual[system.free].max() / (at_walls.max() or 1.0)),
            ),
        )


Solve = Callable[[float, FlowSolution | None], FlowSolution]
"""Flow at a parameter from a predicted start, or from rest."""
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
    """NOT_CONVERGED, and where, when a target was not reached."""
    failures: int
    """Steps that had to be repeated with half their length."""


@dataclass(eq=False)
class _Walk:
    """Where the path is: the last two flows, and the present step."""

    solve: Solve
    rule: StepRule
    at: float
    flow: FlowSolution
    step: float
    before: tuple[float, FlowSolution] | None = None
    failures: int = 0

    def reach(self, target: float) -> bool:
        """Whether the target is reached."""
        while self.at != target and self.step >= self.rule.smallest:
            self._advance(target)
        return self.at == target

    def _advance(self, target: float) -> None:
        remaining = abs(target - self.at)
        length = min(self.step, remaining)
        # A sliver left over would make the secant through it worthless.
        length = remaining if remaining - length < 0.1 * length else length
        parameter = target if length == remaining else self.at + length * (1 if target > self.at else -1)
        flow = self.solve(parameter, self._predicted(parameter))
        if not flow.status.ok:
            self.failures, self.step = self.failures + 1, length / 2
            return
        easy = flow.statistics.iterations <= self.rule.easy_iterations
        self.before = self.at, self.flow
        self.at, self.flow = parameter, flow
        self.step = min(max(self.step, length) * (self.rule.growth if easy else 1.0), self.rule.largest)

    def _predicted(self, parameter: float) -> FlowSolution:
        if self.before is None:
            return self.flow
        (at, flow), now = self.before, self.flow
        share = (parameter - self.at) / (self.at - at)
        return replace(
            now,
            vector=now.vector + share * (now.vector - flow.vector),
            driving_gradient=now.driving_gradient + share * (now.driving_gradient - flow.driving_gradient),
        )


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
    walk = _Walk(solve=solve, rule=rule, at=start_at, flow=start, step=rule.first)
    reached: list[FlowSolution] = []
    for target in targets:
        if not walk.reach(target):
            text = f"the path ended at {walk.at:.6g} on its way to {target:.6g}"
            remedy = "refine the mesh or take smaller steps"
            status = Status(code=StatusCode.NOT_CONVERGED, text=f"{text}; {remedy}")
            return _FlowPath(solutions=tuple(reached), status=status, failures=walk.failures)
        reached.append(walk.flow)
    return _FlowPath(solutions=tuple(reached), status=Status(), failures=walk.failures)


def flow_at(*, solve: Solve, parameter: float, first: float) -> FlowSolution:
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
