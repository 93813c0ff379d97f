"""From evidence to one HTML file: sections, figures, off-screen pictures."""

if not __name__.startswith("ringbalance."):
    raise ImportError(
        f"import ringbalance.{__name__}, not {__name__}: under two names each class exists twice"
    )
