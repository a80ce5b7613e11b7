"""Whitened regression, and test statistics for each effect at each joint."""
