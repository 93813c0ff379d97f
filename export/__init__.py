"""The calibrated law for other programs: some four hundred numbers, and one evaluator.

`compact.py` makes the numbers, `point.py` answers one query from them, `translate.py` writes `point.py` in
other languages, `hosts.py` puts a frame around each.
"""

if not __name__.startswith("ringbalance."):
    raise ImportError(
        f"import ringbalance.{__name__}, not {__name__}: under two names each class exists twice"
    )
