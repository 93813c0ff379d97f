"""The pressure problem in 3 dimensions against a manufactured solution."""
