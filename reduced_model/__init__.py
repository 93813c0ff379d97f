"""Calibration models from the physics: lambda, k(u), the flow law and its uncertainty."""

if not __name__.startswith("ringbalance."):
    raise ImportError(
        f"import ringbalance.{__name__}, not {__name__}: under two names each class exists twice"
    )
