"""Keeps the heavy results of a report with the program, so that later light reports can show them.

    python tools/keep_evidence.py out/evidence.json

Only heavy cases are kept, each with its date and the hash of its scene; a light report takes those whose
scene is its own.
"""

from __future__ import annotations

import json
import sys
from pathlib import Path

from ringbalance.reports.saved import PACKAGED, kept_document
from ringbalance.scene import write_whole

TARGET = Path(__file__).resolve().parents[1] / "reports" / "data" / PACKAGED


def main(arguments: list[str]) -> int:
    """Write the packaged evidence from that of a heavy report."""
    document = json.loads(Path(arguments[0]).read_text(encoding="utf-8"))
    kept = kept_document(document)
    write_whole(TARGET, json.dumps(kept, allow_nan=False, indent=1, ensure_ascii=False) + "\n")
    print(f"{len(kept['verification'])} heavy cases kept in {TARGET}")
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
