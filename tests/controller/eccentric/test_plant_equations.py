"""The plant's equations, derived by sympy from a Lagrangian in the fixed frame, and what the paper prints."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import pytest
import sympy as sp

T = sp.Symbol("t")
M_R, M_IM, R_IM, PHASE = sp.symbols("m_r m_im r_im phi_m", positive=True)
M_B, R_B, K, C = sp.symbols("m_b r_b K_B C_B", positive=True)
ADDED, U_1, U_2 = sp.symbols("J_add u_1 u_2")
X, Y, PHI_1, PHI_2, THETA = (sp.Function(name)(T) for name in ("x", "y", "phi_1", "phi_2", "theta"))
COORDINATES = (X, Y, PHI_1, PHI_2)
SPEED, RATE = sp.symbols("W W_rate")
VALUES = sp.symbols("x y phi_1 phi_2 xd yd phid_1 phid_2")
ACCELERATIONS = sp.symbols("xdd ydd phidd_1 phidd_2")


def fixed(vector: sp.Matrix) -> sp.Matrix:
    """Turn a vector of the rotor's frame into the fixed frame."""
    return sp.Matrix([[sp.cos(THETA), -sp.sin(THETA)], [sp.sin(THETA), sp.cos(THETA)]]) * vector


def kinetic(mass: sp.Expr, position: sp.Matrix) -> sp.Expr:
    velocity = fixed(position).diff(T)
    return mass * velocity.dot(velocity) / 2


def on_circle(radius: sp.Expr, angle: sp.Expr) -> sp.Matrix:
    return sp.Matrix([X + radius * sp.cos(angle), Y + radius * sp.sin(angle)])


def reduced(expression: sp.Expr) -> sp.Expr:
    """Expand, with every sin^2 written as 1 - cos^2."""
    expanded = sp.expand(expression)
    for angle in {each.args[0] for each in expanded.atoms(sp.sin)}:
        power = 2
        while expanded.has(sp.sin(angle) ** power) and power < 7:
            reducing = {sp.sin(angle) ** (power + 1): sp.sin(angle) * (1 - sp.cos(angle) ** 2)}
            reducing |= {sp.sin(angle) ** power: 1 - sp.cos(angle) ** 2}
            expanded = sp.expand(expanded.subs(reducing))
    return expanded


def plain(expression: sp.Expr) -> sp.Expr:
    """Functions of time as symbols."""
    for function, acceleration in zip(COORDINATES, ACCELERATIONS, strict=True):
        expression = expression.subs(function.diff(T, 2), acceleration)
    for function, rate in zip(COORDINATES, VALUES[4:], strict=True):
        expression = expression.subs(function.diff(T), rate)
    expression = expression.subs(THETA.diff(T, 2), RATE).subs(THETA.diff(T), SPEED)
    return reduced(expression.subs(dict(zip(COORDINATES, VALUES[:4], strict=True))))


@pytest.fixture(scope="module")
def lagrange() -> list[sp.Expr]:
    """Equations of x, y, phi_1, phi_2 from the fixed frame: expressions that must vanish."""
    energy = kinetic(M_R - M_IM, sp.Matrix([X, Y])) + kinetic(M_IM, on_circle(R_IM, PHASE))
    for phi in (PHI_1, PHI_2):
        energy += kinetic(M_B, on_circle(R_B, phi)) + ADDED * phi.diff(T) ** 2 / 2
    # Here the rotor's angle drops out, and its speed stays.
    energy = reduced(energy)
    assert not energy.has(sp.sin(THETA))
    velocity = fixed(sp.Matrix([X, Y])).diff(T)
    rates = [coordinate.diff(T) for coordinate in COORDINATES]
    dissipated = reduced(C * velocity.dot(velocity) / 2)
    potential = K * (X**2 + Y**2) / 2
    drives = (0, 0, U_1, U_2)
    return [
        plain(
            energy.diff(rate).diff(T)
            - energy.diff(coordinate)
            + potential.diff(coordinate)
            + dissipated.diff(rate)
            - drive
        )
        for coordinate, rate, drive in zip(COORDINATES, rates, drives, strict=True)
    ]


def entry(equations: list[sp.Expr], row: int, symbol: sp.Symbol) -> sp.Expr:
    """Coefficient of a symbol in the left side of an equation, at rest on the track."""
    return sp.expand(equations[row]).coeff(symbol)


x_, y_, p1_, p2_, xd_, yd_, w1_, w2_ = VALUES
B = M_B * R_B
PRINTED: dict[str, tuple[int, sp.Symbol, Callable[[], sp.Expr]]] = {
    # The paper has m_b r_b [Omega^2 sin(phi_1) + Omega' cos(phi_1)] in both columns of row 3.
    "K(3,1)": (2, x_, lambda: B * (SPEED**2 * sp.sin(p1_) + RATE * sp.cos(p1_))),
    "K(3,2)": (2, y_, lambda: B * (-(SPEED**2) * sp.cos(p1_) + RATE * sp.sin(p1_))),
    "K(4,2)": (3, y_, lambda: B * (-(SPEED**2) * sp.cos(p2_) + RATE * sp.sin(p2_))),
    "K(1,2)": (0, y_, lambda: -C * SPEED - (M_R + 2 * M_B) * RATE),
    "K(2,1)": (1, x_, lambda: C * SPEED + (M_R + 2 * M_B) * RATE),
    "C(1,2)": (0, yd_, lambda: -2 * (M_R + 2 * M_B) * SPEED),
    "C(2,1)": (1, xd_, lambda: 2 * (M_R + 2 * M_B) * SPEED),
    "C(3,1)": (2, xd_, lambda: 2 * B * SPEED * sp.cos(p1_)),
    "C(3,2)": (2, yd_, lambda: 2 * B * SPEED * sp.sin(p1_)),
}


@pytest.mark.parametrize("name", PRINTED)
def test_matrix_entries(name: str, lagrange: list[sp.Expr]) -> None:
    """The entries of the paper's matrices as they must be, from the Lagrangian alone."""
    row, symbol, expected = PRINTED[name]
    assert reduced(entry(lagrange, row, symbol) - expected()) == 0


def test_the_printed_k32_is_another_one(lagrange: list[sp.Expr]) -> None:
    """Printed: K(3,2) = K(3,1). It differs, also at constant speed and whatever the signs lost in print."""
    right: Any = entry(lagrange, 2, y_).subs(RATE, 0)
    for sign in (1, -1):
        printed = sign * B * SPEED**2 * sp.sin(p1_)
        assert reduced(right - printed) != 0
