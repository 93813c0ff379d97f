"""Rules of shape for the disc and its tube."""

from __future__ import annotations

import math
from typing import Any

from ringbalance.scene.keys.derivations import even_number_of_chambers, shortest_path, swept_area
from ringbalance.scene.keys.reading import SceneReading
from ringbalance.scene.kinds import Check, Contradiction, check, condition, written

_ROUNDING = 1e-9
_NARROWEST = 1 / 2000
"""Opening over depth of a chamber below which rounding costs a pressure field more than seven digits."""
_SHALLOWEST = 1e-8
"""Depth over outer radius of a full ring; calibration goes down to a fortieth of its fill."""
DRAWING_ROUNDING = 1e-5
"""Relative rounding of values in drawings: "1.5708 rad" is a right angle."""


def _port_under_liquid(
    port: float, initial: float, inner: float, outer: float, angle: float, thickness: float
) -> Contradiction | None:
    """At the start the ports lie under the liquid: the fraction of the chamber outside r_p is below the fill.

    A port inside the outer wall is allowed: liquid outside it stays in its chamber.
    """
    outside = _fraction_outside(port, inner, outer, angle, thickness)
    if outside < initial:
        return None
    larger = f", or max_fill_ratio above {2 * outside:.3g}" if 2 * outside < 1 else ""
    return Contradiction(
        problem=f"at the start (fill {initial:.3g}) the liquid does not cover the port: {outside:.3g} of the "
        "chamber lies outside it, so gas would pass through the tube in place of liquid",
        allowed=f"nearer to outer_radius ({written(outer, 'mm')}){larger}",
    )


def _inlet_above_liquid(
    inlet: float, largest: float, inner: float, outer: float, angle: float, thickness: float
) -> Contradiction | None:
    """R1 <= r_i < R2, and the liquid of a pair in one chamber leaves the gas inlet free."""
    if not inner <= inlet < outer:
        inside = f"at least inner_radius ({written(inner, 'mm')})"
        return Contradiction(
            problem="the gas inlet lies outside the chamber",
            allowed=f"{inside} and below outer_radius ({written(outer, 'mm')})",
        )
    outside = _fraction_outside(inlet, inner, outer, angle, thickness)
    if largest < outside:
        return None
    return Contradiction(
        problem=f"at max_fill_ratio ({largest:.3g}) the liquid covers the gas inlet: {outside:.3g} of the "
        "chamber lies outside it",
        allowed=f"nearer to inner_radius ({written(inner, 'mm')}), or max_fill_ratio below {outside:.3g}",
    )


def _fraction_outside(radius: float, inner: float, outer: float, angle: float, thickness: float) -> float:
    """Fill ratio at which the free surface lies at a radius."""
    within = swept_area(
        radius=[inner, radius, outer], central_angle=angle, plate_thickness=thickness
    ).tolist()
    return float((within[2] - within[1]) / (within[2] - within[0]))


def _shortest(values: Any, crest: float | None) -> dict[str, float]:
    """Shortest path between ports anywhere in opposite chambers, at least pi - theta apart, m."""
    apart = max(math.pi - values.central_angle, 0.0)
    least = shortest_path(port_radius=values.port_radius, hump_radius=crest, separation=apart)
    return {"least": least}


def _least_fill(values: Any) -> dict[str, float]:
    """Least max_fill_ratio of a ring that is at least 1e-8 R2 deep, R2 - sqrt(R2^2 - x (R2^2 - R1^2)).

    Geometry without plates, which at most halve the depth.
    """
    inner, outer = values.inner_radius, values.outer_radius
    least = _SHALLOWEST * outer * (2 - _SHALLOWEST) * outer / ((outer - inner) * (outer + inner))
    # The allowed value is rounded up, so that the value in the message passes.
    return {"least": least, "allowed": min(1.0, 1.01 * least)}


def _least_angle(values: Any) -> dict[str, float]:
    """Least angle of a chamber whose opening, 2 R1 (theta/2 - asin(t/R1)), is 1/2000 of its depth.

    Rounding in elongated cells grows with the square of depth over opening.
    """
    inner, depth = values.inner_radius, values.outer_radius - values.inner_radius
    least = 2 * math.asin(values.plate_thickness / inner) + _NARROWEST * depth / inner
    return {"least": least, "allowed": 1.001 * least}


_INNER, _OUTER, _ANGLE = "disc.inner_radius", "disc.outer_radius", "disc.central_angle"
_PLATE, _FILL = "disc.plate_thickness", "disc.max_fill_ratio"
_PORT, _CREST, _LENGTH, _BORE = "tube.port_radius", "tube.hump_radius", "tube.length", "tube.bore"
_HOLE_RADIUS = "disc.gas_hole_radius"
_NO_RING = ("radii_in_order",)
_NO_DEPTH = ("radii_in_order", "chamber_has_depth")
_CHAMBER = (_INNER, _OUTER, _ANGLE, _PLATE)
_NO_CHAMBER = (
    *_NO_DEPTH,
    "plates_leave_room",
    "chamber_wide_enough",
    "fill_has_depth",
    "fills_share_the_liquid",
)
_REACHED = "at least {least:mm}, the shortest path from chamber to opposite chamber"


def _drawn(reading: SceneReading) -> bool:
    """True when keys describe the chamber; a mesh has separate checks."""
    return not reading.known("disc.geometry")


SIZE_CHECKS: tuple[Check, ...] = (
    condition(
        "port_in_chamber",
        *(_PORT, _INNER, _OUTER),
        holds=lambda v: v.inner_radius < v.port_radius <= v.outer_radius,
        problem="the port lies outside the chamber",
        allowed="above inner_radius ({inner_radius:mm}) and at most outer_radius ({outer_radius:mm})",
        moot=_NO_RING,
    ),
    # Holds for a crest inside any port.
    condition(
        "crest_in_disc",
        *(_CREST, _OUTER),
        holds=lambda v: v.hump_radius < v.outer_radius,
        problem="the siphon crest lies outside the port, and outside the chamber's outer wall too",
        allowed="above 0 mm and below port_radius, which is at most outer_radius ({outer_radius:mm})",
    ),
    condition(
        "crest_inside_port",
        *(_CREST, _PORT),
        holds=lambda v: v.hump_radius < v.port_radius,
        problem="the siphon crest lies outside the port, but it is the smallest radius on the path",
        allowed="above 0 mm and below port_radius ({port_radius:mm}), or leave the key out",
        moot=("port_in_chamber", "crest_in_disc"),
    ),
    condition(
        "bore_fits_chamber",
        *(_BORE, "disc.axial_width", _INNER, _OUTER),
        more=lambda v: {"most": max(v.axial_width, v.outer_radius - v.inner_radius)},
        holds=lambda v: v.bore <= v.most,
        problem="no wall of the chamber is large enough for this bore",
        allowed="above 0 mm and at most {most:mm}, the larger of axial_width and outer_radius - inner_radius",
        moot=_NO_RING,
    ),
    condition(
        "length_reaches_over_crest",
        *(_LENGTH, _ANGLE, _PORT, _CREST),
        more=lambda v: _shortest(v, v.hump_radius),
        holds=lambda v: v.length >= v.least * (1 - _ROUNDING),
        problem="the tube cannot reach the opposite port over the siphon crest at {hump_radius:mm}",
        allowed=_REACHED,
        moot=("port_in_chamber", "crest_in_disc", "crest_inside_port"),
    ),
    condition(
        "length_reaches",
        *(_LENGTH, _ANGLE, _PORT),
        more=lambda v: _shortest(v, None),
        holds=lambda v: v.length >= v.least * (1 - _ROUNDING),
        problem="the tube cannot reach the opposite port",
        allowed=_REACHED,
        moot=("port_in_chamber", "length_reaches_over_crest"),
    ),
)
"""Checks of tube lengths that depend on the size of the chamber."""
CHECKS: tuple[Check, ...] = (
    condition(
        "radii_in_order",
        *(_INNER, _OUTER),
        holds=lambda v: v.inner_radius < v.outer_radius,
        problem="the inner radius must be smaller than outer_radius ({outer_radius:mm})",
        allowed="above 0 mm and below {outer_radius:mm}",
    ),
    condition(
        "chamber_has_depth",
        *(_INNER, _OUTER),
        more=lambda v: {"least": _SHALLOWEST * v.outer_radius},
        holds=lambda v: v.outer_radius - v.inner_radius >= v.least,
        problem="the chamber is too shallow to be resolved: outer_radius is {outer_radius:mm}",
        allowed=f"at least {_SHALLOWEST:g} of outer_radius, {{least:mm}}, below outer_radius",
        moot=_NO_RING,
    ),
    # The opening between the plates stays above zero at R1.
    condition(
        "plates_leave_room",
        *(_PLATE, _INNER, _ANGLE),
        more=lambda v: {"most": v.inner_radius * math.sin(min(v.central_angle, math.pi) / 2)},
        holds=lambda v: v.plate_thickness < v.most,
        problem="the plates close the chamber at inner_radius ({inner_radius:mm})",
        allowed="at least 0 mm and below inner_radius * sin(central_angle / 2) = {most:mm}",
    ),
    condition(
        "chamber_wide_enough",
        *(_ANGLE, _PLATE, _INNER, _OUTER),
        more=_least_angle,
        holds=lambda v: v.central_angle >= v.least,
        problem="the chamber's opening at inner_radius ({inner_radius:mm}) is below 1/2000 of its depth, too "
        "narrow to be resolved",
        allowed="at least {allowed:deg} for these radii and this plate_thickness",
        moot=(*_NO_RING, "plates_leave_room"),
    ),
    condition(
        "fill_has_depth",
        *(_FILL, _INNER, _OUTER),
        more=_least_fill,
        holds=lambda v: v.max_fill_ratio >= v.least,
        problem=f"the ring would be shallower than {_SHALLOWEST:g} of outer_radius ({{outer_radius:mm}}), "
        "too shallow to be resolved",
        allowed="at least {allowed:.3g} for this disc, at most 1",
        moot=_NO_DEPTH,
    ),
    condition(
        "chambers_fit",
        *(_ANGLE, "disc.chambers"),
        more=lambda v: {"most": 2 * math.pi / v.chambers},
        holds=lambda v: v.central_angle <= v.most * (1 + DRAWING_ROUNDING),
        problem="{chambers} chambers of this angle do not fit into 360 deg",
        allowed="above 0 deg and at most 360 deg / chambers = {most:deg}",
    ),
    condition(
        "chambers_even",
        _ANGLE,
        more=lambda v: {"count": 2 * math.pi / v.central_angle},
        holds=lambda v: even_number_of_chambers(v.central_angle) is not None,
        problem="360 deg / central_angle = {count:.6g} is not an even number of chambers, at least four",
        allowed="90 deg, 60 deg, 45 deg, 36 deg ... (13.8462 deg for 26 chambers at the most), or at most 90 "
        "deg with chambers given as well",
        when=lambda reading: not reading.given("disc.chambers"),
    ),
    condition(
        "fills_share_the_liquid",
        *("disc.initial_fill", _FILL),
        more=lambda v: {"half": v.max_fill_ratio / 2},
        holds=lambda v: abs(2 * v.initial_fill - v.max_fill_ratio) <= _ROUNDING * v.max_fill_ratio,
        problem="two opposite chambers start with equal fills that add up to max_fill_ratio "
        "({max_fill_ratio:g})",
        allowed="{half:g}, or leave the key out",
    ),
    *SIZE_CHECKS,
    check(
        _port_under_liquid,
        *(_PORT, "disc.initial_fill", *_CHAMBER),
        moot=(*_NO_CHAMBER, "port_in_chamber"),
        when=_drawn,
    ),
    check(_inlet_above_liquid, "gas.inlet_radius", _FILL, *_CHAMBER, moot=_NO_CHAMBER, when=_drawn),
    # Gas enters through the hole.
    condition(
        "hole_is_the_inlet",
        *(_HOLE_RADIUS, "gas.inlet_radius"),
        holds=lambda v: abs(v.gas_hole_radius - v.inlet_radius) <= _ROUNDING * v.inlet_radius,
        problem="gas enters the chambers at gas.inlet_radius ({inlet_radius:mm})",
        allowed="that radius, or one of both keys alone",
    ),
    check(
        _inlet_above_liquid,
        _HOLE_RADIUS,
        _FILL,
        *_CHAMBER,
        moot=(*_NO_CHAMBER, "inlet_above_liquid", "hole_is_the_inlet"),
        when=_drawn,
    ),
    condition(
        "hole_fits_chamber",
        *("disc.gas_hole_diameter", "disc.axial_width", _INNER, _OUTER),
        more=lambda v: {"most": min(v.axial_width, v.outer_radius - v.inner_radius)},
        holds=lambda v: v.gas_hole_diameter <= v.most,
        problem="the gas hole is larger than the chamber",
        allowed="above 0 mm and at most {most:mm}, the smaller of its width and depth",
        moot=_NO_RING,
    ),
    # The inner side of each bend is curved.
    condition(
        "bore_fits_bends",
        *(_BORE, "tube.bends"),
        more=lambda v: {
            "radius": (r := min((each.radius for each in v.bends), default=math.inf)),
            "most": 2 * r,
        },
        holds=lambda v: v.bore <= v.most * (1 + _ROUNDING),
        problem="the bore is wider than the tightest of the bends allows (radius {radius:mm})",
        allowed="above 0 mm and at most twice that radius, {most:mm}",
    ),
    condition(
        "roughness_fits_bore",
        *("tube.roughness", _BORE),
        more=lambda v: {"most": v.bore / 2},
        holds=lambda v: v.roughness < v.most,
        problem="a roughness of half the bore closes the tube",
        allowed="at least 0 um and below bore / 2 = {most:mm}",
    ),
    condition(
        "length_holds_bends",
        *(_LENGTH, "tube.bends"),
        more=lambda v: {"arcs": math.fsum(each.angle * each.radius for each in v.bends)},
        holds=lambda v: v.length >= v.arcs * (1 - _ROUNDING),
        problem="the tube is shorter than the arcs of its bends together",
        allowed="at least {arcs:mm}, the sum of angle * radius over the bends",
    ),
    condition(
        "entrance_has_radius",
        *("tube.entrance_radius", "tube.entrance"),
        holds=lambda v: v.entrance == "rounded" or v.entrance_radius == 0,
        problem='a {entrance} entrance has no radius (entrance = "{entrance}")',
        allowed='leave the key out, or entrance = "rounded"',
    ),
)
