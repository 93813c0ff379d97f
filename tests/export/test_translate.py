"""What languages take differently is refused, not translated."""

from __future__ import annotations

import pytest

from ringbalance.export.translate import Source, c_functions, number_text, st_functions

HEAD = "N, X = 2, 0.5\n\ndef f(c: Law, a: float, n: int) -> float:\n"


@pytest.mark.parametrize(
    "line",
    [
        "return a ** 2.0",
        "return a % 2.0",
        "return exp(a)",
        "return a * 2",
        "return a // 2.0",
        "return float(n / 2)",
        "return c[a]",
        "return 1.0 if a > 0.0 else 2.0",
        "return n",
        "x = a\n    x = n\n    return a",
        "for x in c:\n        pass",
        "a += 1.0",
        "return 0.0 < a < 1.0",
        "return abs(a)",
        "X = a",
    ],
)
def test_what_is_not_of_the_subset_is_refused(line: str) -> None:
    with pytest.raises((ValueError, KeyError)):
        c_functions(Source.of_text(f"{HEAD}    {line}\n"))


def test_both_languages_have_the_same_statements() -> None:
    source = Source.of_text(f"{HEAD}    if not a > X:\n        return c[N + n // 2]\n    return -a\n")
    assert "if (!(a > X)) {\n        return c[N + (n / 2)];\n    }\n    return -a;" in c_functions(source)
    text = st_functions(source, prefix="p", sizes={"Law": "0..3"})
    assert "IF NOT (v_a > 0.5) THEN\n    p_f := v_c[2 + (v_n / 2)];\n    RETURN;\nEND_IF;" in text


def test_numbers_have_a_point() -> None:
    assert [number_text(x) for x in (1e-100, 0.5, 3.0)] == ["1.0e-100", "0.5", "3.0"]
