"""One injection with inertia, gas filling, venting and valve lag, compared with scipy's solve_ivp.

    python benchmarks/moving_injection.py [--json] [--repeats 5]

Both sides have the same model: the column's mass, its rise to the crest, the spill until the tube is primed,
separation, and the gas of both chambers through an ISO 6358 line.  The rival is a plain user script
with the tables of the calibrated law: phases that end at events, at the loosest tolerance that keeps the fill
within 1e-6, by the fastest of the methods tried.  The program uses the compiled integration of an ensemble's
member at its own tolerance, and must keep the fill within the same 1e-6.
"""

from __future__ import annotations

import argparse
import json
import math
import time
from collections.abc import Callable
from dataclasses import replace

import numpy as np
from scipy.integrate import solve_ivp

from ringbalance.controller.liquid_ring.drawn_runs import RELATIVE_ERROR
from ringbalance.controller.terms import dynamics_of
from ringbalance.physics.gas import flow_shape
from ringbalance.reduced_model.calibration import calibrate
from ringbalance.reduced_model.injection.dynamics import WORKSPACE, Dynamics, Lift
from ringbalance.reduced_model.injection.events import command
from ringbalance.reduced_model.injection.march import advance
from ringbalance.reduced_model.injection.pair import at_rest
from ringbalance.reduced_model.law.calibrated_law import CalibratedLaw
from ringbalance.reduced_model.law.flow_law import BalancerModel
from ringbalance.reduced_model.terms import FILLING, HELD, INERTIA, LAG
from ringbalance.reduced_model.tube.heads import roots_of
from ringbalance.reduced_model.tube.path import crest_span
from ringbalance.reduced_model.tube.regime import cleared, resting_pressure
from ringbalance.scene.arrays import FloatArray
from ringbalance.scene.loader import bundled_scene, load_scene
from ringbalance.scene.models import Scene
from ringbalance.scene.narrowing import liquid_ring_scene
from ringbalance.scene.platform.compiled import in_place

FILL_ERROR = 1e-6
WANTED = 1000.0
DURATIONS = (0.03, 0.06, 0.2)
"""Valve-open times, s."""
TAIL = 0.5
"""Time until the next sample, s."""
BATCH = 2000
METHODS = ("RK45", "DOP853", "LSODA", "Radau")
TOLERANCES = (1e-3, 1e-4, 1e-5, 1e-6, 1e-7, 1e-8)
RESTS, LIFTS, FLOWS = 0, 1, 2
Y = FloatArray


class Rival:
    """A pair of chambers by solve_ivp: rest, lift, spill and flow, each to the event that ends it."""

    def __init__(self, scene: Scene, model: BalancerModel) -> None:
        assert isinstance(model.flow, CalibratedLaw)
        assert model.flow.heads.hump is not None
        self.scene, self.model, self.law = scene, model, model.flow
        self.crest, self.hump = model.flow.path, model.flow.heads.hump
        self.ambient = scene.gas.ambient_pressure
        self.upstream = crest_span(scene.tube)[1] * scene.tube.length
        lift = Lift.of(scene, law=model.flow)
        assert lift is not None
        self.entrance, self.span = lift.entrance, crest_span(scene.tube)
        self.risen = self.span[0]
        self.hold_up = model.tube_area * scene.tube.length / model.chamber_volume

    def gas_flow(self, p: float, outside: float) -> float:
        gas = self.scene.gas
        c = (gas.conductance or 0.0) * 1e5 * math.sqrt(gas.temperature / 293.15)
        up, down = max(p, outside), min(p, outside)
        return math.copysign(c * up * flow_shape(down / up, gas.critical_ratio or 0.0), outside - p)

    def margins(self, y: Y) -> tuple[float, float]:
        ends = self.law.ends(
            fill_ratio=y[0], opposite_fill_ratio=0.5 - y[0], gas_pressure=y[2] - self.ambient
        )
        gas = float(y[3]) - self.ambient
        resting = float(resting_pressure(self.crest, ends))
        low = self.crest.vapour_pressure
        cavity = low + self.crest.released * (max(gas, low) - low)
        return resting - cavity, resting - max(gas, cavity)

    def spill(self, margin: float) -> float:
        return float(replace(self.law.heads, siphon=self.hump).velocity(max(margin, 1e-9) / self.law.density))

    def cleared(self, y: Y) -> float:
        return float(cleared(self.crest, self.spill(self.margins(y)[1])))

    def push(self, y: Y, speed: float, primed: bool) -> float:
        full_margin, gas_margin = self.margins(y)
        margin = full_margin
        if not primed:
            margin = gas_margin + (self.cleared(y) * (full_margin - gas_margin) if gas_margin > 0 else 0.0)
        rho, speed = self.law.density, max(speed, 1e-12)
        driven, other = (float(self.law.hydrostatic_pressure(x)) for x in (y[0], 0.5 - y[0]))
        head = rho * float(roots_of(self.law.heads.siphon, speed)) ** 8
        upper = rho * float(roots_of(self.hump, speed)) ** 8
        full = (y[2] - y[3] + driven - other - head) / (rho * self.scene.tube.length)
        return min(float(full), (margin - upper) / (rho * self.upstream))

    def lift(self, y: Y, begun: float) -> float:
        """Acceleration of liquid that the gas still lifts to the end of the crest, m/s^2."""
        front = self.place(y, begun)
        loss = self.law.density * float(roots_of(self.hump, max(y[1], 1e-12))) ** 8
        loss *= self.entrance + (1 - self.entrance) * front / self.span[1]
        out = max(1 - front / self.span[0], 0.0)
        height = (float(self.crest.column_pressure) - self.law.path.port_pressure) * out**2
        return (self.margins(y)[1] + height - loss) / (self.law.density * front * self.scene.tube.length)

    def place(self, y: Y, begun: float) -> float:
        """Fraction of the path filled with liquid since the chamber's fill was `begun`."""
        return self.risen + float(begun - y[0]) / self.hold_up

    def set_out(self, y: Y) -> None:
        """Set front and velocity of a leg risen with the gas: y'' = A y^2 + B t, from the balance on."""
        volume = (1 - y[0]) * self.model.chamber_volume
        rate = self.gas_flow(y[2], self.ambient + self.scene.gas.pressure) / volume
        leg = self.span[0] * self.scene.tube.length
        b = rate / (self.law.density * leg)
        path = self.law.path
        a = (float(self.crest.column_pressure) - path.port_pressure) / (self.law.density * leg**3)
        self.risen = self.span[0] - 0.54956 * (b**2 / a**3) ** 0.2 / self.scene.tube.length
        y[1] = 0.62435 * (b**3 / a**2) ** 0.2

    def rates(self, y: Y, *, is_open: bool, stage: int, primed: bool, begun: float) -> list[float]:
        x, u, p, q = y
        u = max(u, 0.0) if stage else 0.0
        flow, volume = self.model.tube_area * u, self.model.chamber_volume
        outside = self.ambient + (self.scene.gas.pressure if is_open else 0.0)
        push = 0.0
        if stage:
            push = self.lift(y, begun) if stage == LIFTS else self.push(y, u, primed)
        return [
            -flow / volume,
            push,
            (self.gas_flow(p, outside) - p * flow) / ((1 - x) * volume),
            (self.gas_flow(q, self.ambient) + q * flow) / ((0.5 + x) * volume),
        ]

    def inject(self, duration: float, *, method: str, tolerance: float, fill: float = 0.25) -> float:
        """Fill after an injection and its tail."""
        y, stage, primed, begun = np.array([fill, 0.0, self.ambient, self.ambient]), RESTS, False, fill
        for is_open, left in ((True, duration), (False, TAIL - (self.scene.gas.valve_lag or 0.0))):
            while left > 1e-12:
                now = (is_open, stage, primed, begun)
                y, spent, stage, primed = self.phase(y, left, now, method, tolerance)
                left -= spent
                if stage == LIFTS and now[1] == RESTS:
                    begun = float(y[0])
                    self.set_out(y)
        return float(y[0])

    def phase(
        self, y: Y, left: float, now: tuple[bool, int, bool, float], method: str, tolerance: float
    ) -> tuple[Y, float, int, bool]:
        is_open, stage, primed, begun = now

        def change(_: float, state: Y) -> float:
            return float(state[1]) + 1e-9 if stage else self.margins(state)[1]

        def next_stage(_: float, state: Y) -> float:
            if stage == LIFTS:
                return self.place(state, begun) - self.span[1]
            return self.cleared(state) - 0.5

        change.terminal = next_stage.terminal = True  # type: ignore[attr-defined]
        change.direction, next_stage.direction = (-1.0 if stage else 1.0), 1.0  # type: ignore[attr-defined]
        results = solve_ivp(
            lambda _, state: self.rates(state, is_open=is_open, stage=stage, primed=primed, begun=begun),
            (0.0, left),
            y,
            method=method,
            rtol=tolerance,
            atol=[1e-2 * tolerance, 1e-1 * tolerance, 1e5 * tolerance, 1e5 * tolerance],
            events=(change, next_stage) if stage and not primed else (change,),
        )
        end, ended = results.y[:, -1], results.t_events[0].size > 0
        further = len(results.t_events) > 1 and results.t_events[1].size > 0
        if stage == LIFTS and (ended or further):
            # Liquid short of the middle of the crest falls back.
            end[0] = begun - max(self.place(end, begun) - sum(self.span) / 2, 0.0) * self.hold_up
        if ended:
            end[1] = 0.0
            # A column that has stopped with the gas venting is gone.
            return end, float(results.t[-1]), RESTS if stage else LIFTS, False
        if further and stage == LIFTS:
            return end, float(results.t[-1]), FLOWS, self.cleared(end) > 0.5
        return end, float(results.t[-1]), stage, primed or further


@in_place
def _inject(  # type: ignore[no-untyped-def]
    plant, motions, duration: float, tail: float, count: int, w
) -> float:
    motion = motions[0]
    for _ in range(count):
        motions[0] = motions[1]
        command(plant, motion, 0, duration)
        advance(plant, motion, duration + tail, w, 0, 0, w)
    return motion.state[0]  # type: ignore[no-any-return]


def ours(dynamics: Dynamics, duration: float, *, error: float, count: int, fill: float = 0.25) -> float:
    """Fill after the program's injection and tail, repeated `count` times."""
    plant = dynamics.plant(total=0.5, relative_error=error)
    motions = np.repeat(at_rest(plant, fill=fill), 2)
    return float(_inject(plant[0], motions, duration, TAIL, count, np.zeros(WORKSPACE)))


def least(function: Callable[[], object], repeats: int) -> float:
    """Least processor time of several calls, s."""
    results = []
    for _ in range(repeats):
        start = time.process_time()
        function()
        results.append(time.process_time() - start)
    return min(results)


def rival_seconds(rival: Rival, duration: float, exact: float, repeats: int) -> tuple[float, str, float]:
    """Time of the fastest method at its loosest sufficient tolerance, s, its name and its tolerance."""
    best = (math.inf, "", 0.0)
    for method in METHODS:
        for tolerance in TOLERANCES:
            if abs(rival.inject(duration, method=method, tolerance=tolerance) - exact) <= FILL_ERROR:
                spent = least(
                    lambda m=method, t=tolerance: rival.inject(duration, method=m, tolerance=t),  # type: ignore[misc]
                    repeats,
                )
                best = min(best, (spent, method, tolerance))
                break
    if not math.isfinite(best[0]):
        raise RuntimeError("solve_ivp does not reach the error asked for")
    return best


def piped_scene() -> Scene:
    """The paper's disc with a gas line and a valve."""
    scene = liquid_ring_scene(load_scene(bundled_scene("liquid_ring_paper")))
    return replace(scene, gas=replace(scene.gas, conductance=1e-8, critical_ratio=0.3, valve_lag=5e-3))


def rows(repeats: int) -> list[dict[str, object]]:
    """One row for each duration."""
    scene = piped_scene()
    model = calibrate(scene).model
    dynamics = dynamics_of(scene=scene, model=model, modelled=(INERTIA, FILLING, LAG, HELD))
    rival, results = Rival(scene, model), []
    for duration in DURATIONS:
        exact = ours(dynamics, duration, error=1e-10, count=1)
        error = abs(ours(dynamics, duration, error=RELATIVE_ERROR, count=1) - exact)
        driven = least(
            lambda d=duration: ours(dynamics, d, error=RELATIVE_ERROR, count=BATCH),  # type: ignore[misc]
            repeats,
        )
        theirs, method, tolerance = rival_seconds(rival, duration, exact, repeats)
        results.append(
            {
                "valve_open_s": duration,
                "ours_s": driven / BATCH,
                "fill_error": error,
                "solve_ivp_s": theirs,
                "method": method,
                "rtol": tolerance,
                "ratio": theirs / (driven / BATCH),
                "wanted": WANTED,
            }
        )
    return results


def main() -> None:
    """Run the benchmark from the command line."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("--json", action="store_true", help="print one JSON document")
    parser.add_argument("--repeats", type=int, default=5)
    options = parser.parse_args()
    results = rows(options.repeats)
    if options.json:
        print(json.dumps(results, indent=2))
        return
    for row in results:
        print(
            f"{1e3 * float(str(row['valve_open_s'])):.3g} ms: ours {1e6 * float(str(row['ours_s'])):.3g} us, "
            f"error {row['fill_error']:.1e}; solve_ivp {1e3 * float(str(row['solve_ivp_s'])):.3g} ms "
            f"({row['method']}, rtol {row['rtol']}); {float(str(row['ratio'])):.4g} times faster"
        )


if __name__ == "__main__":
    main()
