"""Finite-element solves and correlations: pressure field, ring quantities, tube flow, grid convergence."""

if not __name__.startswith("ringbalance."):
    raise ImportError(
        f"import ringbalance.{__name__}, not {__name__}: under two names each class exists twice"
    )
