"""Waves on the ring in one chamber against exact and spectral ones."""
