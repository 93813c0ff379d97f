"""What languages take differently is refused, not translated."""

from __future__ import annotations

from pathlib import Path
from types import ModuleType

import numpy as np
import pytest

from ringbalance.export.translate import (
    Source,
    c_functions,
    exact_text,
    js_functions,
    number_text,
    st_functions,
)

HEAD = "N, X = 2, 0.5\n\ndef f(c: Law, a: float, n: int) -> float:\n"


@pytest.mark.parametrize(
    "line",
    [
        "return a ** 2.0",
        "return a % 2.0",
        "return exp2(a)",
        "return a * 2",
        "return a // 2.0",
        "return float(n / 2)",
        "return c[a]",
        "return 1.0 if a > 0.0 else 2.0",
        "return n",
        "x = a\n    x = n\n    return a",
        "for x in c:\n        pass",
        "for n in range(3):\n        n = 5\n    return a",
        "for i in range(n):\n        n = 5\n    return a",
        "for i in range(3):\n        continue\n    return a",
        "a = x = a * 2.0\n    return a",
        "a, x = x, a\n    return a",
        "return 0.0 < a < 1.0",
        "return abs(n)",
        "X = a",
    ],
)
def test_what_is_not_of_the_subset_is_refused(line: str) -> None:
    with pytest.raises((ValueError, KeyError)):
        c_functions(Source.of_text(f"{HEAD}    {line}\n"))


def test_all_languages_have_the_same_statements() -> None:
    source = Source.of_text(f"{HEAD}    if not a > X:\n        return c[N + n // 2]\n    return -a\n")
    assert "if (!(a > X)) {\n        return c[N + (n / 2)];\n    }\n    return -a;" in c_functions(source)
    assert "if (!(a > X)) {\n        return c[N + ((n / 2) | 0)];\n    }\n    return -a;" in js_functions(
        source
    )
    text = st_functions(source, prefix="p", sizes={"Law": "0..3"})
    assert "IF NOT (v_a > 0.5) THEN\n    p_f := v_c[2 + (v_n / 2)];\n    RETURN;\nEND_IF;" in text


def test_loops_sums_and_several_targets_are_reduced_to_what_all_languages_have() -> None:
    source = Source.of_text(
        f"{HEAD}    x = y = 0.0\n    i, k = n, 2\n    for j in range(1, n):\n"
        "        x += row.larger(c[row.N + j], a)\n    return x\n"
        "\ndef larger(a: row.Number, b: float) -> float:\n    return a\n"
    )
    assert source.functions["f"].text.split("\n")[1:] == [
        "    x = 0.0",
        "    y = 0.0",
        "    i = n",
        "    k = 2",
        "    j = 1",
        "    while j < n:",
        "        x = x + larger(c[N + j], a)",
        "        j = j + 1",
        "    return x",
    ]
    assert source.functions["larger"].arguments == {"a": "Number", "b": "float"}


def test_a_name_with_two_meanings_is_refused(tmp_path: Path) -> None:
    texts = (
        "N, M = 1, 3\n\n\ndef f(c: Law) -> float:\n    return c[N]\n",
        "N, M = 2, 3\n\n\ndef g(c: Law) -> float:\n    return f(c) + c[N]\n",
    )
    modules = []
    for name, text in zip(("first", "second"), texts, strict=True):
        file = tmp_path / f"{name}.py"
        file.write_text(text)
        modules.append(ModuleType(name))
        modules[-1].__file__ = str(file)
    with pytest.raises(ValueError, match="different numbers by N"):
        Source.of_modules(modules, ["g"])
    assert Source.of_modules(modules, ["f"]).constants == {"N": 1}


def test_numbers_of_c_are_exact_and_the_shorter_of_two() -> None:
    assert [exact_text(x) for x in (0.25, 1e-100, -0.0, 2.0**-20)] == ["0.25", "1.0e-100", "-0.0", "0x1p-20"]
    drawn = np.random.default_rng(1).normal(size=200) * 10.0 ** np.arange(-100, 100)
    assert [
        float.fromhex(x) if "x" in x else float(x) for x in map(exact_text, drawn.tolist())
    ] == drawn.tolist()


def test_numbers_have_a_point() -> None:
    assert [number_text(x) for x in (1e-100, 0.5, 3.0)] == ["1.0e-100", "0.5", "3.0"]
