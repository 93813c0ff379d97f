"""Only the models that a scene requires, on three hundred scenes."""
