"""The worked examples of Celik et al. (2008)."""
