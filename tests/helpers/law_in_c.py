"""Answers of an exported law that a C compiler has compiled."""

from __future__ import annotations

import subprocess
from pathlib import Path

import numpy as np
from c_warnings import WARNINGS

from ringbalance.export.blocks import law_block
from ringbalance.export.compact import CompactLaw
from ringbalance.export.hosts import c_files
from ringbalance.scene.arrays import FloatArray

HARNESS = """
#include <stdio.h>
#include "disc.h"
int main(void)
{
    double q[4];
    while (fread(q, sizeof(double), 4, stdin) == 4) {
        disc_flow f = disc_answer(q[0], q[1], q[2], q[3] != 0.0);
        double a[6];
        a[0] = f.velocity; a[1] = f.regime; a[2] = f.status; a[3] = f.primed;
        a[4] = disc_moment(q[0]); a[5] = disc_surface_radius(q[0]);
        fwrite(a, sizeof(double), 6, stdout);
    }
    return 0;
}
"""


def compiled_answers(folder: Path, law: CompactLaw, asked: FloatArray, *flags: str) -> FloatArray:
    """What a C program answers, shape (queries, 6)."""
    for name, text in (c_files(law_block(law), "disc") | {"main.c": HARNESS}).items():
        (folder / name).write_text(text)
    command = ["gcc", *WARNINGS, *flags, "disc.c", "main.c", "-o", "ask", "-lm"]
    subprocess.run(command, cwd=folder, check=True)
    ran = subprocess.run([folder / "ask"], input=asked.T.tobytes(), capture_output=True, check=True)
    assert ran.stderr == b""
    return np.frombuffer(ran.stdout).reshape(-1, 6)
