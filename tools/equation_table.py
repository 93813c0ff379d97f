"""Set every equation of the report and of the cases, and keep them in reports/data/equations.json.xz.

python tools/equation_table.py    after a change of an equation, or of the library that sets them
"""

from __future__ import annotations

import json
import lzma
from collections.abc import Mapping
from pathlib import Path

from typesetting import typeset

from ringbalance.reports.equations import equations
from ringbalance.verification.catalogue import load_cases

TABLE = Path(__file__).resolve().parents[1] / "reports" / "data" / "equations.json.xz"


def equation_table() -> Mapping[str, str]:
    """SVG of each equation by its LaTeX."""
    of_sections = [equation.latex for equation in equations().values()]
    of_cases = [latex for case in load_cases() for latex in case.equations]
    return {latex: typeset(latex) for latex in sorted({*of_sections, *of_cases})}


if __name__ == "__main__":
    TABLE.write_bytes(lzma.compress(json.dumps(equation_table()).encode(), preset=9))
