"""Meshes of the liquid in a chamber, their quality, closed-form geometry, and VTU files."""

if not __name__.startswith("ringbalance."):
    raise ImportError(
        f"import ringbalance.{__name__}, not {__name__}: under two names each class exists twice"
    )
