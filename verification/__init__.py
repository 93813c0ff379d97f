"""Verification: what is claimed against what is found, and every solver against what is known of it."""

if not __name__.startswith("ringbalance."):
    raise ImportError(
        f"import ringbalance.{__name__}, not {__name__}: under two names each class exists twice"
    )
