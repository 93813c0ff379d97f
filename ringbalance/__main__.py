"""Entry point of `python -m ringbalance` and the command `ringbalance`; an interrupt gives no traceback."""

from __future__ import annotations

import sys

try:
    from ringbalance.cli import main
except KeyboardInterrupt:
    # The value of `ringbalance.cli.INTERRUPTED`, which is not imported yet.
    sys.exit(130)

# Worker processes import this module again under another name.
if __name__ == "__main__":
    sys.exit(main())
