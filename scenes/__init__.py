"""Scene files that come with the program; `ringbalance.scene.bundled_scene` finds them by name."""

if not __name__.startswith("ringbalance."):
    raise ImportError(
        f"import ringbalance.{__name__}, not {__name__}: under two names each class exists twice"
    )
