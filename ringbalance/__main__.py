"""`python -m ringbalance`: the same as the command `ringbalance`."""

from __future__ import annotations

import sys

from ringbalance.cli import main

# Worker processes import this module again under another name.
if __name__ == "__main__":
    sys.exit(main())
