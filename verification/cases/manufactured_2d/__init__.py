"""The pressure problem in 2 dimensions against a manufactured solution."""
