"""Gravity across the shaft: the free surface is part of a circle."""
