"""Finite-element solves and correlations: pressure field, ring quantities, tube flow, grid convergence."""
