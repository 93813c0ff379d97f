"""Balances of flux, force, torque, weight and volume."""
