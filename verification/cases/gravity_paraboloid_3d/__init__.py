"""Gravity along the shaft: the free surface is a paraboloid."""
