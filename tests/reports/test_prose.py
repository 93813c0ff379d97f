"""Plain prose gets its signs, and keeps its words and numbers."""

from __future__ import annotations

import re

import pytest
from hypothesis import given
from hypothesis import strategies as st

from ringbalance.reports.prose import typeset


@pytest.mark.parametrize(
    ("plain", "set_text"),
    [
        ("rho omega^2 (R2^2 - a^2)/2", "ρ ω² (R₂² − a²)/2"),
        ("lambda within 0.7 %", "λ within 0.7 %"),
        ("R1'min = 34.9 mm", "R₁′min = 34.9 mm"),
        ("10^-3 or 10^(-3)", "10⁻³ or 10⁻³"),
        ("9 mm^2/s", "9 mm²/s"),
        ("bore/(k + 1)^0.25", "bore/(k + 1)^0.25"),
        ("3.4e-06 %", "3.4\u202f×\u202f10⁻⁶ %"),
        ("0.05 um at 20 degC", "0.05 µm at 20 °C"),
        ("rhomboid, omegas, pipe", "rhomboid, omegas, pipe"),
        ("sqrt(T_0/T) with sigma and R_Omega", "√(T₀/T) with σ and R_Ω"),
        ("the disc's siphon crest", "the disc’s siphon crest"),
    ],
)
def test_signs(plain: str, set_text: str) -> None:
    assert typeset(plain) == set_text


@given(st.text(alphabet="abcdefgh ,.;()=<>/+", max_size=60))
def test_other_text_is_left_alone(text: str) -> None:
    assert typeset(text) == text


@given(st.from_regex(r"[a-z]{1,6} [0-9]{1,6}\.[0-9]{1,4} [a-z]{2,6}", fullmatch=True))
def test_numbers_stay(text: str) -> None:
    assert re.findall(r"\d+\.\d+", typeset(text)) == re.findall(r"\d+\.\d+", text)
