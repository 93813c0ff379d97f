"""A-priori estimates of neglected effects in a chamber, and the fills at which its models hold."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from functools import lru_cache
from typing import Final, NamedTuple

import numpy as np

from ringbalance.mesh.faceting import drawing_shares
from ringbalance.mesh.geometry import (
    chamber_volume,
    half_angle,
    head_square,
    liquid_area,
    surface_radius,
    wall_square,
)
from ringbalance.physics.gas import applied_pressure, pressure_factor
from ringbalance.physics.results import Status, StatusCode
from ringbalance.physics.sloshing import HIGHEST_TRUE, LOWEST_TRUE, SMALL_WAVE_RATIO
from ringbalance.reduced_model.chamber.tilted_ring import TiltedRing, closed_ring
from ringbalance.reduced_model.chamber.values import chamber_closed_forms, chamber_pressure, share_across
from ringbalance.results.rows import Finding
from ringbalance.scene.arrays import FloatArray
from ringbalance.scene.models import Scene
from ringbalance.scene.rules.working import LARGEST_COMPRESSION, bulk_modulus, surface_tension


def percent(fraction: float) -> str:
    """A fraction in per cent, to two digits."""
    value = 100 * fraction
    return f"{value:.0f} %" if 99.5 <= abs(value) < 1e6 else f"{value:.2g} %"


_MODES: Final = 24
"""Number of modes of a chamber: the part of gravity's tilt in a mode falls with the mode's number squared."""
_SWING_ERROR: Final = 0.2
"""Error of the estimated amplification, as a fraction of the moment's ripple."""
_CORIOLIS_FACTOR: Final = 2.0
"""Ripple of the pressure over the swing: 2 omega times the flux along the ring, about that with which a free
particle follows gravity, however thin the ring."""


def capillary_share(scene: Scene, fills: FloatArray) -> Mapping[str, FloatArray]:
    """Upper bound of capillary pressure over liquid pressure at R2, sigma (2/B + 1/(a alpha) + 1/a)/P.

    The moment changes by the fraction of the liquid in the menisci along the walls.
    Returns: Shares by "pressures" and "moments", along the fills, which are above zero.
    Source: contact line over area of the free surface, contact angle zero, plus the ring's own curvature.
    """
    disc, density, square = scene.disc, scene.liquid.density, scene.rotor.speed**2
    a = surface_radius(disc=disc, fill_ratio=fills)
    alpha = half_angle(disc=disc, radius=a)
    pressure = density * square * (disc.outer_radius**2 - a**2) / 2
    tension = surface_tension(scene.liquid)
    jump = tension * (2 / disc.axial_width + 1 / (a * alpha) + 1 / a)
    # A meniscus of length sqrt(sigma/(rho omega^2 a)) along each wall moves its own cross-section of liquid.
    length = np.sqrt(tension / (density * square * a))
    depth = disc.outer_radius - a
    moved = length**2 * (1 / (a * alpha * depth) + 2 / (disc.axial_width * depth))
    return {"pressures": jump / pressure, "moments": moved}


def wall_layers(scene: Scene, fills: FloatArray) -> tuple[FloatArray, float]:
    """Estimated contribution of friction at the walls, relative, along the fills; and the Ekman number.

    Source: g/(omega^2 a) sqrt(Ek), Ek = nu/(omega R2^2), of the liquid's swing on a horizontal shaft.
    """
    omega, a = abs(scene.rotor.speed), surface_radius(disc=scene.disc, fill_ratio=fills)
    ekman = scene.liquid.kinematic_viscosity / (omega * scene.disc.outer_radius**2)
    gravity = scene.environment.gravity if scene.environment.shaft == "horizontal" else 0.0
    return gravity / (omega**2 * a) * ekman**0.5, ekman


def unmodelled_fractions(scene: Scene, fills: FloatArray) -> Mapping[str, FloatArray]:
    """Contribution of unmodelled effects: surface tension, friction at the walls, waves of finite height.

    An imported chamber adds the error of facets in place of smooth walls, and the excess of its moment over
    the component along its middle, which moments and lambda describe.
    Returns: Relative, of "pressures" (the wall's), "heads" and "moments", shape (n,) each; zero without
        liquid.
    Source: sum of the estimates, errors of one sign at worst.
    """
    fractions, wet = {}, fills > 0
    common = wall_layers(scene, fills[wet])[0] + _wave_mean(scene, fills[wet])
    faceting = drawing_shares(scene.disc, fills[wet])
    transverse = np.hypot(1.0, share_across(scene.disc, fills[wet])) - 1
    tension = capillary_share(scene, fills[wet])
    a = surface_radius(disc=scene.disc, fill_ratio=fills[wet])
    # A capillary pressure is a larger fraction of the mean over a wall nearer to the surface.
    nearer = head_square(disc=scene.disc, surface_radius=a) / wall_square(disc=scene.disc, surface_radius=a)
    shares = {
        "pressures": nearer * tension["pressures"] + common + faceting.wall_pressure,
        "heads": tension["pressures"] + common + faceting.hydrostatic_pressure,
        "moments": tension["moments"] + common + (faceting.moment + transverse),
    }
    for part, share in shares.items():
        fractions[part] = np.zeros(fills.shape)
        fractions[part][wet] = share
    return fractions


class _Swing(NamedTuple):
    """Lowest and largest amplification of gravity's ripple within `FREQUENCY_UNCERTAINTY`."""

    lowest: FloatArray
    largest: FloatArray


def amplification(scene: Scene, fills: FloatArray | float) -> _Swing:
    """Estimated amplification of gravity's ripple by the swinging liquid, |1/(1 - (1 + i d)/s^2)|.

    Returns: Factors along the fills; 1 on a vertical shaft.
    Source: s^2 = k tanh(k ln(R2/a)), the lowest mode without Coriolis force, driven at s = 1; d, `_swing`.
    """
    if scene.environment.shaft == "vertical":
        return _Swing(np.ones(np.shape(fills)), np.ones(np.shape(fills)))
    disc = scene.disc
    depth = np.log(disc.outer_radius / surface_radius(disc=disc, fill_ratio=fills))
    return _swing(scene, np.pi / disc.central_angle, depth, disc.central_angle / 2)


def _wave_height(scene: Scene, fills: FloatArray) -> FloatArray:
    """Estimated height that gravity's waves may have, zero-to-peak, over the depth of the ring.

    The tilt of a surface by gravity alone, g/omega^2 sin(phi) and cos(phi), is resolved into the modes of a
    chamber with half-angle alpha, k = j pi/(2 alpha), each of which responds as in `amplification` with the
    largest swing that its frequency's uncertainty allows. For the 90 deg of the liquid-ring paper within a
    factor of three of finite elements, thin rings included; half circles from a quarter of them up.
    """
    if scene.environment.shaft == "vertical":
        return np.zeros(np.shape(fills))
    a = surface_radius(disc=scene.disc, fill_ratio=fills)[..., None]
    alpha, mode = half_angle(disc=scene.disc, radius=a), np.arange(1, _MODES + 1)
    k = mode * np.pi / (2 * alpha)
    less, more = (alpha * np.sinc((k + sign) * alpha / np.pi) for sign in (-1, 1))
    shares = np.abs(less + np.where(mode % 2, -more, more)) / alpha
    answers = shares * _swing(scene, k, np.log(scene.disc.outer_radius / a), alpha).largest
    # Odd and even modes are a quarter of a turn out of phase.
    height = np.hypot(answers[..., ::2].sum(axis=-1), answers[..., 1::2].sum(axis=-1))
    tilt = scene.environment.gravity / scene.rotor.speed**2
    return np.asarray(height * tilt / (scene.disc.outer_radius - a[..., 0]))


def _swing(scene: Scene, k: FloatArray | float, depth: FloatArray, alpha: FloatArray | float) -> _Swing:
    """Range of |1/(1 - (1 + i d)/s^2)| by the uncertainty of s, of modes cos(k phi) of rings ln(R2/a) deep.

    d = (E/2)^(1/2) [2 R2/B + q/depth + (1 - q)/alpha], q = 2 k depth/sinh(2 k depth), is the damping by
    Stokes layers on ends, outer wall and plates at s = 1, E = nu/(omega R2^2); at a peak within a factor of
    two of finite elements.
    Source: the layers of `sloshing_system` on phi = cosh(k ln(R2/r)) cos(k phi), plates at r = R2.
    """
    disc, twice = scene.disc, 2 * k * depth
    ekman = scene.liquid.kinematic_viscosity / (abs(scene.rotor.speed) * disc.outer_radius**2)
    shallow = -2 * twice * np.exp(-twice) / np.expm1(-2 * twice)
    layers = 2 * disc.outer_radius / disc.axial_width + shallow / depth + (1 - shallow) / alpha
    damping, square = np.sqrt(ekman / 2) * layers, k * np.tanh(k * depth)
    ends = LOWEST_TRUE**2 * square, HIGHEST_TRUE**2 * square
    low, high, nearest = (1 / np.hypot(1 - 1 / end, damping / end) for end in (*ends, np.clip(1.0, *ends)))
    return _Swing(np.minimum(low, high), np.asarray(nearest))


def _wave_mean(scene: Scene, fills: FloatArray) -> FloatArray:
    """Upper bound of the relative effect of waves on means over a turn, (eta/h)^2/4, at most 1.

    In shallow waves the mean square of the velocity is g_c <eta^2>/h, of which Bernoulli's equation takes
    half from the wall pressure and as much from the surface's mean position; <eta^2> is at most eta^2/2.
    """
    return np.minimum(_wave_height(scene, fills) ** 2 / 4, 1.0)


_FILL_SHARES: Final = (0.2, 0.5, 1.0)
"""Fills at which a chamber is judged, as shares of max_fill_ratio."""


@lru_cache(maxsize=64)
def chamber_fills(scene: Scene) -> FloatArray:
    """Fill ratios at which a chamber is judged: those of the range at which gravity leaves a closed ring.

    Returns: x, shape (n,); empty without such a fill.
    """
    fills = range_fills(scene)
    return fills[closed_ring(scene, fills)]


def range_fills(scene: Scene) -> FloatArray:
    """Fill ratios over the range, with that of resonant sloshing where it lies within.

    At resonance the natural frequency of the lowest mode equals the speed, s = 1: tanh(k ln(R2/a)) = 1/k;
    where k <= 1 the mode stays below the speed at any fill.
    """
    disc, fills = scene.disc, scene.disc.max_fill_ratio * np.array(_FILL_SHARES)
    k = np.pi / disc.central_angle
    if scene.environment.shaft == "vertical" or scene.environment.gravity == 0 or k <= 1:
        return fills
    radius = disc.outer_radius * float(np.exp(-np.arctanh(1 / k) / k))
    if radius < disc.inner_radius:
        return fills
    area = float(liquid_area(disc=disc, surface_radius=radius))
    resonant = area * disc.axial_width / chamber_volume(disc=disc)
    return np.unique(np.append(fills, resonant)) if fills[0] < resonant < fills[-1] else fills


class _GravityShares(NamedTuple):
    """Estimated relative contributions of gravity to wall pressure or moment at the worst fill."""

    mean: float
    """Contribution to means over a turn, of second order in g/(omega^2 a)."""
    swing: float
    """Contribution of the ripple at 1x, of first order, amplified by the liquid's swing."""


@lru_cache(maxsize=8)
def gravity_shares(scene: Scene) -> _GravityShares:
    """Estimate gravity's contributions over `chamber_fills`; 1 where no ring is closed."""
    if scene.environment.gravity == 0:
        return _GravityShares(mean=0.0, swing=0.0)
    fills = chamber_fills(scene)
    if fills.size == 0:
        return _GravityShares(mean=1.0, swing=1.0)
    wall, moment, ratio = chamber_closed_forms(scene=scene, fill_ratio=fills)
    ring, (lowest, largest) = TiltedRing.of(scene, fills), amplification(scene, fills)
    changes = (
        ring.wall_pressure / wall,
        ring.moment / moment,
        2 * ring.moment_per_volume / scene.liquid.density / ratio,
    )
    parts = (
        (ring.wall_pressure_ripple / wall, _CORIOLIS_FACTOR * np.maximum(1.0, largest)),
        (ring.moment_ripple / moment, np.maximum(np.abs(lowest - 1), np.abs(largest - 1)) + _SWING_ERROR),
    )
    return _GravityShares(
        mean=float(np.max(np.abs(np.array(changes) - 1))),
        swing=max(float(np.max(ripple) + np.max(ripple * swing)) for ripple, swing in parts),
    )


def compression(scene: Scene, fills: FloatArray) -> FloatArray:
    """Relative increase of the liquid's density on the outer wall, p/K, under the scene's gas pressure.

    Returns: Shares along the fills; those above `LARGEST_COMPRESSION` are beyond every model here, and so
        are velocities that such a pressure drives.
    Source: p = f p_gas + rho omega^2 (R2^2 - a^2)/2; `scene.rules.working`.
    """
    column = chamber_pressure(scene=scene, fill_ratio=fills)
    pressure = column + max(applied_pressure(scene.gas), 0.0) * pressure_factor(scene)
    return np.asarray(pressure / bulk_modulus(scene.liquid))


def chamber_status(scene: Scene) -> Status:
    """Validity of linear sloshing, a closed ring and one density over the range of fills, by estimates."""
    fills = chamber_fills(scene)
    if fills.size != range_fills(scene).size:
        lowest = f"above a fill ratio of {fills[0]:.3g} only" if fills.size else "at no fill of this scene"
        return Status(
            code=StatusCode.NO_RING if fills.size == 0 else StatusCode.OUT_OF_RANGE,
            text=(
                f"gravity leaves a closed ring {lowest}: elsewhere liquid runs along the wall every turn and "
                "no model describes it; turn faster or fill more"
            ),
        )
    share = float(compression(scene, np.array([scene.disc.max_fill_ratio]))[0])
    if share > LARGEST_COMPRESSION:
        pressure = share * bulk_modulus(scene.liquid)
        return Status(
            code=StatusCode.OUT_OF_RANGE,
            text=(
                f"up to {pressure / 1e6:.4g} MPa on the outer wall would make the liquid {percent(share)} "
                f"denser there, and no model holds above {percent(LARGEST_COMPRESSION)}, velocities "
                "included: lower rotor.speed, gas.pressure or disc.max_fill_ratio"
            ),
        )
    height = _wave_height(scene, fills)
    worst = int(np.argmax(height))
    if height[worst] <= SMALL_WAVE_RATIO:
        return Status()
    sector = "" if scene.disc.geometry is None else "in a plain sector of the same opening, "
    return Status(
        code=StatusCode.OUT_OF_RANGE,
        text=(
            f"{sector}at a fill ratio of {fills[worst]:.3g} waves may reach about {height[worst]:.2g} of the "
            "ring's depth, too high for linear sloshing, the finest model: avoid that fill, or turn faster"
        ),
    )


_ROTOR_DAMPING_RATIO: Final = 0.01
"""Approximate lower bound of a rotor's damping ratio: growth below it gives no warning."""
_WHIRL_FILL_SHARES: Final = np.linspace(0.1, 1.0, 19)
"""Fills at which whirl is estimated, as shares of max_fill_ratio."""


@dataclass(frozen=True, kw_only=True)
class AsynchronousInstability:
    """Critical speed at which whirl grows fastest, and its growth; orders of magnitude."""

    fill_ratio: float
    """Fill ratio of all chambers at which whirl grows fastest."""
    critical_speed: float
    """Critical speed (1 - s) omega, rad/s."""
    growth: float
    """Growth rate over that critical speed: the damping ratio that would stop whirl."""

    @classmethod
    def of(cls, scene: Scene) -> AsynchronousInstability | None:
        """Estimate at the worst fill; None where every wave is faster than the rotor, s >= 1.

        In the disc's frame the lowest wave of a chamber turns backwards at s omega, s^2 = k T,
        T = tanh(k ln(R2/a)), k = pi/theta; seen from outside at (1 - s) omega. With its effective mass
        m = rho B a^2 I^2 s^2/(theta/2), I = int sin(k phi) sin(phi) dphi, n chambers and M = 1/K of the
        rotor, (w_c^2 - w^2) (s^2 omega^2 - (w - omega)^2) = (n m/2M) w^4, which at w_c = (1 - s) omega
        grows with Im(w)/w_c = 0.5 ((n m/2M) (1 - s)/s)^(1/2).
        Range: order of magnitude. No Coriolis force on the wave (s is 3 % higher with it), no damping, equal
            fills, M from an influence coefficient K taken well above the critical speed.
        Source: derived; the mechanism after Wolf, J. Appl. Mech. 35 (1968) 676.
        """
        disc, omega = scene.disc, abs(scene.rotor.speed)
        fills = _WHIRL_FILL_SHARES * disc.max_fill_ratio
        k, radius = math.pi / disc.central_angle, surface_radius(disc=disc, fill_ratio=fills)
        square = k * np.tanh(k * np.log(disc.outer_radius / radius))
        slow = square < 1
        if not np.any(slow):
            return None
        s = np.sqrt(square[slow])
        integral = math.pi / 2 if abs(k - 1) < 1e-6 else 2 * math.cos(disc.central_angle / 2) / (k**2 - 1)
        sides = 2 * integral**2 / disc.central_angle
        mass = scene.liquid.density * disc.axial_width * radius[slow] ** 2 * sides * s**2
        ratio = disc.chambers / 2 * mass * scene.rotor.influence_coefficient
        growth = np.sqrt(ratio * (1 - s) / s) / 2
        worst = int(np.argmax(growth))
        return cls(
            fill_ratio=float(fills[slow][worst]),
            critical_speed=float((1 - s[worst]) * omega),
            growth=float(growth[worst]),
        )

    @property
    def finding(self) -> Finding | None:
        """Warning that the growth exceeds the damping of rotors; None below it."""
        if self.growth <= _ROTOR_DAMPING_RATIO:
            return None
        numbers = {"critical_speed": self.critical_speed, "fill_ratio": self.fill_ratio}
        return Finding(code="asynchronous_instability", values={**numbers, "damping_ratio": self.growth})
