"""The closed loop: rotor, liquid-ring disc, control algorithms and the integration of injections in time."""

if not __name__.startswith("ringbalance."):
    raise ImportError(
        f"import ringbalance.{__name__}, not {__name__}: under two names each class exists twice"
    )
