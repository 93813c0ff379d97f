"""The loop about the balanced state as matrices with named signals, for tools of control engineering.

From sample to sample, in the frame of the disc (x towards chamber A), with vibration v and valve-open time t
as complex numbers: the plant v' = v - b exp(-j lag) t removes b per second in the direction of the gas, the
controller t = Kc exp(j lag') (v + w' + q (v - v_before)), w' = w + i (v + v_before)/2 commands it, i = dt/Ti
and q = Td/dt.  A complex number c is the matrix ((Re c, -Im c), (Im c, Re c)).

The proportional part is exact: g = Kc b exp(j (lag' - lag)), L(z) = g/(z - 1).  The algorithm is a PID on
the amplitude, in the direction of the present vector; `before` and `integral` are those of a PID on the
vector, and the same only while the direction stays.  Where the residual reverses at every sample the
amplitude hardly changes, so the algorithm's derivative is about zero where that of the matrices is largest,
and the integral is reset.  Margins are therefore those of `loop_factor.loop_margins`, as runs have them.
"""

from __future__ import annotations

import cmath
import math
from dataclasses import dataclass, replace
from typing import Any, Final

import numpy as np

from ringbalance.controller.liquid_ring.loop_factor import (
    Margins,
    default_gain,
    loop_margins,
    loop_rate,
    sampling_interval,
    short_integral,
    small_margin,
)
from ringbalance.physics import balancing
from ringbalance.reduced_model.law.flow_law import BalancerModel, CompleteLaw
from ringbalance.results.rows import Finding
from ringbalance.scene.arrays import FloatArray, as_real, finite
from ringbalance.scene.faults import SceneError
from ringbalance.scene.models import Scene
from ringbalance.scene.narrowing import scene_as
from ringbalance.scene.registry import registered

AIR_TIME: Final = ("air_time_x", "air_time_y")
VIBRATION: Final = ("vibration_x", "vibration_y")
_INEXACT: Final = "integral and derivative of the matrices hold only while the residual keeps its direction"


@dataclass(frozen=True, kw_only=True, eq=False)
class StateSpace:
    """x' = A x + B u, y = C x + D u from one sample to the next."""

    a: FloatArray
    b: FloatArray
    c: FloatArray
    d: FloatArray
    inputs: tuple[str, ...]
    outputs: tuple[str, ...]
    states: tuple[str, ...]
    dt: float
    """Sampling interval, s, see `sampling_interval`."""

    def to_control(self) -> Any:
        """A `control.StateSpace` with these names. Raises: ImportError: python-control is not installed."""
        try:
            make = registered("function", "control_state_space")
        except ImportError:
            raise ImportError("python-control is not installed: pip install control") from None
        names = {"inputs": list(self.inputs), "outputs": list(self.outputs), "states": list(self.states)}
        return make(self.a, self.b, self.c, self.d, self.dt, **names)


@dataclass(frozen=True, kw_only=True, repr=False)
class LinearLoop:
    """Plant and controller about the balanced state.

    Example:
        >>> scene = rb.load_scene(rb.bundled_scene("six_chamber"))
        >>> loop: rb.LinearLoop = rb.linear_loop(scene, flow_law=rb.calibrate(scene).flow_law)
        >>> loop.disk_margin > 0.5
        True
    """

    plant: StateSpace
    """air_time_x, air_time_y (s) to vibration_x, vibration_y (m)."""
    controller: StateSpace
    """vibration_x, vibration_y (m) to air_time_x, air_time_y (s)."""
    gain: complex
    """g = Kc b exp(j (lag' - lag)), with b of the fastest pair, the mean of its two chambers."""
    integral: float
    """i = dt/Ti."""
    derivative: float
    """q = Td/dt."""
    findings: tuple[Finding, ...]
    """Findings on a default gain, small or exceeded margins, and a derivative or integral beyond them."""

    def __repr__(self) -> str:
        """Results on the loop without its matrices, for JSON."""
        plant, margins = self.plant, self.margins
        lines = [
            f"Linear loop, {'stable' if self.stable else 'unstable'}, sampled every {plant.dt:.3g} s "
            "near the limit",
            f"  gain margin {margins.gain_factor:.4g}, phase margin {math.degrees(margins.phase):.3g} deg",
            f"  proportional part: disk margin {self.disk_margin:.3g} of 2, "
            f"peak of the sensitivity {self.sensitivity_peak:.3g}, zone {self.zone}",
            *(() if self.proportional_alone else [f"  {_INEXACT}"]),
            *(each.text for each in self.findings),
            f"  plant: {', '.join(plant.inputs)} -> {', '.join(plant.outputs)}; the controller the other way",
        ]
        return "\n".join(lines)

    def to_dict(self) -> dict[str, Any]:
        """Gain, margins and findings, without matrices, as a JSON document in SI; null where unbounded."""
        return {
            "stable": self.stable,
            "gain": [self.gain.real, self.gain.imag],
            "integral": self.integral,
            "derivative": self.derivative,
            "gain_margin": self.margins.gain_factor,
            "phase_margin_rad": self.margins.phase,
            "disk_margin": self.disk_margin,
            "sensitivity_peak": finite(self.sensitivity_peak),
            "zone": self.zone,
            "findings": [each.document() for each in self.findings],
        }

    @property
    def margins(self) -> Margins:
        """Margins of the algorithm; disk and peak are of its proportional part."""
        return loop_margins(self.gain, integral=self.integral > 0.0)

    @property
    def stable(self) -> bool:
        """True if a small residual decays in runs; `closed` may differ with an integral or a derivative."""
        return self.margins.stable

    @property
    def closed(self) -> FloatArray:
        """Closed loop of the matrices over all states; positive feedback, as the sign is in the plant."""
        p, k = self.plant, self.controller
        return np.block([[p.a + p.b @ k.d @ p.c, p.b @ k.c], [k.b @ p.c, k.a]])

    @property
    def sensitivity_peak(self) -> float:
        """Peak of the sensitivity of the proportional part, see `Margins`."""
        return self.margins.sensitivity_peak

    @property
    def zone(self) -> str:
        """Zone A to D of ISO 14839-3 by this peak, see `balancing.zone`."""
        return balancing.zone(self.sensitivity_peak)

    @property
    def disk_margin(self) -> float:
        """Disk margin of the proportional part, 0 to 2, see `Margins`."""
        return self.margins.disk

    @property
    def proportional_alone(self) -> bool:
        """True if the matrices are exact: without integral and derivative."""
        return self.integral == 0.0 and self.derivative == 0.0


def linear_loop(scene: Scene, *, flow_law: CompleteLaw) -> LinearLoop:
    """The loop of a scene with the target-vector controller about the balanced state.

    Args: `flow_law`: such as `calibrate(scene).flow_law`; what one second of gas removes is the mean of a
        pair's two chambers, of all pairs the largest.
    Raises: SceneError: another balancer, see `eccentric_loop`, or another controller.

    Example:
        >>> scene = rb.load_scene(rb.bundled_scene("six_chamber"))
        >>> loop = rb.linear_loop(scene, flow_law=rb.calibrate(scene).flow_law)
        >>> loop.stable
        True
    """
    scene = scene_as(Scene, scene)
    if scene.controller.kind != "target_vector":
        problem = f"the controller {scene.controller.kind!r} has no linear loop"
        raise SceneError.of_file(scene.file, problem, 'controller.kind = "target_vector"')
    settings, lag = scene.controller, scene.rotor.lag_angle
    dt, rate = sampling_interval(scene), loop_rate(scene, BalancerModel.of(flow_law))
    plant = StateSpace(
        a=np.eye(2),
        b=as_real([[-cmath.rect(rate, -lag)]]),
        c=np.eye(2),
        d=np.zeros((2, 2)),
        inputs=AIR_TIME,
        outputs=VIBRATION,
        states=VIBRATION,
        dt=dt,
    )

    # States of the controller: w, where there is an integral part, and the vibration of the previous sample.
    integral = 0.0 if settings.integral_time is None else dt / settings.integral_time
    derivative = settings.derivative_time / dt
    gain, half = cmath.rect(settings.proportional, settings.assumed_lag_angle), integral / 2.0
    a, b = [[1.0, half], [0.0, 0.0]], [[half], [1.0]]
    c = [gain, gain * (half - derivative)]
    states: tuple[str, ...] = ("integral_x", "integral_y", "before_x", "before_y")
    if integral == 0.0:
        a, b, c, states = [[0.0]], [[1.0]], c[1:], states[2:]
    controller = StateSpace(
        a=as_real(a),
        b=as_real(b),
        c=as_real([c]),
        d=as_real([[gain * (1.0 + derivative + half)]]),
        inputs=VIBRATION,
        outputs=AIR_TIME,
        states=states,
        dt=dt,
    )
    loop = LinearLoop(
        plant=plant,
        controller=controller,
        gain=cmath.rect(settings.proportional * rate, settings.assumed_lag_angle - lag),
        integral=integral,
        derivative=derivative,
        findings=(),
    )
    findings = (*default_gain(scene), *small_margin(scene, loop.margins), *short_integral(scene))
    return replace(loop, findings=findings)
