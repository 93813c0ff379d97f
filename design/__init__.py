"""Many scenes at once: axes along which keys vary, rows of answers, what is kept of them, and who computes.

`axes.py` makes points, `static.py` and `runs.py` answer them, `store.py` keeps the answers, `work.py` deals
them out, `sweep.py` puts it together.
"""

if not __name__.startswith("ringbalance."):
    raise ImportError(
        f"import ringbalance.{__name__}, not {__name__}: under two names each class exists twice"
    )
