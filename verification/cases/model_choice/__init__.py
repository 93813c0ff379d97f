"""Only the models that a scene requires."""
