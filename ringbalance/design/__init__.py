"""Sweeps over many scenes, and the search for a design.

`axes.py` makes points; `static.py` and `runs.py` compute their results; `store.py` stores them; `work.py`
distributes the work; `sweep.py` combines all of it.  `designing.py` is the search.
"""
