"""Friction of laminar flow in a turning tube against its exact limits."""
