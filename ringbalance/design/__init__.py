"""Many scenes at once: axes along which keys vary, rows of answers, what is kept of them, and who computes.

`axes.py` makes points, `static.py` and `runs.py` answer them, `store.py` keeps the answers, `work.py` deals
them out, `sweep.py` puts it together.
"""
