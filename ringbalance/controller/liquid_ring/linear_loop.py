"""The loop about the balanced state as matrices with named signals, for tools of control engineering.

From sample to sample, in the frame of the disc (x towards chamber A), with vibration v and valve-open time t
as complex numbers: the plant v' = v - b exp(-j lag) t removes b per second in the direction of the gas, the
controller t = Kc exp(j lag') (v + w' + q (v - v_before)), w' = w + i (v + v_before)/2 commands it, i = dt/Ti
and q = Td/dt.  With g = Kc b exp(j (lag' - lag)) the loop is L(z) = g C(z)/(z - 1),
C = 1 + (i/2)(z + 1)/(z - 1) + q (1 - 1/z).  A complex number c is the matrix ((Re c, -Im c), (Im c, Re c)):
the loop of two inputs and two outputs has the margins and the sensitivity of the complex one over the whole
unit circle.
"""

from __future__ import annotations

import cmath
import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Final

import numpy as np
import numpy.typing as npt

from ringbalance.controller.liquid_ring.loop_factor import FREQUENCIES, default_gain, loop_rate
from ringbalance.reduced_model.law.flow_law import BalancerModel, CompleteLaw
from ringbalance.results.rows import Finding
from ringbalance.scene.arrays import ComplexArray, FloatArray, finite
from ringbalance.scene.faults import SceneError
from ringbalance.scene.models import Scene
from ringbalance.scene.registry import registered

AIR_TIME: Final = ("air_time_x", "air_time_y")
VIBRATION: Final = ("vibration_x", "vibration_y")
_ZONES: Final = ((3.0, "A"), (4.0, "B"), (5.0, "C"))
"""Peaks of the sensitivity up to which a zone of ISO 14839-3 reaches: 9.5 and 12 dB as the documentation of
ROSS (its tutorial on magnetic bearings) reports them, 14 dB recalled; the standard itself was not read."""


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
    """Time from the closing of the valves to the next sample, s; valve-open times add to it."""

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
    """Findings on a default gain, which the scene does not state."""

    def __repr__(self) -> str:
        """Results on the loop without its matrices, for JSON."""
        plant = self.plant
        lines = [
            f"Linear loop, {'stable' if self.stable else 'unstable'}, sampled every {plant.dt:g} s",
            f"  disk margin {self.disk_margin:.3g} of 2",
            f"  peak of the sensitivity {self.sensitivity_peak:.3g}, zone {self.zone}",
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
            "disk_margin": self.disk_margin,
            "sensitivity_peak": finite(self.sensitivity_peak),
            "zone": self.zone,
            "findings": [each.document() for each in self.findings],
        }

    @property
    def stable(self) -> bool:
        """True if a small residual decays."""
        return bool(np.max(np.abs(np.linalg.eigvals(self.closed))) < 1.0)

    @property
    def closed(self) -> FloatArray:
        """Matrix of the closed loop over the states of plant and controller."""
        p, k = self.plant, self.controller
        return np.block([[p.a + p.b @ k.d @ p.c, p.b @ k.c], [k.b @ p.c, k.a]])

    @property
    def sensitivity_peak(self) -> float:
        """Largest gain from a disturbance of the vibration to the vibration, max |1/(1 + L)|.

        With P alone 1/(1 + L) = (z - 1)/(z - 1 + g) maps the unit circle to a circle: 2/(2 - h) for real g.
        Infinite for an unstable loop.
        """
        if not self.stable:
            return math.inf
        if self.proportional_alone:
            centre, radius = _image(1.0, 1.0 - self.gain)
            return abs(centre) + radius
        return float(np.max(np.abs(1.0 / (1.0 + self._open(_circle())))))

    @property
    def zone(self) -> str:
        """Zone A to D of ISO 14839-3 by the peak of the sensitivity; a standard for magnetic bearings, of
        limited meaning for a loop that is closed once in a period."""
        return next((name for most, name in _ZONES if self.sensitivity_peak < most), "D")

    @property
    def disk_margin(self) -> float:
        """Disk margin, 0 to 2: gain and phase of both axes may change together, differently by frequency.

        With P alone min |2 (1 + L)/(1 - L)| = 2 |z - 1 + g|/|z - 1 - g|, the nearest point of a circle:
        2 (2 - h)/(2 + h) for real g.
        Source: as `loop_factor.loop_margins`.
        """
        if not self.stable:
            return 0.0
        if self.proportional_alone:
            centre, radius = _image(1.0 - self.gain, 1.0 + self.gain)
            return min(2.0 * abs(abs(centre) - radius), 2.0)
        loop = self._open(_circle())
        return min(float(np.min(np.abs(2.0 * (1.0 + loop) / (1.0 - loop)))), 2.0)

    @property
    def proportional_alone(self) -> bool:
        """True if the margins have a closed form."""
        return self.integral == 0.0 and self.derivative == 0.0

    def _open(self, z: ComplexArray) -> ComplexArray:
        shape = 1.0 + self.integral / 2.0 * (z + 1.0) / (z - 1.0) + self.derivative * (1.0 - 1.0 / z)
        return np.asarray(self.gain * shape / (z - 1.0))


def linear_loop(scene: Scene, *, flow_law: CompleteLaw) -> LinearLoop:
    """The loop of a scene with the target-vector controller about the balanced state.

    Args: `flow_law`: such as `calibrate(scene).flow_law`; what one second of gas removes is the mean of a
        pair's two chambers, of all pairs the largest.
    Raises: SceneError: another controller, which has no linear loop.

    Example:
        >>> scene = rb.load_scene(rb.bundled_scene("six_chamber"))
        >>> loop = rb.linear_loop(scene, flow_law=rb.calibrate(scene).flow_law)
        >>> loop.stable
        True
    """
    if scene.controller.kind != "target_vector":
        problem = f"the controller {scene.controller.kind!r} has no linear loop"
        raise SceneError.of_file(scene.file, problem, 'controller.kind = "target_vector"')
    settings, dt, lag = scene.controller, scene.controller.period, scene.rotor.lag_angle
    rate = loop_rate(scene, BalancerModel.of(flow_law))
    plant = StateSpace(
        a=np.eye(2),
        b=_matrix([[-cmath.rect(rate, -lag)]]),
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
        a=_matrix(a),
        b=_matrix(b),
        c=_matrix([c]),
        d=_matrix([[gain * (1.0 + derivative + half)]]),
        inputs=VIBRATION,
        outputs=AIR_TIME,
        states=states,
        dt=dt,
    )
    return LinearLoop(
        plant=plant,
        controller=controller,
        gain=cmath.rect(settings.proportional * rate, settings.assumed_lag_angle - lag),
        integral=integral,
        derivative=derivative,
        findings=tuple(default_gain(scene)),
    )


def _matrix(rows: Sequence[Sequence[complex]]) -> FloatArray:
    """Each complex number as a matrix of two rows and columns."""
    values: npt.NDArray[np.complex128] = np.array(rows, dtype=np.complex128)
    return np.asarray(
        np.kron(values.real, np.eye(2)) + np.kron(values.imag, np.array([[0.0, -1.0], [1.0, 0.0]]))
    )


def _image(a: complex, b: complex) -> tuple[complex, float]:
    """Centre and radius of the circle to which (z - a)/(z - b) maps the unit circle, |b| not 1."""
    inside = 1.0 - abs(b) ** 2
    return 1.0 + (b - a) * complex(b).conjugate() / inside, abs(b - a) / abs(inside)


def _circle() -> ComplexArray:
    """Points of the unit circle on both sides of z = 1."""
    return np.exp(1j * np.concatenate([FREQUENCIES, -FREQUENCIES]))
