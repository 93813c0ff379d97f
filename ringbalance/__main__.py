"""`python -m ringbalance`, and the command `ringbalance`: an interrupt ends both in silence from here on."""

from __future__ import annotations

import sys

try:
    from ringbalance.cli import main
except KeyboardInterrupt:
    # As `ringbalance.cli.INTERRUPTED`, which is not there yet.
    sys.exit(130)

# Worker processes import this module again under another name.
if __name__ == "__main__":
    sys.exit(main())
